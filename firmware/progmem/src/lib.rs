//! Access to the AVR's program memory, which ordinary loads do not reach. Programs keep constants
//! there to save RAM.
//!
//! This crate is empty on other chips.

#![no_std]
#![cfg(target_arch = "avr")]
#![feature(asm_experimental_arch)]

use core::arch::asm;

use bittybuzz_vm_core::{Part, Parts, rom};

#[unsafe(link_section = ".progmem.data")]
static ROM: [u8; rom::TINY.len()] = rom::TINY;

#[unsafe(link_section = ".progmem.data")]
static ROM_WITHOUT_MATHS: [u8; rom::TINY_WITHOUT_MATHS.len()] = rom::TINY_WITHOUT_MATHS;

/// Returns byte `at` of the tables of a virtual machine with these parts, which must be a constant.
/// The linker drops the tables that no machine uses.
#[inline(always)]
pub fn rom(parts: Parts, at: usize) -> u8 {
    let tables = match parts.has(Part::Maths) {
        true => &raw const ROM as usize,
        false => &raw const ROM_WITHOUT_MATHS as usize,
    };
    byte(tables.wrapping_add(at))
}

/// Reads a byte at an address of program memory.
#[inline(always)]
pub fn byte(address: usize) -> u8 {
    let byte: u8;
    // SAFETY: `lpm` reads program memory, all of which may be read.
    unsafe {
        asm!("lpm {b}, Z", b = out(reg) byte, in("Z") address as u16,
            options(pure, nomem, nostack, preserves_flags));
    }
    byte
}

/// Reads two bytes, little-endian, at an address of program memory.
#[inline(always)]
pub fn word(address: usize) -> u16 {
    let word: u16;
    // SAFETY: as above; r0 is scratch.
    unsafe {
        // The word is read into the register of the address. Assembling it from two byte operands
        // would cost eight more instructions, and with any `reg_pair` LLVM 22 miscompiles the
        // verifier.
        asm!("lpm r0, Z+", "lpm r31, Z", "mov r30, r0",
            inout("Z") address as u16 => word, options(pure, nomem, nostack, preserves_flags));
    }
    word
}
