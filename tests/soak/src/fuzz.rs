//! Runs the fuzz targets. The [`Executions`] of all runs are added up, until a file changes that the
//! target exercises. CI compiles the targets for their lints only: the tests of `tests/fuzz-bodies`
//! execute the same bodies with the committed inputs and changes of them.

use crate::Verdict;
use crate::executions::Executions;
use crate::sources::Sources;
use anyhow::Result;
use bittybuzz_builds::shell::{Invocation, target};
use fs_err as fs;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::thread;

/// The executions of a target that are enough.
const ENOUGH: u64 = 10_000_000;
/// Executions that are enough for targets that run whole machines.
const ENOUGH_RUNS: u64 = 1_000_000;
/// Targets whose executions are whole runs of machines.
const RUNS: [&str; 2] = ["social", "time"];
/// Seconds after which executions are written down; a run that is stopped loses at most those.
const CHUNK: &str = "-max_total_time=300";
/// libFuzzer's weights of inputs take half of the time of targets that are as fast as these.
const SCHEDULE: &str = "-entropic=0";
/// The folder of the crate with the targets, and of the inputs from which they start.
const FOLDER: &str = "fuzz";
/// The folder of the modules that the targets call.
const BODIES: &str = "tests/fuzz-bodies/src/";

/// The target whose inputs are images.
const IMAGE: &str = "image";

/// A fuzz target. What it does stands in `tests/fuzz-bodies/src/lib.rs`.
struct Target {
    name: &'static str,
    /// The modules of `tests/fuzz-bodies` that it consists of, besides `COMMON`.
    bodies: &'static [&'static str],
    /// Starts of the paths of the files that it exercises.
    exercises: &'static [&'static str],
}

/// The modules of `tests/fuzz-bodies` that every target has.
const COMMON: [&str; 2] = ["lib", "choices"];
const MACHINE: &[&str] = &["vm-core/src/"];
/// The compiler, and of the machine what it uses and what judges its images: not what runs them.
const COMPILER: &[&str] = &[
    "compiler/src/",
    "robots/*/robot.toml",
    "spec/files/",
    "spec/robot/",
    "spec/toml/",
    "vm-core/src/builtin.rs",
    "vm-core/src/image.rs",
    "vm-core/src/hash.rs",
    "vm-core/src/number/",
    "vm-core/src/opcode.rs",
    "vm-core/src/rom.rs",
    "vm-core/src/verify.rs",
];

const MESSAGES: &[&str] = &["vm-core/src/", "comms/src/queue.rs"];
const RECORDINGS: &[&str] = &["arena/src/output/"];
/// The reader of scenarios, and of the robots what it reads: no physics and no images.
const SCENARIOS: &[&str] = &[
    "arena/src/scenario/",
    "robots/*/model/src/",
    "robots/*/robot.toml",
    "robots/models/src/",
    "spec/",
    "tests/scenarios/",
];
const ROBOT_FILES: &[&str] = &["robots/*/robot.toml", "spec/robot/", "spec/toml/"];
const SYSLINK: &[&str] = &["comms/src/syslink/"];
const PAYLOADS: &[&str] = &["comms/src/nrf24.rs"];
const LIGHT: &[&str] = &["comms/src/infrared.rs", "robots/kilobot/link/src/"];

#[rustfmt::skip]
const TARGETS: &[Target] = &[
    Target { name: IMAGE, bodies: &["machine", "seeds"], exercises: MACHINE },
    Target { name: "image_mutated", bodies: &["machine", "mutation", "seeds"], exercises: MACHINE },
    Target { name: "program", bodies: &["machine", "program", "program/kind", "program/writer"], exercises: MACHINE },
    Target { name: "script", bodies: &["machine"], exercises: COMPILER },
    Target { name: "script_mutated", bodies: &["machine", "seeds", "words"], exercises: COMPILER },
    Target { name: "bo", bodies: &["machine"], exercises: COMPILER },
    Target { name: "bo_mutated", bodies: &["bo_mutation", "machine", "seeds"], exercises: COMPILER },
    Target { name: "message", bodies: &["messages"], exercises: MESSAGES },
    Target { name: "recording", bodies: &["files", "words"], exercises: RECORDINGS },
    Target { name: "scenario", bodies: &["files", "words"], exercises: SCENARIOS },
    Target { name: "robot_file", bodies: &["files", "words"], exercises: ROBOT_FILES },
    Target { name: "symbols", bodies: &["files", "seeds", "words"], exercises: COMPILER },
    Target { name: "syslink", bodies: &["links"], exercises: SYSLINK },
    Target { name: "nrf24", bodies: &["links"], exercises: PAYLOADS },
    Target { name: "ir", bodies: &["links"], exercises: LIGHT },
    Target { name: "social", bodies: &["messages", "mutation", "social"], exercises: MESSAGES },
    Target { name: "time", bodies: &["time"], exercises: MACHINE },
];

