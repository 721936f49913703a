//! Ctrl-C: the first press asks the run to end, the second ends the process.

use std::process;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::time::Duration;

/// The exit status of a process that Ctrl-C has ended, by convention 128 and the number of the signal.
const KILLED: i32 = 130;

/// Tells whether Ctrl-C was pressed.
pub struct Interrupt {
    pressed: Receiver<()>,
    raised: bool,
}

impl Interrupt {
    /// Takes over Ctrl-C for the rest of the process.
    pub fn install() -> Result<Self, ctrlc::Error> {
        let (sender, pressed) = mpsc::channel();
        let again = AtomicBool::new(false);
        ctrlc::set_handler(move || {
            if again.swap(true, Ordering::Relaxed) || sender.send(()).is_err() {
                process::exit(KILLED);
            }
        })?;
        Ok(Interrupt { pressed, raised: false })
    }

    /// Whether it was pressed.
    pub fn is_raised(&mut self) -> bool {
        self.raised |= self.pressed.try_recv().is_ok();
        self.raised
    }

    /// Whether it was pressed, or is within that time.
    pub fn is_raised_within(&mut self, time: Duration) -> bool {
        self.wait(time);
        self.raised
    }

    /// Waits so long, or until it is pressed.
    pub fn wait(&mut self, time: Duration) {
        if !self.raised {
            self.raised = self.pressed.recv_timeout(time).is_ok();
        }
    }
}
