//! `bbz sweep status`: counts runs.

use std::path::PathBuf;

use bittybuzz_chunks::Outcome;
use clap::Args;
use serde_json::json;

use crate::chunks::{self, Names, StoreProblem};
use crate::exit::ExitStatus;
use crate::output;
use crate::problem::Problem;

use super::super::experiment;
use super::{cluster, folder};

/// Arguments of `bbz sweep status`.
#[derive(Debug, Args)]
pub struct StatusArguments {
    /// Folder of `bbz sweep plan`
    folder: PathBuf,
    /// Print the counts as JSON
    #[arg(long)]
    json: bool,
    /// Print only the numbers of the chunks that are not finished, one on a line
    #[arg(long, conflicts_with = "json")]
    missing: bool,
}

/// Carries out the command.
pub fn execute(arguments: &StatusArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let store = folder::open(&arguments.folder)?;
    let runs = experiment::runs(store.plan());
    let found = store.all(|run| runs.key(run)).map_err(StoreProblem)?;
    chunks::print_aside(&found.aside);
    let is_failed = |outcome: &&Outcome| matches!(outcome, Outcome::Failed(_));
    let (finished, total) = (found.outcomes.len(), runs.count());
    let failed = found.outcomes.values().filter(is_failed).count();
    let chunks = store.plan().chunks();
    let missing = folder::missing(store.plan(), &found.outcomes);
    let cluster = match arguments.missing {
        true => None,
        false => cluster::state(&arguments.folder, chunks, &missing),
    };
    let unfinished = Names::of(&arguments.folder)?.unfinished;
    let text = match (arguments.json, arguments.missing) {
        (_, true) => missing.iter().map(|chunk| format!("{chunk}\n")).collect(),
        (true, false) => {
            let mut counts = json!({
                "runs": total,
                "finished": finished,
                "failed": failed,
                "chunks": chunks,
                "missing_chunks": missing,
            });
            if let Some(cluster) = &cluster {
                counts["slurm"] = cluster.to_json();
            }
            format!("{counts}\n")
        }
        (false, false) => {
            let mut text = format!(
                "{finished} of {total} runs are finished, {failed} of them could not go on\n\
                 {} of {chunks} chunks are finished\n",
                chunks - missing.len()
            );
            if let Some(first) = missing.first() {
                text += &format!("first chunk that is missing: {first}\n");
            }
            text += &cluster.map_or(String::new(), |cluster| cluster.describe());
            for name in unfinished {
                text += &format!("`{name}` is being written, or a killed process has left it\n");
            }
            text
        }
    };
    output::write(&text)?;
    Ok(if missing.is_empty() { ExitStatus::Success } else { ExitStatus::RuntimeError })
}
