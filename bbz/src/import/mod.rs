//! `bbz import`: writes a scenario for an experiment of ARGoS, and lists what it leaves out.
//!
//! # Principles
//! * A value has the meaning that the source of ARGoS gives it, not that of its name.
//! * Nothing is lost silently: an entry of the list has the line of the experiment and a cure.
//! * The scenario is loaded as `bbz sim` loads it, so mistakes in it appear at once.
//!
//! # What it will not do
//! It translates no code: loop functions and controllers in C++ or Lua are listed.

mod arena;
mod controllers;
mod distribute;
mod document;
mod experiment;
mod generator;
mod group;
mod load;
mod mistake;
mod obstacle;
mod omission;
mod robots;
mod script;
mod separate;
mod write;

use std::path::{Path, PathBuf};

use bittybuzz_toml_reader::file;
use clap::Args;

use crate::exit::ExitStatus;
use crate::file_error::FileError;
use crate::output;
use crate::problem::Problem;
use crate::report;
use crate::whole_file::{self, Inputs};

use document::{Element, Reader};
use robots::RobotKinds;
use script::ScriptFolders;

const EXAMPLES: &str = "\
Examples:
  bbz import field.argos -o field.toml    writes a scenario; then `bbz sim field.toml --view`
  bbz import field.argos                  prints it; paths in it start at the current folder
  bbz import field.argos -o field.toml --robot spiri=spiri.toml    robots of another kind, by a robot file

docs/argos.md describes the import.

Exit status: 0, or 2 mistake in the experiment or incomplete scenario, 3 wrong command line or file.";

/// Arguments of `bbz import`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ImportArguments {
    /// Experiment of ARGoS (*.argos)
    file: PathBuf,
    /// Write the scenario to OUT [default: standard output]
    #[arg(short, long, value_name = "OUT.toml")]
    output: Option<PathBuf>,
    /// Robot that stands for a kind of ARGoS: a name or the path of a robot file; may be given several times
    #[arg(long, value_name = "KIND=NAME|PATH.toml", value_parser = robot_choice)]
    robot: Vec<(String, String)>,
}

fn robot_choice(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((kind, robot)) if !kind.is_empty() && !robot.is_empty() => {
            Ok((kind.to_owned(), robot.to_owned()))
        }
        _ => Err("write KIND=NAME or KIND=FILE.toml, such as spiri=spiri.toml".to_owned()),
    }
}

/// Imports a text as [`execute`] does, for the test of memory, and discards the result.
#[cfg(test)]
pub fn read_text(text: &str, path: &Path) {
    let Ok(kinds) = RobotKinds::new(&[], Path::new("")) else { panic!("the robots ship") };
    let folders = ScriptFolders::new(Path::new(""), Path::new("")).expect("there is a folder");
    let reader = Reader::new("e.argos", text);
    let world = reader
        .document()
        .and_then(|document| experiment::read(Element::root(&document, &reader), &kinds, &folders));
    let (mistakes, omissions) = reader.into_results();
    for (mistake, _) in &mistakes {
        drop((mistake.to_string(), mistake.help()));
    }
    let Some(world) = world.filter(|_| mistakes.is_empty()) else { return };
    let comments = omissions.lines(|line| format!("line {line}"));
    load::errors(&write::scenario(&world, "e.argos", &comments), path);
}

/// Carries out the command.
pub fn execute(arguments: &ImportArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let path = arguments.file.as_path();
    let text = file::read_text(path, file::TEXT_BYTES_MAX)
        .map_err(|error| FileError::reading(path, error))?;
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let output = arguments.output.as_deref();
    let written = output.map_or_else(|| format!("<scenario of {name}>").into(), Path::to_owned);
    let folder = written.parent().unwrap_or(Path::new(""));
    let kinds = RobotKinds::new(&arguments.robot, folder)?;
    let own_folder = path.parent().unwrap_or(Path::new(""));
    let folders = ScriptFolders::new(own_folder, folder)
        .map_err(|error| FileError::writing(&written, error))?;
    let shown = path.to_string_lossy();
    let reader = Reader::new(&shown, &text);
    let world = reader
        .document()
        .and_then(|document| experiment::read(Element::root(&document, &reader), &kinds, &folders));
    let (mistakes, omissions) = reader.into_results();
    for (mistake, place) in &mistakes {
        report::mistake(&mistake.to_string(), Some(place), Some(mistake.help()));
    }
    let Some(world) = world.filter(|_| mistakes.is_empty()) else {
        return Ok(ExitStatus::CompileError);
    };
    let comments = omissions.lines(|line| format!("line {line}"));
    let scenario = write::scenario(&world, &name, &comments);
    match output {
        None => output::write(&scenario)?,
        Some(output) => {
            let mut inputs = Inputs::default();
            inputs.add(path);
            world.groups.iter().for_each(|group| inputs.add(&folder.join(&group.script)));
            inputs.refuse(output)?;
            whole_file::write(output, scenario.as_bytes())?;
        }
    }
    if !comments.is_empty() {
        report::lines(&["left out or changed:".to_owned()]);
        report::lines(&omissions.lines(|line| format!("{}:{line}", report::printable(&shown))));
    }
    let errors = load::errors(&scenario, &written);
    for error in &errors {
        report::mistake(&error.to_string(), error.place.as_deref(), error.help());
    }
    Ok(if errors.is_empty() { ExitStatus::Success } else { ExitStatus::CompileError })
}
