//! Sources: the runs and recordings that a client watches.

use std::time::Duration;

use crate::page_event::PageEvent;

/// A run or a recording, from a client's view: it takes requests, and returns events and samples.
pub trait Source {
    /// Restarts for a client, which may replace another one. The next events contain the full
    /// state.
    fn begin(&mut self);

    /// Handles a request. `now` is the time on a clock of the caller's that never goes back.
    fn request(&mut self, text: &str, now: Duration);

    /// Advances to the tick that is due, as long as `has_time` returns true. This lets the caller do
    /// other work in between. Returns true if ticks are still due.
    fn advance(&mut self, now: Duration, has_time: &mut dyn FnMut() -> bool) -> bool;

    /// Returns the current tick.
    fn tick(&self) -> u64;

    /// Takes the events since the last call.
    fn take_events(&mut self) -> Vec<PageEvent>;

    /// Takes a sample: the state of the robots at the current tick.
    fn take_sample(&mut self) -> Vec<u8>;
}
