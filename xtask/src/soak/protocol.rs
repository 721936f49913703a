//! Small mistakes in the files of the protocol between robots, made by cargo-mutants, each of which a test must find.
//!
//! They are made in a copy of the sources, one after the other in the same target folder: a build compiles only code that
//! depends on the changed function. Each group of files has its own tests, since they take most of the time.

use super::Verdict;
use super::sources::{self, Sources};
use super::survivors::SURVIVORS;
use crate::failure::Failure;
use crate::shell::{Line, is_installed, target};
use std::path::Path;
use std::process::Output;

/// Files, and the tests that find mistakes in them.
struct Group {
    name: &'static str,
    /// Parts, of some 15 mistakes each.
    shards: usize,
    files: &'static [&'static str],
    packages: &'static [&'static str],
    targets: &'static [&'static str],
}

/// All of them.
const GROUPS: [Group; 2] = [
    Group {
        name: "machine",
        shards: 64,
        files: &[
            "vm-core/src/machine/advertise.rs",
            "vm-core/src/machine/messages.rs",
            "vm-core/src/machine/neighbors.rs",
            "vm-core/src/machine/serial.rs",
            "vm-core/src/machine/stigmergy.rs",
            "vm-core/src/machine/swarms.rs",
        ],
        packages: &["bittybuzz-tests"],
        targets: &["containment", "forged", "hostile", "protocol", "stigmergy", "swarm"],
    },
    Group {
        name: "messages",
        shards: 36,
        files: &["vm-core/src/message/*.rs", "vm-core/src/network.rs", "vm-core/src/stamp.rs"],
        packages: &["bittybuzz-vm-core", "bittybuzz-comms", "bittybuzz-tests"],
        targets: &[
            "forged",
            "fragmentation",
            "hostile",
            "message_content",
            "message_properties",
            "protocol",
            "queue",
            "stigmergy",
            "swarm",
            "wire_format",
        ],
    },
];

/// Starts of the paths of what the tests are built from, and of what is known about mistakes.
pub const MADE_OF: &[&str] = &[
    "Cargo",
    "comms/",
    "compiler/",
    "examples/",
    "robots/",
    "tests/",
    "vm-core/",
    "xtask/src/soak/protocol.rs",
    "xtask/src/soak/survivors.rs",
];

/// Seconds after which a mistake counts as found, since the tests do not end. Without a mistake they take 5 s, more on a busy
/// computer.
const PATIENCE: &str = "180";

/// The sources as they are: the tests must pass with them, or they would find anything.
const UNCHANGED: &str = "unchanged";

/// Shards of all groups.
pub fn items() -> Vec<String> {
    let shards = |group: &'static Group| {
        let shards = (0..group.shards).map(|shard| format!("{shard}/{}", group.shards));
        let all = [UNCHANGED.to_owned()].into_iter().chain(shards);
        all.map(|shard| format!("{} {shard}", group.name))
    };
    GROUPS.iter().flat_map(shards).collect()
}

/// Tries the mistakes of one shard.
pub fn run(item: &str) -> Result<Verdict, Failure> {
    let found = item.split_once(' ').and_then(|(name, shard)| {
        GROUPS.iter().find(|group| group.name == name).map(|group| (group, shard))
    });
    let Some((group, shard)) = found else {
        return Ok(Verdict::Missing("no such shard".to_owned()));
    };
    if !is_installed("cargo-mutants") {
        return Err(Failure::Packages {
            command: "cargo install cargo-mutants --locked".to_owned(),
        });
    }
    let folder = target()?.join("soak/protocol");
    let copy = folder.join("sources");
    // A run that was stopped has left a mistake there.
    Sources::list()?.copy_to(&copy)?;
    let target = folder.join("target");
    if shard == UNCHANGED {
        in_copy(group.tests(), &copy, &target).run()?;
        return Ok(Verdict::Shown("all tests pass".to_owned()));
    }
    let output = folder.join(item.replace([' ', '/'], "-"));
    // 2: a mistake was missed; 3: a test did not end.
    let is_done = |output: &Output| matches!(output.status.code(), Some(0 | 2 | 3));
    in_copy(group.mutants(shard, &output), &copy, &target).output_if(is_done)?;
    let outcome = |name: &str| -> Result<Vec<String>, Failure> {
        let text = sources::read_text(&output.join("mutants.out").join(name))?;
        Ok(text.lines().map(without_place).collect())
    };
    let missed = outcome("missed.txt")?;
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
    Ok(Verdict::Shown(format!(
        "{} found, {} by not ending; {} explained; {} do not compile",
        outcome("caught.txt")?.len(),
        outcome("timeout.txt")?.len(),
        missed.len(),
        outcome("unviable.txt")?.len(),
    )))
}

impl Group {
    /// The tests alone.
    fn tests(&self) -> Line {
        let packages = self.packages.iter().map(|name| format!("--package={name}"));
        let targets = self.targets.iter().map(|name| format!("--test={name}"));
        let arguments: Vec<String> = packages.chain(targets).collect();
        let mut all = vec!["test", "--lib"];
        all.extend(arguments.iter().map(String::as_str));
        Line::new("cargo", &all)
    }

    /// The mistakes of a shard.
    fn mutants(&self, shard: &str, output: &Path) -> Line {
        let output = output.display().to_string();
        let packages = self.packages.join(",");
        // Arguments after `--` would hold for the tests, but not for the build before them.
        let targets = self.targets.iter().map(|name| format!("--cargo-arg=--test={name}"));
        let targets: Vec<String> = targets.collect();
        let mut all = vec!["mutants", "--in-place", "--baseline", "skip", "--timeout", PATIENCE];
        all.extend(["--no-shuffle", "--sharding", "round-robin", "--shard", shard]);
        all.extend(["--output", &output, "--test-package", &packages, "--cargo-arg=--lib"]);
        all.extend(self.files.iter().flat_map(|file| ["--file", file]));
        all.extend(targets.iter().map(String::as_str));
        Line::new("cargo", &all)
    }
}

/// The command in the copy of the sources, where builds are quick.
fn in_copy(line: Line, copy: &Path, target: &Path) -> Line {
    line.env("CARGO_TARGET_DIR", &target.display().to_string())
        .env("CARGO_INCREMENTAL", "1")
        .env("CARGO_PROFILE_DEV_DEBUG", "0")
        .in_workspace(&copy.display().to_string())
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
    let known = SURVIVORS.iter().find(|known| known.mutant == mutant)?;
    let count = missed.iter().filter(|other| *other == mutant).count();
    (count <= known.count).then_some(known.reason)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_do_not_matter() {
        let mutant = "vm-core/src/stamp.rs:43:5: replace next -> u32 with 0";
        assert_eq!(without_place(mutant), "vm-core/src/stamp.rs: replace next -> u32 with 0");
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
