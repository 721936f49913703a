//! Messages about runs of a batch that could not go on, and about a batch that was stopped.

use std::ffi::{OsStr, OsString};
use std::path::Path;

use annotate_snippets::{Group, Level};
use bittybuzz_arena::run::RunError;
use bittybuzz_live::Defect;

use crate::interrupt;
use crate::launch;
use crate::report;
use crate::world;

use super::arguments::{SEED, SimArguments};
use super::runs::Runs;
use super::work::{Ends, RunFailure};

/// Prints each cause of failed runs once, with the first run that it ended.
pub fn print_failures(runs: &Runs, arguments: &SimArguments, ends: &Ends) {
    let mut printed: Vec<(String, &RunFailure, usize, usize)> = Vec::new();
    let failures = ends.iter().filter_map(|(number, end)| Some((number, end.as_ref().err()?)));
    for (number, error) in failures {
        let text = error.to_string();
        match printed.iter_mut().find(|(known, ..)| *known == text) {
            Some((.., others)) => *others += 1,
            None => printed.push((text, error, *number, 0)),
        }
    }
    for (text, error, run, others) in printed {
        let others = match others {
            0 => String::new(),
            1 => " (and another run)".to_owned(),
            others => format!(" (and {others} other runs)"),
        };
        let message = format!("the run with seed {}{others} has ended: {text}", runs.seed(run));
        match error {
            RunFailure::Run(RunError::Scenario(error)) => {
                report::mistake(&message, error.place.as_deref(), error.help());
            }
            RunFailure::Run(RunError::Firmware(_)) | RunFailure::Before(_) => {
                report::mistake(&message, None, None);
            }
            RunFailure::Defect(_) => {
                let advice = Defect::advice(&command(runs, arguments, run));
                report::mistake(&message, None, Some(advice));
            }
        }
    }
}

/// Returns the command that simulates only this run.
fn command(runs: &Runs, arguments: &SimArguments, run: usize) -> String {
    let mut words = vec![OsString::from("sim"), arguments.scenario.clone().into()];
    let mut add =
        |option: &str, value: &OsStr| words.extend([OsString::from(option), value.to_owned()]);
    if let Some(robot) = &arguments.robot {
        let count = arguments.count.unwrap_or(world::COUNT);
        add("--robot", OsStr::new(robot));
        add("--count", OsStr::new(&count.to_string()));
    }
    let is_seed = |setting: &&String| setting.split('=').next() == Some(SEED);
    let settings = runs.settings(runs.point_of(run));
    settings
        .iter()
        .filter(|setting| !is_seed(setting))
        .for_each(|setting| add("--set", OsStr::new(setting)));
    add("--seed", OsStr::new(&runs.seed(run).to_string()));
    arguments.include.iter().for_each(|folder| add("-I", folder.as_os_str()));
    if let Some(program) = &arguments.emulator {
        add("--emulator", program.as_os_str());
    }
    launch::command(words)
}

/// Prints the number of finished runs of an interrupted batch, and the way to resume it.
pub fn print_interrupt([finished, total]: [usize; 2], folder: Option<&Path>) {
    let name = interrupt::NAME;
    let title = format!("stopped by {name}: {finished} of {total} runs are finished");
    report::print(Group::with_title(Level::NOTE.primary_title(title)));
    let help = match folder {
        _ if finished == 0 => return,
        Some(folder) => format!(
            "`{}` keeps them: the same command with --resume goes on",
            report::printable(&folder.display().to_string())
        ),
        None => "with --csv they are kept, and --resume goes on".to_owned(),
    };
    report::print(Group::with_title(Level::HELP.primary_title(help)));
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::super::batch::tests::{CommandLine, SCENARIO};
    use super::super::plan;
    use super::super::study::Study;
    use super::*;

    #[test]
    fn the_command_of_a_defect_repeats_one_run() {
        let folder = tempfile::tempdir().unwrap();
        let scenario = folder.path().join("s.toml");
        std::fs::write(&scenario, SCENARIO).unwrap();
        std::fs::write(folder.path().join("s.bzz"), "").unwrap();
        let path = scenario.display().to_string();
        let set = ["--set", "world.duration=2", "--set", "world.seed=4,5"];
        let line = ["sim", &path, "-I", "my scripts", "--runs", "3", "--csv", "runs.csv"];
        let arguments = CommandLine::parse_from(line.into_iter().chain(set)).sim;
        let axes = plan::axes(&arguments.set).unwrap();
        let study = Study::open(&arguments, axes).unwrap().unwrap();
        assert_eq!(
            command(&study.runs, &arguments, 5),
            format!("bbz sim {path} --set world.duration=2 --seed 7 -I 'my scripts'")
        );
    }
}
