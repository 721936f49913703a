//! The handling of failures of the firmware itself. The motors lose power first. Then the robot
//! writes a note of the failure to memory that a reset does not erase, and restarts. After the
//! restart it reports the failure and stands still: no script runs until the power is switched off
//! and on. A robot whose battery is flat switches itself off in the same way.

use core::arch::naked_asm;
use core::panic::PanicInfo;
use core::ptr::{read_volatile, write_volatile};

use bittybuzz_board::fault::fault_place;
use cortex_m::peripheral::SCB;
use embassy_stm32::pac::RCC;

use crate::motors;

/// Marks a note as written by [`restart_after`], since memory holds anything after power-on.
const WRITTEN: u32 = 0xb177_fa11;

/// The note, of four words: [`WRITTEN`], cause, pc, lr. It survives a reset, but not a loss of
/// power.
#[unsafe(link_section = ".uninit.failure")]
static mut NOTE: [u32; 4] = [0; 4];

/// The reason why the robot has restarted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Failure {
    /// The watchdog ended the program, because a task showed no sign of life.
    Watchdog,
    /// The program detected an error of its own. `lr` is the address after the call of the panic
    /// handler.
    Panic { lr: u32 },
    /// The processor refused an instruction or an access, or the stack is full. `pc` is the address
    /// of the instruction, 0 if the stack could not hold it, and `lr` the return address of its
    /// caller.
    HardFault { pc: u32, lr: u32 },
    /// The battery was flat, and the robot switched itself off.
    FlatBattery,
    /// An exception or interrupt of this number occurred, which has no handler.
    Unhandled { number: u32 },
}

/// Returns the cause of the last reset, if that was a failure: not power-on, and not a reset by a
/// person. Clears the chip's flags and the note.
pub fn take() -> Option<Failure> {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // SAFETY: the only other access is that of a failure, after which nothing else runs.
    let [written, cause, pc, lr] = unsafe {
        let note = read_volatile(&raw const NOTE);
        write_volatile(&raw mut NOTE, [0; 4]);
        note
    };
    if flags.iwdgrstf() {
        return Some(Failure::Watchdog);
    }
    if !flags.sftrstf() || written != WRITTEN {
        return None;
    }
    Some(match cause {
        0 => Failure::Panic { lr },
        3 => Failure::HardFault { pc, lr },
        FLAT_BATTERY => Failure::FlatBattery,
        number => Failure::Unhandled { number },
    })
}

/// A cause that is different from all exception numbers.
const FLAT_BATTERY: u32 = u32::MAX;

/// Restarts without a script, for a battery that must not be discharged further.
pub fn switch_off() -> ! {
    restart_after(FLAT_BATTERY, 0, 0)
}

fn restart_after(cause: u32, pc: u32, lr: u32) -> ! {
    motors::cut_power();
    // SAFETY: nothing else runs from here on.
    unsafe { write_volatile(&raw mut NOTE, [WRITTEN, cause, pc, lr]) };
    SCB::sys_reset()
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    let lr: u32;
    // SAFETY: reads a register.
    unsafe { core::arch::asm!("mov {}, lr", out(reg) lr) };
    restart_after(0, 0, lr)
}

/// Handles every exception and interrupt without a handler of its own.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    // SAFETY: reading ICSR has no effect. The exception number has six bits (ARMv6-M B3.2.4).
    let active = unsafe { (*SCB::PTR).icsr.read() } & 0x3f;
    restart_after(active, 0, 0)
}

/// Handles a hard fault. A full stack is one of the causes, so the stack pointer may be outside the
/// memory. The handler therefore sets a stack pointer of its own before anything is pushed.
///
/// # Safety
/// Only the processor may call this function.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mrs r0, msp",
        "ldr r1, =_stack_start",
        "msr msp, r1",
        "ldr r1, ={handler}",
        "bx r1",
        handler = sym hard_fault,
    )
}

extern "C" fn hard_fault(frame: *const u32) -> ! {
    motors::cut_power();
    // SAFETY: the exception wrote the frame, and the linker gave this memory to the stack.
    let [pc, lr] = unsafe { fault_place(frame, STACK) };
    restart_after(3, pc, lr)
}

/// The memory of the stack.
const STACK: core::ops::Range<usize> =
    crate::robot::STACK_ADDRESS..crate::robot::STACK_ADDRESS + crate::robot::STACK_SIZE;
