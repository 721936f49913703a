//! Runs test programs two at a time.
//!
//! Cargo runs one program after the other, so that the slowest test of each program keeps only one
//! processor busy. cargo-nextest would fill all processors, but a clean machine compiles it for
//! longer than it saves.

use crate::cargo_test::{GUIDES, cargo_test};
use crate::shell::{Invocation, at_once};
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::cmp::Reverse;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};
use std::thread;
use std::time::Instant;

/// Programs that run at the same time. Each has a thread per processor for its tests.
const PROGRAMS: usize = 2;

/// The packages whose programs run longest, the longest first. They start first, so that none of
/// them is the only one at the end.
const SLOWEST: [&str; 5] =
    ["bittybuzz-hil", "bittybuzz-tests", "bittybuzz-model", "bbz", "bittybuzz-arena"];

/// A program with a test that takes half of the program's time (100 s). A program starts its tests in
/// the order of their names, in which this one comes late and would run alone at the end. So it runs
/// first, apart from the others.
const SPLIT: &str = "cargo test --package bittybuzz-hil --test hil";
const SLOWEST_TEST: &str = "script::a_step_without_end_is_reported_and_stops_the_motors_on_qemu";

/// Names and values of environment variables.
pub type Variables = Vec<(&'static str, String)>;

/// A compiled test program.
#[derive(Clone, Debug, PartialEq, Eq)]
struct TestProgram {
    /// The command that runs only this program.
    command: String,
    package: String,
    executable: PathBuf,
    /// The folder of the package, in which its tests run.
    folder: PathBuf,
    /// Arguments that select some of its tests.
    selection: &'static [&'static str],
}

impl TestProgram {
    /// Returns the same program, of which these arguments select some tests.
    fn with(&self, selection: &'static [&'static str]) -> TestProgram {
        let command = format!("{} -- {}", self.command, selection.join(" "));
        TestProgram { command, selection, ..self.clone() }
    }
}

/// The tests of one or more programs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Tests that passed.
    pub passed: u32,
    failed: u32,
    ignored: u32,
}

/// The programs that wait, and the results of those that ran.
#[derive(Default)]
struct Run {
    waiting: Vec<TestProgram>,
    counts: Counts,
    /// The commands that repeat the failed programs.
    failed: Vec<String>,
}

/// Arguments of cargo that compile tests and list the compiled programs.
const COMPILE: [&str; 3] = ["--no-run", "--message-format", "json-render-diagnostics"];

/// Compiles the tests of some packages as [`run`] does, which then has less to compile.
pub fn compile(packages: &[&str]) -> Result<()> {
    cargo_test(&[packages, &COMPILE].concat()).shown_errors().map(|_| ())
}

/// Compiles the tests of some packages, runs their programs and the examples of their
/// documentation, and prints the number of tests. A failed program does not stop the others.
///
/// `packages` are the options of cargo that select packages, and `chosen` the arguments for each
/// test program. `variables` returns the environment of the tests. It may build images: it runs
/// while the tests are compiled, because an image keeps only one processor busy.
pub fn run(
    packages: &[&str],
    chosen: &[&str],
    variables: impl FnOnce() -> Result<Variables> + Send,
) -> Result<()> {
    let build = || cargo_test(&[packages, &COMPILE].concat()).shown_errors();
    let (messages, variables) = at_once(build, variables)?;
    let Built { programs, bbz, has_documented_library } = read_messages(&messages)?;
    let bbz = bbz.map(|path| ("BITTYBUZZ_BBZ", path));
    let variables: Variables = variables.into_iter().chain(bbz).collect();
    let with_variables =
        |line: Invocation| variables.iter().fold(line, |line, (name, value)| line.env(name, value));
    let count = programs.len();
    let run = Mutex::new(Run { waiting: in_order(programs), ..Run::default() });
    let run_waiting = || -> Result<()> {
        loop {
            let next = lock(&run).waiting.pop();
            let Some(program) = next else { return Ok(()) };
            let start = Instant::now();
            let arguments = [chosen, program.selection].concat();
            let line = Invocation::named(&program.command, &program.executable, &arguments)
                .in_folder(&program.folder);
            let output = with_variables(line).unannounced().output_if(|_| true)?;
            let text = String::from_utf8_lossy(&output.stdout);
            let counts = Counts::read(&text);
            let seconds = start.elapsed().as_secs();
            let mut run = lock(&run);
            run.counts.add(counts);
            println!("$ {}: {} in {seconds} s", program.command, counts.text());
            if !output.status.success() {
                println!("{text}{}", String::from_utf8_lossy(&output.stderr));
                run.failed.push(format!("{} ({})", program.command, output.status));
            }
        }
    };
    thread::scope(|scope| {
        let threads: Vec<_> = (0..PROGRAMS).map(|_| scope.spawn(run_waiting)).collect();
        threads.into_iter().try_for_each(|thread| thread.join().expect("running a test panics"))
    })?;
    let Run { counts, failed, .. } = run.into_inner().expect("a thread that panics is reported");
    println!("{} in {count} test programs", counts.text());
    if !failed.is_empty() {
        bail!("these commands repeat the failed test programs:\n{}", failed.join("\n"));
    }
    if has_documented_library {
        with_variables(cargo_test(&[packages, &["--doc", "--"], chosen].concat())).run()?;
    }
    Ok(())
}

