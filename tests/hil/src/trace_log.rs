//! The messages that a robot writes with defmt.

use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use bittybuzz_comms::trace::{PrintedValue, Record, Unused};
use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_trace_reader::{MessageContent, Table, TraceReader};

use crate::table::zooids;
use crate::{EmulatorEvent, TimedEvent, crazyflie};

/// The messages of a robot since the test began.
pub struct TraceLog {
    /// The lines that its script logged: the time and the values of each.
    pub log: Vec<(Duration, Vec<String>)>,
    /// Messages of its firmware.
    pub firmware: Vec<String>,
    /// The counts of discarded messages since power-on.
    pub unused: Unused,
    /// Messages that found no room in the robot's buffer.
    pub lost: u64,
    /// Records other than start, log and these, as they were decoded.
    pub records: Vec<String>,
    reader: TraceReader,
    /// The symbols of the script; without them its strings stay numbers.
    symbols: Option<Symbols>,
}

impl TraceLog {
    /// Returns the empty log of a Crazyflie.
    pub(crate) fn of_crazyflie() -> Self {
        static TABLE: OnceLock<Arc<Table>> = OnceLock::new();
        Self::new(TABLE.get_or_init(|| messages(&crazyflie())).clone())
    }

    /// Returns the log of a Crazyflie with these events.
    pub fn of_events(events: &[TimedEvent]) -> Self {
        TraceLog::of_crazyflie().with(events)
    }

    /// Returns the log of a Crazyflie that runs the script with these symbols.
    pub fn of_script(events: &[TimedEvent], symbols: &Symbols) -> Self {
        TraceLog { symbols: Some(symbols.clone()), ..TraceLog::of_crazyflie() }.with(events)
    }

    fn with(mut self, events: &[TimedEvent]) -> Self {
        for event in events {
            match &event.event {
                EmulatorEvent::Rtt { bytes } => self.read(bytes),
                // A record that was under way never comes.
                EmulatorEvent::Reset { .. } => self.restart(),
                _ => {}
            }
        }
        self
    }

    /// Returns the empty log of a Zooid.
    pub(crate) fn of_zooid() -> Self {
        static TABLE: OnceLock<Arc<Table>> = OnceLock::new();
        Self::new(TABLE.get_or_init(|| messages(&zooids())).clone())
    }

    fn new(table: Arc<Table>) -> Self {
        let (log, firmware, records, unused) = (vec![], vec![], vec![], Unused::default());
        let reader = TraceReader::new(table);
        TraceLog { log, firmware, records, unused, lost: 0, reader, symbols: None }
    }

    /// Discards an incomplete message and the counts, since the power was off.
    pub(crate) fn restart(&mut self) {
        self.reader.restart();
        self.unused = Unused::default();
    }

    /// Reads what came by RTT.
    pub(crate) fn read(&mut self, bytes: &[u8]) {
        for message in self.reader.read(bytes) {
            let at = Duration::from_secs_f64(message.seconds.unwrap_or(0.0));
            match message.content {
                MessageContent::Record(bytes) => self.note(at, &bytes),
                MessageContent::Text(text) => self.firmware.push(text),
                damaged => panic!("the firmware's messages are damaged: {damaged:?}"),
            }
        }
    }

    fn note(&mut self, at: Duration, record: &[u8]) {
        match Record::decode(record).expect("a record") {
            Record::Start { .. } => {}
            Record::Log { items, .. } => {
                let items = items.map(|item| self.text_of(item.expect("an item")));
                let items = items.collect();
                self.log.push((at, items));
            }
            Record::Unused(unused) => self.unused = unused,
            Record::Lost(lost) => self.lost += u64::from(lost),
            Record::Fault { step, fault, .. } => {
                self.records.push(format!("fault in {step}: {fault:?}"))
            }
            Record::Contained { step, fault, .. } => {
                self.records.push(format!("contained fault in {step}: {fault:?}"))
            }
            record => self.records.push(format!("{record:?}")),
        }
    }

    fn text_of(&self, item: PrintedValue<'_>) -> String {
        match item {
            PrintedValue::Nil => "nil".to_owned(),
            PrintedValue::Int(value) => value.to_string(),
            PrintedValue::Float(value) => value.to_string(),
            PrintedValue::String(number) => {
                let text = self.symbols.as_ref().and_then(|symbols| symbols.string(number));
                text.map_or_else(|| format!("{item:?}"), str::to_owned)
            }
            other => format!("{other:?}"),
        }
    }
}

/// The messages of an image.
fn messages(path: &Path) -> Arc<Table> {
    let elf = std::fs::read(path).expect("the image is there");
    Arc::new(Table::parse(&elf).expect("it can be read").expect("it has defmt messages"))
}
