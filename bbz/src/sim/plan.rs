//! The plan of a batch: the values of `--set` and of `[sweep]`, and the seeds.

use std::collections::BTreeMap;

use bittybuzz_arena::output::metrics;
use bittybuzz_arena::scenario::{OWN_COLUMNS, SET, ScenarioError};
use bittybuzz_arena::sweep::{
    Axis, Chance, KeyNames, Parameter, Plan, SetError, TooManyRuns, count_points, cross, parse_set,
};
use bittybuzz_toml_reader::Place;

use crate::problem::Problem;

use super::open::Unopened;
use super::source::{self, ScenarioText};

/// The most runs of one command. Those of `bbz sim` keep their results, about a kilobyte each, until the
/// last run ends.
pub const RUNS_MAX: u32 = bittybuzz_chunks::RUNS_MAX;

/// A reason why options and scenario give no runs.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// A `--set` that has no values.
    #[error(transparent)]
    Set(#[from] SetError),
    /// There are more than [`RUNS_MAX`] runs.
    #[error(transparent)]
    TooManyRuns(#[from] TooManyRuns),
    /// A key that both `--set` and `[sweep]` vary.
    #[error("`{key}` has values in [sweep] (line {line}) and in `--set`")]
    VariedTwice { key: String, line: usize },
    /// A key that two `--set` vary.
    #[error("`{0}` has values in two `--set`")]
    SetTwice(String),
}

impl Problem for PlanError {
    fn help(&self) -> Option<String> {
        Some(match self {
            PlanError::Set(error) => error.help(),
            PlanError::TooManyRuns(_) => {
                format!("all runs together can be {RUNS_MAX}; use `bbz sim` several times")
            }
            PlanError::VariedTwice { .. } => {
                "leave out one of them; a single run (without --runs and --csv) ignores [sweep]"
                    .to_owned()
            }
            PlanError::SetTwice(key) => format!("write all values into one: `--set {key}=1,2`"),
        })
    }
}

/// The places in the scenario of parameters whose values are given to it as settings, by their keys.
#[derive(Debug, Clone, Default)]
pub struct ParameterPlaces(BTreeMap<String, Place>);

impl ParameterPlaces {
    /// Returns the errors with the places of the parameters instead of those of their settings.
    pub fn locate(&self, mut errors: Vec<ScenarioError>) -> Vec<ScenarioError> {
        for error in &mut errors {
            let Some(place) = &mut error.place else { continue };
            let key = place.path.strip_prefix(SET).map(str::trim);
            if let Some(known) = key.and_then(|key| self.0.get(key)) {
                **place = known.clone();
            }
        }
        errors
    }
}

/// Returns the values of `--set`.
pub fn axes(set: &[String]) -> Result<Vec<Axis>, PlanError> {
    let axes = set.iter().map(|argument| parse_set(argument));
    Ok(axes.collect::<Result<_, SetError>>()?)
}

/// Returns the settings of the first row of each axis.
pub fn first_settings(axes: &[Axis]) -> Vec<String> {
    let of_axis = |axis: &Axis| -> Vec<String> {
        let values = axis.rows.first().into_iter().flatten();
        axis.keys
            .iter()
            .zip(values)
            .map(|(key, value)| format!("{key}={}", value.to_toml()))
            .collect()
    };
    axes.iter().flat_map(of_axis).collect()
}

/// Returns the plan of a batch. `runs` is the number of runs of each point, if the command line has one.
pub fn plan(
    ScenarioText { path, text }: &ScenarioText,
    runs: Option<u32>,
    axes: Vec<Axis>,
) -> Result<(Plan, ParameterPlaces), Unopened> {
    // Before anything is prepared for them.
    count_points(&axes, runs.unwrap_or(1), RUNS_MAX as usize).map_err(PlanError::from)?;
    let scenario = source::parse(path, text, &first_settings(&axes)).map_err(Unopened::Scenario)?;
    let names = KeyNames::of(text);
    let indexed = |key: &str| names.indexed(key).unwrap_or_else(|_| key.to_owned());
    let set: Vec<String> =
        axes.iter().flat_map(|axis| &axis.keys).map(|key| indexed(key)).collect();
    if let Some((_, key)) = set.iter().enumerate().find(|(at, key)| set[..*at].contains(key)) {
        return Err(PlanError::SetTwice(key.clone()).into());
    }
    let sweep = scenario.sweep.as_ref();
    let varied = sweep.into_iter().flat_map(|sweep| &sweep.parameters);
    if let Some((key, parameter)) = varied.clone().find(|(key, _)| set.contains(&indexed(key))) {
        let line = parameter.place.line;
        return Err(PlanError::VariedTwice { key: key.clone(), line }.into());
    }
    let places = varied.map(|(key, parameter)| (key.clone(), parameter.place.clone())).collect();
    let replicates = runs.or(sweep.and_then(|sweep| sweep.seeds)).unwrap_or(1);
    let chance = sweep.map_or(Chance::Common, |sweep| sweep.chance);
    let of_sweep = sweep.map_or_else(Vec::new, |sweep| sweep.axes.clone());
    let axes: Vec<Axis> = of_sweep.into_iter().chain(axes).collect();
    let points = cross(&axes, replicates, RUNS_MAX as usize).map_err(PlanError::from)?;
    let own = |key: &String| sweep?.parameters.get(key)?.name.as_deref();
    let keys: Vec<&String> = axes.iter().flat_map(|axis| &axis.keys).collect();
    let named: Vec<(&str, Option<&str>)> =
        keys.iter().map(|key| (key.as_str(), own(key))).collect();
    let metrics = metrics::metrics(&scenario);
    let taken = metrics.iter().map(|metric| metric.name.as_str()).chain(OWN_COLUMNS);
    let columns = names.columns(&named, &taken.collect::<Vec<&str>>());
    let parameters = keys.iter().zip(columns).map(|(key, name)| Parameter {
        key: (*key).clone(),
        name,
        place: sweep.and_then(|sweep| Some(sweep.parameters.get(*key)?.place.clone())),
    });
    let parameters = parameters.collect();
    Ok((Plan { parameters, points, replicates, chance }, ParameterPlaces(places)))
}
