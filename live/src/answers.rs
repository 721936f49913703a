//! Answers to questions that are asked while the run is paused.
//!
//! A question is a command, which acts in the next tick. A copy of the run goes there, so that the
//! answer can be shown at once. The run itself gives the same answer when it goes on.

use bittybuzz_arena::robot::{Interest, LineKind, LogLine};
use bittybuzz_arena::run::{EventKind, ObservedEvent, Observer, Setup, Simulation};

use crate::events::line_event;
use crate::faults;
use crate::page_event::{FaultEvent, LogEvent};

/// Returns the answers that the next tick of a run gives, if a question waits. A run that cannot be copied
/// gives none.
pub fn of_next_tick(run: &Simulation) -> Vec<LogEvent> {
    let copy = run.has_waiting_questions().then(|| run.snapshot()).flatten();
    let Some(mut copy) = copy else { return Vec::new() };
    let mut answers = AnswerCollector { setup: run.setup(), faults: Vec::new(), lines: Vec::new() };
    match copy.tick_observed(&mut answers) {
        Ok(()) => answers.lines,
        // Only robots in emulators fail, and a run with these cannot be copied.
        Err(_) => Vec::new(),
    }
}

/// Collects the answers of a tick.
struct AnswerCollector<'a> {
    setup: &'a Setup,
    faults: Vec<FaultEvent>,
    lines: Vec<LogEvent>,
}

impl Observer for AnswerCollector<'_> {
    fn interest(&self) -> Interest {
        Interest { frames: false, calls: false }
    }

    fn see(&mut self, event: ObservedEvent<'_>) {
        let ObservedEvent { tick, robot, kind } = event;
        match kind {
            EventKind::Log(LogLine { kind: LineKind::Logged, .. }) => {}
            EventKind::Log(line) => {
                let last = self.faults.last();
                self.lines.push(line_event(self.setup, last, (tick, robot), line));
            }
            EventKind::Fault(found) => {
                self.faults.push(faults::describe(self.setup, None, robot, found));
            }
            _ => {}
        }
    }
}
