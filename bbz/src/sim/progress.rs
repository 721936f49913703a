//! The progress of a simulation, on a terminal.

use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Updates of the line per second.
const REFRESH_HZ: u8 = 5;

/// A line that shows the progress. Without a terminal, it shows nothing.
pub struct Progress {
    bar: ProgressBar,
    start: Instant,
    shown: Instant,
}

impl Progress {
    /// Returns a line for this number of steps, ticks or runs.
    pub fn new(length: u64, is_hidden: bool) -> Self {
        let target = match is_hidden {
            true => ProgressDrawTarget::hidden(),
            // The line is hidden too if standard error is not a terminal.
            false => ProgressDrawTarget::stderr_with_hz(REFRESH_HZ),
        };
        let bar = ProgressBar::with_draw_target(Some(length), target);
        let style = ProgressStyle::with_template("{bar:30} {percent:>3} %  {msg}  {eta} left")
            .expect("the template is constant, and a test uses it");
        bar.set_style(style.progress_chars("=> "));
        Progress { bar, start: Instant::now(), shown: Instant::now() }
    }

    /// Sets the position. Calls `message` only when the line is due for an update.
    pub fn set(&mut self, position: u64, message: impl FnOnce(Duration) -> String) {
        let now = Instant::now();
        if !self.bar.is_hidden() && now - self.shown >= Duration::from_millis(200) {
            self.shown = now;
            self.bar.set_message(message(now - self.start));
            self.bar.set_position(position);
        }
    }

    /// Hides the line while `write` prints something else.
    pub fn aside<T>(&self, write: impl FnOnce() -> T) -> T {
        self.bar.suspend(write)
    }

    /// Removes the line, and returns the time since its creation.
    pub fn finish(self) -> Duration {
        self.bar.finish_and_clear();
        self.start.elapsed()
    }
}
