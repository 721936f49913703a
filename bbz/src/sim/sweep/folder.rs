//! The folder of a sweep, and the study whose runs it has.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

use bittybuzz_chunks::{Folder, Outcome, Plan, Store};

use crate::chunks::StoreProblem;
use crate::problem::Problem;
use crate::report;
use crate::whole_file::Inputs;

use super::super::arguments::SimArguments;
use super::super::study::Study;
use super::super::{experiment, source};

/// A folder without a plan.
#[derive(Debug, thiserror::Error)]
#[error("`{0}` has no plan of a sweep")]
struct NoPlan(PathBuf);

impl Problem for NoPlan {
    fn help(&self) -> Option<String> {
        Some("`bbz sweep plan SCENARIO.toml` makes a folder with one".to_owned())
    }
}

/// A result in the folder of the sweep.
#[derive(Debug, thiserror::Error)]
#[error("`{0}` is in the folder of the sweep")]
struct InFolder(PathBuf);

impl Problem for InFolder {
    fn help(&self) -> Option<String> {
        Some("name a file outside of it: the folder has the plan and the rows alone".to_owned())
    }
}

/// Opens the folder of a sweep.
pub fn open(path: &Path) -> Result<Store<Folder>, Box<dyn Problem>> {
    let store = Store::open(Folder(path.to_owned())).map_err(StoreProblem)?;
    Ok(store.ok_or_else(|| NoPlan(path.to_owned()))?)
}

/// Returns the arguments of the runs of a plan in a folder.
pub fn arguments(folder: &Path, plan: &Plan) -> SimArguments {
    let include = plan.include.iter().map(|path| beside(folder, path)).collect();
    SimArguments::of_sweep(beside(folder, &plan.scenario), include, plan.seed)
}

/// Opens the study of a plan to carry out runs. Prints mistakes of files, and returns `None` if there
/// are any.
pub fn study<'a>(
    arguments: &'a SimArguments,
    store: &Store<Folder>,
) -> Result<Option<Study<'a>>, Box<dyn Problem>> {
    experiment::check_program(store.plan(), &store.path())?;
    open_study(arguments, store)
}

/// Opens the study of a plan to show its runs, which a program of other sources may have carried out: then
/// a warning is printed.
pub fn shown_study<'a>(
    arguments: &'a SimArguments,
    store: &Store<Folder>,
) -> Result<Option<Study<'a>>, Box<dyn Problem>> {
    if let Err(problem) = experiment::check_program(store.plan(), &store.path()) {
        let help =
            "the rows are shown as they are; a run that is opened in the page may end otherwise";
        report::warning(&problem.to_string(), Some(help));
    }
    open_study(arguments, store)
}

fn open_study<'a>(
    arguments: &'a SimArguments,
    store: &Store<Folder>,
) -> Result<Option<Study<'a>>, Box<dyn Problem>> {
    let plan = store.plan();
    let text = source::read(arguments)?;
    let opened = Study::with_plan(arguments, text, experiment::runs(plan).plan, Default::default());
    let study = match opened {
        Ok(study) => study,
        Err(unopened) => return unopened.print().map(|()| None),
    };
    experiment::check(&study, plan, &store.path())?;
    Ok(Some(study))
}

/// Returns the chunks of a plan that are not finished.
pub fn missing(plan: &Plan, outcomes: &BTreeMap<usize, Outcome>) -> Vec<usize> {
    let is_whole = |chunk: &usize| {
        let runs = plan.runs_of(*chunk);
        outcomes.range(runs.clone()).count() == runs.len()
    };
    (0..plan.chunks()).filter(|chunk| !is_whole(chunk)).collect()
}

/// Refuses a result that would be in the folder of a sweep, or in the place of a file that its runs read.
pub fn refuse(path: &Path, folder: &Path, plan: &Plan) -> Result<(), Box<dyn Problem>> {
    let scenario = self::beside(folder, &plan.scenario);
    let mut inputs = Inputs::default();
    inputs.add(&scenario);
    plan.files.keys().for_each(|file| inputs.add(&scenario.with_file_name("").join(file)));
    inputs.refuse(path)?;
    let beside = path.parent().filter(|beside| !beside.as_os_str().is_empty());
    let beside = fs::canonicalize(beside.unwrap_or(Path::new(".")));
    match (beside, fs::canonicalize(folder)) {
        (Ok(beside), Ok(folder)) if beside == folder => Err(InFolder(path.to_owned()).into()),
        _ => Ok(()),
    }
}

/// Returns a path that begins at a folder, without a detour through the folder if there is none to make.
fn beside(folder: &Path, path: &str) -> PathBuf {
    // `..` of a link is not the folder that has the link.
    let has_name = matches!(folder.components().next_back(), Some(Component::Normal(_)));
    match (path.strip_prefix("../"), folder.parent()) {
        (Some(rest), Some(parent)) if has_name && !folder.is_symlink() => parent.join(rest),
        _ => folder.join(path),
    }
}
