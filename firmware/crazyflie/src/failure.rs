//! What happens when the firmware itself fails: the motors lose power first, then the robot notes what happened where a
//! reset does not erase it, and restarts. After the restart it tells, and stays on the ground: no script runs until the
//! power is switched off and on.

use core::arch::naked_asm;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use embassy_stm32::pac::RCC;

use crate::motors;

/// Marks a note as written by [`note`]: memory holds anything after power-on.
const WRITTEN: u32 = 0xb177_fa11;

const CAUSE: usize = 1;
const PC: usize = 2;
const LR: usize = 3;
const STATUS: usize = 4;

/// Survives a reset, but not a loss of power.
#[unsafe(link_section = ".uninit.failure")]
static NOTE: [AtomicU32; 5] = [const { AtomicU32::new(0) }; 5];

/// Why the robot has restarted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// A task showed no sign of life and the watchdog ended the program.
    Watchdog,
    /// The program found a mistake of its own.
    Panic {
        /// The code that called the panic handler.
        lr: u32,
    },
    /// The processor refused an instruction or an access, or the stack is full.
    HardFault {
        /// The instruction, 0 if the stack could not hold it.
        pc: u32,
        /// Its caller.
        lr: u32,
        /// Configurable fault status register, ARMv7-M B3.2.15.
        cfsr: u32,
    },
    /// An interrupt that nothing handles.
    Interrupt {
        /// Its exception number.
        number: u32,
    },
}

impl defmt::Format for Failure {
    fn format(&self, f: defmt::Formatter<'_>) {
        match self {
            Failure::Watchdog => defmt::write!(f, "a task died (watchdog)"),
            Failure::Panic { lr } => defmt::write!(f, "a panic, called from {=u32:#x}", lr),
            Failure::HardFault { pc, lr, cfsr } => defmt::write!(
                f,
                "a hardware fault at {=u32:#x}, called from {=u32:#x}, CFSR {=u32:#x}",
                pc,
                lr,
                cfsr
            ),
            Failure::Interrupt { number } => {
                defmt::write!(f, "exception {=u32}, which nothing handles", number)
            }
        }
    }
}

/// Why the last reset came, if it was not power-on or a person. Clears the chip's flags and the note.
pub fn take() -> Option<Failure> {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    let written = NOTE[0].swap(0, Ordering::Relaxed) == WRITTEN;
    let word = |at: usize| NOTE[at].load(Ordering::Relaxed);
    if flags.wdgrstf() {
        return Some(Failure::Watchdog);
    }
    if !flags.sftrstf() || !written {
        return None;
    }
    Some(match word(CAUSE) {
        0 => Failure::Panic { lr: word(LR) },
        3 => Failure::HardFault { pc: word(PC), lr: word(LR), cfsr: word(STATUS) },
        number => Failure::Interrupt { number },
    })
}

fn restart_after(cause: u32, pc: u32, lr: u32, status: u32) -> ! {
    motors::cut_power();
    for (at, value) in [(CAUSE, cause), (PC, pc), (LR, lr), (STATUS, status), (0, WRITTEN)] {
        NOTE[at].store(value, Ordering::Relaxed);
    }
    SCB::sys_reset()
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    let lr: u32;
    // SAFETY: reads a register.
    unsafe { core::arch::asm!("mov {}, lr", out(reg) lr) };
    restart_after(0, 0, lr, 0)
}

/// Every exception and interrupt without a handler of its own.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    // SAFETY: reading ICSR has no effect.
    let active = unsafe { (*SCB::PTR).icsr.read() } & 0x1ff;
    restart_after(active, 0, 0, 0)
}

/// The stack pointer may be outside the memory: a full stack is one of the reasons to be here. So the handler begins with
/// a stack pointer of its own, before anything is pushed.
///
/// # Safety
/// Called by the processor only.
#[unsafe(no_mangle)]
#[unsafe(naked)]
unsafe extern "C" fn HardFault() -> ! {
    naked_asm!(
        "mrs r0, msp",
        "ldr r1, =_stack_start",
        "msr msp, r1",
        "b {handler}",
        handler = sym hard_fault,
    )
}

extern "C" fn hard_fault(frame: *const u32) -> ! {
    motors::cut_power();
    // SAFETY: reading CFSR has no effect.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    let (mut pc, mut lr) = (0, 0);
    if STACK.contains(&(frame as usize)) && (frame as usize).is_multiple_of(4) {
        // SAFETY: eight words from here on lie within the stack's memory; the exception has written them.
        unsafe {
            lr = frame.add(5).read_volatile();
            pc = frame.add(6).read_volatile();
        }
    }
    restart_after(3, pc, lr, status)
}

/// Where an exception frame of eight words can begin.
const STACK: core::ops::Range<usize> = crate::robot::STACK_ADDRESS
    ..crate::robot::STACK_ADDRESS + crate::robot::STACK_SIZE - 7 * size_of::<u32>();
