//! The chip's memory (RM0090 2.3), and its addresses in QEMU.

use std::ops::Range;

/// Main flash.
pub const FLASH: Range<u32> = 0x0800_0000..0x0810_0000;
/// Core-coupled memory.
pub const CCM: Range<u32> = 0x1000_0000..0x1001_0000;
/// Main RAM.
pub const SRAM: Range<u32> = 0x2000_0000..0x2002_0000;
/// Memory that QEMU 7.2 has, but not the chip: QEMU treats the chip's 192 KiB of RAM as one block.
const SURPLUS: u32 = 0x2002_0000;

/// The layout of the chip's memory in QEMU.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MemoryLayout {
    /// The addresses of the chip.
    Chip,
    /// No core-coupled memory (QEMU 7.2): its content is placed after the main RAM. The stack
    /// pointer is moved there when it is set, and the bridge executes accesses by address. The
    /// firmware can notice the difference by addresses of objects on its stack, and by a stack
    /// overflow, which reaches the end of the main RAM instead of causing a fault.
    CcmBehindSram,
}

impl MemoryLayout {
    /// Returns the address in QEMU of the `length` bytes at `address` of the chip, if all of them
    /// are memory.
    pub fn locate(self, address: u32, length: usize) -> Option<u32> {
        let end = u32::try_from(length).ok()?.checked_add(address)?;
        let region = [FLASH, CCM, SRAM]
            .into_iter()
            .find(|region| region.contains(&address) && end <= region.end)?;
        Some(if region == CCM { self.relocate(address) } else { address })
    }

    /// Returns the stack pointer in QEMU for the stack pointer `value` on the chip. The end of the
    /// memory is a valid stack pointer, too.
    pub fn relocate(self, value: u32) -> u32 {
        match self {
            MemoryLayout::CcmBehindSram if (CCM.start..=CCM.end).contains(&value) => {
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
    fn memory_has_the_manuals_size() {
        for layout in [MemoryLayout::Chip, MemoryLayout::CcmBehindSram] {
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
    fn memory_that_qemu_lacks_is_relocated() {
        assert_eq!(MemoryLayout::Chip.locate(0x1000_0010, 4), Some(0x1000_0010));
        assert_eq!(MemoryLayout::CcmBehindSram.locate(0x1000_0010, 4), Some(0x2002_0010));
        assert_eq!(MemoryLayout::CcmBehindSram.relocate(0x1001_0000), 0x2003_0000);
        assert_eq!(MemoryLayout::CcmBehindSram.relocate(0x2000_8000), 0x2000_8000);
    }
}
