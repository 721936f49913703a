//! Each guide and recipe is carried out in a copy of the repository, command by command.
//!
//! The first run builds the dependencies of the copy, embassy among them; later runs build only the
//! changes of a guide. The variable `BITTYBUZZ_GUIDES` chooses the guides: `changed` skips those whose
//! files are as in the last recorded run, and a date `YYYY-MM-DD` carries out all and records them as
//! of that day. Without the variable all are carried out and nothing is recorded.

#![allow(clippy::unwrap_used, reason = "a failure here fails the test")]

use std::collections::BTreeSet;
use std::env;
use std::path::{Path, PathBuf};

use bittybuzz_builds::copy::Copy;
use bittybuzz_builds::shell::{Invocation, root};
use bittybuzz_guides::runs::{self, Run};
use bittybuzz_guides::{Guide, Runs};
use bittybuzz_hil::Core;

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

/// Pages whose reader has installed `bbz` before, as the README says. The other pages build it after
/// a change, or do not need it.
const NEED_BBZ: [&str; 1] = ["docs/start.md"];

fn carry_out(page: &str, cores: &[Core]) {
    let text = fs_err::read_to_string(root().join(page)).unwrap();
    let guide = Guide::read(page, &text).unwrap_or_else(|failure| panic!("{failure}"));
    let wanted = env::var("BITTYBUZZ_GUIDES").ok();
    let hash = runs::hash(&guide, &text).unwrap();
    if wanted.as_deref() == Some("changed")
        && let Some(run) = Runs::load().unwrap().with_hash(page, &hash)
    {
        println!(
            "{page}: its files are those of the run of {}, so it is not carried out",
            run.date
        );
        return;
    }
    let folders = cores.iter().filter_map(|core| Some(core.program().parent()?.to_owned()));
    let copy = Copy::new(Path::new(env!("CARGO_TARGET_TMPDIR"))).expect("git is there, and room");
    let programs: Vec<PathBuf> = folders.collect();
    if NEED_BBZ.contains(&page) {
        let build = Invocation::cargo(&["build", "--locked", "--quiet", "--package", "bbz"]);
        let variables = copy.variables();
        let build = variables.iter().fold(build, |build, (name, value)| build.env(name, value));
        build.in_workspace(&copy.root().display().to_string()).run().unwrap();
    }
    guide.carry_out(&copy, &programs).unwrap_or_else(|failure| panic!("{failure}"));
    if let Some(date) = wanted.filter(|wanted| wanted != "changed") {
        // The lock of the copy also keeps the other guides from writing the file now.
        let mut runs = Runs::load().unwrap();
        runs.record(page, Run { date, files: hash }).unwrap();
    }
}

/// CONTRIBUTING.md promises that each page in its table of recipes is carried out, and it lists all
/// of them. Each of them has a recorded run.
#[test]
fn every_recipe_is_carried_out() {
    let text = fs_err::read_to_string(root().join("CONTRIBUTING.md")).unwrap();
    let (_, section) = text.split_once("\n## Recipes\n").expect("there is a table of recipes");
    let table = section.lines().take_while(|line| !line.starts_with("## "));
    let rows = table.filter(|line| line.starts_with("| "));
    let linked: BTreeSet<&str> = rows
        .flat_map(|row| row.split("](").skip(1))
        .filter_map(|rest| Some(rest.split_once(')')?.0))
        .collect();
    assert_eq!(linked, PAGES.iter().copied().collect());
    let runs = Runs::load().unwrap();
    assert_eq!(linked, runs.pages().collect());
}
