//! Changes since the client was last informed, as events: state, verdicts, commands and answers.

use bittybuzz_arena::run::Verdict;

use super::Live;
use crate::answers;
use crate::conditions;
use crate::events;
use crate::pace::Pace;
use crate::page_event::{
    AnswersEvent, ExpectationEvent, MeasuresEvent, PageEvent, SeriesCutEvent, StateEvent,
};

impl Live {
    /// Adds the lines and faults that the client does not have, and the state of the run.
    pub(super) fn add_state(&mut self) {
        let run = self.session.run();
        self.reports.send(run.now(), &mut self.events);
        let rate = match self.pace {
            Pace::Rate { rate, .. } => Some(rate),
            _ => None,
        };
        self.events.push(PageEvent::State(StateEvent {
            tick: run.now(),
            plays: self.pace != Pace::Paused,
            rate,
            over: run.is_over(),
        }));
    }

    /// Adds an event for each expectation whose verdict has changed, and one if measures have.
    pub(super) fn add_verdicts(&mut self) {
        let convergences = self.session.run().convergences();
        let verdicts: Vec<Verdict> = convergences.iter().map(|one| one.verdict).collect();
        for (number, one) in convergences.iter().enumerate() {
            // The client takes expectations as open until it receives a verdict.
            if *self.verdicts.get(number).unwrap_or(&Verdict::Open) == one.verdict {
                continue;
            }
            let (verdict, tick) = (events::verdict(one.verdict), one.held_at.or(one.failed_at));
            let event = ExpectationEvent { number, verdict, tick };
            self.events.push(PageEvent::Expectation(event));
        }
        self.verdicts = verdicts;
        // JSON has no other numbers. They would also differ from themselves, and be sent each time.
        let finite = |value: Option<f64>| value.filter(|value| value.is_finite());
        let values = self.session.run().measures().into_iter().map(finite).collect();
        let measures = MeasuresEvent { values };
        if self.measures != measures {
            self.events.push(PageEvent::Measures(measures.clone()));
            self.measures = measures;
        }
    }

    /// Adds an event if lamps or commands have changed.
    pub(super) fn add_conditions(&mut self) {
        self.add_conditions_of(false);
    }

    /// Adds an event if lamps or commands have changed; `is_moved` if by undo or redo.
    pub(super) fn add_conditions_of(&mut self, is_moved: bool) {
        let commands = conditions::commands(self.session.run());
        if let Some(tick) = conditions::parting(&self.conditions.commands, &commands) {
            self.leave_statement(true);
            self.series.cut(tick);
            self.reports.cut(tick);
            self.events.push(PageEvent::SeriesCut(SeriesCutEvent { tick }));
            if !is_moved {
                self.changes.record(&self.conditions.commands);
            }
        }
        let conditions = conditions::describe(self.session.run(), &self.changes);
        if self.conditions != conditions {
            self.events.push(PageEvent::Conditions(conditions.clone()));
            self.conditions = conditions;
            self.answered_at = None;
        }
        self.add_answers();
    }

    /// Adds an event if there are other answers to questions that wait than at the last time.
    pub(super) fn add_answers(&mut self) {
        let run = self.session.run();
        let is_waiting = self.pace == Pace::Paused && run.has_waiting_questions();
        let tick = is_waiting.then(|| run.now());
        if tick == self.answered_at && (is_waiting || self.answers.is_empty()) {
            return;
        }
        let lines = if is_waiting { answers::of_next_tick(run) } else { Vec::new() };
        self.answered_at = tick;
        if lines != self.answers {
            self.events.push(PageEvent::Answers(AnswersEvent { lines: lines.clone() }));
            self.answers = lines;
        }
    }
}
