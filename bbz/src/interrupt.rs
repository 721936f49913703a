//! Ctrl-C and SIGTERM: the first one asks the run to end, the second ends the process.

use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::Duration;

use crate::exit::{ExitStatus, KILLED};
use crate::problem::Problem;

/// Ctrl-C cannot be taken over.
#[derive(Debug, thiserror::Error)]
#[error("cannot take over Ctrl-C: {0}")]
pub struct InterruptError(#[from] ctrlc::Error);

impl Problem for InterruptError {}

/// The causes of an interrupt, for messages.
pub const NAME: &str = "Ctrl-C or SIGTERM";

/// Lets a write beyond the limit of file sizes (`ulimit -f`) fail with an error, which names the
/// file. The signal would otherwise end the process without a sentence, and leave temporary files.
#[cfg(unix)]
pub fn outlive_file_limit() {
    // Without the handler, the process ends as all others do.
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default());
}

/// Other systems have no such limit.
#[cfg(not(unix))]
pub fn outlive_file_limit() {}

/// Reports interrupts: Ctrl-C, or a request that the process ends.
pub struct Interrupt {
    flag: Arc<AtomicBool>,
    pressed: Receiver<()>,
    raised: bool,
}

impl Interrupt {
    /// Takes over Ctrl-C and SIGTERM for the rest of the process.
    pub fn install() -> Result<Self, InterruptError> {
        Interrupt::install_with(None)
    }

    /// Takes them over in a process that has nothing to finish: it ends with success `patience` after
    /// the first interrupt, if it has not ended by then. A tick of 50,000 robots takes a minute.
    pub fn install_ending_after(patience: Duration) -> Result<Self, InterruptError> {
        Interrupt::install_with(Some(patience))
    }

    fn install_with(patience: Option<Duration>) -> Result<Self, InterruptError> {
        let (sender, pressed) = mpsc::channel();
        let flag = Arc::new(AtomicBool::new(false));
        let again = flag.clone();
        let handle = Arc::new(move || {
            if again.swap(true, Ordering::Relaxed) || sender.send(()).is_err() {
                process::exit(KILLED);
            }
            if let Some(patience) = patience {
                thread::spawn(move || {
                    thread::sleep(patience);
                    process::exit(ExitStatus::Success as i32);
                });
            }
        });
        on_termination(handle.clone())?;
        ctrlc::set_handler(move || handle())?;
        Ok(Interrupt { flag, pressed, raised: false })
    }

    /// Returns a flag for all threads that becomes true at the first interrupt. The flag works as
    /// long as this value exists.
    pub fn flag(&self) -> Arc<AtomicBool> {
        self.flag.clone()
    }

    /// Returns true after an interrupt.
    pub fn is_raised(&mut self) -> bool {
        self.raised |= self.pressed.try_recv().is_ok();
        self.raised
    }

    /// Waits for at most `time`, and returns true after an interrupt.
    pub fn is_raised_within(&mut self, time: Duration) -> bool {
        self.wait(time);
        self.raised
    }

    /// Waits for `time`, or until an interrupt.
    pub fn wait(&mut self, time: Duration) {
        if !self.raised {
            self.raised = self.pressed.recv_timeout(time).is_ok();
        }
    }
}

/// Calls `handle` for each SIGTERM.
#[cfg(unix)]
fn on_termination(handle: Arc<impl Fn() + Send + Sync + 'static>) -> Result<(), ctrlc::Error> {
    use signal_hook::consts::SIGTERM;
    use signal_hook::iterator::Signals;

    let mut signals = Signals::new([SIGTERM]).map_err(ctrlc::Error::System)?;
    thread::spawn(move || signals.forever().for_each(|_| handle()));
    Ok(())
}

/// Does nothing: other systems do not have this signal.
#[cfg(not(unix))]
fn on_termination(_: Arc<impl Fn() + Send + Sync + 'static>) -> Result<(), ctrlc::Error> {
    Ok(())
}