impl Target {
    /// Starts of the paths of all files that a count of executions is about.
    fn made_of(&self) -> Vec<String> {
        let bodies = COMMON.iter().chain(self.bodies);
        let bodies = bodies.map(|module| format!("{BODIES}{module}.rs"));
        let exercises = self.exercises.iter().map(|start| (*start).to_owned());
        let program = format!("{FOLDER}/fuzz_targets/{}.rs", self.name);
        bodies.chain(exercises).chain([program, format!("{FOLDER}/Cargo")]).collect()
    }

    fn fingerprint(&self, sources: &Sources) -> Result<u64> {
        let made_of = self.made_of();
        let starts: Vec<&str> = made_of.iter().map(String::as_str).collect();
        sources.under(&starts).fingerprint()
    }
}

/// Names of all targets.
pub fn items() -> Vec<String> {
    TARGETS.iter().map(|target| target.name.to_owned()).collect()
}

/// Runs a target until it has enough executions.
pub fn run(name: &str) -> Result<Verdict> {
    let Some(fuzzed) = TARGETS.iter().find(|target| target.name == name) else {
        return Ok(Verdict::Missing("there is no such target".to_owned()));
    };
    let enough = if RUNS.contains(&name) { ENOUGH_RUNS } else { ENOUGH };
    let fingerprint = fuzzed.fingerprint(&Sources::list()?)?;
    let mut executions = Executions::load()?;
    let left = |executions: &Executions| enough.saturating_sub(executions.of(name, fingerprint));
    if left(&executions) > 0 {
        let program = build(name)?;
        while left(&executions) > 0 {
            println!("{name}: {} of {enough} executions left", left(&executions));
            match chunk(name, &program, left(&executions))? {
                Chunk::Executed(more) => executions.add(name, fingerprint, more)?,
                Chunk::Panicked(input) => {
                    return Ok(Verdict::Missing(format!("a panic: {input}")));
                }
            }
        }
    }
    let count = executions.of(name, fingerprint);
    Ok(Verdict::Shown(format!("{count} executions without a panic")))
}

/// The folder of build outputs, which all targets share.
fn target_folder() -> Result<PathBuf> {
    Ok(target()?.join("soak/fuzz/target"))
}

/// Cargo in the workspace of the targets.
fn cargo(arguments: &[&str], target: &Path) -> Invocation {
    let target = target.display().to_string();
    Invocation::cargo(arguments).env("CARGO_TARGET_DIR", &target).in_workspace(FOLDER)
}

/// Builds a target, and returns its program. The configuration of the workspace has the options of the instrumentation.
fn build(name: &str) -> Result<PathBuf> {
    let folder = target_folder()?;
    cargo(&["build", "--release", "--features", "run", "--bin", name], &folder).run()?;
    let output = Invocation::new("rustc", &["--print", "host-tuple"]).unannounced().output(0)?;
    let host = String::from_utf8_lossy(&output.stdout).trim().to_owned();
    Ok(folder.join(host).join("release").join(name))
}

enum Chunk {
    Executed(u64),
    /// The message, and where the input is.
    Panicked(String),
}

/// Runs a target for a while on every processor, at most as often as is left; what one of them finds the others take over.
fn chunk(name: &str, program: &Path, remaining: u64) -> Result<Chunk> {
    let folder = target()?.join("soak/fuzz");
    let found = folder.join("corpus").join(name);
    fs::create_dir_all(&found)?;
    let panics = artifacts(&folder, name);
    let known = known(&folder, name, program)?;
    let (found, known) = (found.display().to_string(), known.display().to_string());
    let workers = thread::available_parallelism().map_or(1, usize::from);
    let share = format!("-runs={}", remaining.div_ceil(workers as u64));
    let arguments = [CHUNK, &share, SCHEDULE, &panics, &found, &known];
    let one = || Invocation::named(name, program, &arguments).output_if(|_| true);
    let outputs = thread::scope(|scope| {
        let workers: Vec<_> = (0..workers).map(|_| scope.spawn(one)).collect();
        workers
            .into_iter()
            .map(|worker| worker.join().unwrap_or_else(|panic| resume_unwind(panic)))
            .collect::<Vec<_>>()
    });
    let mut all = 0;
    for output in outputs {
        let output = output?;
        // It reports on standard error.
        let report = String::from_utf8_lossy(&output.stderr);
        match executions(&report) {
            Some(executions) if output.status.success() => all += executions,
            _ => return Ok(Chunk::Panicked(panicked(&report))),
        }
    }
    Ok(Chunk::Executed(all))
}

