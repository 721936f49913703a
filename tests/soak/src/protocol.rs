//! Small mistakes in the files of the protocol between robots, made by cargo-mutants, each of which a test must find.
//!
//! They are made in copies of the sources, one after the other in the same target folder: a build compiles only code that
//! depends on the changed function. The quick tests find most of them, built without optimization, since the build takes
//! longest; the tests that take long try those that are left. A mistake that was found counts as found until its file or
//! a test changes.

use super::survivors::SURVIVORS;
use super::{Record, Verdict};
use crate::sources::Sources;
use anyhow::{Result, ensure};
use bittybuzz_builds::copy::Copy;
use bittybuzz_builds::shell::{Invocation, is_installed, target};
use fs_err as fs;
use std::collections::BTreeMap;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::thread;

/// Files, and the tests that find mistakes in them.
struct Group {
    name: &'static str,
    /// Items of evidence. Each is a shard for each worker, of some 15 mistakes.
    items: usize,
    files: &'static [&'static str],
    packages: &'static [&'static str],
    /// Test programs of these packages.
    programs: &'static [&'static str],
    /// The modules of them whose tests are quick.
    modules: &'static [&'static str],
}

/// All of them.
const GROUPS: [Group; 2] = [
    Group {
        name: "machine",
        items: 32,
        files: &[
            "vm-core/src/machine/network/advertise.rs",
            "vm-core/src/machine/network/conflicts.rs",
            "vm-core/src/machine/network/entries.rs",
            "vm-core/src/machine/network/index.rs",
            "vm-core/src/machine/network/merging.rs",
            "vm-core/src/machine/network/messages.rs",
            "vm-core/src/machine/network/mod.rs",
            "vm-core/src/machine/network/neighbors.rs",
            "vm-core/src/machine/network/protocol.rs",
            "vm-core/src/machine/network/serial.rs",
            "vm-core/src/machine/network/stigmergy.rs",
            "vm-core/src/machine/network/swarms.rs",
        ],
        packages: &["bittybuzz-tests"],
        programs: &["tests"],
        modules: &["protocol::"],
    },
    Group {
        name: "messages",
        items: 18,
        files: &["vm-core/src/message/*.rs", "vm-core/src/network.rs", "vm-core/src/stamp.rs"],
        packages: &["bittybuzz-vm-core", "bittybuzz-comms", "bittybuzz-tests"],
        programs: &["vm-core", "comms", "tests"],
        modules: &[
            "fragmentation::",
            "long::",
            "message::",
            "message_content::",
            "message_properties::",
            "protocol::",
            "queue::",
            "stamp::",
            "wire_format::",
        ],
    },
];

/// Shards that are tried at the same time, each in a copy of its own.
const WORKERS: usize = 2;

/// Path prefixes of the tests.
const TESTS: &[&str] =
    &["comms/tests/", "tests/src/", "tests/testkit/", "tests/tests/protocol/", "vm-core/tests/"];

/// Path prefixes of the files with mistakes, of the tests, and of the list of explained mistakes. The rest of the machine and
/// the compiler do not count: they are the same for the test that finds a mistake and for the one that passes without it.
pub const MADE_OF: &[&str] = &[
    "comms/tests/",
    "tests/src/",
    "tests/testkit/",
    "tests/tests/protocol/",
    "vm-core/src/machine/network/",
    "vm-core/src/message/",
    "vm-core/src/network.rs",
    "vm-core/src/stamp.rs",
    "vm-core/tests/",
    "tests/soak/src/protocol.rs",
    "tests/soak/src/survivors.rs",
];

/// Tests that are tried on a mistake.
struct Tests {
    /// Optimization level of the tests and of the machine in them.
    optimization: u8,
    /// True for the tests of [`ENDURANCE`], false for all others of a group.
    are_long: bool,
    /// Seconds after which a mistake counts as found, since the tests do not end.
    patience: &'static str,
}

/// The module whose tests take long.
const ENDURANCE: &str = "endurance::";

/// They take a second.
const QUICK: Tests = Tests { optimization: 0, are_long: false, patience: "60" };

/// They take ten.
const LONG: Tests = Tests { optimization: 2, are_long: true, patience: "120" };

/// The sources as they are: the tests must pass with them, or they would find anything.
const UNCHANGED: &str = "unchanged";

