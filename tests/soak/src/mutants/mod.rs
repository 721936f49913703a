//! Builds firmware or a model with a mistake in it, and sees a test fail.
//!
//! The mistakes are made in the copy of the repository that guides are carried out in, so that dependencies are compiled once.
//! Robots' images are run by the tests of `tests/hil`, models by their own.

mod crazyflie;
mod devices;
mod drivers;
mod kilobot;
mod models;
mod zooids;

use crate::Verdict;
use crate::sources;
use anyhow::{Result, bail};
use bittybuzz_builds::board::{BEHAVIORS, CRAZYFLIE, FirmwareBuild, KILOBOT, ZOOIDS};
use bittybuzz_builds::cargo_test::{SKIP_SLOW, cargo_test, image_tests};
use bittybuzz_builds::copy::Copy;
use bittybuzz_builds::shell::{Invocation, target};
use fs_err as fs;
use std::path::{Path, PathBuf};

/// One mistake.
pub struct Mutant {
    /// Its name on the command line and in the records.
    pub name: &'static str,
    /// Its file, as a path from the root.
    pub file: &'static str,
    /// The right text, which the file has once.
    pub find: &'static str,
    /// The wrong text.
    pub put: &'static str,
    /// The mistake, as somebody would notice it.
    pub breaks: &'static str,
}

/// Mistakes that the same tests must find.
struct Subject {
    name: &'static str,
    mutants: &'static [Mutant],
    tests: Tests,
    /// Those that CI tries, each with one test that finds it: to see that no other test does would
    /// take most of the time.
    sample: &'static [(&'static str, &'static str)],
}

/// The tests that must find mistakes.
enum Tests {
    /// The image of a board, under the name of this variable, is run by these modules of `tests/hil`.
    OfImage {
        board: &'static FirmwareBuild,
        variable: &'static str,
        /// Behaviors of `examples/kilobot` whose images it replaces; it is built with the parts of the machine that the first uses.
        behaviors: &'static [&'static str],
        modules: &'static [&'static str],
    },
    /// The tests of the packages that the mistakes are in, and of those built from them.
    OfPackages(&'static [&'static str]),
}

const SUBJECTS: &[Subject] = &[
    Subject {
        name: "crazyflie",
        mutants: crazyflie::MUTANTS,
        tests: Tests::OfImage {
            board: &CRAZYFLIE,
            variable: "BITTYBUZZ_CRAZYFLIE",
            behaviors: &[],
            modules: &[
                "link",
                "nrf51",
                "board",
                "failures",
                "resets",
                "brown_out",
                "battery",
                "script",
                "cable",
                "debugger",
                "replay",
                "slices",
            ],
        },
        sample: &[("motors-exchanged", "script::outputs_follow_the_script_on_unicorn")],
    },
    Subject {
        name: "zooids",
        mutants: zooids::MUTANTS,
        tests: Tests::OfImage {
            board: &ZOOIDS,
            variable: "BITTYBUZZ_ZOOIDS",
            behaviors: &[],
            modules: &[
                "debugger",
                "zooid_failures",
                "zooid_brown_out",
                "zooid_battery",
                "zooid_settings",
                "zooid_costs",
                "zooid_power",
                "zooids",
            ],
        },
        sample: &[("power-cut", "zooid_failures::a_failure_takes_the_motors_power_first")],
    },
    Subject {
        name: "kilobot",
        mutants: kilobot::MUTANTS,
        tests: Tests::OfImage {
            board: &KILOBOT,
            variable: "BITTYBUZZ_KILOBOT",
            // The first uses messages and distances, the other one messages.
            behaviors: &["gradient", "broadcast"],
            modules: &[
                "kilobots",
                "kilobot_board",
                "kilobot_light",
                "kilobot_faults",
                "kilobot_brown_out",
                "kilobot_load",
            ],
        },
        sample: &[("motors-exchanged", "kilobot_board::motors_get_pulses_of_kilolibs_frequency")],
    },
    Subject {
        name: "models",
        mutants: models::MUTANTS,
        tests: Tests::OfPackages(&[
            "bittybuzz-chips",
            "bittybuzz-crazyflie-board",
            "bittybuzz-kilobot-board",
            "bittybuzz-zooids-board",
        ]),
        sample: &[("edges-exchanged", "stm32::exti::tests::edges_raise_the_chosen_interrupt")],
    },
    Subject {
        name: "drivers",
        mutants: drivers::MUTANTS,
        tests: Tests::OfPackages(&[
            "bittybuzz-bmi088",
            "bittybuzz-bmp3xx",
            "bittybuzz-pmw3901",
            "bittybuzz-vl53l1x",
        ]),
        sample: &[],
    },
    Subject {
        name: "devices",
        mutants: devices::MUTANTS,
        tests: Tests::OfPackages(&["bittybuzz-chips"]),
        sample: &[],
    },
];