/// The option that names the folder for inputs that make a target panic.
fn artifacts(folder: &Path, name: &str) -> String {
    format!("-artifact_prefix={}/panic-{name}-", folder.display())
}

/// The inputs that a target starts from.
fn known(folder: &Path, name: &str, program: &Path) -> Result<PathBuf> {
    if name == IMAGE { known_images(folder, program) } else { Ok(known_inputs(name)) }
}

/// The committed inputs of a target.
fn known_inputs(name: &str) -> PathBuf {
    Path::new(FOLDER).join("corpus").join(name)
}

/// Images change with the instruction set: the target makes them, none is kept.
fn known_images(folder: &Path, program: &Path) -> Result<PathBuf> {
    let known = folder.join("images");
    fs::create_dir_all(&known)?;
    Invocation::named(IMAGE, program, &["-runs=0"])
        .env("BITTYBUZZ_IMAGES", &known.display().to_string())
        .output(0)?;
    Ok(known)
}

/// The number in `Done 170989 runs in 61 second(s)`.
fn executions(report: &str) -> Option<u64> {
    report.lines().find_map(|line| line.strip_prefix("Done ")?.split(' ').next()?.parse().ok())
}

/// The message, and the file that holds the input.
fn panicked(report: &str) -> String {
    let mut lines = report.lines();
    let message = lines.by_ref().skip_while(|line| !line.contains("panicked at")).take(2);
    let message: Vec<&str> = message.collect();
    let file = report.lines().find_map(|line| line.split_once("Test unit written to "));
    format!("{}; {}", message.join(" "), file.map_or("no input was kept", |(_, file)| file))
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_builds::shell::root;

    const REPORT: &str = "#20000\tDONE   cov: 990 ft: 2826\nDone 20000 runs in 3 second(s)\n";

    #[test]
    fn executions_are_read_from_the_report() {
        assert_eq!(executions(REPORT), Some(20000));
        assert_eq!(executions("#20000\tDONE   cov: 990"), None);
    }

    #[test]
    fn a_panic_is_reported_with_its_input() {
        let report = "INFO: x\n\nthread '<unnamed>' (1) panicked at a.rs:1:2:\nno such thing\nstack\n\
                      artifact_prefix='x'; Test unit written to f/panic-1\n";
        assert_eq!(
            panicked(report),
            "thread '<unnamed>' (1) panicked at a.rs:1:2: no such thing; f/panic-1"
        );
    }

    #[test]
    fn every_target_has_a_program_inputs_and_a_body() {
        let mut programs: Vec<String> = fs::read_dir(root().join(FOLDER).join("fuzz_targets"))
            .unwrap()
            .map(|file| file.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
            .collect();
        let mut items = items();
        programs.sort();
        items.sort();
        assert_eq!(programs, items);
        let kept = items.iter().filter(|name| *name != IMAGE);
        assert!(kept.into_iter().all(|name| root().join(known_inputs(name)).is_dir()));
    }

    #[test]
    fn exercised_folders_exist() {
        let files = Sources::list().unwrap();
        let nothing = files.under(&[]).fingerprint().unwrap();
        for start in TARGETS.iter().flat_map(Target::made_of) {
            assert_ne!(files.under(&[&start]).fingerprint().unwrap(), nothing, "{start}");
        }
    }

    /// A module that no target names could change what they do, and their executions would still count.
    #[test]
    fn every_module_belongs_to_a_target() {
        let named: Vec<String> = TARGETS.iter().flat_map(Target::made_of).collect();
        for folder in ["", "program/"] {
            let folder = format!("{BODIES}{folder}");
            for file in fs::read_dir(root().join(&folder)).unwrap() {
                let file = format!("{folder}{}", file.unwrap().file_name().display());
                assert!(named.contains(&file) || !file.ends_with(".rs"), "{file}");
            }
        }
    }
}
