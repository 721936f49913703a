//! Logs, faults and messages of a run as tables.

use bittybuzz_arena::engine::LossCause;
use bittybuzz_arena::robot::{FaultRecord, Interest, LogLine};
use bittybuzz_arena::run::{EventKind, FrameOnAir, ObservedEvent, Observer, Simulation};
use bittybuzz_fault::{Backtrace, FaultReport, KnownProgram};

use crate::data::{Cell, RunData, count, integer, optional_integer, text};

/// An observer that keeps log lines, faults and messages.
pub struct Seen {
    logs: RunData,
    faults: RunData,
    /// `None` if messages are not kept.
    messages: Option<RunData>,
    /// Events of the last tick, whose texts the simulation knows.
    new_logs: Vec<(usize, LogLine)>,
    new_faults: Vec<(u64, usize, FaultRecord)>,
    new_messages: Vec<Message>,
}

/// A frame, or its fate at a receiver.
struct Message {
    tick: u64,
    sender: usize,
    receiver: Option<usize>,
    fate: &'static str,
    medium: &'static str,
    start_us: u64,
    bytes: usize,
    hex: String,
}

impl Seen {
    /// Returns tables without rows.
    pub fn new(has_messages: bool) -> Self {
        let first = || vec![integer("run"), integer("tick"), integer("robot")];
        let with = |others: Vec<_>| first().into_iter().chain(others).collect();
        let messages = vec![
            optional_integer("receiver"),
            text("fate"),
            text("medium"),
            text("start_us"),
            integer("bytes"),
            text("content"),
        ];
        let faults = vec![
            text("code"),
            text("message"),
            text("file"),
            optional_integer("line"),
            integer("count"),
        ];
        Seen {
            logs: RunData::new("logs", with(vec![text("text")])),
            faults: RunData::new("faults", with(faults)),
            messages: has_messages.then(|| RunData::new("messages", with(messages))),
            new_logs: Vec::new(),
            new_faults: Vec::new(),
            new_messages: Vec::new(),
        }
    }

    /// Returns the tables.
    pub fn tables(&mut self) -> impl Iterator<Item = &mut RunData> {
        [&mut self.logs, &mut self.faults].into_iter().chain(&mut self.messages)
    }

    /// Returns the number of rows that wait.
    pub fn rows(&self) -> usize {
        let messages = self.messages.as_ref().map_or(0, RunData::rows);
        self.logs.rows() + self.faults.rows() + messages
    }

    /// Turns the events of the last tick into rows.
    pub fn resolve(&mut self, run: u32, simulation: &Simulation) {
        let setup = simulation.setup();
        // Adversaries, which are numbered after the robots, have no id.
        let id = |robot: usize| match robot < simulation.robot_count() {
            true => count(setup.id(robot).into()),
            false => -1,
        };
        let first = |tick: u64, robot: usize| {
            [count(run.into()), count(tick), id(robot)].map(Cell::Integer)
        };
        for (robot, line) in self.new_logs.drain(..) {
            let program = setup.program(line.program);
            let symbols = program.and_then(|program| program.symbols.as_deref());
            let mut bytes = Vec::new();
            line.pieces.iter().for_each(|piece| piece.append_to(symbols, &mut bytes));
            let cell = Cell::OptionalText(Some(String::from_utf8_lossy(&bytes).into_owned()));
            self.logs.push(first(line.tick, robot).into_iter().chain([cell]));
        }
        for (tick, robot, record) in self.new_faults.drain(..) {
            let profile = setup.scenario.group(setup.group(robot)).robot.profile;
            let program = setup.program(record.program);
            let known = program.map_or(KnownProgram::UNKNOWN, |program| KnownProgram {
                image: &program.image,
                profile,
                symbols: program.symbols.as_deref(),
                sources: &*program.sources,
            });
            let backtrace = Backtrace::new(known, record.positions.clone(), record.entry);
            let report = FaultReport::new(&record.fault, backtrace, record.refusal.as_deref());
            let description = report.description();
            let place = description.places.into_iter().flatten().next();
            let line = place.as_ref().and_then(|place| i32::try_from(place.line).ok());
            let cells = [
                Cell::OptionalText(Some(description.code)),
                Cell::OptionalText(Some(description.message)),
                Cell::OptionalText(place.map(|place| place.file)),
                Cell::OptionalInteger(line),
                Cell::Integer(count(record.count.into())),
            ];
            self.faults.push(first(tick, robot).into_iter().chain(cells));
        }
        let Some(messages) = &mut self.messages else { return };
        for message in self.new_messages.drain(..) {
            let text = |text: &str| Cell::OptionalText(Some(text.to_owned()));
            let cells = [
                Cell::OptionalInteger(message.receiver.map(id)),
                text(message.fate),
                text(message.medium),
                text(&message.start_us.to_string()),
                Cell::Integer(count(message.bytes as u64)),
                text(&message.hex),
            ];
            messages.push(first(message.tick, message.sender).into_iter().chain(cells));
        }
    }

    fn add(
        &mut self,
        event: &ObservedEvent<'_>,
        receiver: Option<usize>,
        fate: &'static str,
        frame: &FrameOnAir<'_>,
    ) {
        self.new_messages.push(Message {
            tick: event.tick,
            sender: event.robot,
            receiver,
            fate,
            medium: frame.medium.word(),
            start_us: frame.start_us,
            bytes: frame.bytes.len(),
            hex: frame.bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
        });
    }
}

impl Observer for Seen {
    fn interest(&self) -> Interest {
        Interest { frames: self.messages.is_some(), calls: false }
    }

    fn see(&mut self, event: ObservedEvent<'_>) {
        match &event.kind {
            EventKind::Log(line) => self.new_logs.push((event.robot, (*line).clone())),
            EventKind::Fault(fault) => {
                self.new_faults.push((event.tick, event.robot, fault.fault.clone()));
            }
            EventKind::Sent(frame) => self.add(&event, None, "sent", frame),
            EventKind::Received { frame, receiver, .. } => {
                self.add(&event, Some(*receiver), "received", frame);
            }
            EventKind::Lost { frame, receiver, cause } => {
                self.add(&event, Some(*receiver), word(*cause), frame);
            }
            EventKind::Postponed { .. } | EventKind::Unsent { .. } | EventKind::Call(_) => {}
        }
    }
}

/// Returns the fate of a frame that was lost.
fn word(cause: LossCause) -> &'static str {
    match cause {
        LossCause::Sending => "lost: receiver was sending",
        LossCause::Collision => "lost: collision",
        LossCause::Chance => "lost: by chance",
        LossCause::CutOff => "lost: link was cut",
        LossCause::Off => "lost: receiver was off",
        LossCause::QueueFull => "lost: queue was full",
        LossCause::Unreadable => "lost: not readable",
    }
}
