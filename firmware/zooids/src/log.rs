//! Log messages for a debug probe, if the feature `defmt` is on. Otherwise the macros do nothing,
//! and do not evaluate their arguments.
//!
//! The buffer never waits for its reader (`disable-blocking-mode` of defmt-rtt). It would wait
//! inside a critical section, and a robot whose cable is pulled would stop until its watchdog
//! restarts it. Instead defmt-rtt overwrites unread messages. A message is therefore only written
//! if the buffer has room, and otherwise counted.

#[cfg(feature = "defmt")]
mod room {
    use bittybuzz_comms::trace;
    use bittybuzz_runtime::losses::{ControlBlock, Losses};

    unsafe extern "C" {
        static _SEGGER_RTT: ControlBlock;
    }

    static LOSSES: Losses = Losses::new();

    /// Returns true if there is room for a message with `bytes` bytes of arguments. If earlier
    /// messages were lost, their number is written first. Only tasks may call this function, not
    /// interrupts.
    pub fn has_room(bytes: usize) -> bool {
        // SAFETY: defmt-rtt defines this static with this layout. The probe changes only `read`,
        // which is atomic.
        let block = unsafe { &_SEGGER_RTT };
        match LOSSES.admit(bytes, block) {
            None => return false,
            Some(0) => {}
            Some(lost) => defmt::println!("bbz {=[u8]}", trace::lost(lost).as_slice()),
        }
        true
    }
}

#[cfg(feature = "defmt")]
pub use room::has_room;

/// The maximum length of the arguments of a firmware message, in bytes.
#[cfg(feature = "defmt")]
pub const TEXT: usize = 24;

/// Writes a message for information.
macro_rules! info {
    ($($argument:tt)*) => {{
        #[cfg(feature = "defmt")]
        if crate::log::has_room(crate::log::TEXT) {
            defmt::info!($($argument)*);
        }
    }};
}

/// Writes a warning.
macro_rules! warning {
    ($($argument:tt)*) => {{
        #[cfg(feature = "defmt")]
        if crate::log::has_room(crate::log::TEXT) {
            defmt::warn!($($argument)*);
        }
    }};
}

/// Writes a message about a failure.
macro_rules! error {
    ($($argument:tt)*) => {{
        #[cfg(feature = "defmt")]
        if crate::log::has_room(crate::log::TEXT) {
            defmt::error!($($argument)*);
        }
    }};
}

pub(crate) use {error, info, warning};
