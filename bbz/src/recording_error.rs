//! A recording that a command cannot use.

use std::path::{Path, PathBuf};

use bittybuzz_arena::output::recording::RecordingError;

use crate::problem::Problem;

/// A recording that cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("cannot {action} `{path}`: {error}")]
pub struct RecordingProblem {
    /// The act of the command, such as `show`.
    action: &'static str,
    /// The path from the command line.
    path: PathBuf,
    error: RecordingError,
}

impl RecordingProblem {
    /// Returns the error of a command that does this with recordings.
    pub fn new(action: &'static str, path: &Path, error: RecordingError) -> Self {
        RecordingProblem { action, path: path.to_owned(), error }
    }
}

impl Problem for RecordingProblem {
    fn help(&self) -> Option<String> {
        let is_another_file = matches!(self.error, RecordingError::NotARecording);
        is_another_file.then(|| "`bbz sim SCENARIO.toml --record FILE` makes one".to_owned())
    }
}
