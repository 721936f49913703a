//! The pace of robots that ground stations command.

use std::thread;
use std::time::{Duration, Instant};

/// The longest time by which a run may be late and still catch up. After a longer pause, a ground
/// station would see the robots rush through the time that they missed.
const LATE_MAX: Duration = Duration::from_millis(100);

/// A clock that simulated time does not overtake.
#[derive(Debug, Default)]
pub struct Pace {
    /// The time of this computer at power-on; `None` before the first turn.
    begin: Option<Instant>,
}

impl Pace {
    /// Waits until this time since power-on has come on this computer, too.
    pub fn wait(&mut self, until: Duration) {
        let now = Instant::now();
        let due = self.begin.and_then(|begin| begin.checked_add(until));
        match due {
            Some(due) if due + LATE_MAX >= now => {
                thread::sleep(due.saturating_duration_since(now));
            }
            _ => self.begin = now.checked_sub(until).or(self.begin),
        }
    }
}
