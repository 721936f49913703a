//! The list of the robots that ship: the only place that names them all.
//!
//! Compiler and simulator take robots as arguments and know none; programs take the list from here. A robot is its file
//! `robots/NAME/robot.toml`, embedded in the program. To ship another one, add its line to [`shipped`]
//! (`docs/new-robot.md` leads through it).
//!
//! This crate holds text only: build scripts of firmware use it, so it depends on no model and on no emulator.

use std::path::Path;

use bittybuzz_robot_spec::{Robot, RobotErrors};

/// A robot file that ships.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShippedFile {
    /// The robot's name, by which the command line knows it.
    pub name: &'static str,
    /// Its path from the root of the repository, for messages.
    pub path: &'static str,
    /// Its text.
    pub text: &'static str,
}

macro_rules! shipped_files {
    ($($name:literal: $path:literal)*) => {
        &[$(ShippedFile {
            name: $name,
            path: concat!("robots/", $path),
            text: include_str!(concat!("../../", $path)),
        }),*]
    };
}

/// The robot files that ship.
pub const fn shipped() -> &'static [ShippedFile] {
    shipped_files! {
        "kilobot": "kilobot/robot.toml"
        "zooids": "zooids/robot.toml"
        "crazyflie": "crazyflie/robot.toml"
        "bench": "bench.toml"
    }
}

/// The robots that ship, read.
pub fn all_shipped() -> Vec<Robot> {
    shipped().iter().map(read_shipped).collect()
}

fn read_shipped(file: &ShippedFile) -> Robot {
    match Robot::parse(file.text, file.path) {
        Ok(robot) => robot,
        // A mistake in this repository, which the tests find; no input leads here.
        Err(error) => panic!("a shipped robot does not parse: {error}"),
    }
}

/// The robot that `--robot` names: one that ships, or a robot file of the user (a path that ends in `.toml`).
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
