//! The marks of the measured programs of Cortex-M cores: a program sends a mark by a call of
//! semihosting, a service of debuggers. The debugger reads the registers and returns.

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

/// Asks the debugger to write a character (Arm's semihosting, section 5: SYS_WRITEC), which it does
/// not do; it finds the mark in R2 and the value in R3. QEMU forwards this operation to its debugger
/// without an open file. The character has the address in R1, which must be one of memory.
///
/// The function is naked, so that every mark costs the same.
#[unsafe(naked)]
extern "C" fn send_mark(_mark: u32, _value: u32) {
    naked_asm!(
        "mov r2, r0",
        "mov r3, r1",
        "movs r0, {SYS_WRITEC}",
        "mov r1, sp",
        "bkpt #0xab",
        "bx lr",
        SYS_WRITEC = const 0x03,
    )
}

/// The debugger that receives the marks.
pub struct Debugger;

impl Meter for Debugger {
    #[inline(always)]
    fn mark(&mut self, mark: Mark, value: u32) {
        send_mark(mark as u32, value);
    }
}
