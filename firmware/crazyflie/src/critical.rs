//! Critical sections that leave the link's interrupt alone.
//!
//! At 1 Mbaud a byte comes every 10 µs, and the USART holds one. Some critical sections are longer, above all those in
//! which defmt writes a record. So they mask all interrupts but those of priority 0 (ARMv7-M B1.4.3, BASEPRI), and only the
//! link has that: its interrupt shares nothing with the rest of the program but two lock-free rings.

use cortex_m::peripheral::NVIC;
use cortex_m::register::basepri;
use critical_section::RawRestoreState;

/// Priority of every interrupt but the link's. The F405 has the upper four bits.
const NORMAL: u8 = 0x80;
/// Masks all priorities but 0.
const MASK: u8 = 0x10;

struct AllButTheLink;
critical_section::set_impl!(AllButTheLink);

// SAFETY: on a single core nothing that may use a critical section runs while the mask is set: the interrupts of priority 0
// must not, which `Interrupts` in link/uart.rs keeps to.
unsafe impl critical_section::Impl for AllButTheLink {
    unsafe fn acquire() -> RawRestoreState {
        let before = basepri::read();
        // SAFETY: raises the mask; it never lowers one that is set, as there is only one value.
        unsafe { basepri::write(MASK) };
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::SeqCst);
        before
    }

    unsafe fn release(before: RawRestoreState) {
        core::sync::atomic::compiler_fence(core::sync::atomic::Ordering::SeqCst);
        // SAFETY: back to what `acquire` found.
        unsafe { basepri::write(before) };
    }
}

/// Gives every interrupt but the link's a priority that critical sections mask. Must come before anything else.
pub fn set_priorities(nvic: &mut NVIC) {
    for priority in &nvic.ipr {
        // SAFETY: no interrupt is enabled yet, so that no code relies on a priority.
        unsafe { priority.write(NORMAL) };
    }
    let link = crate::link::uart::INTERRUPT as usize;
    // SAFETY: as above; this interrupt uses no critical sections.
    unsafe { nvic.ipr[link].write(0) };
}
