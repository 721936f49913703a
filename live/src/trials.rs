//! Trials: runs next to the session, of the same scenario from its start, with other values or
//! seeds.

use std::sync::Arc;

use bittybuzz_arena::run::{Setup, Simulation};
use bittybuzz_arena::scenario::Quantity;

use crate::events::verdict;
use crate::hand_in::{HandIn, seconds};
use crate::page_event::{PageEvent, ResultEvent, TrialEvent, TrialsEvent};

/// The greatest number of trials. A page is for quick experiments; `bbz sim --runs` makes larger
/// tables.
pub const TRIALS_MAX: usize = 1000;

/// The trials with one value.
pub struct Variant {
    /// The value, as the client wrote it; `None` if no key is varied.
    pub value: Option<String>,
    /// The scenario and the programs of these trials.
    pub setup: Arc<Setup>,
}

/// The purpose of trials.
pub enum TrialPurpose {
    /// Each trial makes an event, with this quantity at its end.
    Sweep(Option<Quantity>),
    /// The result of the only trial is handed in.
    HandIn(Box<HandIn>),
}

/// Trials in progress.
pub struct Trials {
    purpose: TrialPurpose,
    variants: Vec<Variant>,
    /// The seeds of each variant.
    seeds: Vec<u32>,
    /// The number of trials that have ended.
    done: usize,
    run: Option<Simulation>,
    /// The percentage that was last sent to the client.
    shown: u64,
}

impl Trials {
    /// Returns trials that begin with the next call of [`advance`](Self::advance). There is at least
    /// one variant, and at least one seed.
    pub fn new(purpose: TrialPurpose, variants: Vec<Variant>, seeds: Vec<u32>) -> Self {
        Trials { purpose, variants, seeds, done: 0, run: None, shown: 0 }
    }

    fn count(&self) -> usize {
        self.variants.len() * self.seeds.len()
    }

    /// Simulates one tick, and further ticks as long as `has_time` returns true. Adds events.
    /// Returns false when all trials have ended, after which it must not be called.
    pub fn advance(
        &mut self,
        events: &mut Vec<PageEvent>,
        has_time: &mut dyn FnMut() -> bool,
    ) -> bool {
        loop {
            if let Err(reason) = self.tick(events) {
                events.push(PageEvent::refused(reason, None));
                self.done = self.count();
            }
            self.add_progress(events);
            if self.done >= self.count() {
                return false;
            }
            if !has_time() {
                return true;
            }
        }
    }

    fn tick(&mut self, events: &mut Vec<PageEvent>) -> Result<(), String> {
        let (number, count, seeds) = (self.done, self.count(), self.seeds.len());
        let variant = self.variants.get(number / seeds).expect("a trial has not ended");
        let seed = self.seeds[number % seeds];
        let run = match &mut self.run {
            Some(run) => run,
            none => {
                let run = Simulation::new(variant.setup.clone(), seed, 1);
                none.insert(run.map_err(|error| error.to_string())?)
            }
        };
        if !run.is_over() {
            run.tick().map_err(|error| error.to_string())?;
            run.take_log();
            return Ok(());
        }
        let result = match &self.purpose {
            TrialPurpose::Sweep(quantity) => {
                sweep(run, (number, count), variant, quantity.as_ref())
            }
            TrialPurpose::HandIn(hand_in) => {
                let mut hand_in = (**hand_in).clone();
                hand_in.complete(run);
                PageEvent::Result(ResultEvent {
                    name: hand_in.file_name().display().to_string(),
                    text: hand_in.text(),
                    held: hand_in.expectations.iter().filter(|one| one.held).count(),
                    count: hand_in.expectations.len(),
                    success: hand_in.success,
                })
            }
        };
        events.push(result);
        self.run = None;
        self.done += 1;
        Ok(())
    }

    fn add_progress(&mut self, events: &mut Vec<PageEvent>) {
        // Between two trials no run has a part. A run may end at its first tick.
        let part = self.run.as_ref().map_or(0, |run| 100 * run.now() / run.end().max(1));
        let percent = (100 * self.done as u64 + part) / self.count() as u64;
        if percent != self.shown {
            self.shown = percent;
            events.push(PageEvent::Trials(TrialsEvent { percent }));
        }
    }
}

/// Returns the event of a trial that has ended.
fn sweep(
    run: &mut Simulation,
    (number, count): (usize, usize),
    Variant { value, setup }: &Variant,
    quantity: Option<&Quantity>,
) -> PageEvent {
    let numbers = quantity.and_then(|quantity| {
        // A draft that was written after the request may lack the global.
        let probe = setup.probe(quantity).ok()?;
        Some(run.numbers(&probe))
    });
    let (seed, summary) = (run.seed(), run.summary());
    let convergences = &summary.convergences;
    PageEvent::Trial(TrialEvent {
        number,
        count,
        value: value.clone(),
        seed,
        success: summary.is_success(),
        verdicts: convergences.iter().map(|one| verdict(one.verdict)).collect(),
        since: convergences.iter().map(|one| one.since.map(seconds)).collect(),
        numbers,
    })
}
