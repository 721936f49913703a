//! The plan of a study as a file: everything that decides its rows, without the places of files.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use bittybuzz_arena::sweep::{self, ParameterValue};
use bittybuzz_chunks::{Chance, Experiment, Parameter, Plan, StoreError};
use bittybuzz_live::{relative, sha256};
use bittybuzz_sources::SOURCES;

use crate::chunks::StoreProblem;
use crate::file_error::FileError;
use crate::problem::Problem;

use super::runs::Runs;
use super::study::Study;

/// Returns the version of this program and a hash of its sources. Programs of equal sources give
/// equal rows.
pub fn program() -> String {
    format!("{} {SOURCES}", env!("CARGO_PKG_VERSION"))
}

/// Returns the plan of a study for a folder, with `chunk` runs in each chunk.
pub fn plan(study: &Study, folder: &Path, chunk: u32) -> Result<Plan, Box<dyn Problem>> {
    let arguments = study.arguments;
    let sweep::Plan { parameters, points, replicates, chance } = &study.runs.plan;
    let parameters = parameters.iter().map(|parameter| {
        let (key, column) = (parameter.key.clone(), parameter.name.clone());
        Parameter { key, column }
    });
    let text_of = |point: &Vec<ParameterValue>| point.iter().map(ParameterValue::to_toml).collect();
    // Next to a scenario, in a folder that may move.
    let folder = canonical(folder)?;
    let from_folder =
        |path: &PathBuf| Ok::<_, FileError>(slashed(&relative(&folder, &canonical(path)?)));
    Ok(Plan {
        experiment: experiment(study)?,
        scenario: from_folder(&arguments.scenario)?,
        include: arguments.include.iter().map(from_folder).collect::<Result<_, _>>()?,
        files: files(study)?,
        seed: arguments.seed,
        world_seed: study.runs.world_seed,
        chance: match chance {
            sweep::Chance::Common => Chance::Common,
            sweep::Chance::Independent => Chance::Independent,
        },
        replicates: *replicates,
        chunk,
        parameters: parameters.collect(),
        points: points.iter().map(text_of).collect(),
    })
}

/// Refuses a plan of programs of other sources.
pub fn check_program(plan: &Plan, path: &Path) -> Result<(), StoreProblem> {
    let (of, own) = (plan.experiment.program.clone(), program());
    match of == own {
        true => Ok(()),
        false => Err(StoreProblem(StoreError::OtherProgram { path: path.to_owned(), of, own })),
    }
}

/// Refuses a study whose files are not those of its plan.
pub fn check(study: &Study, plan: &Plan, path: &Path) -> Result<(), Box<dyn Problem>> {
    let mut changed = plan.experiment.differences(&experiment(study)?);
    for (name, hash) in files(study)? {
        if plan.files.get(&name) != Some(&hash) {
            changed.push(format!("`{name}`"));
        }
    }
    match changed.is_empty() {
        true => Ok(()),
        false => {
            let path = path.to_owned();
            Err(StoreProblem(StoreError::OtherExperiment { path, changed }).into())
        }
    }
}

/// Returns the runs of a plan in a file.
pub fn runs(plan: &Plan) -> Runs {
    let parameter = |Parameter { key, column }: &Parameter| sweep::Parameter {
        key: key.clone(),
        name: column.clone(),
        place: None,
    };
    let values =
        |point: &Vec<String>| point.iter().map(|text| ParameterValue::parse(text)).collect();
    let Plan { seed, world_seed, .. } = *plan;
    let plan = sweep::Plan {
        parameters: plan.parameters.iter().map(parameter).collect(),
        points: plan.points.iter().map(values).collect(),
        replicates: plan.replicates,
        chance: match plan.chance {
            Chance::Common => sweep::Chance::Common,
            Chance::Independent => sweep::Chance::Independent,
        },
    };
    Runs { plan, seed, world_seed }
}

/// Returns everything that decides the rows, except settings, seeds and files.
pub fn experiment(study: &Study) -> Result<Experiment, Box<dyn Problem>> {
    let arguments = study.arguments;
    let mut options = BTreeMap::new();
    // These make the scenario of a script.
    let robot = arguments.robot.as_ref().map(|robot| ("--robot", robot.clone()));
    let count = arguments.count.map(|count| ("--count", count.to_string()));
    for (option, value) in robot.into_iter().chain(count) {
        options.insert(option.to_owned(), value);
    }
    for program in study.first.opened.emulator_programs() {
        // A program that is found through PATH has no content here.
        let content = if program.is_file() { hash(program)? } else { String::new() };
        let name = program.file_stem().unwrap_or_default().to_string_lossy();
        options.insert(format!("the emulator {name}"), content);
    }
    Ok(Experiment {
        program: program(),
        // The scenario of a script follows from these options.
        scenario: match arguments.robot {
            Some(_) => String::new(),
            None => scenario(&study.text.text),
        },
        options,
        metrics: study.metrics.iter().map(|metric| metric.name.clone()).collect(),
    })
}

/// Returns a hash of a scenario without its comments and without `[sweep]`, which the plan has.
fn scenario(text: &str) -> String {
    let table = text.parse::<toml::Table>();
    let mut table = table.expect("a scenario that was parsed is valid TOML");
    table.remove("sweep");
    // The tables are sorted.
    sha256(format!("{table:?}"))
}

/// Returns the hashes of all files that the runs read, by their paths from the scenario's folder.
fn files(study: &Study) -> Result<BTreeMap<String, String>, Box<dyn Problem>> {
    let scenario = canonical(&study.arguments.scenario)?;
    let folder = scenario.parent().expect("a path of a file has a folder");
    // The scenario has a hash of its own; a script without a scenario is a file like others.
    let is_scenario = |path: &Path| path == scenario && study.arguments.robot.is_none();
    let mut files = BTreeMap::new();
    for path in study.inputs()?.paths().filter(|path| !is_scenario(path)) {
        files.insert(slashed(&relative(folder, path)), hash(path)?);
    }
    Ok(files)
}

/// Returns a path with `/` between its parts, on Windows, too.
fn slashed(path: &str) -> String {
    path.replace(std::path::MAIN_SEPARATOR, "/")
}

fn canonical(path: &Path) -> Result<PathBuf, FileError> {
    let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
    fs::canonicalize(path).map_err(|error| FileError::reading(path, error))
}

fn hash(path: &Path) -> Result<String, FileError> {
    Ok(sha256(fs::read(path).map_err(|error| FileError::reading(path, error))?))
}
