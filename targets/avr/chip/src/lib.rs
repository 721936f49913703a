//! The common part of the programs for the ATmega328P: avr-libc, and the end of a program.

#![no_std]
#![feature(asm_experimental_arch)]

use core::arch::asm;

// avr-libc's float and memory functions are smaller and faster than those of compiler_builtins.
#[link(name = "m", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

#[link(name = "c", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

/// Ends the emulation: sleep without interrupts.
pub fn stop() -> ! {
    loop {
        // SAFETY: the program has ended; the instructions only stop the core.
        unsafe { asm!("cli", "sleep") };
    }
}
