//! Faults and log lines of a run, as events for clients.

use bittybuzz_arena::engine::LossCause;
use bittybuzz_arena::robot::{Interest, LineKind, LogLine};
use bittybuzz_arena::run::{EventKind, ObservedEvent, Observer, Setup, Verdict};

use crate::backlog::{Backlog, Report};
use crate::faults;
use crate::page_event::{AnswerKind, FaultEvent, LogEvent, VerdictName};
use crate::reports::Reports;
use crate::watch::{MessageFate, Watch};
use crate::workshop::Drafts;

/// Records the faults, log lines and watched messages of a tick.
pub struct EventCollector<'a> {
    /// The programs of the run.
    pub setup: &'a Setup,
    /// The scripts that the client can edit.
    pub drafts: Option<&'a Drafts>,
    /// The events that the client has not taken yet; `None` if it does not see the tick.
    pub events: Option<&'a mut Backlog>,
    /// The log lines and faults of the run; `None` if those of the tick are among them.
    pub reports: Option<&'a mut Reports>,
    /// The faults of the tick.
    pub faults: Vec<FaultEvent>,
    /// The subscription of the client, which collects messages.
    pub watch: &'a mut Watch,
}

impl EventCollector<'_> {
    /// Adds a line or a fault. One tick may have any number: each list has a limit of its own.
    fn add(&mut self, report: Report) {
        if let Some(reports) = &mut self.reports {
            reports.add(report.clone());
        }
        if let Some(events) = &mut self.events {
            events.report(report);
        }
    }
}

impl Observer for EventCollector<'_> {
    fn interest(&self) -> Interest {
        Interest { frames: self.watch.has_messages(), calls: false }
    }

    fn see(&mut self, event: ObservedEvent<'_>) {
        let ObservedEvent { tick, robot, kind } = event;
        match kind {
            EventKind::Log(line) => {
                let line = line_event(self.setup, self.faults.last(), (tick, robot), line);
                self.add(Report::Line(line));
            }
            EventKind::Fault(found) => {
                let fault = faults::describe(self.setup, self.drafts, robot, found);
                self.faults.push(fault.clone());
                self.add(Report::Fault(fault));
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

/// Describes a line that a robot logged at a tick. If an error ended a question, it is the last fault.
pub fn line_event(
    setup: &Setup,
    last: Option<&FaultEvent>,
    (tick, robot): (u64, usize),
    line: &LogLine,
) -> LogEvent {
    let (mut text, mut answer) = (text(setup, line), None);
    match line.kind {
        LineKind::Logged => {}
        LineKind::Answer => answer = Some(AnswerKind::Value),
        LineKind::NoAnswer => answer = Some(AnswerKind::Missing),
        LineKind::Fault => {
            answer = Some(AnswerKind::Missing);
            let last = last.filter(|last| (last.tick, last.robot) == (tick, robot));
            if let Some(last) = last {
                text += &format!(": {}", last.description.message);
            }
        }
    }
    LogEvent { tick, robot, text, answer }
}

/// Returns the text of a line. Bytes that are not valid UTF-8 are replaced.
fn text(setup: &Setup, line: &LogLine) -> String {
    let symbols = setup.program(line.program).and_then(|program| program.symbols.as_deref());
    let mut bytes = Vec::new();
    line.pieces.iter().for_each(|piece| piece.append_to(symbols, &mut bytes));
    String::from_utf8_lossy(&bytes).into_owned()
}