/// Nothing is changed: the tests must pass then, or they would find anything.
const UNCHANGED: &str = "unchanged";

/// Subjects and mistakes, in the order in which they are tried.
pub fn items() -> Vec<String> {
    let of_subject = |subject: &Subject| {
        let names = [UNCHANGED].into_iter().chain(subject.mutants.iter().map(|mutant| mutant.name));
        names.map(|name| format!("{} {name}", subject.name)).collect::<Vec<_>>()
    };
    SUBJECTS.iter().flat_map(of_subject).collect()
}

/// Those that CI tries, each with the test that finds it.
pub fn sample() -> Vec<(String, &'static str)> {
    let of_subject = |subject: &Subject| {
        let chosen = subject.sample.iter();
        chosen.map(|(name, test)| (format!("{} {name}", subject.name), *test)).collect::<Vec<_>>()
    };
    SUBJECTS.iter().flat_map(of_subject).collect()
}

/// Builds the sources with the mistake of that name, and runs all tests of its subject.
pub fn run(item: &str) -> Result<Verdict> {
    run_tests(item, None)
}

/// Like [`run`], with one test.
pub fn run_one(item: &str, test: &str) -> Result<Verdict> {
    run_tests(item, Some(test))
}

fn run_tests(item: &str, only: Option<&str>) -> Result<Verdict> {
    let chosen = item.split_once(' ').and_then(|(subject, name)| {
        let subject = SUBJECTS.iter().find(|known| known.name == subject)?;
        Some((subject, subject.mutants.iter().find(|mutant| mutant.name == name)))
    });
    let Some((subject, mutant)) = chosen else {
        return Ok(Verdict::Missing("there is no such mistake".to_owned()));
    };
    println!("\n== {item}: {}", mutant.map_or("nothing", |mutant| mutant.breaks));
    let folder = target()?.join("soak/mutants");
    let copy = copy_with(mutant)?;
    let output = subject.tests.run(&copy, &folder, only)?;
    let failed = failures(&output);
    match (mutant, failed.is_empty()) {
        (Some(_), true) => Ok(Verdict::Missing("no test finds it".to_owned())),
        (Some(_), false) => Ok(Verdict::Shown(format!("found by {}", failed.join(", ")))),
        (None, true) => Ok(Verdict::Shown("all tests pass".to_owned())),
        (None, false) => {
            print!("{output}");
            bail!("without any mutation these tests fail: {}", failed.join(", "))
        }
    }
}

/// The copy of the repository, with a mistake if there is one.
pub fn copy_with(mutant: Option<&Mutant>) -> Result<Copy> {
    let copy = Copy::new(&target()?.join("tmp"))?;
    if let Some(mutant) = mutant {
        let text = fs::read_to_string(copy.root().join(mutant.file))?;
        copy.put(mutant.file, mutate(mutant, &text)?.as_bytes())?;
    }
    Ok(copy)
}

/// The text with the mistake.
pub fn mutate(mutant: &Mutant, text: &str) -> Result<String> {
    match text.matches(mutant.find).count() {
        1 => Ok(text.replacen(mutant.find, mutant.put, 1)),
        count => bail!(
            "mutant {}: its text is in {} {count} times, not once; bring its table in tests/soak up to date",
            mutant.name,
            mutant.file
        ),
    }
}

