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
    /// Returns the width of an access of `bytes` bytes; none for any other number than 1, 2 and 4.
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

    /// Returns the part of a 32-bit register that an access of this width to `address` reads.
    pub(crate) const fn part(self, register: u32, address: u32) -> u32 {
        register >> ((address & 3) * 8) & self.mask()
    }
}

/// A write to a 32-bit register. Only the bits in `mask` were written.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Write {
    value: u32,
    mask: u32,
}

impl Write {
    /// Creates a write of `value` with `width` to `address`.
    pub fn new(address: u32, width: Width, value: u32) -> Self {
        let shift = (address & 3) * 8;
        let mask = width.mask().checked_shl(shift).unwrap_or(0);
        Write { value: (value & width.mask()).checked_shl(shift).unwrap_or(0) & mask, mask }
    }

    /// Returns the register's value after the write to its value `old`.
    pub fn merge(self, old: u32) -> u32 {
        old & !self.mask | self.value
    }

    /// Returns the bits that were written as 1.
    pub fn ones(self) -> u32 {
        self.value
    }

    /// Returns the bits that were written as 0.
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

    /// Returns all lines; bit n is interrupt n.
    pub const fn bits(self) -> u128 {
        self.0
    }

    pub(crate) fn set(&mut self, irq: u8, high: bool) {
        self.0 = self.0 & !(1 << irq) | u128::from(high) << irq;
    }
}
