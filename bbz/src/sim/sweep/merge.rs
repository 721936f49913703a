//! `bbz sweep merge`: the table of all runs.

use std::path::PathBuf;

use bittybuzz_chunks::Outcome;
use clap::Args;

use crate::chunks::{self, StoreProblem};
use crate::escape::escaped;
use crate::exit::ExitStatus;
use crate::output;
use crate::problem::Problem;
use crate::whole_file;

use super::super::work::{Ends, ends};
use super::super::{batch, experiment};
use super::folder;

/// Runs that are not finished.
#[derive(Debug, thiserror::Error)]
#[error("{missing} of {total} runs of `{folder}` are not finished")]
struct Missing {
    folder: PathBuf,
    missing: usize,
    total: usize,
}

impl Problem for Missing {
    fn help(&self) -> Option<String> {
        let folder = self.folder.display();
        Some(format!("`bbz sweep run {folder}` carries them out; --partial leaves them out"))
    }
}

/// Arguments of `bbz sweep merge`.
#[derive(Debug, Args)]
pub struct MergeArguments {
    /// Folder of `bbz sweep plan`
    folder: PathBuf,
    /// File of the table [default: standard output]
    #[arg(short, value_name = "OUT.csv")]
    output: Option<PathBuf>,
    /// Leave out runs that are not finished
    #[arg(long)]
    partial: bool,
}

/// Carries out the command.
pub fn execute(arguments: &MergeArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let store = folder::open(&arguments.folder)?;
    arguments
        .output
        .iter()
        .try_for_each(|path| folder::refuse(path, &arguments.folder, store.plan()))?;
    let runs = experiment::runs(store.plan());
    let found = store.all(|run| runs.key(run)).map_err(StoreProblem)?;
    chunks::print_aside(&found.aside);
    let (total, finished) = (runs.count(), found.outcomes.len());
    if finished < total && !arguments.partial {
        let folder = arguments.folder.clone();
        return Err(Missing { folder, missing: total - finished, total }.into());
    }
    let has_failed = found.outcomes.values().any(|outcome| matches!(outcome, Outcome::Failed(_)));
    let metrics = store.plan().experiment.metrics.clone();
    let (_, table) = batch::table(&runs, metrics, ends(found.outcomes, Ends::new()));
    let text = escaped(&table.to_csv()).into_owned();
    match &arguments.output {
        Some(path) => whole_file::write(path, text.as_bytes())?,
        None => output::write(&text)?,
    }
    Ok(if has_failed { ExitStatus::RuntimeError } else { ExitStatus::Success })
}
