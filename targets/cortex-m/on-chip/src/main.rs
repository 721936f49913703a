//! The program of Cortex-M cores, see `bittybuzz_on_chip`. It reports by semihosting, a service of
//! debuggers.

#![no_std]
#![no_main]

use core::arch::asm;
use core::hint::black_box;

use bittybuzz_on_chip::{Header, Report, run_batch, slots, sweep};
use bittybuzz_vm_core::Vm;
#[cfg(feature = "full")]
use bittybuzz_vm_core::number::Full as Numbers;
#[cfg(not(feature = "full"))]
use bittybuzz_vm_core::number::Tiny as Numbers;

/// Slots of the machine of the robot with this core.
#[cfg(target_abi = "eabihf")]
const SLOTS: usize = slots::CRAZYFLIE;
#[cfg(not(target_abi = "eabihf"))]
const SLOTS: usize = slots::ZOOIDS;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // The runner detects the missing report.
    stop()
}

/// Bytes for a batch.
const ROOM: usize = 0x2_0000;

#[unsafe(no_mangle)]
static BATCH: [u8; ROOM] = [0; ROOM];

// Operations of Arm's semihosting, section 5.
const SYS_WRITE0: u32 = 0x04;
const SYS_EXIT: u32 = 0x18;
/// The reason code of a successful exit.
const APPLICATION_EXIT: u32 = 0x2_0026;

/// # Safety
/// `parameter` must be valid for the operation.
unsafe fn semihosting(operation: u32, parameter: u32) {
    // SAFETY: the debugger answers in r0 and continues after the instruction.
    unsafe { asm!("bkpt #0xab", inout("r0") operation => _, in("r1") parameter, options(nostack)) };
}

fn print(report: &Report) {
    let mut text = [0; Report::LENGTH + 1];
    text[..Report::LENGTH].copy_from_slice(&report.line());
    // SAFETY: the text ends with a zero.
    unsafe { semihosting(SYS_WRITE0, &raw const text as u32) };
}

#[cortex_m_rt::entry]
fn main() -> ! {
    // The entry macro turns this into a reference, because main runs once.
    static mut MACHINE: Vm<Numbers, &'static [u8], SLOTS> = Vm::new();
    let batch: &'static [u8] = black_box(&BATCH);
    match sweep(Header::read(batch)) {
        Some(report) => print(&report),
        None => run_batch(MACHINE, &batch, print),
    }
    stop()
}

/// Ends the emulation.
fn stop() -> ! {
    // SAFETY: the parameter is a reason code.
    unsafe { semihosting(SYS_EXIT, APPLICATION_EXIT) };
    loop {
        core::hint::spin_loop();
    }
}
