//! Small mistakes in the files of the protocol between robots, listed by cargo-mutants, each of which a test must find.
//!
//! A build for one mistake takes ten seconds of a processor, and there are two thousand. So the test programs are built once,
//! with all mistakes, and an environment variable chooses one when they start. Mistakes in values that the compiler computes,
//! and those that do not compile next to the others, are left to cargo-mutants, which builds each. The quick tests try all of
//! them. What is left is tried on a machine with the code that only small chips have, and then by the tests that take long.

mod combined;
mod found;
mod mistake;
mod trial;

use super::Verdict;
use super::survivors::SURVIVORS;
use anyhow::{Result, ensure};
use bittybuzz_builds::copy::Copy;
use bittybuzz_builds::shell::{Invocation, is_installed, root, target};
use found::Found;
use fs_err as fs;
use mistake::Mistake;
use std::collections::BTreeMap;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Duration;

/// Files, and the tests that find mistakes in them.
struct Group {
    name: &'static str,
    files: &'static [&'static str],
    packages: &'static [&'static str],
    /// Test programs of these packages.
    programs: &'static [&'static str],
    /// The modules of them whose tests are about the protocol and quick.
    modules: &'static [&'static str],
}

/// All of them.
const GROUPS: [Group; 2] = [
    Group {
        name: "machine",
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
        files: &["vm-core/src/message/*.rs", "vm-core/src/network.rs", "vm-core/src/stamp.rs"],
        packages: &["bittybuzz-vm-core", "bittybuzz-comms", "bittybuzz-tests"],
        programs: &["vm-core", "comms", "tests"],
        modules: &[
            "fragmentation::",
            "long::",
            "message::",
            "message_content::",
            "message_properties::",
            "message_waiting::",
            "protocol::",
            "queue::",
            "stamp::",
            "wire_format::",
        ],
    },
];

/// Mistakes that are tried at the same time.
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
    "tests/soak/src/protocol",
    "tests/soak/src/survivors.rs",
];

/// Tests that are tried on a mistake.
struct Tests {
    /// Optimization level of the tests and of the machine in them.
    optimization: u8,
    /// True for the tests that take longer, false for the quick ones of a group.
    are_long: bool,
    /// True for a machine with the code that small chips have in place of that of computers.
    are_for_small_chips: bool,
    /// A mistake with which the tests take longer counts as found.
    patience: Duration,
}

/// The module whose tests take long.
const ENDURANCE: &str = "endurance::";

/// They take seconds without optimization, which would take long with all mistakes.
const QUICK: Tests = Tests {
    optimization: 0,
    are_long: false,
    are_for_small_chips: false,
    patience: Duration::from_secs(60),
};

/// The same on the code of small chips.
const SMALL: Tests = Tests { are_for_small_chips: true, ..QUICK };

/// They take ten seconds with optimization.
const LONG: Tests = Tests {
    optimization: 2,
    are_long: true,
    are_for_small_chips: false,
    patience: Duration::from_secs(120),
};

/// All, in the order in which they try mistakes.
const STAGES: [&Tests; 3] = [&QUICK, &SMALL, &LONG];

