//! Sources: the runs and recordings that a client watches.

use std::time::Duration;

use serde_json::Value;

/// A run or a recording, as its client sees it: requests go in, events and samples come out.
pub trait Source {
    /// A client has come, perhaps in place of another one: the next events are all that it has to know.
    fn begin(&mut self);

    /// Carries a request out. `now` is the time on a clock of the caller's that never goes back.
    fn request(&mut self, text: &str, now: Duration);

    /// Goes on to the tick that is due as long as `goes_on` returns true, so that the caller can look after others. Returns true if
    /// ticks are still due.
    fn advance(&mut self, now: Duration, goes_on: &mut dyn FnMut() -> bool) -> bool;

    /// Returns the tick that is shown.
    fn tick(&self) -> u64;

    /// Takes the events since the last question.
    fn take_events(&mut self) -> Vec<Value>;

    /// Takes a sample: the robots as they are at this tick.
    fn take_sample(&mut self) -> Vec<u8>;
}
