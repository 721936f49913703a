//! Runs test programs two at a time.
//!
//! Cargo runs one program after the other, so that the slowest test of each program keeps only one
//! processor busy. cargo-nextest would fill all processors, but a clean machine compiles it for
//! longer than it saves.

use crate::cargo_test::{BBZ, GUIDES, cargo_test};
use crate::shell::Invocation;
use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::cmp::Reverse;
use std::panic::resume_unwind;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, OnceLock, mpsc};
use std::thread;
use std::time::Instant;

/// Programs that run at the same time. Each has a thread per processor for its tests.
const PROGRAMS: usize = 2;

/// The packages whose programs run longest, the longest first. They start first, so that none of
/// them is the only one at the end.
const SLOWEST: [&str; 5] =
    ["bittybuzz-hil", "bittybuzz-tests", "bittybuzz-model", "bbz", "bittybuzz-arena"];

/// The package whose tests run the robots' images.
const IMAGED: &str = "bittybuzz-hil";

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
/// `packages` are the options of cargo that select packages, `chosen` the arguments for each test
/// program, and `settings` variables of their environment. `prepare` installs what programs and images
/// need; tests are compiled meanwhile. `images` builds the robots' images and returns the variables
/// that name them. An image keeps only one processor busy, so they are built while tests are compiled
/// and while programs run that need none.
pub fn run(
    packages: &[&str],
    chosen: &[&str],
    settings: &[(&'static str, &str)],
    prepare: impl FnOnce() -> Result<()> + Send,
    images: impl FnOnce() -> Result<Variables> + Send,
) -> Result<()> {
    thread::scope(|scope| {
        let (preparing, prepared) = mpsc::channel::<()>();
        let images = scope.spawn(move || {
            let result = prepare();
            drop(preparing);
            result.and_then(|()| images())
        });
        let messages = cargo_test(&[packages, &COMPILE].concat()).shown_errors()?;
        let Built { programs, bbz, has_documented_library } = read_messages(&messages)?;
        let settings = settings.iter().map(|(name, value)| (*name, (*value).to_owned()));
        let runner = Runner {
            chosen,
            settings: settings.chain(bbz.map(|path| (BBZ, path))).collect(),
            images: OnceLock::new(),
            run: Mutex::new(Run::default()),
        };
        let count = programs.len();
        lock(&runner.run).waiting = in_order(programs);
        prepared.recv().expect_err("nothing is sent: the sender is dropped when all is prepared");
        runner.run_all(|| images.join().unwrap_or_else(|panic| resume_unwind(panic)))?;
        let run = lock(&runner.run);
        println!("{} in {count} test programs", run.counts.text());
        if !run.failed.is_empty() {
            bail!("these commands repeat the failed test programs:\n{}", run.failed.join("\n"));
        }
        if has_documented_library {
            let tests = cargo_test(&[packages, &["--doc", "--"], chosen].concat());
            runner.with_variables(tests).run()?;
        }
        Ok(())
    })
}

/// The environment of test programs, and their run.
struct Runner<'a> {
    /// The arguments of each program.
    chosen: &'a [&'a str],
    settings: Variables,
    /// The variables that name images, once these are built; `None` if they cannot be.
    images: OnceLock<Option<Variables>>,
    run: Mutex<Run>,
}

impl Runner<'_> {
    /// Runs all programs, [`PROGRAMS`] at a time, but one at a time until `images` returns.
    fn run_all(&self, images: impl FnOnce() -> Result<Variables>) -> Result<()> {
        thread::scope(|scope| {
            let mut threads = vec![scope.spawn(|| self.run_waiting())];
            let (images, error) = match images() {
                Ok(images) => (Some(images), None),
                Err(error) => (None, Some(error)),
            };
            self.images.set(images).expect("only this thread sets them");
            threads.extend((1..PROGRAMS).map(|_| scope.spawn(|| self.run_waiting())));
            let results =
                threads.into_iter().map(|thread| thread.join().expect("running a test panics"));
            results.chain(error.map(Err)).collect()
        })
    }

    /// Runs programs until none is left that can run.
    fn run_waiting(&self) -> Result<()> {
        loop {
            let has_images = matches!(self.images.get(), Some(Some(_)));
            let next = lock(&self.run).next(has_images);
            if let Some(program) = next {
                self.run_program(&program)?;
            } else if has_images || self.images.wait().is_none() {
                return Ok(());
            }
        }
    }

    fn run_program(&self, program: &TestProgram) -> Result<()> {
        let start = Instant::now();
        let line = Invocation::named(&program.command, &program.executable, self.chosen)
            .in_folder(&program.folder);
        let output = self.with_variables(line).unannounced().output_if(|_| true)?;
        let text = String::from_utf8_lossy(&output.stdout);
        let counts = Counts::read(&text);
        let seconds = start.elapsed().as_secs();
        let mut run = lock(&self.run);
        run.counts.add(counts);
        println!("$ {}: {} in {seconds} s", program.command, counts.text());
        if !output.status.success() {
            println!("{text}{}", String::from_utf8_lossy(&output.stderr));
            run.failed.push(format!("{} ({})", program.command, output.status));
        }
        Ok(())
    }

    fn with_variables(&self, line: Invocation) -> Invocation {
        let images = self.images.get().into_iter().flatten().flatten();
        let variables = self.settings.iter().chain(images);
        variables.fold(line, |line, (name, value)| line.env(name, value))
    }
}

impl Run {
    /// Takes the next program. Without images, takes the next one that needs none.
    fn next(&mut self, has_images: bool) -> Option<TestProgram> {
        let can_run = |program: &TestProgram| has_images || program.package != IMAGED;
        let at = self.waiting.iter().rposition(can_run)?;
        Some(self.waiting.remove(at))
    }
}

/// Returns the programs in the order in which they wait: the last one starts first.
fn in_order(mut programs: Vec<TestProgram>) -> Vec<TestProgram> {
    programs.sort_by_key(|program| {
        Reverse(SLOWEST.iter().position(|slow| *slow == program.package).unwrap_or(SLOWEST.len()))
    });
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
        };
        let programs = [("other", "o"), ("bittybuzz-hil", "h"), ("bbz", "b"), ("bbz", "c")];
        let programs = programs.map(|(package, command)| program(package, command));
        let order = in_order(programs.to_vec());
        let commands: Vec<_> = order.iter().map(|program| program.command.as_str()).collect();
        assert_eq!(commands, ["o", "b", "c", "h"]);

        // Until the images are there, others run.
        let mut run = Run { waiting: order, ..Run::default() };
        let mut next = |has_images| run.next(has_images).map(|program| program.command);
        assert_eq!(next(false).as_deref(), Some("c"));
        assert_eq!(next(true).as_deref(), Some("h"));
        assert_eq!(next(false).as_deref(), Some("b"));
        assert_eq!(next(true).as_deref(), Some("o"));
        assert_eq!(next(true), None);
    }

    #[test]
    fn results_of_several_runs_are_added() {
        let output = "running 3 tests\ntest result: FAILED. 2 passed; 1 failed; 0 ignored; 0 measured\n\
                      test result: ok. 7 passed; 0 failed; 4 ignored; 0 measured; 0 filtered out\n";
        assert_eq!(Counts::read(output), Counts { passed: 9, failed: 1, ignored: 4 });
    }
}
