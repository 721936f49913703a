//! `bbz sim`: simulates the robots of a scenario.

mod arguments;
mod batch;
mod checks;
mod data;
pub mod desk;
mod doors;
mod experiment;
mod journal;
mod live;
mod open;
mod plan;
mod programs;
mod progress;
mod recorder;
mod runs;
mod source;
mod stops;
mod study;
pub mod summary;
pub mod sweep;
mod table;
mod tables;
#[cfg(feature = "view")]
mod unsaved;
#[cfg(feature = "view")]
mod values;
#[cfg(feature = "view")]
mod view;
mod work;

use bittybuzz_arena::sweep::Axis;

use crate::exit::ExitStatus;
use crate::problem::Problem;

use arguments::SEED;
pub use arguments::SimArguments;
pub use tables::{Tables, write_tables};

/// Options that contradict each other.
#[derive(Debug, thiserror::Error)]
enum OptionsError {
    #[error("`--seed` and `--set world.seed` both give the seed")]
    TwoSeeds,
    #[error("`--checks` reports one run, and `--set` asks for several")]
    ChecksOfMany,
    #[cfg(feature = "view")]
    #[error("`--view` shows one run, and `--set` asks for several")]
    ViewOfMany,
}

impl Problem for OptionsError {
    fn help(&self) -> Option<String> {
        let help = match self {
            OptionsError::TwoSeeds => "leave out one of them",
            OptionsError::ChecksOfMany => "give each key of `--set` one value",
            #[cfg(feature = "view")]
            OptionsError::ViewOfMany => "give each key of `--set` one value",
        };
        Some(help.to_owned())
    }
}

/// Carries out the command.
pub fn execute(arguments: &SimArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let axes = plan::axes(&arguments.set)?;
    check_seed(arguments, &axes)?;
    let is_single = axes.iter().all(|axis| axis.rows.len() == 1);
    let only = plan::first_settings(&axes);
    match is_single {
        #[cfg(feature = "view")]
        true if arguments.view => view::run(arguments, &only),
        true if arguments.runs.is_none() && arguments.csv.is_none() => live::run(arguments, &only),
        #[cfg(feature = "view")]
        _ if arguments.view => Err(OptionsError::ViewOfMany.into()),
        _ if arguments.checks => Err(OptionsError::ChecksOfMany.into()),
        _ => batch::run(arguments, axes),
    }
}

/// Refuses a seed that two options give.
fn check_seed(arguments: &SimArguments, axes: &[Axis]) -> Result<(), OptionsError> {
    let mut keys = axes.iter().flat_map(|axis| &axis.keys);
    match arguments.seed.is_some() && keys.any(|key| key == SEED) {
        true => Err(OptionsError::TwoSeeds),
        false => Ok(()),
    }
}
