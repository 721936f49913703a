//! The handling of failures of the firmware itself. The motors lose power first. Then the robot
//! writes a note of the failure to registers that a reset does not erase, and restarts. After the
//! restart it reports the failure and stays on the ground: no script runs until the power is
//! switched off and on.
//!
//! # The place of the note
//! The note is in the backup registers of the real-time clock. RAM is unsuitable: every reset runs
//! Bitcraze's bootloader first, which clears 0x20000014 to 0x20002878 and has its stack below
//! 0x20005000, and no manual promises the content of RAM after a reset. Only a reset of the backup
//! domain changes the backup registers (RM0090 26.3.13 and 6.1.3). Writing them needs PWR's clock
//! and PWR_CR.DBP (5.1.2), but neither the clock nor the key of the real-time clock (26.3.5).
//!
//! # The meaning of a restart
//! | flags of RCC_CSR | note | |
//! |---|---|---|
//! | watchdog | any | failure |
//! | software | good | failure, as noted |
//! | software | none | failure, unless a debugger has control of the core: it resets the same way |
//! | power-on | any | the note is cleared, the script runs |
//! | brown-out alone | any | failure: the cause of the low supply would act again |
//! | pin alone | none | the script runs |
//! | pin alone | good | failure, as noted: only power-on ends the lock |
//! | none, or others | any | failure |
//!
//! A damaged note is a failure, too, except after power-on. Every unexplained restart therefore
//! keeps the motors off.

use core::arch::naked_asm;
use core::panic::PanicInfo;

use bittybuzz_board::fault::fault_place;
use cortex_m::peripheral::{DCB, SCB};
use embassy_stm32::pac::{PWR, RCC, RTC};

use crate::motors;

/// The reason why the robot has restarted and may run no script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The watchdog ended the program, because a task showed no sign of life or the crystal did not
    /// start.
    Watchdog,
    /// The chip reset itself because of a low supply.
    BrownOut,
    /// The cause of the reset is unknown, or the note is damaged.
    Unexplained,
    /// The program detected an error of its own.
    Panic {
        /// The return address in the code that called the panic handler.
        lr: u32,
    },
    /// The processor refused an instruction or an access, or the stack is full.
    HardFault {
        /// The address of the instruction; 0 if the stack could not hold it.
        pc: u32,
        /// The return address of its caller.
        lr: u32,
        /// The configurable fault status register (ARMv7-M B3.2.15).
        cfsr: u32,
    },
    /// An exception or interrupt without a handler.
    Interrupt {
        /// The exception number.
        number: u32,
    },
}