impl Tests {
    /// Returns the output of the tests, or of one of them. Cargo stops after the first program of
    /// tests with a failure.
    fn run(&self, copy: &Copy, folder: &Path, only: Option<&str>) -> Result<String> {
        let line = match self {
            Tests::OfImage { board, variable, behaviors, modules } => {
                let target = folder.join(board.robot);
                let image = build(board, copy, &target, behaviors.first())?;
                let images = target.join("behaviors");
                // A filter matches any part of a name, so it would also choose the modules of other
                // robots, whose images are not built here.
                let others: &[&str] = match board.robot {
                    robot if robot == CRAZYFLIE.robot => {
                        &["--skip", "kilobot_", "--skip", "zooid_"]
                    }
                    _ => &[],
                };
                let modules: Vec<String> = modules.iter().map(|name| format!("{name}::")).collect();
                let modules: Vec<&str> = modules.iter().map(String::as_str).collect();
                let filters = match &only {
                    Some(test) => vec!["--exact", *test],
                    None => [&modules[..], &SKIP_SLOW, others].concat(),
                };
                let bytes = fs::read(&image)?;
                for name in *behaviors {
                    sources::write(&images.join(name).with_extension("elf"), &bytes)?;
                }
                image_tests(&filters)?
                    .env(variable, &image.display().to_string())
                    .env("BITTYBUZZ_BEHAVIORS", &images.display().to_string())
            }
            Tests::OfPackages(packages) => {
                let arguments = match only {
                    // The sample has unit tests of the first package.
                    Some(test) => vec!["--package", packages[0], "--lib", "--", "--exact", test],
                    None => packages.iter().flat_map(|package| ["--package", package]).collect(),
                };
                in_copy(cargo_test(&arguments), copy, "")
            }
        };
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        // A test that fails is a result. Tests that cannot be built are none.
        let output = line.output_if(|output| {
            output.status.success() || !failures(&text(&output.stdout)).is_empty()
        })?;
        Ok(text(&output.stdout))
    }
}

fn build(
    board: &FirmwareBuild,
    copy: &Copy,
    target: &Path,
    behavior: Option<&&str>,
) -> Result<PathBuf> {
    let mut line = Invocation::cargo(&["build", "--release"])
        .env("CARGO_TARGET_DIR", &target.display().to_string());
    if let Some(name) = behavior {
        let script = copy.root().join(BEHAVIORS).join(name).with_extension("bzz");
        line = line.env("BBZ_SCRIPT", &script.display().to_string());
    }
    in_copy(line, copy, board.folder).run()?;
    Ok(board.image_in(target))
}

/// Runs cargo in this folder of the copy.
pub fn in_copy(line: Invocation, copy: &Copy, folder: &str) -> Invocation {
    let variables = copy.variables();
    let line = variables.iter().fold(line, |line, (name, value)| line.env(name, value));
    line.in_workspace(&copy.root().join(folder).display().to_string())
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
    use bittybuzz_builds::shell::root;
    use std::collections::BTreeSet;

    #[test]
    fn every_mutant_can_be_made() {
        for mutant in SUBJECTS.iter().flat_map(|subject| subject.mutants) {
            let text = std::fs::read_to_string(root().join(mutant.file)).unwrap();
            let mutated = mutate(mutant, &text).unwrap_or_else(|failure| panic!("{failure}"));
            assert_ne!(mutated, text, "{}", mutant.name);
        }
    }

    #[test]
    fn names_are_unique_and_the_sample_exists() {
        let all = items();
        let names: BTreeSet<&String> = all.iter().collect();
        assert_eq!(names.len(), all.len());
        assert!(sample().iter().all(|(name, _)| names.contains(name)));
    }

    const MUTANT: Mutant =
        Mutant { name: "m", file: "f", find: "DIV2", put: "DIV4", breaks: "nothing" };

    #[test]
    fn the_text_must_be_there_once() {
        assert_eq!(mutate(&MUTANT, "a DIV2 b").unwrap(), "a DIV4 b");
        for (text, times) in [("a DIV3 b", 0), ("DIV2 DIV2", 2)] {
            let failure = mutate(&MUTANT, text).unwrap_err();
            let count = format!("is in f {times} times");
            assert!(failure.to_string().contains(&count), "{failure}");
        }
    }

    #[test]
    fn failed_tests_are_named() {
        let output = "test a ... ok\ntest b_on_unicorn ... FAILED\ntest result: FAILED. 1 passed";
        assert_eq!(failures(output), ["b_on_unicorn"]);
        assert!(failures("error: could not compile").is_empty());
    }
}
