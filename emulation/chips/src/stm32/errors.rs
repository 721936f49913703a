//! The mistakes of the firmware that a chip notices.

use std::collections::HashSet;

use crate::HardwareError;

/// The mistakes of a firmware. Each is reported once, because firmware that repeats a mistake does so
/// many times per second.
#[derive(Default)]
pub(crate) struct ErrorLog {
    unread: Vec<HardwareError>,
    reported: HashSet<HardwareError>,
    accesses_without_clock: u64,
}

impl ErrorLog {
    /// Reports an error, unless it was reported before.
    pub fn report(&mut self, error: HardwareError) {
        if self.reported.insert(error.clone()) {
            self.unread.push(error);
        }
    }

    /// Returns `is_clocked`. If it is false, the access to the peripheral whose registers begin at
    /// `base` is a mistake.
    pub fn check_clock(&mut self, base: u32, is_clocked: bool) -> bool {
        if !is_clocked {
            self.accesses_without_clock += 1;
            self.report(HardwareError::NoClock { base });
        }
        is_clocked
    }

    /// Returns the number of accesses to peripherals whose clock was off.
    pub fn accesses_without_clock(&self) -> u64 {
        self.accesses_without_clock
    }

    /// Returns true if no error was reported since the last [`take`](Self::take).
    pub fn is_empty(&self) -> bool {
        self.unread.is_empty()
    }

    /// Returns the errors that were reported since the last call.
    pub fn take(&mut self) -> Vec<HardwareError> {
        std::mem::take(&mut self.unread)
    }
}
