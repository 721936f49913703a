//! Trials: runs next to the session, of the same scenario from its start, with other values or
//! seeds.

use std::sync::Arc;

use bittybuzz_arena::run::{Setup, Simulation};
use bittybuzz_arena::scenario::Quantity;

use crate::backlog::Backlog;
use crate::events::verdict;
use crate::grading::{Graded, Prepared, Results, marks_csv};
use crate::hand_in::{HandIn, seconds};
use crate::page_event::{MarksEvent, PageEvent, ResultEvent, TrialEvent, TrialsEvent};

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
    /// Hand-ins run again. The last trial makes an event with the marks of all of them.
    Grade(Grading),
}

/// Hand-ins that are graded.
pub struct Grading {
    /// The files by name. Those that compile have a variant each, in the same order.
    pub files: Vec<(String, Result<Prepared, String>)>,
    /// The results of the trials that have ended.
    pub results: Vec<Result<Graded, String>>,
}

impl Grading {
    /// Returns a variant for each file that compiles.
    pub fn variants(&self) -> Vec<Variant> {
        let prepared = self.files.iter().filter_map(|(_, prepared)| prepared.as_ref().ok());
        prepared.map(|one| Variant { value: None, setup: one.setup().clone() }).collect()
    }

    /// Returns the hand-in of the trial that runs.
    fn current(&self) -> &Prepared {
        let mut prepared = self.files.iter().filter_map(|(_, prepared)| prepared.as_ref().ok());
        prepared.nth(self.results.len()).expect("each variant is a hand-in that compiles")
    }

    /// Returns the marks of all files, once the trials of those that compile have ended.
    pub fn marks(&mut self) -> PageEvent {
        let mut results = Results::default();
        let mut ran = self.results.drain(..);
        for (file, prepared) in &self.files {
            let result = match prepared {
                Err(reason) => Err(reason.clone()),
                Ok(_) => ran.next().expect("its trial has ended"),
            };
            results.add(file.clone(), result);
        }
        let marks = results.marks();
        let csv = marks_csv(&marks);
        PageEvent::Marks(MarksEvent { marks, csv })
    }
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
    pub fn advance(&mut self, events: &mut Backlog, has_time: &mut dyn FnMut() -> bool) -> bool {
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

    fn tick(&mut self, events: &mut Backlog) -> Result<(), String> {
        let (number, count, seeds) = (self.done, self.count(), self.seeds.len());
        let variant = self.variants.get(number / seeds).expect("a trial has not ended");
        let seed = self.seeds[number % seeds];
        let is_over = match advance(&mut self.run, variant, seed) {
            Ok(is_over) => is_over,
            Err(reason) => {
                // A hand-in whose run cannot go on does not keep the others from being graded.
                let TrialPurpose::Grade(grading) = &mut self.purpose else { return Err(reason) };
                grading.results.push(Err(reason));
                self.end_trial(events);
                return Ok(());
            }
        };
        let Some(run) = self.run.as_mut().filter(|_| is_over) else { return Ok(()) };
        let result = match &mut self.purpose {
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
            TrialPurpose::Grade(grading) => {
                let graded = grading.current().result(run);
                grading.results.push(Ok(graded));
                self.end_trial(events);
                return Ok(());
            }
        };
        events.push(result);
        self.end_trial(events);
        Ok(())
    }

    /// Goes on to the next trial. After the last one, the marks of hand-ins are known.
    fn end_trial(&mut self, events: &mut Backlog) {
        self.run = None;
        self.done += 1;
        let is_last = self.done == self.count();
        if let (TrialPurpose::Grade(grading), true) = (&mut self.purpose, is_last) {
            events.push(grading.marks());
        }
    }

    fn add_progress(&mut self, events: &mut Backlog) {
        // Between two trials no run has a part. A run may end at its first tick.
        let part = self.run.as_ref().map_or(0, |run| 100 * run.now() / run.end().max(1));
        let percent = (100 * self.done as u64 + part) / self.count() as u64;
        if percent != self.shown {
            self.shown = percent;
            events.push(PageEvent::Trials(TrialsEvent { percent }));
        }
    }
}

/// Simulates a tick of a trial, which begins if there is no run. Returns true if it was over before.
fn advance(run: &mut Option<Simulation>, variant: &Variant, seed: u32) -> Result<bool, String> {
    let run = match run {
        Some(run) => run,
        none => {
            let run = Simulation::new(variant.setup.clone(), seed, 1);
            none.insert(run.map_err(|error| error.to_string())?)
        }
    };
    if run.is_over() {
        return Ok(true);
    }
    run.tick().map_err(|error| error.to_string())?;
    run.take_log();
    Ok(false)
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