/// Returns the programs in the order in which they wait: the last one starts first.
fn in_order(mut programs: Vec<TestProgram>) -> Vec<TestProgram> {
    programs.sort_by_key(|program| {
        Reverse(SLOWEST.iter().position(|slow| *slow == program.package).unwrap_or(SLOWEST.len()))
    });
    if let Some(at) = programs.iter().position(|program| program.command == SPLIT) {
        let program = programs.remove(at);
        programs.push(program.with(&["--skip", SLOWEST_TEST]));
        programs.push(program.with(&[SLOWEST_TEST]));
    }
    programs
}

fn lock(run: &Mutex<Run>) -> MutexGuard<'_, Run> {
    run.lock().expect("no thread panics while it holds the lock")
}

/// The outputs of cargo's build of tests.
#[derive(Debug, Default)]
struct Built {
    programs: Vec<TestProgram>,
    /// The path of the program `bbz`, which tests of other packages run, too.
    bbz: Option<String>,
    /// True if there is a library whose documentation may have examples.
    has_documented_library: bool,
}

/// Reads cargo's messages about what it compiled.
fn read_messages(messages: &str) -> Result<Built> {
    let mut built = Built::default();
    for line in messages.lines() {
        let message: Value =
            serde_json::from_str(line).with_context(|| format!("cargo printed `{line}`"))?;
        if message["reason"] != "compiler-artifact" {
            continue;
        }
        let text = |value: &Value| value.as_str().map(str::to_owned);
        let target = &message["target"];
        let kind = text(&target["kind"][0]).context("a target has a kind")?;
        if message["profile"]["test"] != true {
            if kind == "bin" && target["name"] == "bbz" {
                built.bbz = text(&message["executable"]);
            }
            continue;
        }
        built.has_documented_library |= target["doctest"] == true;
        // Cargo lists the program of an example without tests, too, but does not run it.
        let (Some(executable), true) = (text(&message["executable"]), target["test"] == true)
        else {
            continue;
        };
        let manifest = PathBuf::from(text(&message["manifest_path"]).context("a manifest")?);
        let folder = manifest.parent().context("a manifest is in a folder")?.to_owned();
        let package = package(&text(&message["package_id"]).context("a package")?);
        if package == GUIDES && kind == "test" {
            continue;
        }
        let name = text(&target["name"]).context("a target has a name")?;
        let selection = match kind.as_str() {
            "test" | "bin" | "example" | "bench" => format!("--{kind} {name}"),
            _ => "--lib".to_owned(),
        };
        built.programs.push(TestProgram {
            command: format!("cargo test --package {package} {selection}"),
            package,
            executable: executable.into(),
            folder,
            selection: &[],
        });
    }
    Ok(built)
}

/// Returns the name in a package id such as `path+file:///folder/lib#bittybuzz-lib@0.1.0`. The
/// folder has the name if there is no `@`.
fn package(id: &str) -> String {
    let (source, fragment) = id.rsplit_once('#').unwrap_or((id, ""));
    match fragment.split_once('@') {
        Some((name, _)) => name.to_owned(),
        None => source.rsplit('/').next().unwrap_or(source).to_owned(),
    }
}

