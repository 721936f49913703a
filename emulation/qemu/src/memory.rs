//! The chip's memory, and where QEMU keeps it (RM0090 2.3).

use std::ops::Range;

/// Main flash.
pub const FLASH: Range<u32> = 0x0800_0000..0x0810_0000;
/// Core-coupled memory.
pub const CCM: Range<u32> = 0x1000_0000..0x1001_0000;
/// Main RAM.
pub const SRAM: Range<u32> = 0x2000_0000..0x2002_0000;
/// Memory that the chip does not have, but QEMU 7.2: it took the chip's 192 KiB of RAM for one piece.
const SURPLUS: u32 = 0x2002_0000;

/// Where memory is in QEMU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// As on the chip.
    Chip,
    /// Without core-coupled memory (QEMU 7.2): its content stands behind the main RAM. The stack pointer is
    /// moved there when it is set, accesses by address are done by the bridge. The firmware can tell by
    /// the addresses of what is on its stack, and when that overflows: no fault, but the end of the main RAM.
    CcmBehindSram,
}

impl Layout {
    /// Where QEMU keeps the `length` bytes at `address` of the chip, if all of them are memory.
    pub fn locate(self, address: u32, length: usize) -> Option<u32> {
        let end = u32::try_from(length).ok()?.checked_add(address)?;
        let region = [FLASH, CCM, SRAM]
            .into_iter()
            .find(|region| region.contains(&address) && end <= region.end)?;
        Some(if region == CCM { self.relocate(address) } else { address })
    }

    /// What a stack pointer must be in QEMU that is `value` on the chip. The end of the memory is a stack
    /// pointer too.
    pub fn relocate(self, value: u32) -> u32 {
        match self {
            Layout::CcmBehindSram if (CCM.start..=CCM.end).contains(&value) => {
                value - CCM.start + SURPLUS
            }
            _ => value,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_ends_where_the_manual_says() {
        for layout in [Layout::Chip, Layout::CcmBehindSram] {
            assert_eq!(layout.locate(0x0800_0000, 0x10_0000), Some(0x0800_0000));
            assert_eq!(layout.locate(0x080f_ffff, 2), None);
            assert_eq!(layout.locate(0x2001_fffc, 4), Some(0x2001_fffc));
            assert_eq!(layout.locate(0x2001_fffc, 5), None);
            assert_eq!(layout.locate(0x1000_ffff, 2), None);
            assert_eq!(layout.locate(0x4000_0000, 4), None);
            assert_eq!(layout.locate(0xffff_fffc, 8), None);
            assert_eq!(layout.locate(0x2000_0000, usize::MAX), None);
        }
    }

    #[test]
    fn missing_memory_stands_elsewhere() {
        assert_eq!(Layout::Chip.locate(0x1000_0010, 4), Some(0x1000_0010));
        assert_eq!(Layout::CcmBehindSram.locate(0x1000_0010, 4), Some(0x2002_0010));
        assert_eq!(Layout::CcmBehindSram.relocate(0x1001_0000), 0x2003_0000);
        assert_eq!(Layout::CcmBehindSram.relocate(0x2000_8000), 0x2000_8000);
    }
}
