//! The trace of a script in firmware: records among the firmware's own messages, sent by defmt over
//! RTT.

use std::sync::Arc;

use bittybuzz_comms::trace::{PrintedValue, Record, Unused};
use bittybuzz_trace_reader::{MessageContent, Table, TraceReader};
use bittybuzz_vm_core::{Fault, ImageError};

use crate::robot::Piece;

/// An event of the trace.
#[derive(Debug, Clone, PartialEq)]
pub enum TraceEvent {
    /// The script has logged a line.
    Log(Vec<Piece>),
    /// The script has stopped, with the positions of the calls that led there.
    Fault(Fault, Vec<u16>),
    /// A fault ended a listener or a handler, with the positions of the calls that led there.
    Contained(Fault, Vec<u16>),
    /// The script starts again after this number of ticks; 0: it starts now.
    Restart(u16),
    /// The firmware rejects the script, which does not start.
    Refused(ImageError),
    /// The counters of messages that were not used, since power-on.
    Unused(Unused),
    /// A step took too long: the number of steps that were skipped since power-on.
    Overrun(u32),
}

/// Reads the trace of a robot.
pub struct TraceEventReader(TraceReader);

impl TraceEventReader {
    /// Returns a reader for firmware with these messages.
    pub fn new(table: Arc<Table>) -> Self {
        TraceEventReader(TraceReader::new(table))
    }

    /// Returns a reader of the same firmware after a power-on, when an incomplete message is lost.
    pub fn anew(mut self) -> Self {
        self.0.restart();
        self
    }

    /// Reads received bytes. Incomplete messages are skipped, as on a debug probe.
    pub fn read(&mut self, bytes: &[u8]) -> Vec<TraceEvent> {
        self.0.read(bytes).into_iter().filter_map(|message| event_of(message.content)).collect()
    }
}

/// Returns the event in a message; `None` for messages of the firmware about itself, and for
/// records that a run does not use.
fn event_of(content: MessageContent) -> Option<TraceEvent> {
    let MessageContent::Record(bytes) = content else { return None };
    match Record::decode(&bytes).ok()? {
        Record::Log { items, .. } => {
            let pieces = items.map(|item| item.map_or(Piece::Text(CUT.into()), piece));
            Some(TraceEvent::Log(pieces.collect()))
        }
        Record::Fault { fault, calls, .. } => Some(TraceEvent::Fault(fault, calls.collect())),
        Record::Contained { fault, calls, .. } => {
            Some(TraceEvent::Contained(fault, calls.collect()))
        }
        Record::Restart { pause, .. } => Some(TraceEvent::Restart(pause)),
        Record::Refused(cause) => Some(TraceEvent::Refused(cause)),
        Record::Unused(unused) => Some(TraceEvent::Unused(unused)),
        Record::Overrun { missed, .. } => Some(TraceEvent::Overrun(missed)),
        Record::Start { .. } | Record::Expired { .. } | Record::Lost(_) => None,
    }
}

/// Marks the end of a truncated text.
const CUT: &[u8] = b"...";

fn piece(item: PrintedValue<'_>) -> Piece {
    match item {
        PrintedValue::Nil => Piece::Nil,
        PrintedValue::Int(value) => Piece::Int(value),
        PrintedValue::Float(value) => Piece::Float(value),
        PrintedValue::String(number) => Piece::Constant(number),
        PrintedValue::Text(text) => Piece::Text(text.to_vec()),
        PrintedValue::Table(size) => Piece::Table(usize::from(size)),
        PrintedValue::Function => Piece::Function,
        PrintedValue::Rest => Piece::Text(CUT.into()),
    }
}