impl Counts {
    /// Reads the lines `test result: ok. 7 passed; 0 failed; 1 ignored; …` of a program.
    pub fn read(output: &str) -> Counts {
        let mut counts = Counts::default();
        for line in output.lines().filter(|line| line.starts_with("test result: ")) {
            let number = |name: &str| -> u32 {
                let field = line.split(['.', ';']).find_map(|part| part.trim().strip_suffix(name));
                field.and_then(|number| number.trim().parse().ok()).unwrap_or(0)
            };
            counts.add(Counts {
                passed: number("passed"),
                failed: number("failed"),
                ignored: number("ignored"),
            });
        }
        counts
    }

    fn add(&mut self, other: Counts) {
        self.passed += other.passed;
        self.failed += other.failed;
        self.ignored += other.ignored;
    }

    fn text(self) -> String {
        let Counts { passed, failed, ignored } = self;
        format!("{passed} tests passed, {failed} failed, {ignored} ignored")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_are_read_from_messages() {
        // As cargo 1.95 prints them, without fields that are not read.
        let messages = r##"
{"reason":"compiler-artifact","package_id":"path+file:///r/lib#bittybuzz-lib@0.1.0","manifest_path":"/r/lib/Cargo.toml","target":{"kind":["lib"],"name":"bittybuzz_lib","doctest":true,"test":true},"profile":{"test":false},"executable":null}
{"reason":"compiler-artifact","package_id":"path+file:///r/lib#bittybuzz-lib@0.1.0","manifest_path":"/r/lib/Cargo.toml","target":{"kind":["lib"],"name":"bittybuzz_lib","doctest":true,"test":true},"profile":{"test":true},"executable":"/t/lib-1"}
{"reason":"compiler-artifact","package_id":"path+file:///r/bbz#0.1.0","manifest_path":"/r/bbz/Cargo.toml","target":{"kind":["test"],"name":"bbz","doctest":false,"test":true},"profile":{"test":true},"executable":"/t/bbz-2"}
{"reason":"compiler-artifact","package_id":"path+file:///r/bbz#0.1.0","manifest_path":"/r/bbz/Cargo.toml","target":{"kind":["bin"],"name":"bbz","doctest":false,"test":true},"profile":{"test":false},"executable":"/t/bbz"}
{"reason":"compiler-artifact","package_id":"path+file:///r/guides#bittybuzz-guides@0.1.0","manifest_path":"/r/guides/Cargo.toml","target":{"kind":["test"],"name":"guides","doctest":false,"test":true},"profile":{"test":true},"executable":"/t/guides-3"}
{"reason":"build-finished","success":true}"##;
        let Built { programs, bbz, has_documented_library } =
            read_messages(messages.trim()).unwrap();
        assert_eq!(bbz.as_deref(), Some("/t/bbz"));
        let found: Vec<_> = programs
            .iter()
            .map(|program| (program.command.as_str(), program.folder.to_str().unwrap()))
            .collect();
        assert_eq!(
            found,
            [
                ("cargo test --package bittybuzz-lib --lib", "/r/lib"),
                ("cargo test --package bbz --test bbz", "/r/bbz")
            ]
        );
        assert!(has_documented_library);
        assert!(read_messages("warning: no message").is_err());
    }

    #[test]
    fn the_slowest_start_first() {
        let program = |package: &str, command: &str| TestProgram {
            command: command.to_owned(),
            package: package.to_owned(),
            executable: PathBuf::new(),
            folder: PathBuf::new(),
            selection: &[],
        };
        let programs = [("other", "o"), ("bittybuzz-hil", SPLIT), ("bbz", "b"), ("bbz", "c")];
        let programs = programs.map(|(package, command)| program(package, command));
        let order = in_order(programs.to_vec());
        let selections: Vec<_> = order.iter().rev().map(|program| program.selection).collect();
        assert_eq!(selections[..2], [&[SLOWEST_TEST][..], &["--skip", SLOWEST_TEST]]);
        let commands: Vec<_> = order.iter().map(|program| program.command.as_str()).collect();
        assert_eq!(commands[..3], ["o", "b", "c"]);
        assert_eq!(commands[4], format!("{SPLIT} -- {SLOWEST_TEST}"));
    }

    #[test]
    fn results_of_several_runs_are_added() {
        let output = "running 3 tests\ntest result: FAILED. 2 passed; 1 failed; 0 ignored; 0 measured\n\
                      test result: ok. 7 passed; 0 failed; 4 ignored; 0 measured; 0 filtered out\n";
        assert_eq!(Counts::read(output), Counts { passed: 9, failed: 1, ignored: 4 });
    }
}
