//! Standard output, kept in order with standard error. All text passes the filter of [`crate::escape`].

use std::io::{self, BufWriter, Stdout, Write};
use std::time::{Duration, Instant};

use serde_json::json;

use crate::escape::escaped;
use crate::problem::Problem;

/// Standard output cannot be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write to standard output: {0}")]
pub struct OutputError(io::Error);

impl Problem for OutputError {}

/// The longest time that a line stays in the buffer.
const PATIENCE: Duration = Duration::from_millis(50);

/// The form of a script's output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputForm {
    /// Lines.
    Lines,
    /// A JSON object for each line: `{"printed": "..."}`.
    Json,
}

/// The output of a run. It is buffered, because a script may log thousands of lines per second;
/// code that writes to standard error or waits flushes first.
pub struct ScriptOutput {
    stdout: BufWriter<Stdout>,
    form: OutputForm,
    flushed: Instant,
    error: Option<io::Error>,
}

impl ScriptOutput {
    /// Opens the standard output of this process, in lines.
    pub fn new() -> Self {
        ScriptOutput::of(OutputForm::Lines)
    }

    /// Opens the standard output of this process in this form.
    pub fn of(form: OutputForm) -> Self {
        ScriptOutput {
            stdout: BufWriter::new(io::stdout()),
            form,
            flushed: Instant::now(),
            error: None,
        }
    }

    /// Writes a line that a script prints. It consists of bytes, because a script can cut a string
    /// in the middle of a character.
    pub fn line(&mut self, line: &[u8]) {
        match self.form {
            OutputForm::Lines => self.plain(line),
            OutputForm::Json => {
                let object = json!({ "printed": String::from_utf8_lossy(line) });
                self.plain(object.to_string().as_bytes());
            }
        }
    }

    /// Writes a line.
    pub fn plain(&mut self, line: &[u8]) {
        let line = String::from_utf8_lossy(line);
        self.attempt(|stdout| {
            stdout.write_all(escaped(&line).as_bytes())?;
            stdout.write_all(b"\n")
        });
    }

    /// Makes everything written visible.
    pub fn flush(&mut self) {
        self.attempt(BufWriter::flush);
        self.flushed = Instant::now();
    }

    /// Flushes output that has waited for `PATIENCE`, in runs without pauses.
    pub fn refresh(&mut self) {
        if self.flushed.elapsed() >= PATIENCE {
            self.flush();
        }
    }

    /// Returns true if nothing more can be written.
    pub fn has_failed(&self) -> bool {
        self.error.is_some()
    }

    /// Flushes, and returns the reason if not everything was written. A reader that has closed the
    /// output (`bbz run ... | head`) is no error.
    pub fn finish(mut self) -> Result<(), OutputError> {
        self.flush();
        match self.error {
            Some(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(OutputError(error)),
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
pub fn write(text: &str) -> Result<(), OutputError> {
    let mut output = ScriptOutput::new();
    output.attempt(|stdout| stdout.write_all(escaped(text).as_bytes()));
    output.finish()
}
