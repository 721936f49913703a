//! The accesses between the core and the peripherals.

/// Size of an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// 8 bits.
    Byte,
    /// 16 bits.
    Half,
    /// 32 bits.
    Word,
}

impl Width {
    /// The width of an access of `bytes` bytes.
    pub const fn from_bytes(bytes: usize) -> Option<Width> {
        match bytes {
            1 => Some(Width::Byte),
            2 => Some(Width::Half),
            4 => Some(Width::Word),
            _ => None,
        }
    }

    /// Returns the number of bytes.
    pub const fn bytes(self) -> u32 {
        match self {
            Width::Byte => 1,
            Width::Half => 2,
            Width::Word => 4,
        }
    }

    pub(crate) const fn mask(self) -> u32 {
        match self {
            Width::Byte => 0xff,
            Width::Half => 0xffff,
            Width::Word => 0xffff_ffff,
        }
    }
}

/// A write to a register of 32 bits, of which only the bits in `mask` are meant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Write {
    value: u32,
    mask: u32,
}

impl Write {
    /// A write of `value` with `width` to `address`.
    pub fn new(address: u32, width: Width, value: u32) -> Self {
        let shift = (address & 3) * 8;
        let mask = width.mask().checked_shl(shift).unwrap_or(0);
        Write { value: (value & width.mask()).checked_shl(shift).unwrap_or(0) & mask, mask }
    }

    /// The register afterwards: untouched bits stay as they were.
    pub fn merge(self, old: u32) -> u32 {
        old & !self.mask | self.value
    }

    /// The bits written as one.
    pub fn ones(self) -> u32 {
        self.value
    }

    /// The bits written as zero.
    pub fn zeros(self) -> u32 {
        self.mask & !self.value
    }
}

/// The levels of the interrupt lines to the NVIC; bit n is interrupt n.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lines(u128);

impl Lines {
    /// Returns true if line `irq` is high.
    pub const fn is_high(self, irq: u8) -> bool {
        irq < 128 && self.0 >> irq & 1 != 0
    }

    /// All lines, bit n is interrupt n.
    pub const fn bits(self) -> u128 {
        self.0
    }

    pub(crate) fn set(&mut self, irq: u8, high: bool) {
        self.0 = self.0 & !(1 << irq) | u128::from(high) << irq;
    }
}
