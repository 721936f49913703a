//! Faults and log lines of a run, as JSON objects for clients.

use bittybuzz_arena::engine::LossCause;
use bittybuzz_arena::robot::{Consequence, FaultRecord, LogLine, ProgramId};
use bittybuzz_arena::run::{EventKind, ObservedEvent, Observer, Setup, Verdict};
use serde_json::{Value, json};

use crate::watch::{MessageFate, Watch};

/// Records the faults, log lines and watched messages of a tick.
pub struct Notes<'a> {
    /// The programs of the run.
    pub setup: &'a Setup,
    /// The events that the client has not taken yet.
    pub events: &'a mut Vec<Value>,
    /// The subscription of the client, which collects messages.
    pub watch: &'a mut Watch,
}

impl Observer for Notes<'_> {
    fn see(&mut self, event: ObservedEvent<'_>) {
        let ObservedEvent { tick, robot, kind } = event;
        match kind {
            EventKind::Log(line) => self.events.push(json!({
                "event": "log",
                "tick": tick,
                "robot": robot,
                "text": text(self.setup, line),
            })),
            EventKind::Fault(record) => self.events.push(fault(self.setup, robot, record)),
            EventKind::Received { receiver, .. } => {
                self.watch.note(MessageFate::Heard, robot, receiver)
            }
            EventKind::Lost { receiver, cause: LossCause::Collision, .. } => {
                self.watch.note(MessageFate::Collided, robot, receiver);
            }
            EventKind::Lost { receiver, .. } => self.watch.note(MessageFate::Lost, robot, receiver),
            _ => {}
        }
    }
}

/// Returns the word for a verdict.
pub fn verdict(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Open => "open",
        Verdict::Held => "held",
        Verdict::Failed => "failed",
    }
}

/// Returns the text of a line. Bytes that are not valid UTF-8 are replaced.
fn text(setup: &Setup, line: &LogLine) -> String {
    let symbols = setup.program(line.program).and_then(|program| program.symbols.as_ref());
    let mut bytes = Vec::new();
    line.pieces.iter().for_each(|piece| piece.append_to(symbols, &mut bytes));
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Describes a fault of a robot.
pub fn fault(setup: &Setup, robot: usize, record: &FaultRecord) -> Value {
    let consequence = match record.consequence {
        Consequence::Contained => "contained",
        Consequence::Pause(_) => "pause",
        Consequence::Stop => "stop",
    };
    json!({
        "event": "fault",
        "tick": record.tick,
        "robot": robot,
        "code": format!("R{:04}", record.fault.code as u8),
        "consequence": consequence,
        "places": record.positions.iter().map(|at| place(setup, record.program, *at)).collect::<Vec<_>>(),
    })
}

/// Returns the source of a position in the code; `null` without symbols.
fn place(setup: &Setup, program: ProgramId, position: u16) -> Value {
    let symbols = setup.program(program).and_then(|program| program.symbols.as_ref());
    let Some(symbols) = symbols else { return Value::Null };
    let function = symbols.function(position.into()).map(|function| &function.name);
    let Some(place) = symbols.position(position.into()) else { return Value::Null };
    json!({
        "file": symbols.file(place.file),
        "line": place.line,
        "column": place.column,
        "function": function,
    })
}
