//! The reasons why a recording cannot be read.

use std::fmt;

use super::{ROBOTS_MAX, VERSION};

/// A reason why a recording cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RecordingError {
    /// The data do not begin like a recording.
    NotARecording,
    /// The recording has another version of the format.
    Version(u8),
    /// The recording has more robots than there are ids.
    TooManyRobots(u32),
    /// Two robots of the recording have this id.
    EqualIds(u16),
    /// The recording has no samples.
    Empty,
    /// The data end before the end of the recording.
    Truncated,
    /// The content at this byte is not valid.
    Malformed(usize),
}

impl fmt::Display for RecordingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RecordingError::NotARecording => f.write_str("it is not a recording"),
            RecordingError::Version(version) => {
                let age = if *version < VERSION { "older" } else { "newer" };
                write!(
                    f,
                    "it is a recording of version {version}, {age} than version {VERSION}, which this program reads: \
                     record the run again"
                )
            }
            RecordingError::TooManyRobots(count) => {
                write!(
                    f,
                    "it is damaged: it has {count} robots, and at most {ROBOTS_MAX} have different ids"
                )
            }
            RecordingError::EqualIds(id) => {
                write!(f, "it is damaged: two of its robots have the id {id}")
            }
            RecordingError::Empty => f.write_str("it has no samples"),
            RecordingError::Truncated => f.write_str("it is cut off"),
            RecordingError::Malformed(at) => write!(f, "it is damaged at byte {at}"),
        }
    }
}

impl std::error::Error for RecordingError {}
