//! Test programs with many mistakes in them, and their runs.

use super::combined::{self, Combined, FIRST, VARIABLE, combine};
use super::mistake::Mistake;
use super::{Group, SMALL_CHIP, Tests, Worker};
use anyhow::{Context, Result, bail, ensure};
use bittybuzz_builds::shell::Invocation;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;

/// The root of the crate whose functions get mistakes.
const CRATE: &str = "vm-core/src/lib.rs";

/// A test program, and the folder that it expects to run in.
struct Program {
    path: PathBuf,
    folder: PathBuf,
}

/// The test programs of a group.
pub struct Programs {
    programs: Vec<Program>,
}

/// A line of cargo's output for programs.
#[derive(Deserialize)]
struct Line {
    executable: Option<PathBuf>,
    manifest_path: Option<PathBuf>,
    message: Option<Message>,
}

#[derive(Deserialize)]
struct Message {
    level: String,
    rendered: Option<String>,
    spans: Vec<Span>,
}

#[derive(Deserialize)]
struct Span {
    file_name: String,
    byte_start: usize,
    is_primary: bool,
    expansion: Option<Box<Expansion>>,
}

#[derive(Deserialize)]
struct Expansion {
    span: Span,
}

/// Builds the tests with all mistakes, and moves those that do not compile next to the others to `single`.
pub fn build<'a>(
    group: &Group,
    tests: &Tests,
    worker: &Worker,
    mistakes: &mut Vec<&'a Mistake>,
    single: &mut Vec<&'a Mistake>,
) -> Result<Programs> {
    let original = |file: &str| tests.source(file);
    worker.copy.put(CRATE, (original(CRATE)? + &combined::module()).as_bytes())?;
    if tests.are_for_small_chips {
        for (file, _, _) in SMALL_CHIP {
            worker.copy.put(file, original(file)?.as_bytes())?;
        }
    }
    let changed: BTreeSet<&str> = mistakes.iter().map(|mistake| mistake.file.as_str()).collect();
    loop {
        let files = combine(mistakes, original)?;
        for file in &changed {
            // A file may have no mistake left.
            let text = match files.get(*file) {
                Some(combined) => combined.text.clone(),
                None => original(file)?,
            };
            worker.copy.put(file, text.as_bytes())?;
        }
        let arguments = group.build_arguments(tests);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let line = worker.command(Invocation::cargo(&arguments));
        let output = line.output_if(|output| matches!(output.status.code(), Some(0 | 101)))?;
        let text = String::from_utf8_lossy(&output.stdout);
        let lines = text.lines().filter_map(|line| serde_json::from_str::<Line>(line).ok());
        if output.status.success() {
            return Ok(Programs { programs: lines.filter_map(program).collect() });
        }
        let refused = refused(lines, &files)?;
        for &number in refused.iter().rev() {
            single.push(mistakes.remove(number - FIRST));
        }
    }
}

fn program(line: Line) -> Option<Program> {
    let folder = line.manifest_path?.parent()?.to_owned();
    Some(Program { path: line.executable?, folder })
}

/// Numbers of the mistakes that have errors. Fails if there is an error elsewhere.
fn refused(
    lines: impl Iterator<Item = Line>,
    files: &BTreeMap<String, Combined>,
) -> Result<BTreeSet<usize>> {
    let mut refused = BTreeSet::new();
    let mut others = Vec::new();
    for message in lines.filter_map(|line| line.message).filter(|one| one.level == "error") {
        match message.spans.iter().filter(|span| span.is_primary).find_map(|span| span.owner(files))
        {
            Some(number) => _ = refused.insert(number),
            None => others.extend(message.rendered),
        }
    }
    ensure!(!refused.is_empty(), "the sources with all mistakes are refused:\n{}", others.concat());
    Ok(refused)
}

impl Span {
    fn owner(&self, files: &BTreeMap<String, Combined>) -> Option<usize> {
        let own = files.get(&self.file_name).and_then(|file| file.owner(self.byte_start));
        own.or_else(|| self.expansion.as_ref()?.span.owner(files))
    }
}

impl Programs {
    /// Fails if a test fails without a mistake.
    pub fn ensure_unchanged_passes(&self, group: &Group, tests: &Tests) -> Result<()> {
        match self.find(group, tests, 0)? {
            None => Ok(()),
            Some(how) => bail!("without a mistake: {how}"),
        }
    }

    /// Runs the tests with a mistake. Returns how they find it, `None` if they do not.
    pub fn find(
        &self,
        group: &Group,
        tests: &Tests,
        number: usize,
    ) -> Result<Option<&'static str>> {
        for program in &self.programs {
            let found = program.find(&group.choice(tests), tests, number);
            if let Some(how) = found.with_context(|| program.path.display().to_string())? {
                return Ok(Some(how));
            }
        }
        Ok(None)
    }
}

impl Program {
    fn find(&self, choice: &[&str], tests: &Tests, number: usize) -> Result<Option<&'static str>> {
        let mut child = Command::new(&self.path)
            .args(choice)
            .arg("--test-threads=1")
            .current_dir(&self.folder)
            .env(VARIABLE, number.to_string())
            .env("PROPTEST_RNG_SEED", "1")
            .env("CARGO_MANIFEST_DIR", &self.folder)
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()?;
        let output = child.stdout.take().expect("the output is a pipe");
        let (failed, failure) = channel();
        thread::spawn(move || {
            let mut lines = BufReader::new(output).lines().map_while(Result::ok);
            if lines.any(|line| line.ends_with("... FAILED")) {
                // Nobody waits any longer for tests that did not end in time.
                _ = failed.send(());
            }
        });
        // Other tests need not run after the first one that fails.
        let found = match failure.recv_timeout(tests.patience) {
            Ok(()) => Some(super::BY_A_TEST),
            Err(RecvTimeoutError::Timeout) => Some(super::WITHOUT_END),
            Err(RecvTimeoutError::Disconnected) => None,
        };
        if found.is_some() {
            child.kill()?;
        }
        let status = child.wait()?;
        Ok(found.or((!status.success()).then_some(super::BY_A_TEST)))
    }
}
