//! How the core reaches the peripherals, and they the core.

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

    pub(crate) const fn mask(self) -> u32 {
        match self {
            Width::Byte => 0xff,
            Width::Half => 0xffff,
            Width::Word => 0xffff_ffff,
        }
    }
}

/// The levels of the interrupt lines to the NVIC; bit n is interrupt n (RM0090 table 62).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lines(u128);

impl Lines {
    /// Whether line `irq` is high.
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