/// Items of all groups.
pub fn items() -> Vec<String> {
    let items = |group: &'static Group| {
        let items = (0..group.items).map(|item| format!("{item}/{}", group.items));
        let all = [UNCHANGED.to_owned()].into_iter().chain(items);
        all.map(|item| format!("{} {item}", group.name))
    };
    GROUPS.iter().flat_map(items).collect()
}

/// Tries the mistakes of one item.
pub fn run(item: &str) -> Result<Verdict> {
    let found = item.split_once(' ').and_then(|(name, number)| {
        GROUPS.iter().find(|group| group.name == name).map(|group| (group, number))
    });
    let Some((group, number)) = found else {
        return Ok(Verdict::Missing("no such item".to_owned()));
    };
    ensure!(
        is_installed("cargo-mutants"),
        "a program is missing; please run: cargo install cargo-mutants --locked"
    );
    if number == UNCHANGED {
        for tests in [&QUICK, &LONG] {
            Worker::new(0)?.command(group.tests(tests)).run()?;
        }
        return Ok(Verdict::Shown("all tests pass".to_owned()));
    }
    let Some(first) = number.split_once('/').and_then(|(item, _)| item.parse::<usize>().ok())
    else {
        return Ok(Verdict::Missing("no such item".to_owned()));
    };
    let shard = |worker| {
        let shard = format!("{}/{}", worker * group.items + first, WORKERS * group.items);
        group.shard(&shard, &Worker::new(worker)?)
    };
    let outcomes = thread::scope(|scope| {
        let workers: Vec<_> =
            (0..WORKERS).map(|worker| scope.spawn(move || shard(worker))).collect();
        let outcomes = workers
            .into_iter()
            .map(|worker| worker.join().unwrap_or_else(|panic| resume_unwind(panic)));
        outcomes.collect::<Result<Vec<Outcome>>>()
    })?;
    let mut all = Outcome::default();
    outcomes.into_iter().for_each(|outcome| all.add(outcome));
    let mut unexplained = Vec::new();
    for mutant in &all.missed {
        match reason(mutant, &all.missed) {
            Some(reason) => println!("{mutant}: {reason}"),
            None => unexplained.push(mutant.as_str()),
        }
    }
    if !unexplained.is_empty() {
        return Ok(Verdict::Missing(format!("no test finds: {}", unexplained.join("; "))));
    }
    let found = all.found.iter().map(|(evidence, count)| format!("{count} {evidence}, "));
    Ok(Verdict::Shown(format!("{}{} explained", found.collect::<String>(), all.missed.len())))
}

/// The results for some mistakes.
#[derive(Default)]
struct Outcome {
    /// The number of mistakes found in each way.
    found: BTreeMap<String, usize>,
    /// Descriptions of the others, without places.
    missed: Vec<String>,
}

impl Outcome {
    fn add(&mut self, other: Outcome) {
        for (evidence, count) in other.found {
            *self.found.entry(evidence).or_default() += count;
        }
        self.missed.extend(other.missed);
    }
}

/// Files of cargo-mutants with the names of mistakes, one in a line, that count as found, and how they were.
const FOUND: [(&str, &str); 3] = [
    ("caught.txt", "found by a test"),
    ("timeout.txt", "found by tests that did not end"),
    ("unviable.txt", "not compiled"),
];

/// Mistakes that were found, with the fingerprints of their files. A mistake moves to another shard when a file before its own
/// changes, so that the records of all shards count.
struct Found {
    sources: Sources,
    known: BTreeMap<String, String>,
    record: Record,
}

impl Found {
    fn open(shard: &str) -> Result<Found> {
        let sources = Sources::list()?;
        let tests = sources.under(TESTS).fingerprint()?;
        let mut known = BTreeMap::new();
        let of_shard = |shard: &str| Record::open(&format!("protocol/found/{shard}"), tests);
        let folder = target()?.join("soak/protocol/found");
        fs::create_dir_all(&folder)?;
        for entry in fs::read_dir(folder)? {
            known.extend(of_shard(&entry?.file_name().to_string_lossy())?.shown);
        }
        Ok(Found { record: of_shard(shard)?, sources, known })
    }

    /// The key of a mistake as its file is today.
    fn key(&self, name: &str) -> Result<String> {
        let file = name.split(':').next().unwrap_or_default();
        Ok(format!("{:016x} {name}", self.sources.under(&[file]).fingerprint()?))
    }

    fn evidence(&self, name: &str) -> Result<Option<&str>> {
        Ok(self.known.get(&self.key(name)?).map(String::as_str))
    }

