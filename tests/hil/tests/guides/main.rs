//! Each guide and recipe is carried out in a copy of the repository, command by command.
//!
//! The first run builds what the copies need (embassy, for the chip); later ones only what a guide changes.

mod console;
mod edit;
mod guide;

use std::fs;
use std::path::{Path, PathBuf};

use bittybuzz_builds::copy::Copy;
use bittybuzz_hil::Core;
use bittybuzz_tests::bbz;

use guide::Guide;

/// A test for each page, and the cores whose emulators its reader has built before.
macro_rules! guides {
    ($($test:ident: $page:literal, $cores:expr;)*) => {
        /// All pages that are carried out.
        const PAGES: &[&str] = &[$($page),*];

        $(#[test]
        fn $test() {
            carry_out($page, &$cores);
        })*
    };
}

guides! {
    guide_to_the_first_steps: "docs/start.md", [Core::Own];
    guide_to_a_robot: "docs/new-robot.md", [Core::Unicorn];
    guide_to_a_robot_function: "docs/new-robot-function.md", [Core::Unicorn];
    guide_to_a_built_in: "docs/recipes/built-in.md", [];
    guide_to_a_chip_model: "docs/recipes/chip-model.md", [];
    guide_to_a_command_line_option: "docs/recipes/command-line-option.md", [];
    guide_to_an_instruction: "docs/recipes/instruction.md", [];
    guide_to_a_function_on_all_robots: "docs/recipes/function-on-all-robots.md", [Core::Unicorn, Core::Own, Core::Avr];
    guide_to_a_sensor: "docs/recipes/sensor.md", [Core::Avr];
}

fn carry_out(page: &str, cores: &[Core]) {
    let text = fs::read_to_string(bbz::root().join(page)).expect("the guide is there");
    let guide = Guide::read(page, &text).unwrap_or_else(|failure| panic!("{failure}"));
    let folders = cores.iter().filter_map(|core| Some(core.program().parent()?.to_owned()));
    let copy = Copy::new(Path::new(env!("CARGO_TARGET_TMPDIR"))).expect("git is there, and room");
    let programs: Vec<PathBuf> = folders.collect();
    guide.carry_out(&copy, &programs).unwrap_or_else(|failure| panic!("{failure}"));
}

/// CONTRIBUTING.md promises that each page in its table of recipes is carried out, and it lists all of them.
#[test]
fn every_recipe_is_carried_out() {
    let text = fs::read_to_string(bbz::root().join("CONTRIBUTING.md")).expect("it is there");
    let (_, section) = text.split_once("\n## Recipes\n").expect("there is a table of recipes");
    let table = section.lines().take_while(|line| !line.starts_with("## "));
    let rows = table.filter(|line| line.starts_with("| "));
    let mut linked: Vec<&str> = rows
        .flat_map(|row| row.split("](").skip(1))
        .filter_map(|rest| Some(rest.split_once(')')?.0))
        .collect();
    let mut carried_out = PAGES.to_vec();
    linked.sort_unstable();
    carried_out.sort_unstable();
    assert_eq!(linked, carried_out);
}
