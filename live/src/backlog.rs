//! The events that a client has not taken yet.
//!
//! Their number has a limit, although robots may log and fail without end and a client may not read:
//! of log lines and faults the newest remain, and the others are counted. States and the progress
//! of trials replace the ones before. All other events answer requests, and the caller takes no
//! request of a client that does not read the answers.

use std::collections::VecDeque;

use crate::page_event::{FaultEvent, LogEvent, LogsEvent, PageEvent};

/// The greatest number of log lines and faults that wait.
const REPORTS_MAX: usize = 500;

/// A line that a robot logged, or its fault. There may be any number.
#[derive(Debug, Clone)]
pub enum Report {
    Line(LogEvent),
    Fault(FaultEvent),
}

impl Report {
    /// Returns the tick of the line or fault.
    pub fn tick(&self) -> u64 {
        match self {
            Report::Line(line) => line.tick,
            Report::Fault(fault) => fault.tick,
        }
    }
}

/// Something that waits for the client.
#[derive(Debug)]
enum Waiting {
    Report(Report),
    Event(PageEvent),
}

impl Waiting {
    fn is_report(&self) -> bool {
        matches!(self, Waiting::Report(_))
    }

    /// Returns true if the client needs only the later one of two successive events.
    fn replaces(&self, before: &Waiting) -> bool {
        use PageEvent::{State, Trials};
        match (before, self) {
            // A client forgets the lines that come after the tick of a step back.
            (Waiting::Event(State(before)), Waiting::Event(State(now))) => before.tick <= now.tick,
            (Waiting::Event(Trials(_)), Waiting::Event(Trials(_))) => true,
            _ => false,
        }
    }
}

/// The events that a client has not taken yet, in their order.
#[derive(Debug, Default)]
pub struct Backlog {
    waiting: VecDeque<Waiting>,
    /// The number of log lines and faults among them.
    reports: usize,
    /// The number of older log lines and faults that were dropped.
    lost: u64,
}

impl Backlog {
    /// Adds an event.
    pub fn push(&mut self, event: PageEvent) {
        self.add(Waiting::Event(event));
    }

    /// Adds events.
    pub fn extend(&mut self, events: impl IntoIterator<Item = PageEvent>) {
        events.into_iter().for_each(|event| self.push(event));
    }

    /// Adds a log line or a fault.
    pub fn report(&mut self, report: Report) {
        self.add(Waiting::Report(report));
    }

    fn add(&mut self, next: Waiting) {
        if next.is_report() {
            self.reports += 1;
            if self.reports > REPORTS_MAX {
                let oldest = self.waiting.iter().position(Waiting::is_report);
                // Few events come before the oldest report, so this moves few.
                self.waiting.remove(oldest.expect("all but one of the reports wait"));
                self.reports -= 1;
                self.lost += 1;
            }
        }
        match self.waiting.back_mut() {
            Some(last) if next.replaces(last) => *last = next,
            _ => self.waiting.push_back(next),
        }
    }

    /// Removes and returns the events. Successive lines become one event.
    pub fn take(&mut self) -> Vec<PageEvent> {
        let Backlog { waiting, lost, .. } = std::mem::take(self);
        let mut events = Vec::new();
        if lost > 0 {
            events.push(PageEvent::Logs(LogsEvent { lost, lines: Vec::new() }));
        }
        for next in waiting {
            match (next, events.last_mut()) {
                (Waiting::Report(Report::Line(line)), Some(PageEvent::Logs(logs))) => {
                    logs.lines.push(line);
                }
                (Waiting::Report(Report::Line(line)), _) => {
                    events.push(PageEvent::Logs(LogsEvent { lost: 0, lines: vec![line] }));
                }
                (Waiting::Report(Report::Fault(fault)), _) => events.push(PageEvent::Fault(fault)),
                (Waiting::Event(event), _) => events.push(event),
            }
        }
        events
    }

    /// Adds everything that waits elsewhere.
    pub fn append(&mut self, other: Backlog) {
        self.lost += other.lost;
        other.waiting.into_iter().for_each(|next| self.add(next));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page_event::StateEvent;

    fn line(tick: u64) -> Report {
        Report::Line(LogEvent { tick, robot: 1, text: "x".to_owned(), answer: None })
    }

    fn state(tick: u64) -> PageEvent {
        PageEvent::State(StateEvent { tick, plays: true, rate: None, over: false })
    }

    #[test]
    fn the_newest_lines_remain_and_the_others_are_counted() {
        let mut backlog = Backlog::default();
        backlog.push(PageEvent::Began);
        (0..1_700).for_each(|tick| backlog.report(line(tick)));
        backlog.push(PageEvent::Began);
        (1_700..2_000).for_each(|tick| backlog.report(line(tick)));
        let events = backlog.take();
        let [lost, began, lines, again, last] = &events[..] else { panic!("{events:?}") };
        let logs = |event: &PageEvent| match event {
            PageEvent::Logs(LogsEvent { lost, lines }) => {
                (*lost, lines.iter().map(|line| line.tick).collect::<Vec<u64>>())
            }
            _ => panic!("{event:?}"),
        };
        assert_eq!((began, again), (&PageEvent::Began, &PageEvent::Began));
        assert_eq!(logs(lost), (1_500, Vec::new()));
        assert_eq!(logs(lines), (0, (1_500..1_700).collect()));
        assert_eq!(logs(last), (0, (1_700..2_000).collect()));
        assert_eq!(backlog.take(), []);
    }

    #[test]
    fn a_state_replaces_the_one_before_but_not_one_of_a_later_tick() {
        let mut backlog = Backlog::default();
        backlog.extend([9, 3, 4, 4, 8].map(state));
        assert_eq!(backlog.take(), [state(9), state(8)]);
    }
}
