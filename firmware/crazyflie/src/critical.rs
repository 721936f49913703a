//! Critical sections that do not mask the link's interrupt.
//!
//! At 1 Mbaud a byte arrives every 10 µs, and the USART holds one. Some critical sections are
//! longer, above all those in which defmt writes a record. Critical sections therefore mask all
//! interrupts except those of priority 0 (ARMv7-M B1.4.3, BASEPRI), which only the link's interrupt
//! has. That interrupt shares nothing with the rest of the program except two lock-free rings.

use cortex_m::peripheral::NVIC;
use cortex_m::register::basepri;
use critical_section::RawRestoreState;

/// The priority of every interrupt except the link's. The F405 implements the upper four bits.
const NORMAL: u8 = 0x80;
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

/// Gives every interrupt except the link's a priority that critical sections mask. Call this
/// function first.
pub fn set_priorities(nvic: &mut NVIC) {
    for priority in &nvic.ipr {
        // SAFETY: no interrupt is enabled yet, so no code relies on a priority.
        unsafe { priority.write(NORMAL) };
    }
    let link = crate::link::uart::INTERRUPT as usize;
    // SAFETY: as above; this interrupt uses no critical sections.
    unsafe { nvic.ipr[link].write(0) };
}
