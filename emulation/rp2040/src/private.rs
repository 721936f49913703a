//! The private peripheral bus: interrupt controller and system control block, as far as firmware
//! uses them (ARMv6-M B3.2, B3.4).

use bittybuzz_chips::CoreKind;
use bittybuzz_cortex_m::registers::{AIRCR, CPUID, ICSR, VTOR, cpuid, requests_reset};
use rp2040_emu::bus::ppb::Ppb;
use rp2040_emu::core::Nvic;

const ISER: u32 = 0xe000_e100;
const ICER: u32 = 0xe000_e180;
const ISPR: u32 = 0xe000_e200;
const ICPR: u32 = 0xe000_e280;
const IPR: u32 = 0xe000_e400;
const IPR_END: u32 = 0xe000_e420;
/// The core's own registers that a program can access.
pub struct Private {
    pub nvic: Nvic,
    pub ppb: Ppb,
    pub reset_requested: bool,
}

impl Private {
    pub fn new() -> Self {
        Private { nvic: Nvic::new(), ppb: Ppb::new(), reset_requested: false }
    }

    /// Reads the word at `address`; `active` is the number of the exception that is being handled.
    pub fn read(&self, address: u32, active: u32) -> u32 {
        match address {
            ISER | ICER => self.nvic.enabled,
            ISPR | ICPR => self.nvic.pending,
            IPR..IPR_END => {
                let first = (address - IPR) as usize;
                u32::from_le_bytes(std::array::from_fn(|n| self.nvic.priority[first + n]))
            }
            CPUID => cpuid(CoreKind::CortexM0),
            ICSR => self.ppb.icsr | active,
            // VTOR exists on this core, but not on the Cortex-M0.
            VTOR => 0,
            _ => self.ppb.read32(address),
        }
    }

    /// Writes the bits of `value` that are in `mask` to the word at `address`.
    pub fn write(&mut self, address: u32, value: u32, mask: u32) {
        match address {
            ISER => self.nvic.enabled |= value & mask,
            ICER => self.nvic.enabled &= !(value & mask),
            ISPR => self.nvic.pending |= value & mask,
            ICPR => self.nvic.pending &= !(value & mask),
            IPR..IPR_END => {
                let first = (address - IPR) as usize;
                for (index, priority) in self.nvic.priority[first..first + 4].iter_mut().enumerate()
                {
                    if mask >> (8 * index) & 0xff != 0 {
                        *priority = (value >> (8 * index)) as u8 & 0xc0;
                    }
                }
            }
            VTOR => {}
            AIRCR => self.reset_requested |= requests_reset(value),
            _ => self.ppb.write32(address, value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_stand_where_the_manual_says() {
        let mut private = Private::new();
        private.write(ISER, 1 << 7 | 1 << 16, !0);
        private.write(ICER, 1 << 16, !0);
        assert_eq!(private.read(ISER, 0), 1 << 7);
        // Byte 3 of NVIC_IPR1: interrupt 7.
        private.write(0xe000_e404, 0xff00_0000, 0xff00_0000);
        assert_eq!(private.nvic.priority[7], 0xc0);
        assert_eq!(private.read(CPUID, 0), 0x410c_c200);
        private.write(AIRCR, 1 << 2, !0);
        assert!(!private.reset_requested, "without the key");
        private.write(AIRCR, 0x05fa_0004, !0);
        assert!(private.reset_requested);
    }
}
