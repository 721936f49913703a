//! The log lines and faults of a run up to the latest tick that was simulated.
//!
//! A client shows those before the tick at which the run is. It forgets the later ones when the run goes
//! back, so it gets them again on any way forward, also on one that leads over a copy of the run.

use std::collections::VecDeque;

use crate::backlog::{Backlog, Report};
use crate::page_event::{LogsEvent, PageEvent};

/// The greatest number of lines and faults that are kept: about 5 MB.
const KEPT_MAX: usize = 20_000;

/// The greatest number of lines and faults that a client shows (bbz/page/web/log.js).
const SHOWN_MAX: usize = 500;

/// The lines and faults of a run, and the part of them that the client has.
#[derive(Debug, Default)]
pub struct Reports {
    /// Lines and faults in the order of their ticks, at most [`KEPT_MAX`].
    kept: VecDeque<Report>,
    /// The number of older ones that were dropped.
    lost: u64,
    /// The tick before which all are known. Later ticks have to be observed.
    known: u64,
    /// The tick before which the client has all that it shows.
    sent: u64,
}

impl Reports {
    /// Returns true if a tick was observed.
    pub fn knows(&self, tick: u64) -> bool {
        tick < self.known
    }

    /// Adds one of a tick that was not observed before.
    pub fn add(&mut self, report: Report) {
        if self.kept.len() == KEPT_MAX {
            self.kept.pop_front();
            self.lost += 1;
        }
        self.kept.push_back(report);
    }

    /// Takes note that a tick was observed.
    pub fn has_observed(&mut self, tick: u64) {
        self.known = self.known.max(tick + 1);
    }

    /// Takes note that the client gets those of a tick.
    pub fn has_sent(&mut self, tick: u64) {
        self.sent = tick + 1;
    }

    /// Takes note that the client has none before a tick.
    pub fn forget_sent(&mut self, tick: u64) {
        self.sent = self.sent.min(tick);
    }

    /// Drops those from a tick on: the run goes another way from there.
    pub fn cut(&mut self, tick: u64) {
        let end = self.kept.partition_point(|one| one.tick() < tick);
        self.kept.truncate(end);
        self.known = self.known.min(tick);
        self.forget_sent(tick);
    }

    /// Sends those before the tick at which the run is to a client that does not have them.
    pub fn send(&mut self, now: u64, events: &mut Backlog) {
        let from = self.sent;
        self.sent = now;
        if now > from {
            self.send_between(from, now, events);
        } else if now < from && self.kept.len() as u64 + self.lost > SHOWN_MAX as u64 {
            // The client has dropped lines to show later ones.
            events.push(PageEvent::LogCleared);
            self.send_between(0, now, events);
        }
    }

    fn send_between(&self, from: u64, to: u64, events: &mut Backlog) {
        let place = |tick| self.kept.partition_point(|one: &Report| one.tick() < tick);
        let (start, end) = (place(from), place(to));
        let first = start.max(end.saturating_sub(SHOWN_MAX));
        // Those that were dropped may be of this time, too.
        let lost = (first - start) as u64 + if start == 0 { self.lost } else { 0 };
        if lost > 0 {
            events.push(PageEvent::Logs(LogsEvent { lost, lines: Vec::new() }));
        }
        self.kept.range(first..end).for_each(|one| events.report(one.clone()));
    }
}
