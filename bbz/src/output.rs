//! Standard output, in order with what goes to standard error.

use std::io::{self, BufWriter, Stdout, Write};
use std::time::{Duration, Instant};

use crate::problem::Problem;

/// How long a person may wait to see a line.
const PATIENCE: Duration = Duration::from_millis(50);

/// Results of a run. Buffered, because a script may log thousands of lines in a second; whoever writes to standard
/// error or waits flushes first.
pub struct Output {
    stdout: BufWriter<Stdout>,
    flushed: Instant,
    error: Option<io::Error>,
}

impl Output {
    /// The standard output of this process.
    pub fn new() -> Self {
        Output { stdout: BufWriter::new(io::stdout()), flushed: Instant::now(), error: None }
    }

    /// Writes a line. Bytes, because a script can cut a string in the middle of a character.
    pub fn line(&mut self, line: &[u8]) {
        self.attempt(|stdout| {
            stdout.write_all(line)?;
            stdout.write_all(b"\n")
        });
    }

    /// Makes everything written visible.
    pub fn flush(&mut self) {
        self.attempt(BufWriter::flush);
        self.flushed = Instant::now();
    }

    /// Makes visible what has waited for long enough: for runs without pauses.
    pub fn refresh(&mut self) {
        if self.flushed.elapsed() >= PATIENCE {
            self.flush();
        }
    }

    /// Whether nothing more can be written.
    pub fn has_failed(&self) -> bool {
        self.error.is_some()
    }

    /// Flushes, and says why not everything was written. That the reader has gone (`bbz run ... | head`) is no error.
    pub fn finish(mut self) -> Result<(), Problem> {
        self.flush();
        match self.error {
            Some(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(Problem::Output(error)),
            _ => Ok(()),
        }
    }

    fn attempt(&mut self, write: impl FnOnce(&mut BufWriter<Stdout>) -> io::Result<()>) {
        if self.error.is_none() {
            self.error = write(&mut self.stdout).err();
        }
    }
}

/// Writes a whole result.
pub fn write(text: &str) -> Result<(), Problem> {
    let mut output = Output::new();
    output.attempt(|stdout| stdout.write_all(text.as_bytes()));
    output.finish()
}