impl defmt::Format for Failure {
    fn format(&self, f: defmt::Formatter<'_>) {
        match self {
            Failure::Watchdog => defmt::write!(f, "a watchdog reset: a task died, or the crystal"),
            Failure::BrownOut => defmt::write!(f, "a brown-out: charge the battery"),
            Failure::Unexplained => defmt::write!(f, "a reset that nothing explains"),
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

/// The causes in a note. Smaller values are exception numbers, which have nine bits; 0 is a panic.
const WATCHDOG: u32 = 0x200;
const BROWN_OUT: u32 = 0x201;
const UNEXPLAINED: u32 = 0x202;
const HARD_FAULT: u32 = 3;

/// A failure as it is stored in the backup registers: a mark, the cause, the address, the caller,
/// the status, and a checksum of these.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Note([u32; 6]);

/// The mark, which is the first word of a note.
const WRITTEN: u32 = 0xb177_fa11;

impl Note {
    /// The content of the registers when no failure was noted since power-on.
    const BLANK: Note = Note([0; 6]);

    fn new(cause: u32, pc: u32, lr: u32, status: u32) -> Self {
        Note([WRITTEN, cause, pc, lr, status, Self::checksum(cause, pc, lr, status)])
    }

    fn checksum(cause: u32, pc: u32, lr: u32, status: u32) -> u32 {
        !(cause ^ pc.rotate_left(8) ^ lr.rotate_left(16) ^ status.rotate_left(24))
    }

    fn of(failure: Failure) -> Self {
        match failure {
            Failure::Watchdog => Note::new(WATCHDOG, 0, 0, 0),
            Failure::BrownOut => Note::new(BROWN_OUT, 0, 0, 0),
            Failure::Unexplained => Note::new(UNEXPLAINED, 0, 0, 0),
            Failure::Panic { lr } => Note::new(0, 0, lr, 0),
            Failure::HardFault { pc, lr, cfsr } => Note::new(HARD_FAULT, pc, lr, cfsr),
            Failure::Interrupt { number } => Note::new(number, 0, 0, 0),
        }
    }

    /// Returns the failure in the note; `None` if there is no note.
    fn failure(self) -> Option<Failure> {
        if self == Note::BLANK {
            return None;
        }
        let Note([written, cause, pc, lr, status, checksum]) = self;
        if written != WRITTEN || checksum != Self::checksum(cause, pc, lr, status) {
            return Some(Failure::Unexplained);
        }
        Some(match cause {
            0 => Failure::Panic { lr },
            HARD_FAULT => Failure::HardFault { pc, lr, cfsr: status },
            WATCHDOG => Failure::Watchdog,
            BROWN_OUT => Failure::BrownOut,
            UNEXPLAINED => Failure::Unexplained,
            number => Failure::Interrupt { number },
        })
    }

    fn read() -> Self {
        Note(core::array::from_fn(|at| RTC.bkpr(at).read().bkp()))
    }

    /// Writes the note to the backup registers. This works even if nothing else is set up.
    fn write(self) {
        RCC.apb1enr().modify(|w| w.set_pwren(true));
        // The clock reaches PWR two cycles later (RM0090 6.3.13). This read waits for it.
        let _ = RCC.apb1enr().read();
        PWR.cr1().modify(|w| w.set_dbp(true));
        for (at, word) in self.0.into_iter().enumerate() {
            RTC.bkpr(at).write(|w| w.set_bkp(word));
        }
    }
}

/// Returns the failure that keeps scripts from running, if there is one: that of the last reset, or
/// of an earlier one since power-on. Clears the chip's flags.
pub fn take() -> Option<Failure> {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    let noted = Note::read().failure();
    let is_software = flags.sftrstf() && !flags.wwdgrstf() && !flags.lpwrrstf();
    let failure = if flags.wdgrstf() {
        Some(Failure::Watchdog)
    } else if is_software {
        noted.or((!is_debugged()).then_some(Failure::Unexplained))
    } else if flags.wwdgrstf() || flags.lpwrrstf() {
        Some(Failure::Unexplained)
    } else if flags.porrstf() {
        None
    } else if flags.borrstf() {
        Some(Failure::BrownOut)
    } else if flags.padrstf() {
        noted
    } else {
        Some(Failure::Unexplained)
    };
    failure.map_or(Note::BLANK, Note::of).write();
    failure
}

/// Returns true if a debugger has control of the core (DHCSR.C_DEBUGEN, ARMv7-M C1.6.2).
fn is_debugged() -> bool {
    // SAFETY: reading DHCSR only clears two flags, which only debuggers use.
    unsafe { (*DCB::PTR).dhcsr.read() & 1 != 0 }
}

fn restart_after(cause: u32, pc: u32, lr: u32, status: u32) -> ! {
    motors::cut_power();
    Note::new(cause, pc, lr, status).write();
    SCB::sys_reset()
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    let lr: u32;
    // SAFETY: reads a register.
    unsafe { core::arch::asm!("mov {}, lr", out(reg) lr) };
    restart_after(0, 0, lr, 0)
}

/// Handles every exception and interrupt without a handler of its own.
#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_: i16) -> ! {
    // SAFETY: reading ICSR has no effect.
    let active = unsafe { (*SCB::PTR).icsr.read() } & 0x1ff;
    restart_after(active, 0, 0, 0)
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
        "b {handler}",
        handler = sym hard_fault,
    )
}

extern "C" fn hard_fault(frame: *const u32) -> ! {
    motors::cut_power();
    // SAFETY: reading CFSR has no effect.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    // SAFETY: the exception wrote the frame, and the linker gave this memory to the stack.
    let [pc, lr] = unsafe { fault_place(frame, STACK) };
    restart_after(HARD_FAULT, pc, lr, status)
}

/// The memory of the stack.
const STACK: core::ops::Range<usize> =
    crate::robot::STACK_ADDRESS..crate::robot::STACK_ADDRESS + crate::robot::STACK_SIZE;
