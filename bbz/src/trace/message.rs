//! The messages of a robot.

use bittybuzz_comms::infrared::FaultReport;
use bittybuzz_trace_reader as reader;

/// A message of a robot, or an observation of it.
#[derive(Debug, Clone, PartialEq)]
pub struct PrintedMessage {
    /// Seconds of the robot's own clock, or since power-on for an emulated robot.
    pub time: Option<f64>,
    pub content: TraceContent,
}

/// The content of a message.
#[derive(Debug, Clone, PartialEq)]
pub enum TraceContent {
    /// A record about the script ([`bittybuzz_comms::trace`]).
    Record(Vec<u8>),
    /// A message of a Kilobot about a fault of its script.
    Report(FaultReport),
    /// A message between Kilobots that is not about a fault.
    Received,
    /// An emulated Kilobot completed a step. It makes no steps in the pause after a fault.
    Step,
    /// A damaged record.
    Damaged(String),
    /// A message of the firmware.
    Firmware { level: Option<Level>, text: String },
    /// An output of an emulated robot.
    Output { name: String, state: String },
    /// The chip was reset.
    Reset { cause: String },
    /// The firmware cannot go on, or did something that the chip does not allow.
    Failure(String),
}

/// The level of a message of the firmware, as defmt names it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Level {
    Trace,
    Debug,
    Info,
    Warn,
    Error,
}

impl Level {
    pub const ALL: [Level; 5] =
        [Level::Trace, Level::Debug, Level::Info, Level::Warn, Level::Error];

    /// Returns the level of that name, in upper or lower case.
    pub fn from_name(name: &str) -> Option<Level> {
        Level::ALL.into_iter().find(|level| level.name().eq_ignore_ascii_case(name))
    }

    pub const fn name(self) -> &'static str {
        match self {
            Level::Trace => "TRACE",
            Level::Debug => "DEBUG",
            Level::Info => "INFO",
            Level::Warn => "WARN",
            Level::Error => "ERROR",
        }
    }
}

impl TraceContent {
    /// Converts the text of a defmt message, which may be a record.
    pub fn from_text(level: Option<Level>, text: &str) -> TraceContent {
        TraceContent::from_firmware(level, reader::MessageContent::from_text(text))
    }

    /// A message of the firmware.
    pub fn from_firmware(level: Option<Level>, content: reader::MessageContent) -> TraceContent {
        match content {
            reader::MessageContent::Record(bytes) => TraceContent::Record(bytes),
            reader::MessageContent::DamagedRecord(text) => TraceContent::Damaged(text),
            reader::MessageContent::Text(text) => TraceContent::Firmware { level, text },
            reader::MessageContent::Undecodable => {
                TraceContent::Damaged("a message of the firmware".to_owned())
            }
        }
    }
}
