//! The exit status of this process.

/// The exit status of a process that Ctrl-C ended: by convention 128 plus the number of the signal.
pub const KILLED: i32 = 130;

/// The exit status of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExitStatus {
    Success = 0,
    RuntimeError = 1,
    CompileError = 2,
    /// A wrong command line, a file that cannot be read or written, an image that is refused.
    Usage = 3,
    /// A defect of this program ended a session. Rust uses this number for a panic.
    Defect = 101,
    /// Ctrl-C or SIGTERM, before all runs of a batch were finished.
    Interrupted = KILLED as isize,
}
