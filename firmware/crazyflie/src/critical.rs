//! The priorities of interrupts, and critical sections that do not mask the link's interrupt.
//!
//! At 1 Mbaud a byte arrives every 10 µs, and the USART holds one. Some critical sections are
//! longer, above all those in which defmt writes a record. Critical sections therefore mask all
//! interrupts except those of priority 0 (ARMv7-M B1.4.3, BASEPRI), which only the link's interrupt
//! has. That interrupt shares nothing with the rest of the program except two lock-free rings.
//!
//! | priority | interrupts | masked by critical sections |
//! |---|---|---|
//! | 0x00 | USART6, the link | no |
//! | 0x20 | I2C3, all DMA streams, the gyroscope's data-ready line | yes |
//! | 0x30 | UART5, which runs the flight executor ([`crate::flight`]) | yes |
//! | 0x80 | all others, among them the timer and the link's waker | yes |
//! | none | the thread executor: link, script, LEDs, battery | |
//!
//! Only the link's interrupt uses no critical sections. All wakers, the timer queue and the state
//! that tasks of both executors share lie behind critical sections, so every interrupt from 0x10 on
//! may use them. The longest critical section in emulation takes 6.4 µs, while defmt writes a record.
//! It delays the sensors' interrupts by as much: the bus then waits with SCL low, and loses nothing.
//! The times of data-ready pulses are late by the same amount.

use cortex_m::peripheral::NVIC;
use cortex_m::register::basepri;
use critical_section::RawRestoreState;
use embassy_stm32::interrupt::{Interrupt, Priority};

/// The priority of all interrupts without one of their own. The F405 implements the upper four bits.
const NORMAL: u8 = 0x80;
/// The priority of DMA interrupts, which `embassy_stm32::init` sets. That of I2C3 needs it; the others
/// only end transfers.
pub const DMA: Priority = Priority::P2;
/// The interrupts with a priority of their own.
const PRIORITIES: [(Interrupt, u8); 6] = [
    (crate::link::uart::INTERRUPT, 0x00),
    (Interrupt::I2C3_EV, 0x20),
    (Interrupt::I2C3_ER, 0x20),
    (Interrupt::DMA1_STREAM2, 0x20),
    (Interrupt::EXTI15_10, 0x20),
    (crate::flight::INTERRUPT, 0x30),
];
/// The value of BASEPRI that masks all priorities except 0.
const MASK: u8 = 0x10;

struct AllButTheLink;
critical_section::set_impl!(AllButTheLink);

// SAFETY: there is a single core. While the mask is set, only interrupts of priority 0 run, and
// these must not use critical sections; `Interrupts` in link/uart.rs complies.
unsafe impl critical_section::Impl for AllButTheLink {
    unsafe fn acquire() -> RawRestoreState {
        let before = basepri::read();
        // SAFETY: this raises the mask, or leaves it as it is; there is only one value.
        unsafe { basepri::write(MASK) };
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::SeqCst);
        before
    }

    unsafe fn release(before: RawRestoreState) {
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::SeqCst);
        // SAFETY: this restores the value from before `acquire`.
        unsafe { basepri::write(before) };
    }
}

/// Gives every interrupt its priority. Call this function first.
pub fn set_priorities(nvic: &mut NVIC) {
    for priority in &nvic.ipr {
        // SAFETY: no interrupt is enabled yet, so no code relies on a priority.
        unsafe { priority.write(NORMAL) };
    }
    for (interrupt, priority) in PRIORITIES {
        // SAFETY: as above; the interrupt of priority 0 uses no critical sections.
        unsafe { nvic.set_priority(interrupt, priority) };
    }
}
