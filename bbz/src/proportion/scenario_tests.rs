//! Scenarios and robot files.

use std::path::Path;
use std::sync::Arc;

use bittybuzz_arena::run::{Program, Setup, Simulation};
use bittybuzz_arena::scenario::Scenario;
use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_robot_spec::Robot;

use super::{CONSTANT, LIMITS, Limits};

/// A value of the TOML parser takes up to 100 bytes with its place, and the shortest one has a byte
/// of text. A part of the scenario has its place with the line for messages.
const TOML: Limits = Limits { per_byte: 128, constant: CONSTANT };

/// A table of the TOML parser has room for several keys, 600 bytes, also if it has one.
const TABLES: Limits = Limits { per_byte: 192, constant: CONSTANT };

const WORLD: &str = "[world]\nsize = [100000, 100000]\nduration = 1\n\n";

fn files() -> MemoryFiles {
    MemoryFiles::default().with("a.bzz", "function step() { led(1) }\n")
}

/// Parses a text, and formats the messages about it.
fn parse(text: &str) -> Option<Scenario> {
    let models = bittybuzz_robot_models::all();
    match Scenario::parse_in(&files(), text, Path::new("s.toml"), &[], &models) {
        Ok(scenario) => Some(scenario),
        Err(errors) => {
            errors.iter().for_each(|error| drop((error.to_string(), error.help())));
            None
        }
    }
}

fn read(text: &str) {
    drop(parse(text));
}

/// Returns a scenario of groups of one Kilobot each, 150 mm apart.
fn groups(count: usize) -> String {
    let group = |number: usize| {
        let [x, y] = [number % 200, number / 200].map(|at| at as i32 * 150 - 15_000);
        format!("[[robots]]\nrobot = \"kilobot\"\nscript = \"a.bzz\"\npositions = [[{x}, {y}]]\n\n")
    };
    WORLD.to_owned() + &(0..count).map(group).collect::<String>()
}

/// Returns a scenario with a group and a repeated part.
fn with(part: impl Fn(usize) -> String, count: usize) -> String {
    let group = "[[robots]]\nrobot = \"kilobot\"\nscript = \"a.bzz\"\ncount = 5\n\n";
    [WORLD, group].concat() + &(0..count).map(part).collect::<String>()
}

/// 30,000 groups took 7 s, and each had its own copy of the robot file.
#[test]
fn scenarios_of_many_groups() {
    TOML.check("groups", 500, groups, |text| assert!(parse(text).is_some()));
    let same = |count: usize| {
        let group = "[[robots]]\nrobot = \"kilobot\"\nscript = \"a.bzz\"\ncount = 65536\n\n";
        WORLD.to_owned() + &group.repeat(count)
    };
    TOML.check("groups with all ids", 500, same, read);
    let unknown =
        |count: usize| WORLD.to_owned() + &"[[robots]]\nrobot = \"kilobt\"\n".repeat(count);
    TOML.check("groups of unknown robots", 500, unknown, read);
}

#[test]
fn scenarios_of_many_parts() {
    let event = |number: usize| format!("[[event]]\nat = 0.{number}\nfail = [0, \"1..3\"]\n");
    TOML.check("events", 1000, |n| with(event, n), read);
    let expect = |_| "[[expect]]\nvalue = \"x\"\nbelow = 3\nalways = true\n".to_owned();
    TOML.check("expectations", 1000, |n| with(expect, n), read);
    let jam = |_| "[[adversary]]\nkind = \"jam\"\nat = [0, 0]\n".to_owned();
    TOML.check("adversaries", 1000, |n| with(jam, n), read);
    let file = |number: usize| format!("[[file]]\npath = \"{number}\"\ntext = \"\"\n");
    TOML.check("files", 1000, |n| with(file, n), read);
    let disc = "{ at = [0, 0], radius = 9 }, ";
    let world = |n| WORLD.trim_end().to_owned() + "\nobstacles = [" + &disc.repeat(n) + "]\n";
    TOML.check("obstacles", 1000, world, read);
}

/// Texts that are not TOML, or not a scenario.
#[test]
fn scenarios_of_any_text() {
    TOML.check("brackets", 20_000, |n| "[".repeat(n), read);
    TOML.check("nested lists", 20_000, |n| format!("a = {}", "[".repeat(n)), read);
    TOML.check("a dotted key", 20_000, |n| "a.".repeat(n) + "a = 1", read);
    TOML.check("a long key", 50_000, |n| "a".repeat(n) + " = 1", read);
    TOML.check("a long string", 50_000, |n| format!("a = \"{}\"", "\\n".repeat(n)), read);
    TOML.check("an open string", 50_000, |n| format!("a = \"{}", "x".repeat(n)), read);
    TOML.check("equal keys", 10_000, |n| "a = 1\n".repeat(n), read);
    let keys = |n| (0..n).map(|key| format!("a{key} = 1\n")).collect::<String>();
    TOML.check("unknown keys", 5000, keys, read);
    let tables = |n| (0..n).map(|key| format!("[a{key}.b]\n")).collect::<String>();
    TABLES.check("tables", 5000, tables, read);
    TOML.check("line ends", 50_000, |n| "\n".repeat(n), read);
    TOML.check("a list", 20_000, |n| format!("a = [{}]", "1,".repeat(n)), read);
}

/// A run has a virtual machine for each robot, which is larger than the text of its group.
#[test]
fn runs_of_many_groups() {
    let limits = Limits { per_byte: 200, constant: 8 * CONSTANT };
    let run = |text: &str| {
        let scenario = Arc::new(parse(text).unwrap());
        let empty = Program::empty(&scenario.groups[0]);
        let programs = vec![empty; scenario.groups.len()];
        let setup = Arc::new(Setup::new(scenario, programs).ok().unwrap());
        let mut run = Simulation::new(setup, 1, 1).unwrap();
        run.tick().unwrap();
        run.summary();
    };
    limits.check("runs of groups", 500, groups, run);
}

#[test]
fn robot_files_of_any_shape() {
    const ROVER: &str = include_str!("../../../spec/robot/src/tests/rover.toml");
    let read = |text: &str| {
        if let Err(errors) = Robot::parse(text, "r.toml") {
            assert!(!errors.to_string().is_empty());
        }
    };
    let functions = |n| {
        let function = |number| format!("[[function]]\nname = \"f{number}\"\nhelp = \"h\"\n\n");
        ROVER.to_owned() + &(0..n).map(function).collect::<String>()
    };
    LIMITS.check("functions", 300, functions, read);
    let equal = |n| ROVER.to_owned() + &"[[function]]\nname = \"f\"\nhelp = \"h\"\n\n".repeat(n);
    LIMITS.check("equal functions", 300, equal, read);
    let sensor = "[[sensor]]\nname = \"s\"\nkind = \"ground\"\n\n";
    LIMITS.check("sensors", 300, |n| ROVER.to_owned() + &sensor.repeat(n), read);
    LIMITS.check("a long name", 50_000, |n| format!("name = \"{}\"\n", "a".repeat(n)), read);
    let accepts = |n| {
        let list = "\"a: number, b: number\", ".repeat(n);
        format!("{ROVER}[[function]]\nname = \"f\"\nhelp = \"h\"\naccepts = [{list}]\n")
    };
    LIMITS.check("accepted arguments", 1000, accepts, read);
}
