//! Program memory: the script, and the machine's tables.

use core::arch::asm;

use bittybuzz_bench::{HEADER, ROOM};
use bittybuzz_vm_core::{ByteCode, rom};

#[unsafe(no_mangle)]
#[unsafe(link_section = ".progmem.data")]
static BENCH_SCRIPT: [u8; ROOM] = [0; ROOM];

#[unsafe(link_section = ".progmem.data")]
static ROM: [u8; rom::LENGTH] = rom::BYTES;

/// A byte of flash.
#[inline(always)]
fn lpm(address: usize) -> u8 {
    let byte: u8;
    // SAFETY: `lpm` reads program memory, all of which may be read.
    unsafe {
        asm!("lpm {b}, Z", b = out(reg) byte, in("Z") address as u16,
            options(pure, nomem, nostack, preserves_flags));
    }
    byte
}

/// Two bytes of flash.
#[inline(always)]
fn lpm_word(address: usize) -> u16 {
    let (low, high): (u8, u8);
    // SAFETY: as above.
    unsafe {
        asm!("lpm {l}, Z+", "lpm {h}, Z", l = out(reg) low, h = out(reg) high,
            inout("Z") address as u16 => _, options(pure, nomem, nostack, preserves_flags));
    }
    u16::from_le_bytes([low, high])
}

/// Address of a byte of the script.
#[inline(always)]
fn script(at: usize) -> usize {
    (&raw const BENCH_SCRIPT as usize).wrapping_add(at)
}

/// The image.
#[derive(Clone, Copy)]
pub struct Flash;

impl Flash {
    /// The number of the global with the result.
    pub fn global() -> u16 {
        lpm_word(script(0))
    }
}

impl ByteCode for Flash {
    fn len(&self) -> usize {
        usize::from(lpm_word(script(2)))
    }

    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        lpm(script(at.wrapping_add(HEADER)))
    }

    fn rom(at: usize) -> u8 {
        lpm((&raw const ROM as usize).wrapping_add(at))
    }

    #[inline(always)]
    fn word(&self, at: usize) -> u16 {
        lpm_word(script(at.wrapping_add(HEADER)))
    }
}