/// A text of a file, and another one of as many lines.
type Replacement = (&'static str, &'static str, &'static str);

/// Changes that give the machine the code of small chips: no registers of 64 bits, and a digest that is added up when it is
/// needed.
const SMALL_CHIP: [Replacement; 2] = [
    (
        "vm-core/src/number/wide.rs",
        r#"cfg!(any(target_pointer_width = "64", target_family = "wasm"))"#,
        "false",
    ),
    (
        "vm-core/src/machine/network/advertise.rs",
        "use crate::network::{HAS_MANY_PLACES, Places};",
        "use crate::network::Places; const HAS_MANY_PLACES: bool = false;",
    ),
];

/// A test of what small chips do not have: they leave out no entry that a neighbor has sent.
const NOT_SMALL: &str = "many_entries_are_advertised_in_bursts_and_not_by_all";

/// The evidence of a mistake that a test finds.
const BY_A_TEST: &str = "found by a test";
/// The evidence of a mistake with which the tests do not end.
const WITHOUT_END: &str = "found by tests that did not end";

/// Files of cargo-mutants with the names of mistakes, one in a line, that count as found, and how they were.
const FOUND: [(&str, &str); 3] =
    [("caught.txt", BY_A_TEST), ("timeout.txt", WITHOUT_END), ("unviable.txt", "not compiled")];

/// Mistakes that cargo-mutants tries before they are recorded.
const BATCH: usize = 16;

/// The names of all groups.
pub fn items() -> Vec<String> {
    GROUPS.iter().map(|group| group.name.to_owned()).collect()
}

/// Tries the mistakes of a group.
pub fn run(item: &str) -> Result<Verdict> {
    let Some(group) = GROUPS.iter().find(|group| group.name == item) else {
        return Ok(Verdict::Missing("no such item".to_owned()));
    };
    ensure!(
        is_installed("cargo-mutants"),
        "a program is missing; please run: cargo install cargo-mutants --locked"
    );
    let list = group.mistakes(&["--list", "--json"]).output(0)?;
    let all = mistake::list(&String::from_utf8_lossy(&list.stdout))?;
    let found = group.try_all(&all)?;
    let missed = missed(&all, &found)?;
    let mut evidence = BTreeMap::new();
    for mistake in &all {
        if let Some(how) = found.evidence(&mistake.name)? {
            *evidence.entry(how).or_insert(0) += 1;
        }
    }
    let mut unexplained = Vec::new();
    for mutant in &missed {
        match reason(mutant, &missed) {
            Some(reason) => println!("{mutant}: {reason}"),
            None => unexplained.push(mutant.as_str()),
        }
    }
    if !unexplained.is_empty() {
        return Ok(Verdict::Missing(format!("no test finds: {}", unexplained.join("; "))));
    }
    let found = evidence.iter().map(|(how, count)| format!("{count} {how}, "));
    Ok(Verdict::Shown(format!("{}{} explained", found.collect::<String>(), missed.len())))
}

/// Descriptions, without places, of the mistakes that no test has found.
fn missed(all: &[Mistake], found: &Found) -> Result<Vec<String>> {
    let mut missed = Vec::new();
    for mistake in all {
        if found.evidence(&mistake.name)?.is_none() {
            missed.push(without_place(&mistake.name));
        }
    }
    Ok(missed)
}

/// Those of the tried mistakes that the long tests have to find: neither found nor explained.
fn unexplained<'a>(
    tried: Vec<&'a Mistake>,
    all: &[Mistake],
    found: &Found,
) -> Result<Vec<&'a Mistake>> {
    let missed = missed(all, found)?;
    let mut left = Vec::new();
    for mistake in tried {
        let is_missed = found.evidence(&mistake.name)?.is_none();
        if is_missed && reason(&without_place(&mistake.name), &missed).is_none() {
            left.push(mistake);
        }
    }
    Ok(left)
}

impl Group {
    /// Tries the mistakes that were not found before.
    fn try_all(&self, all: &[Mistake]) -> Result<Found> {
        let mut found = Found::open(self.name)?;
        let (mut chosen, mut single) = (Vec::new(), Vec::new());
        for mistake in all {
            if found.evidence(&mistake.name)?.is_some() {
                continue;
            }
            let text = fs::read_to_string(root().join(&mistake.file))?;
            match mistake.find(&text) {
                Some(change) => chosen.push((&mistake.file, change.body.start, mistake)),
                None => single.push(mistake),
            }
        }
        // Those of a function follow each other.
        chosen.sort_by_key(|&(file, start, _)| (file, start));
        let mut chosen: Vec<&Mistake> = chosen.into_iter().map(|(_, _, one)| one).collect();
        for tests in STAGES {
            if chosen.is_empty() {
                break;
            }
            let programs = {
                let worker = Worker::new("combined")?;
                trial::build(self, tests, &worker, &mut chosen, &mut single)?
            };
            println!("{}: {} in one build, {} alone", self.name, chosen.len(), single.len());
            programs.ensure_unchanged_passes(self, tests)?;
            found = self.try_chosen(&programs, tests, &chosen, found)?;
            chosen = unexplained(chosen, all, &found)?;
        }
        for tests in STAGES {
            for batch in single.chunks(BATCH) {
                self.try_single(tests, batch, &mut found)?;
            }
            single = unexplained(single, all, &found)?;
        }
        Ok(found)
    }

    /// Runs the programs with each of these mistakes.
    fn try_chosen(
        &self,
        programs: &trial::Programs,
        tests: &Tests,
        mistakes: &[&Mistake],
        found: Found,
    ) -> Result<Found> {
        let next = AtomicUsize::new(0);
        let found = Mutex::new(found);
        let work = || -> Result<()> {
            loop {
                let at = next.fetch_add(1, Ordering::Relaxed);
                let Some(mistake) = mistakes.get(at) else { return Ok(()) };
                if let Some(how) = programs.find(self, tests, combined::FIRST + at)? {
                    found.lock().expect("no thread panics").keep(&mistake.name, how)?;
                }
            }
        };
        at_once(|_| work())?;
        Ok(found.into_inner().expect("no thread panics"))
    }

    /// Lets cargo-mutants try mistakes, each in a build of its own.
    fn try_single(&self, tests: &Tests, mistakes: &[&Mistake], found: &mut Found) -> Result<()> {
        let shares: Vec<&[&Mistake]> =
            mistakes.chunks(mistakes.len().div_ceil(WORKERS).max(1)).collect();
        let outcomes = at_once(|number| match shares.get(number) {
            Some(share) => self.try_share(tests, &Worker::new(&number.to_string())?, share),
            None => Ok(Vec::new()),
        })?;
        for (name, how) in outcomes.into_iter().flatten() {
            found.keep(&name, how)?;
        }
        Ok(())
    }

