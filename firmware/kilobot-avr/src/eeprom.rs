//! The EEPROM (data sheet 8.4).

use core::arch::asm;

use avr_device::interrupt;

use crate::chip::Chip;

/// The byte there. A write that a reset has interrupted goes on, and nothing can be read meanwhile (8.4.2, 8.6.3).
#[inline(never)]
pub fn read(chip: &Chip, address: u16) -> u8 {
    // -14 bytes against the methods of the register.
    // SAFETY: waits for EEPE in EECR.
    unsafe { asm!("0:", "sbic 0x1f, 1", "rjmp 0b", options(nostack, preserves_flags)) };
    // SAFETY: every address of ten bits may be read.
    unsafe { chip.EEPROM.eear().write(|w| w.bits(address)) };
    chip.EEPROM.eecr().write(|w| w.eere().set_bit());
    chip.EEPROM.eedr().read().bits()
}

/// Writes it, in 3.4 ms.
#[inline(never)]
pub fn write(chip: &Chip, address: u16, byte: u8) {
    // SAFETY: what was stored there is to be replaced.
    unsafe {
        chip.EEPROM.eear().write(|w| w.bits(address));
        chip.EEPROM.eedr().write(|w| w.bits(byte));
    }
    interrupt::free(|_| {
        // EEPE at most four cycles after EEMPE, in EECR.
        // SAFETY: begins to write.
        unsafe { asm!("sbi 0x1f, 2", "sbi 0x1f, 1", options(nostack, preserves_flags)) };
    });
    while chip.EEPROM.eecr().read().eepe().bit_is_set() {}
}
