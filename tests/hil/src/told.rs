//! What a robot tells by defmt.

use std::path::Path;
use std::sync::OnceLock;
use std::time::Duration;

use bittybuzz_comms::trace::{Item, Record, Unused};
use defmt_decoder::{DecodeError, StreamDecoder, Table};

use crate::crazyflie;
use crate::table::zooids;

/// What a robot told.
pub struct Told {
    /// What its script logged: when, and the values.
    pub log: Vec<(Duration, Vec<String>)>,
    /// Messages of its firmware.
    pub firmware: Vec<String>,
    /// Messages that came to nothing, all of them since power-on.
    pub unused: Unused,
    /// Records other than start, log and these, as they were decoded.
    pub records: Vec<String>,
    table: &'static Table,
    decoder: Box<dyn StreamDecoder + Send + Sync>,
}

impl Told {
    /// Nothing yet, of a Crazyflie.
    pub(crate) fn of_crazyflie() -> Self {
        static TABLE: OnceLock<Table> = OnceLock::new();
        Self::new(TABLE.get_or_init(|| messages(&crazyflie())))
    }

    /// Nothing yet, of a Zooid.
    pub(crate) fn of_zooid() -> Self {
        static TABLE: OnceLock<Table> = OnceLock::new();
        Self::new(TABLE.get_or_init(|| messages(&zooids())))
    }

    fn new(table: &'static Table) -> Self {
        let (log, firmware, records, unused) = (vec![], vec![], vec![], Unused::default());
        Told { log, firmware, records, unused, table, decoder: table.new_stream_decoder() }
    }

    /// The power was gone: what was not told whole never will be.
    pub(crate) fn begin_anew(&mut self) {
        self.decoder = self.table.new_stream_decoder();
        self.unused = Unused::default();
    }

    /// Reads what came by RTT.
    pub(crate) fn read(&mut self, bytes: &[u8]) {
        self.decoder.received(bytes);
        loop {
            let (time, text) = match self.decoder.decode() {
                Ok(frame) => {
                    let time = frame.display_timestamp().map(|time| time.to_string());
                    (time, frame.display_message().to_string())
                }
                Err(DecodeError::UnexpectedEof) => return,
                Err(DecodeError::Malformed) => panic!("the firmware's messages are damaged"),
            };
            let seconds = time.and_then(|time| time.trim().parse().ok());
            self.note(Duration::from_secs_f64(seconds.unwrap_or(0.0)), &text);
        }
    }

    fn note(&mut self, at: Duration, text: &str) {
        let Some(list) = text.strip_prefix("bbz [").and_then(|list| list.strip_suffix(']')) else {
            return self.firmware.push(text.to_owned());
        };
        let bytes: Vec<u8> =
            list.split(", ").map(|number| number.parse().expect("a list of bytes")).collect();
        match Record::decode(&bytes).expect("a record") {
            Record::Start { .. } => {}
            Record::Log { items, .. } => {
                let items = items.map(|item| text_of(item.expect("an item")));
                self.log.push((at, items.collect()));
            }
            Record::Unused(unused) => self.unused = unused,
            Record::Fault { step, fault, .. } => {
                self.records.push(format!("fault in {step}: {fault:?}"))
            }
            record => self.records.push(format!("{record:?}")),
        }
    }
}

/// The messages of an image.
fn messages(path: &Path) -> Table {
    let elf = std::fs::read(path).expect("the image is there");
    Table::parse(&elf).expect("it can be read").expect("it has defmt messages")
}

fn text_of(item: Item<'_>) -> String {
    match item {
        Item::Nil => "nil".to_owned(),
        Item::Int(value) => value.to_string(),
        Item::Float(value) => value.to_string(),
        other => format!("{other:?}"),
    }
}