    /// Returns the names of those that are found, and how they are.
    fn try_share(
        &self,
        tests: &Tests,
        worker: &Worker,
        mistakes: &[&Mistake],
    ) -> Result<Vec<(String, &'static str)>> {
        if tests.are_for_small_chips {
            for (file, _, _) in SMALL_CHIP {
                worker.copy.put(file, tests.source(file)?.as_bytes())?;
            }
        }
        let output = worker.folder.join("outcomes");
        fs::create_dir_all(&output)?;
        // 2: a mistake was missed; 3: a test did not end.
        let is_done = |output: &Output| matches!(output.status.code(), Some(0 | 2 | 3));
        let patterns: Vec<String> = mistakes.iter().map(|one| pattern(&one.name)).collect();
        worker.command(self.mutants(tests, &output, &patterns)).output_if(is_done)?;
        let mut found = Vec::new();
        for (file, how) in FOUND {
            let names = fs::read_to_string(output.join("mutants.out").join(file))?;
            found.extend(names.lines().map(|name| (name.to_owned(), how)));
        }
        Ok(found)
    }

    /// Arguments of cargo, which builds the test programs.
    fn build_arguments(&self, tests: &Tests) -> Vec<String> {
        let packages = self.packages.iter().map(|name| format!("--package={name}"));
        let programs = self.programs.iter().map(|name| format!("--test={name}"));
        let options = ["test", "--lib", "--no-run", "--message-format=json"].map(str::to_owned);
        options
            .into_iter()
            .chain(packages)
            .chain(programs)
            .chain(configuration(tests.optimization))
            .collect()
    }

    /// Arguments of the test programs.
    fn choice(&self, tests: &Tests) -> Vec<&'static str> {
        if tests.are_long {
            return vec![ENDURANCE];
        }
        let mut choice = [self.modules, &["--skip", ENDURANCE]].concat();
        if tests.are_for_small_chips {
            choice.extend(["--skip", NOT_SMALL]);
        }
        choice
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
        let arguments = programs.chain(configuration(tests.optimization));
        let arguments: Vec<String> =
            arguments.map(|argument| format!("--cargo-arg={argument}")).collect();
        let patience = tests.patience.as_secs().to_string();
        let mut all = vec!["--in-place", "--baseline", "skip", "--timeout", &patience];
        all.extend(["--output", &output, "--test-package", &packages, "--cargo-arg=--lib"]);
        all.extend(arguments.iter().map(String::as_str));
        all.extend(patterns.iter().flat_map(|pattern| ["--re", pattern.as_str()]));
        all.extend(["--", "--"]);
        all.extend(self.choice(tests));
        self.mistakes(&all)
    }
}

impl Tests {
    /// The text of a file of the machine that they test.
    fn source(&self, file: &str) -> Result<String> {
        let mut text = fs::read_to_string(root().join(file))?;
        for (_, from, to) in SMALL_CHIP.iter().filter(|(of, ..)| *of == file) {
            if self.are_for_small_chips {
                ensure!(text.contains(from), "{file} has no {from} any more");
                text = text.replacen(from, to, 1);
            }
        }
        Ok(text)
    }
}

/// Arguments for cargo with the optimization level of the tests and of the machine in them.
fn configuration(optimization: u8) -> impl Iterator<Item = String> {
    ["tests", "vm-core"].into_iter().map(move |name| {
        format!("--config=profile.dev.package.bittybuzz-{name}.opt-level={optimization}")
    })
}

/// Runs a chore in each of the workers, which it gets the number of.
fn at_once<T: Send>(chore: impl Fn(usize) -> Result<T> + Sync) -> Result<Vec<T>> {
    thread::scope(|scope| {
        let chore = &chore;
        let workers: Vec<_> =
            (0..WORKERS).map(|worker| scope.spawn(move || chore(worker))).collect();
        let join = |worker: thread::ScopedJoinHandle<'_, Result<T>>| {
            worker.join().unwrap_or_else(|panic| resume_unwind(panic))
        };
        workers.into_iter().map(join).collect()
    })
}

/// A copy of the repository, and its build.
struct Worker {
    folder: PathBuf,
    copy: Copy,
}

impl Worker {
    /// Brings its copy up to date; a run that was stopped has left a mistake there.
    fn new(name: &str) -> Result<Worker> {
        let folder = target()?.join("soak/protocol").join(name);
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
    fn the_sources_have_code_for_small_chips() {
        for (file, from, to) in SMALL_CHIP {
            assert!(SMALL.source(file).expect("a file of the machine").contains(to), "{file}");
            assert!(QUICK.source(file).expect("a file of the machine").contains(from), "{file}");
        }
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
