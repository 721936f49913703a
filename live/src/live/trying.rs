//! Trials next to the session: of a sweep, of what is handed in, and of hand-ins that are graded.

use std::sync::Arc;

use bittybuzz_arena::scenario::Quantity;

use super::{Live, NO_TRIALS};
use crate::edit;
use crate::grading::Assignment;
use crate::hand_in::{HandIn, TextFile};
use crate::page_event::{PageEvent, TrialsEvent};
use crate::request::Texts;
use crate::trials::{self, Grading, TrialPurpose, Trials, Variant};

impl Live {
    /// Returns trials of the scenario with several values of a key.
    pub(super) fn sweep(
        &self,
        key: Option<String>,
        values: Vec<String>,
        seeds: u32,
        quantity: Option<Quantity>,
    ) -> Result<Trials, String> {
        let drafts = self.drafts.as_ref().ok_or(NO_TRIALS)?;
        let values: Vec<Option<String>> = match key {
            None => vec![None],
            Some(_) => values.into_iter().map(Some).collect(),
        };
        let count = values.len().saturating_mul(seeds as usize);
        if count == 0 {
            return Err("at least one value and one seed are needed".to_owned());
        }
        if count > trials::TRIALS_MAX {
            let max = trials::TRIALS_MAX;
            return Err(format!(
                "{count} trials are more than {max}: `bbz sim --runs` has no such limit"
            ));
        }
        let variants = values.into_iter().map(|value| {
            let setting = key.as_deref().zip(value.as_deref());
            let setup = edit::trial(drafts, &self.scenario, setting, &drafts.last())?;
            Ok(Variant { value, setup: Arc::new(setup) })
        });
        let variants = variants.collect::<Result<Vec<Variant>, String>>()?;
        let first = self.session.run().seed();
        let seeds = (0..seeds).map(|number| first.wrapping_add(number)).collect();
        Ok(Trials::new(TrialPurpose::Sweep(quantity), variants, seeds))
    }

    /// Returns the trial whose result is handed in. `shown` are the texts that the client shows.
    pub(super) fn hand_in(&self, by: String, shown: &Texts) -> Result<Trials, String> {
        let drafts = self.drafts.as_ref().ok_or(NO_TRIALS)?;
        let scripts = edit::handed_in(drafts, self.session.run(), &self.scenario, shown)?;
        let setup = edit::trial(drafts, &self.scenario, None, &scripts)?;
        let scenario = &setup.scenario;
        let title = scenario.assignment.as_ref().map(|assignment| assignment.task.title.clone());
        let title = title.ok_or("the scenario has no [assignment]")?;
        let name = edit::name_of_scenario(drafts, &setup);
        let text = TextFile::new(name, self.scenario.clone());
        let hand_in = HandIn::new(by, title, text, edit::files(&setup, scripts));
        let (seed, setup) = (scenario.world.seed, Arc::new(setup));
        let variant = Variant { value: None, setup };
        Ok(Trials::new(TrialPurpose::HandIn(Box::new(hand_in)), vec![variant], vec![seed]))
    }

    /// Starts the trials of hand-ins, of which the scenario decides with which the session was opened.
    pub(super) fn grade(&mut self, files: Texts) {
        let mut grading = match self.grading(files) {
            Ok(grading) => grading,
            Err(reason) => return self.refuse(&reason, None),
        };
        let variants = grading.variants();
        let Some(Variant { setup, .. }) = variants.first() else {
            return self.events.push(grading.marks());
        };
        let seeds = vec![setup.scenario.world.seed];
        self.start_trials(Ok(Trials::new(TrialPurpose::Grade(grading), variants, seeds)));
    }

    fn grading(&self, files: Texts) -> Result<Grading, String> {
        let drafts = self.drafts.as_ref().ok_or(NO_TRIALS)?;
        let (count, max) = (files.len(), trials::TRIALS_MAX);
        if count > max {
            return Err(format!(
                "{count} results are more than {max}: `bbz grade` has no such limit"
            ));
        }
        let assignment = Assignment::new(drafts.workshop(), &self.opened)
            .map_err(|errors| format!("the assignment does not run: {}", errors.trim_end()))?;
        let files = files.into_iter().map(|(name, text)| (name, assignment.prepare(&text)));
        Ok(Grading { files: files.collect(), results: Vec::new() })
    }

    pub(super) fn start_trials(&mut self, trials: Result<Trials, String>) {
        match trials {
            Ok(trials) => {
                self.trials = Some(trials);
                self.events.push(PageEvent::Trials(TrialsEvent { percent: 0 }));
            }
            Err(reason) => self.refuse(&reason, None),
        }
    }
}
