//! The USB OTG controller with full speed (RM0090 34), without a cable: storage, except for the bits
//! that a firmware polls while it sets the controller up.

/// Offsets of the global registers.
const GRSTCTL: u32 = 0x10;
const GINTSTS: u32 = 0x14;

const GRSTCTL_AHBIDL: u32 = 1 << 31;
/// Resets and flushes, which the hardware clears when they are complete (34.16.2).
const GRSTCTL_REQUESTS: u32 = 0x37;

/// Returns the content of the register at `offset`, in which the firmware has written `stored`.
/// Requests are complete at once. No interrupt is ever pending, and the controller is in device
/// mode.
pub(crate) fn read(offset: u32, stored: u32) -> u32 {
    match offset {
        GRSTCTL => stored & !GRSTCTL_REQUESTS | GRSTCTL_AHBIDL,
        GINTSTS => 0,
        _ => stored,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_core_reset_is_complete_at_once() {
        // RM0090 34.16.2: AHBIDL is bit 31, CSRST bit 0.
        assert_eq!(read(GRSTCTL, 0), 0x8000_0000);
        assert_eq!(read(GRSTCTL, 1), 0x8000_0000);
        assert_eq!(read(GRSTCTL, 0x10 << 6 | 1 << 5), 0x8000_0400, "a flush of all FIFOs");
        assert_eq!(read(GINTSTS, 0xbfff_ffff), 0);
        assert_eq!(read(0x08, 0x1), 0x1);
    }
}
