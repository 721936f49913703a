//! The list of the robots that ship. This is the only place that names all of them.
//!
//! Compiler and simulator know no robots and take them as arguments; programs take the list from
//! this crate. A robot is its file `robots/NAME/robot.toml`, embedded in the program. To ship
//! another one, add its line to [`shipped`] (`docs/new-robot.md` describes all steps). The files in
//! `robots/host` describe robots of other hosts of Buzz, which have no firmware here.
//!
//! This crate holds text only and depends on no model and on no emulator, because build scripts of
//! firmware use it.

use std::path::Path;

use bittybuzz_robot_spec::{Robot, RobotErrors};

/// A robot file that ships.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShippedFile {
    /// The robot's name on the command line.
    pub name: &'static str,
    /// The file's path from the root of the repository, for messages.
    pub path: &'static str,
    /// The file's text.
    pub text: &'static str,
}

macro_rules! shipped_files {
    ($($name:literal: $path:literal)*) => {
        &[$(ShippedFile {
            name: $name,
            path: concat!("robots/", $path),
            text: include_str!(concat!("../../../robots/", $path)),
        }),*]
    };
}

/// Returns the robot files that ship.
pub const fn shipped() -> &'static [ShippedFile] {
    shipped_files! {
        "kilobot": "kilobot/robot.toml"
        "zooids": "zooids/robot.toml"
        "crazyflie": "crazyflie/robot.toml"
        "footbot": "host/footbot.toml"
        "epuck": "host/epuck.toml"
        "khepera": "host/khepera.toml"
        "hiveboard": "host/hiveboard.toml"
        "bench": "bench.toml"
    }
}

/// Returns the robots that ship, parsed from their files.
pub fn all_shipped() -> Vec<Robot> {
    shipped().iter().map(read_shipped).collect()
}

fn read_shipped(file: &ShippedFile) -> Robot {
    match Robot::parse(file.text, file.path) {
        Ok(robot) => robot,
        // Tests parse all shipped files, so only a mistake in this repository leads here, never an
        // input.
        Err(error) => panic!("a shipped robot does not parse: {error}"),
    }
}

/// Returns the robot that `--robot` names: one that ships, or a robot file of the user (a path that
/// ends in `.toml`).
pub fn find(name_or_path: &str) -> Result<Robot, RobotErrors> {
    let path = Path::new(name_or_path);
    if path.extension().is_some_and(|extension| extension == "toml") {
        return Robot::read(path);
    }
    match shipped().iter().find(|file| file.name == name_or_path) {
        Some(file) => Ok(read_shipped(file)),
        None => {
            let known = shipped().iter().map(|file| file.name);
            Err(RobotErrors::unknown_robot(name_or_path, known))
        }
    }
}