    fn keep(&mut self, name: &str, evidence: &str) -> Result<()> {
        let key = self.key(name)?;
        self.known.insert(key.clone(), evidence.to_owned());
        self.record.keep(&key, evidence)
    }
}

impl Group {
    /// The tests alone.
    fn tests(&self, tests: &Tests) -> Invocation {
        let packages = self.packages.iter().map(|name| format!("--package={name}"));
        let programs = self.programs.iter().map(|name| format!("--test={name}"));
        let arguments: Vec<String> =
            packages.chain(programs).chain(tests.configuration()).collect();
        let mut all = vec!["test", "--lib"];
        all.extend(arguments.iter().map(String::as_str));
        all.push("--");
        all.extend(self.choice(tests));
        Invocation::cargo(&all)
    }

    /// Arguments of the test programs.
    fn choice(&self, tests: &Tests) -> Vec<&'static str> {
        if tests.are_long {
            return vec![ENDURANCE];
        }
        [self.modules, &["--skip", ENDURANCE]].concat()
    }

    /// Tries the mistakes of a shard that were not found before: the quick tests on all of them, then the long ones on
    /// those that are left.
    fn shard(&self, shard: &str, worker: &Worker) -> Result<Outcome> {
        let name = format!("{}-{}", self.name, shard.replace('/', "-"));
        let output = worker.folder.join("outcomes").join(&name);
        fs::create_dir_all(&output)?;
        let chosen = ["--list", "--no-shuffle", "--sharding", "round-robin", "--shard", shard];
        let list = worker.command(self.mistakes(&chosen)).output(0)?;
        let list = String::from_utf8_lossy(&list.stdout).into_owned();
        let mut found = Found::open(&name)?;
        let remaining = |found: &Found| -> Result<Vec<String>> {
            let mut remaining = Vec::new();
            for name in list.lines() {
                if found.evidence(name)?.is_none() {
                    remaining.push(pattern(name));
                }
            }
            Ok(remaining)
        };
        // 2: a mistake was missed; 3: a test did not end.
        let is_done = |output: &Output| matches!(output.status.code(), Some(0 | 2 | 3));
        for tests in [&QUICK, &LONG] {
            let remaining = remaining(&found)?;
            if remaining.is_empty() {
                break;
            }
            worker.command(self.mutants(tests, &output, &remaining)).output_if(is_done)?;
            for (file, evidence) in FOUND {
                let names = fs::read_to_string(output.join("mutants.out").join(file))?;
                for name in names.lines() {
                    found.keep(name, evidence)?;
                }
            }
        }
        let mut outcome = Outcome::default();
        for name in list.lines() {
            match found.evidence(name)? {
                Some(evidence) => *outcome.found.entry(evidence.to_owned()).or_default() += 1,
                None => outcome.missed.push(without_place(name)),
            }
        }
        Ok(outcome)
    }

    /// cargo-mutants, for mistakes in the files.
    fn mistakes(&self, options: &[&str]) -> Invocation {
        let files = self.files.iter().flat_map(|file| ["--file", file]);
        let all: Vec<&str> = ["mutants"].into_iter().chain(files).chain(options.to_vec()).collect();
        Invocation::new("cargo", &all)
    }

    /// cargo-mutants, for tests of the mistakes whose names have these patterns.
    fn mutants(&self, tests: &Tests, output: &Path, patterns: &[String]) -> Invocation {
        let output = output.display().to_string();
        let packages = self.packages.join(",");
        // Cargo's arguments after `--` would hold for the tests, but not for the build before them.
        let programs = self.programs.iter().map(|name| format!("--test={name}"));
        let arguments = programs.chain(tests.configuration());
        let arguments: Vec<String> =
            arguments.map(|argument| format!("--cargo-arg={argument}")).collect();
        let mut all = vec!["--in-place", "--baseline", "skip", "--timeout", tests.patience];
        all.extend(["--output", &output, "--test-package", &packages, "--cargo-arg=--lib"]);
        all.extend(arguments.iter().map(String::as_str));
        all.extend(patterns.iter().flat_map(|pattern| ["--re", pattern.as_str()]));
        all.extend(["--", "--"]);
        all.extend(self.choice(tests));
        self.mistakes(&all)
    }
}

impl Tests {
    /// Arguments for cargo.
    fn configuration(&self) -> impl Iterator<Item = String> {
        let optimization = self.optimization;
        ["tests", "vm-core"].into_iter().map(move |name| {
            format!("--config=profile.dev.package.bittybuzz-{name}.opt-level={optimization}")
        })
    }
}

