//! Reads a robot's trace records (`bittybuzz_comms::trace`) out of its messages, on the host.
//!
//! Firmware sends a record as the defmt message `bbz {=[u8]}`, which prints as `bbz [1, 7, 0]`. A
//! host receives it either as bytes from RTT, which [`TraceReader`] decodes with the [`Table`] of
//! the firmware's ELF file, or as text from probe-rs, for [`MessageContent::from_text`].
//! `bittybuzz_comms::trace::Record` decodes the record's bytes.

use std::sync::Arc;

pub use defmt_decoder::Table;
use defmt_decoder::{DecodeError, Encoding, Frame};

/// The content of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum MessageContent {
    /// The bytes of a trace record.
    Record(Vec<u8>),
    /// The text of a message that begins like a record but cannot be parsed as one.
    DamagedRecord(String),
    /// The text of the firmware's own message.
    Text(String),
    /// Bytes that do not decode as a message of this firmware.
    Undecodable,
}

impl MessageContent {
    /// Parses the text of a message. The location in the firmware's source may follow a record.
    pub fn from_text(text: &str) -> MessageContent {
        let Some(list) = text.strip_prefix("bbz [") else {
            return MessageContent::Text(text.to_owned());
        };
        let bytes = list.split_once(']').and_then(|(list, _)| {
            let numbers = list.split(',').map(str::trim).filter(|number| !number.is_empty());
            numbers.map(|number| number.parse().ok()).collect()
        });
        match bytes {
            Some(bytes) => MessageContent::Record(bytes),
            None => MessageContent::DamagedRecord(text.to_owned()),
        }
    }
}

/// A message of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct TraceMessage {
    pub seconds: Option<f64>,
    /// The level as defmt names it: `trace`, `debug`, `info`, `warn` or `error`.
    pub level: Option<&'static str>,
    pub content: MessageContent,
}

impl TraceMessage {
    fn new(frame: &Frame<'_>) -> Self {
        let time = frame.display_timestamp().map(|time| time.to_string());
        TraceMessage {
            seconds: time.and_then(|time| time.trim().parse().ok()),
            level: frame.level().map(|level| level.as_str()),
            content: MessageContent::from_text(&frame.display_message().to_string()),
        }
    }

    const UNDECODABLE: Self =
        TraceMessage { seconds: None, level: None, content: MessageContent::Undecodable };
}

/// The longest message in bytes. A robot's whole RTT buffer has a few KiB. Without a limit, bytes that
/// end no message would be kept, and read again with each piece that arrives.
const MESSAGE_BYTES_MAX: usize = 16 << 10;

/// Decodes the bytes that a robot writes to RTT.
#[derive(Clone)]
pub struct TraceReader {
    table: Arc<Table>,
    /// The received bytes of a message that is not complete yet.
    waiting: Vec<u8>,
    /// True while the bytes that follow cannot be read: after an error in the raw encoding, which has
    /// no frames, and to the end of a frame that is too long.
    is_lost: bool,
}

impl TraceReader {
    /// Returns a reader for the firmware whose ELF file holds `table`.
    pub fn new(table: Arc<Table>) -> Self {
        TraceReader { table, waiting: Vec::new(), is_lost: false }
    }

    /// Discards an incomplete message, after a reset or a power-off of the robot.
    pub fn restart(&mut self) {
        self.waiting.clear();
        self.is_lost = false;
    }

    /// Adds received bytes and returns the messages that are complete.
    pub fn read(&mut self, bytes: &[u8]) -> Vec<TraceMessage> {
        self.waiting.extend(bytes);
        if matches!(self.table.encoding(), Encoding::Raw) {
            self.read_raw()
        } else {
            self.read_frames()
        }
    }

    /// Reads messages of the raw encoding, which has no separators.
    fn read_raw(&mut self) -> Vec<TraceMessage> {
        let mut messages = Vec::new();
        let mut read = 0;
        while !self.is_lost {
            match self.table.decode(self.waiting.get(read..).unwrap_or_default()) {
                Ok((frame, length)) => {
                    read += length;
                    messages.push(TraceMessage::new(&frame));
                }
                Err(DecodeError::UnexpectedEof)
                    if self.waiting.len() - read <= MESSAGE_BYTES_MAX =>
                {
                    break;
                }
                Err(DecodeError::UnexpectedEof | DecodeError::Malformed) => {
                    self.is_lost = true;
                    messages.push(TraceMessage::UNDECODABLE);
                }
            }
        }
        if self.is_lost {
            self.waiting.clear();
        } else {
            self.waiting.drain(..read);
        }
        messages
    }

    /// Reads the complete frames; a zero byte ends each. A stream decoder borrows the table, so
    /// each call creates one, and it only receives whole frames.
    fn read_frames(&mut self) -> Vec<TraceMessage> {
        let Some(last) = self.waiting.iter().rposition(|byte| *byte == 0) else {
            if self.waiting.len() <= MESSAGE_BYTES_MAX {
                return Vec::new();
            }
            self.waiting.clear();
            let is_known = std::mem::replace(&mut self.is_lost, true);
            return if is_known { Vec::new() } else { vec![TraceMessage::UNDECODABLE] };
        };
        let rest = self.waiting.split_off(last + 1);
        let mut whole = std::mem::replace(&mut self.waiting, rest);
        if std::mem::take(&mut self.is_lost) {
            let end = whole.iter().position(|byte| *byte == 0).expect("a zero was found");
            whole.drain(..=end);
        }
        let mut decoder = self.table.new_stream_decoder();
        decoder.received(&whole);
        let mut messages = Vec::new();
        loop {
            match decoder.decode() {
                Ok(frame) => messages.push(TraceMessage::new(&frame)),
                Err(DecodeError::UnexpectedEof) => return messages,
                Err(DecodeError::Malformed) => messages.push(TraceMessage::UNDECODABLE),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::MessageContent;

    #[test]
    fn records_are_lists_of_bytes() {
        let record = |bytes: &[u8]| MessageContent::Record(bytes.to_vec());
        assert_eq!(MessageContent::from_text("bbz [6, 1, 0, 255]"), record(&[6, 1, 0, 255]));
        assert_eq!(
            MessageContent::from_text("bbz [6,1] (crazyflie src/trace.rs:31)"),
            record(&[6, 1])
        );
        assert_eq!(MessageContent::from_text("bbz []"), record(&[]));
    }

    #[test]
    fn damaged_records_are_no_text() {
        for text in ["bbz [1, 2", "bbz [1, 256]", "bbz [1, x]", "bbz [-1]"] {
            assert_eq!(
                MessageContent::from_text(text),
                MessageContent::DamagedRecord(text.to_owned())
            );
        }
        for text in ["", "bbz", "a bbz [1]", "boot"] {
            assert_eq!(MessageContent::from_text(text), MessageContent::Text(text.to_owned()));
        }
    }
}
