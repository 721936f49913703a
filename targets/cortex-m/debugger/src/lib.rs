//! The marks of the measured programs of Cortex-M cores: a program sends a mark by calling
//! [`bench_mark`], where a debugger stops it and makes it return at once.

#![no_std]

use core::arch::naked_asm;

use bittybuzz_bench::{Mark, Meter};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // The runner detects the missing mark.
    loop {
        core::hint::spin_loop();
    }
}

/// Receives the mark in R0 and the value in R1.
#[unsafe(naked)]
#[unsafe(no_mangle)]
pub extern "C" fn bench_mark(_mark: u32, _value: u32) {
    naked_asm!("bx lr")
}

/// The debugger that receives the marks.
pub struct Debugger;

impl Meter for Debugger {
    #[inline(always)]
    fn mark(&mut self, mark: Mark, value: u32) {
        bench_mark(mark as u32, value);
    }
}
