//! The runs of a plan on one scenario. A point is opened when a run needs it, because a plan may have a
//! million points.

use std::collections::BTreeSet;
use std::sync::Arc;

use bittybuzz_arena::output::metrics::{self, Metric};
use bittybuzz_arena::run::{Setup, SetupError};
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_arena::sweep::{Axis, ParameterValue, Plan};
use rayon::prelude::*;

use crate::problem::Problem;
use crate::whole_file::Inputs;

use super::arguments::SimArguments;
use super::data;
use super::doors;
use super::open::{self, Opened, Unopened};
use super::plan::{self, ParameterPlaces};
use super::programs::Programs;
use super::runs::Runs;
use super::source::{self, ScenarioText};

/// The key of the duration in a scenario.
const DURATION: &str = "world.duration";

/// A reason why points cannot be compared.
#[derive(Debug, thiserror::Error)]
enum StudyError {
    /// Points with other columns.
    #[error("the values of `--set` change which columns the table has")]
    DifferentColumns,
    /// Points with other columns in the tables of `--data`.
    #[error("the values of `--set` change which columns the tables of --data have")]
    DifferentData,
    /// Robots with doors, which are at the same ports in each run.
    #[error("robots with a `door` for ground stations run once, not in a batch")]
    Doors,
}

impl Problem for StudyError {
    fn help(&self) -> Option<String> {
        let help = match self {
            StudyError::DifferentColumns | StudyError::DifferentData => {
                "use `bbz sim` once for each, with a table of its own"
            }
            StudyError::Doors => "leave out `door`, or --runs, --csv and further values of --set",
        };
        Some(help.to_owned())
    }
}

/// A scenario with the settings of a point.
pub struct StudyPoint {
    pub opened: Opened,
    pub setup: Arc<Setup>,
}

/// The runs of a plan.
pub struct Study<'a> {
    pub arguments: &'a SimArguments,
    pub text: ScenarioText,
    pub runs: Runs,
    places: ParameterPlaces,
    programs: Programs,
    /// The metrics of each run.
    pub metrics: Vec<Metric>,
    pub first: Arc<StudyPoint>,
}

impl<'a> Study<'a> {
    /// Opens the study of a command line. Prints mistakes of files, and returns `None` if there are any.
    pub fn open(
        arguments: &'a SimArguments,
        axes: Vec<Axis>,
    ) -> Result<Option<Self>, Box<dyn Problem>> {
        let text = source::read(arguments)?;
        let study = plan::plan(&text, arguments.runs, axes)
            .and_then(|(plan, places)| Study::with_plan(arguments, text, plan, places))
            .and_then(|study| study.check().map(|()| study));
        match study {
            Ok(study) => Ok(Some(study)),
            Err(unopened) => unopened.print().map(|()| None),
        }
    }

    /// Opens the first point of a plan.
    pub fn with_plan(
        arguments: &'a SimArguments,
        text: ScenarioText,
        plan: Plan,
        places: ParameterPlaces,
    ) -> Result<Self, Unopened> {
        let programs = Programs::default();
        let settings = plan.settings(plan.points.first().expect("a plan has a point"));
        let first = open_point(arguments, &text, &settings, &places, &programs)?;
        first.opened.print_warnings(&text.text);
        let metrics = metrics::metrics(&first.opened.scenario);
        let world_seed = first.opened.scenario.world.seed;
        let runs = Runs { plan, seed: arguments.seed, world_seed };
        Ok(Study { arguments, text, runs, places, programs, metrics, first: Arc::new(first) })
    }

    /// Opens all points, so that a mistake in one of them is found before the first run.
    fn check(&self) -> Result<(), Unopened> {
        let first = &self.first.opened.scenario;
        let (quantities, messages) = (data::quantities(first), first.output.data.messages);
        let has_data = self.arguments.data.is_some();
        let check = |point: usize| {
            let point = self.point(point)?;
            let scenario: &Scenario = &point.opened.scenario;
            if metrics::metrics(scenario) != self.metrics {
                return Err(StudyError::DifferentColumns.into());
            }
            let is_same = || {
                data::quantities(scenario) == quantities
                    && scenario.output.data.messages == messages
            };
            if has_data && !is_same() {
                return Err(StudyError::DifferentData.into());
            }
            if doors::exist(scenario) {
                return Err(StudyError::Doors.into());
            }
            Ok(())
        };
        let mistake = |point: usize| check(point).err();
        let found = (0..self.runs.plan.points.len()).into_par_iter().find_map_first(mistake);
        found.map_or(Ok(()), Err)
    }

    /// Opens a point.
    pub fn point(&self, point: usize) -> Result<StudyPoint, Unopened> {
        open_point(
            self.arguments,
            &self.text,
            &self.runs.settings(point),
            &self.places,
            &self.programs,
        )
    }

    /// Returns the files that the runs read. Only values that are texts or lists can name other files, so
    /// other points are not opened.
    pub fn inputs(&self) -> Result<Inputs, Box<dyn Problem>> {
        let is_number = |value: &ParameterValue| {
            matches!(value, ParameterValue::Integer(_) | ParameterValue::Float(_))
        };
        let mut known = BTreeSet::new();
        let mut inputs = Inputs::default();
        for (number, point) in self.runs.plan.points.iter().enumerate() {
            let texts = point.iter().filter(|value| !is_number(value)).map(ParameterValue::to_toml);
            if known.insert(texts.collect::<Vec<String>>()) {
                match self.point(number) {
                    Ok(point) => point.opened.add_inputs(&mut inputs),
                    Err(unopened) => unopened.print()?,
                }
            }
        }
        Ok(inputs)
    }

    /// Returns the duration of the runs of a point, in s.
    pub fn duration(&self, point: usize) -> f64 {
        let first = self.first.opened.scenario.world.duration;
        if self.runs.plan.parameters.iter().all(|parameter| parameter.key != DURATION) {
            return first;
        }
        let scenario = source::parse(&self.text.path, &self.text.text, &self.runs.settings(point));
        scenario.map_or(first, |scenario| scenario.world.duration)
    }
}

fn open_point(
    arguments: &SimArguments,
    text: &ScenarioText,
    settings: &[String],
    places: &ParameterPlaces,
    programs: &Programs,
) -> Result<StudyPoint, Unopened> {
    let opened = open::open_text(arguments, text, settings, places, programs)?;
    let setup = match opened.try_setup() {
        Ok(setup) => setup,
        Err(SetupError::Scenario(errors)) => return Err(Unopened::Scenario(errors)),
        Err(SetupError::Refused { program, cause }) => {
            return Err(Unopened::Refused(opened.refusal(program, &cause)));
        }
    };
    Ok(StudyPoint { opened, setup: Arc::new(setup) })
}
