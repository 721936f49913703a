//! The EEPROM (data sheet 8.4).

use core::arch::asm;

use avr_device::interrupt;

use crate::chip::Chip;

/// Returns the byte at an address. A write that a reset interrupted continues, and nothing can be
/// read until its end (8.4.2, 8.6.3).
#[inline(never)]
pub fn read(chip: &Chip, address: u16) -> u8 {
    // The loop in assembly takes 14 bytes less than the methods of the register.
    // SAFETY: this waits for EEPE in EECR.
    unsafe { asm!("0:", "sbic 0x1f, 1", "rjmp 0b", options(nostack, preserves_flags)) };
    // SAFETY: every address of ten bits may be read.
    unsafe { chip.EEPROM.eear().write(|w| w.bits(address)) };
    chip.EEPROM.eecr().write(|w| w.eere().set_bit());
    chip.EEPROM.eedr().read().bits()
}

/// Writes a byte, which takes 3.4 ms.
#[inline(never)]
pub fn write(chip: &Chip, address: u16, byte: u8) {
    // SAFETY: the old content of the address is to be replaced.
    unsafe {
        chip.EEPROM.eear().write(|w| w.bits(address));
        chip.EEPROM.eedr().write(|w| w.bits(byte));
    }
    interrupt::free(|_| {
        // EEPE in EECR must be set at most four cycles after EEMPE.
        // SAFETY: this starts the write.
        unsafe { asm!("sbi 0x1f, 2", "sbi 0x1f, 1", options(nostack, preserves_flags)) };
    });
    while chip.EEPROM.eecr().read().eepe().bit_is_set() {}
}
