//! Builds the firmware with a mistake in it, and sees a hardware-in-the-loop test fail.
//!
//! The mistakes are made in a copy of the sources. All are built one after the other in the same target folder, so that
//! what they depend on is compiled once.

use super::Verdict;
use super::sources::{self, Sources};
use super::table::{MUTANTS, Mutant};
use crate::board::CRAZYFLIE;
use crate::checks::{SKIP_SLOW, hardware_in_the_loop};
use crate::failure::Failure;
use crate::shell::{Line, target};
use std::path::{Path, PathBuf};

/// The image as it is: the tests must pass with it, or they would find anything.
const UNCHANGED: &str = "unchanged";

/// Names of all, in the order in which they are tried.
pub fn items() -> Vec<String> {
    let names = MUTANTS.iter().map(|mutant| mutant.name);
    [UNCHANGED].into_iter().chain(names).map(str::to_owned).collect()
}

/// Tries one.
pub fn run(name: &str) -> Result<Verdict, Failure> {
    let folder = target()?.join("soak/mutants");
    let copy = folder.join("sources");
    Sources::list()?.copy_to(&copy)?;
    let mutant = MUTANTS.iter().find(|mutant| mutant.name == name);
    if let Some(mutant) = mutant {
        println!("\n== {name}: {}", mutant.breaks);
        let file = copy.join(mutant.file);
        sources::write(&file, mutate(mutant, &sources::read_text(&file)?)?.as_bytes())?;
    } else {
        println!("\n== {UNCHANGED}");
    }
    let image = build(&copy, &folder.join("target"))?;
    let output = test(&image)?;
    let failed = failures(&output);
    match (mutant, failed.is_empty()) {
        (Some(_), true) => Ok(Verdict::Missing("no test finds it".to_owned())),
        (Some(_), false) => Ok(Verdict::Shown(format!("found by {}", failed.join(", ")))),
        (None, true) => Ok(Verdict::Shown("all tests pass".to_owned())),
        (None, false) => {
            print!("{output}");
            Err(Failure::Unchanged { failed })
        }
    }
}

/// The text with the mistake.
pub fn mutate(mutant: &Mutant, text: &str) -> Result<String, Failure> {
    match text.matches(mutant.find).count() {
        1 => Ok(text.replacen(mutant.find, mutant.put, 1)),
        count => Err(Failure::MutantText { mutant: mutant.name, file: mutant.file, count }),
    }
}

fn build(copy: &Path, target: &Path) -> Result<PathBuf, Failure> {
    let folder = copy.join(CRAZYFLIE.folder);
    Line::new("cargo", &["build", "--release"])
        .env("CARGO_TARGET_DIR", &target.display().to_string())
        .in_workspace(&folder.display().to_string())
        .run()?;
    Ok(CRAZYFLIE.image_in(target))
}

/// What the tests of this image print. Cargo stops after the first program of tests with a failure.
fn test(image: &Path) -> Result<String, Failure> {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    // A test that fails is a result. Tests that cannot be built are none.
    let output = hardware_in_the_loop(image, &SKIP_SLOW)?.output_if(|output| {
        output.status.success() || !failures(&text(&output.stdout)).is_empty()
    })?;
    Ok(text(&output.stdout))
}

/// The names in the lines `test NAME ... FAILED`.
fn failures(output: &str) -> Vec<String> {
    let names = output.lines().filter_map(|line| {
        line.strip_prefix("test ").and_then(|rest| rest.strip_suffix(" ... FAILED"))
    });
    names.map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const MUTANT: Mutant =
        Mutant { name: "m", file: "f", find: "DIV2", put: "DIV4", breaks: "nothing" };

    #[test]
    fn the_text_must_be_there_once() {
        assert_eq!(mutate(&MUTANT, "a DIV2 b").unwrap(), "a DIV4 b");
        for (text, times) in [("a DIV3 b", 0), ("DIV2 DIV2", 2)] {
            let failure = mutate(&MUTANT, text).unwrap_err();
            assert!(matches!(failure, Failure::MutantText { count, .. } if count == times));
        }
    }

    #[test]
    fn failed_tests_are_named() {
        let output = "test a ... ok\ntest b_on_unicorn ... FAILED\ntest result: FAILED. 1 passed";
        assert_eq!(failures(output), ["b_on_unicorn"]);
        assert!(failures("error: could not compile").is_empty());
    }
}