/// A copy of the repository, for one mistake at a time, and its build.
struct Worker {
    folder: PathBuf,
    copy: Copy,
}

impl Worker {
    /// Brings its copy up to date; a run that was stopped has left a mistake there.
    fn new(number: usize) -> Result<Worker> {
        let folder = target()?.join(format!("soak/protocol/{number}"));
        Ok(Worker { copy: Copy::new(&folder)?, folder })
    }

    /// The command in its copy, where builds are quick.
    fn command(&self, line: Invocation) -> Invocation {
        line.env("CARGO_TARGET_DIR", &self.folder.join("target").display().to_string())
            .env("CARGO_INCREMENTAL", "1")
            .env("CARGO_PROFILE_DEV_DEBUG", "0")
            .env("PROPTEST_RNG_SEED", "1")
            .in_workspace(&self.copy.root().display().to_string())
    }
}

/// A regular expression for the name of one mistake.
fn pattern(name: &str) -> String {
    let escaped = name.chars().flat_map(|letter| {
        let special = r"\.+*?()|[]{}^$".contains(letter);
        special.then_some('\\').into_iter().chain([letter])
    });
    format!("^{}$", escaped.collect::<String>())
}

/// A mistake without its line and column, which other changes move.
fn without_place(mutant: &str) -> String {
    let mut parts = mutant.splitn(4, ':');
    match (parts.next(), parts.nth(2)) {
        (Some(file), Some(rest)) => format!("{file}:{rest}"),
        _ => mutant.to_owned(),
    }
}

/// The reason why no test has to find a mistake; `None` if there is none, or if more mistakes of that description were missed
/// than the reason is for.
fn reason(mutant: &str, missed: &[String]) -> Option<&'static str> {
    let is_for_a_part = |guard: &str, value: &str| {
        mutant.contains(&format!("match guard {guard}Self::has(Part::"))
            && mutant.contains(&format!(") with {value} in "))
    };
    if is_for_a_part("", "true") || is_for_a_part("!", "false") {
        return Some("the machine of these tests has every part");
    }
    let known = SURVIVORS.iter().find(|known| known.mutant == mutant)?;
    let count = missed.iter().filter(|other| *other == mutant).count();
    (count <= known.count).then_some(known.reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_are_for_one_name() {
        let name = "a.rs:1:2: replace + with * in Vm<P>::f -> Option<[u8; 2]>";
        let expected = r"^a\.rs:1:2: replace \+ with \* in Vm<P>::f -> Option<\[u8; 2\]>$";
        assert_eq!(pattern(name), expected);
    }

    #[test]
    fn lines_do_not_matter() {
        let mutant = "vm-core/src/stamp.rs:43:5: replace next -> u32 with 0";
        assert_eq!(without_place(mutant), "vm-core/src/stamp.rs: replace next -> u32 with 0");
    }

    #[test]
    fn parts_that_are_there_need_no_reason_of_their_own() {
        let guard = |change: &str| format!("a.rs: replace match guard {change} in Vm<P>::handle");
        for (change, is_explained) in [
            ("Self::has(Part::Messages) with true", true),
            ("!Self::has(Part::Messages) with false", true),
            ("Self::has(Part::Messages) with false", false),
            ("!a.is(Tag::SNAPSHOT) with false", false),
        ] {
            assert_eq!(reason(&guard(change), &[]).is_some(), is_explained, "{change}");
        }
    }

    #[test]
    fn a_reason_is_for_as_many_mistakes_as_it_says() {
        let known = &SURVIVORS[0];
        let mut missed = vec![known.mutant.to_owned(); known.count];
        assert_eq!(reason(known.mutant, &missed), Some(known.reason));
        missed.push(known.mutant.to_owned());
        assert_eq!(reason(known.mutant, &missed), None);
        assert_eq!(reason("vm-core/src/stamp.rs: replace next -> u32 with 0", &missed), None);
    }

    #[test]
    fn every_reason_is_for_a_file_of_a_group() {
        for known in SURVIVORS {
            let (file, _) = known.mutant.split_once(": ").expect("a file and a mistake");
            let (folder, _) = file.rsplit_once('/').expect("a folder and a name");
            let all = format!("{folder}/*.rs");
            let is_in =
                |group: &Group| group.files.iter().any(|name| *name == file || *name == all);
            assert!(GROUPS.iter().any(is_in), "{file}");
        }
    }
}
