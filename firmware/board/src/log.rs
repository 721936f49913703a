//! Log messages for a debug probe, if the feature `defmt` is on. Otherwise the macros do nothing,
//! and do not evaluate their arguments.
//!
//! The buffer never waits for its reader (`disable-blocking-mode` of defmt-rtt). It would wait
//! inside a critical section, and a robot whose cable is pulled would stop until its watchdog
//! restarts it. Instead defmt-rtt overwrites unread messages. A message is therefore only written
//! if the buffer has room, and otherwise counted. Only tasks may write messages, not interrupts.

pub use crate::{error, info, warning};

#[cfg(feature = "defmt")]
mod room {
    use bittybuzz_comms::trace;
    use bittybuzz_runtime::losses::{ControlBlock, Losses};

    unsafe extern "C" {
        static _SEGGER_RTT: ControlBlock;
    }

    static LOSSES: Losses = Losses::new();

    /// The maximum length of the arguments of a firmware message, in bytes.
    pub const TEXT_MAX: usize = 24;

    /// Returns true if there is room for a message with `bytes` bytes of arguments. If earlier
    /// messages were lost, their number is written first.
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
pub use room::{TEXT_MAX, has_room};

/// Writes a record of the script's trace.
pub fn write_record(_record: &[u8]) {
    #[cfg(feature = "defmt")]
    if has_room(_record.len()) {
        defmt::println!("bbz {=[u8]}", _record);
    }
}

/// Writes a message of a level of defmt.
#[cfg(feature = "defmt")]
#[doc(hidden)]
#[macro_export]
macro_rules! write_message {
    ($level:ident, $($argument:tt)*) => {
        if $crate::log::has_room($crate::log::TEXT_MAX) {
            defmt::$level!($($argument)*);
        }
    };
}

#[cfg(not(feature = "defmt"))]
#[doc(hidden)]
#[macro_export]
macro_rules! write_message {
    ($($argument:tt)*) => {{}};
}

/// Writes a message for information.
#[macro_export]
macro_rules! info {
    ($($argument:tt)*) => { $crate::write_message!(info, $($argument)*) };
}

/// Writes a warning.
#[macro_export]
macro_rules! warning {
    ($($argument:tt)*) => { $crate::write_message!(warn, $($argument)*) };
}

/// Writes a message about a failure.
#[macro_export]
macro_rules! error {
    ($($argument:tt)*) => { $crate::write_message!(error, $($argument)*) };
}
