//! Faults and log lines of a run, as events for clients.

use bittybuzz_arena::engine::LossCause;
use bittybuzz_arena::robot::{Interest, LogLine};
use bittybuzz_arena::run::{EventKind, ObservedEvent, Observer, Setup, Verdict};

use crate::backlog::{Backlog, Waiting};
use crate::faults;
use crate::page_event::{FaultEvent, LogEvent, PageEvent, VerdictName};
use crate::watch::{MessageFate, Watch};
use crate::workshop::Drafts;

/// Records the faults, log lines and watched messages of a tick.
pub struct EventCollector<'a> {
    /// The programs of the run.
    pub setup: &'a Setup,
    /// The scripts that the client can edit.
    pub drafts: Option<&'a Drafts>,
    /// The events that the client has not taken yet.
    pub events: &'a mut Backlog,
    /// The faults of the tick.
    pub faults: Vec<FaultEvent>,
    /// The subscription of the client, which collects messages.
    pub watch: &'a mut Watch,
}

impl Observer for EventCollector<'_> {
    fn interest(&self) -> Interest {
        Interest { frames: self.watch.has_messages(), calls: false }
    }

    fn see(&mut self, event: ObservedEvent<'_>) {
        let ObservedEvent { tick, robot, kind } = event;
        match kind {
            EventKind::Log(line) => {
                let text = text(self.setup, line);
                self.events.add(Waiting::Line(LogEvent { tick, robot, text }));
            }
            EventKind::Fault(found) => {
                let fault = faults::describe(self.setup, self.drafts, robot, found);
                self.faults.push(fault.clone());
                self.events.push(PageEvent::Fault(fault));
            }
            EventKind::Received { receiver, .. } => {
                self.watch.record(MessageFate::Received, robot, receiver)
            }
            EventKind::Lost { receiver, cause: LossCause::Collision, .. } => {
                self.watch.record(MessageFate::Collided, robot, receiver);
            }
            EventKind::Lost { receiver, .. } => {
                self.watch.record(MessageFate::Lost, robot, receiver)
            }
            _ => {}
        }
    }
}

/// Returns the name of a verdict.
pub fn verdict(verdict: Verdict) -> VerdictName {
    match verdict {
        Verdict::Open => VerdictName::Open,
        Verdict::Held => VerdictName::Held,
        Verdict::Failed => VerdictName::Failed,
    }
}

/// Returns the text of a line. Bytes that are not valid UTF-8 are replaced.
fn text(setup: &Setup, line: &LogLine) -> String {
    let symbols = setup.program(line.program).and_then(|program| program.symbols.as_deref());
    let mut bytes = Vec::new();
    line.pieces.iter().for_each(|piece| piece.append_to(symbols, &mut bytes));
    String::from_utf8_lossy(&bytes).into_owned()
}
