//! Commands in documents and in CI must build with the crates of the lock files.

use bittybuzz_builds::shell::{Invocation, root};
use std::fs;

/// Commands that would use other crates without `--locked`: `install` always, the others after a
/// change of a manifest.
const COMMANDS: [&str; 6] = ["build", "clippy", "doc", "install", "run", "test"];

/// The only command that writes a lock file: that of a new robot begins as a copy of another
/// robot's.
const WRITES: &str = "$ (cd firmware/lamp && cargo build --quiet --release)";

/// Returns the documents and the definition of CI, without the change log, which contains commands
/// of old versions.
fn documents() -> Vec<String> {
    let list = Invocation::new("git", &["ls-files", "*.md", ".github", ".ci"]).output(0).unwrap();
    let names = String::from_utf8(list.stdout).unwrap();
    names.lines().filter(|name| *name != "CHANGELOG.md").map(str::to_owned).collect()
}

/// Returns the commands in a line that have options, but not `--locked`.
fn unlocked(line: &str) -> impl Iterator<Item = &str> {
    let commands = line.split("cargo ").skip(1).filter(|rest| {
        COMMANDS.iter().any(|command| {
            rest.strip_prefix(command).is_some_and(|options| options.starts_with(" "))
        })
    });
    // A command ends with its code span, or at an operator of the shell.
    let alone = |rest| str::split(rest, ['`', '|', '&', '#']).next().unwrap_or(rest).trim_end();
    commands.map(alone).filter(|command| {
        !COMMANDS.contains(command) && !command.split(' ').any(|word| word == "--locked")
    })
}

#[test]
fn commands_keep_the_lock_files() {
    let mut read = 0;
    for document in documents() {
        let text = fs::read_to_string(root().join(&document)).unwrap();
        for (line, number) in text.lines().zip(1..) {
            read += line.matches("--locked").count();
            let found = unlocked(line).next().filter(|_| line != WRITES);
            assert_eq!(found, None, "{document}:{number}: add `--locked`");
        }
    }
    assert!(read > 30, "{read} commands with `--locked`");
}

#[test]
fn commands_without_the_option_are_found() {
    let found = |line| unlocked(line).collect::<Vec<_>>();
    assert_eq!(found("Run `cargo build -p bbz` now"), ["build -p bbz"]);
    assert_eq!(found("`cargo build` is for `cargo test --locked -p a`"), [""; 0]);
    assert_eq!(found("cargo run --release | cargo test --locked"), ["run --release"]);
    assert_eq!(found("cargo fmt --all; cargo xtask test"), [""; 0]);
}
