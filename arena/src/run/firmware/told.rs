//! What firmware tells of its script: records among its messages, by defmt over RTT.

use bittybuzz_comms::trace::{Item, Record, Unused};
use bittybuzz_vm_core::{Fault, ImageError};
use defmt_decoder::{DecodeError, StreamDecoder, Table};

use super::super::robot::Piece;

/// What was told.
#[derive(Debug, Clone, PartialEq)]
pub enum Told {
    /// The script has logged a line.
    Log(Vec<Piece>),
    /// The script has stopped, with the positions of the calls that led there.
    Fault(Fault, Vec<u16>),
    /// It does not start.
    Refused(ImageError),
    /// Messages came to nothing: all of them since power-on.
    Unused(Unused),
}

/// Reads what a robot tells.
pub struct Reader<'t> {
    table: &'t Table,
    decoder: Box<dyn StreamDecoder + Send + Sync + 't>,
    /// Whether an error has made the rest unreadable.
    is_lost: bool,
}

impl<'t> Reader<'t> {
    /// Of firmware with these messages.
    pub fn new(table: &'t Table) -> Self {
        Reader { table, decoder: table.new_stream_decoder(), is_lost: false }
    }

    /// Of the same firmware after a power-on: what was not told whole never will be.
    pub fn anew(self) -> Self {
        Reader::new(self.table)
    }

    /// Reads what has come. Messages that were not told whole are left out, as on a debug probe.
    pub fn read(&mut self, bytes: &[u8]) -> Vec<Told> {
        self.decoder.received(bytes);
        let mut all = Vec::new();
        while !self.is_lost {
            match self.decoder.decode() {
                Ok(frame) => all.extend(told(&frame.display_message().to_string())),
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) => {
                    self.is_lost = !self.table.encoding().can_recover();
                }
            }
        }
        all
    }
}

/// The record in a message; `None` for what the firmware says of itself, and for what does not concern a run.
fn told(message: &str) -> Option<Told> {
    let list = message.strip_prefix("bbz [")?.strip_suffix(']')?;
    let bytes: Option<Vec<u8>> = list.split(", ").map(|number| number.parse().ok()).collect();
    match Record::decode(&bytes?).ok()? {
        Record::Log { items, .. } => {
            let pieces = items.map(|item| item.map_or(Piece::Text(CUT.into()), piece));
            Some(Told::Log(pieces.collect()))
        }
        Record::Fault { fault, calls, .. } => Some(Told::Fault(fault, calls.collect())),
        Record::Refused(cause) => Some(Told::Refused(cause)),
        Record::Unused(unused) => Some(Told::Unused(unused)),
        Record::Start { .. }
        | Record::Overrun { .. }
        | Record::Expired { .. }
        | Record::Lost(_) => None,
    }
}

/// Stands for what did not fit.
const CUT: &[u8] = b"...";

fn piece(item: Item<'_>) -> Piece {
    match item {
        Item::Nil => Piece::Nil,
        Item::Int(value) => Piece::Int(value),
        Item::Float(value) => Piece::Float(value),
        Item::String(number) => Piece::Constant(number),
        Item::Text(text) => Piece::Text(text.to_vec()),
        Item::Table(size) => Piece::Table(usize::from(size)),
        Item::Function => Piece::Function,
        Item::Rest => Piece::Text(CUT.into()),
    }
}
