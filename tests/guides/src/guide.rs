//! Guides that can be carried out: the sentence before a block of code is the instruction, for people and for the test.
//!
//! | before the block | does |
//! |---|---|
//! | New file `F`: | writes it |
//! | At the end of `F`: | appends the block |
//! | In `F`, after `TEXT`: | inserts the block below the only line with that text; also `before` |
//! | In `F`: | changes lines as the block says, a `diff`; a line `@@` is between changes in different places |
//!
//! A block in the language `console` is run, in a shell of its own that starts in the root of the repository: commands
//! after `$ `, below them what they print (console.rs says how exactly). Blocks in the languages `sh` and `text` are only shown.

use std::env;
use std::fmt;
use std::fs;
use std::io;
use std::path::PathBuf;
use std::process::Command;

use bittybuzz_builds::copy::Copy;

use crate::console;
use crate::edit::{Edit, EditError};

/// A guide.
#[derive(Debug)]
pub struct Guide {
    /// Its path from the root of the repository.
    path: String,
    steps: Vec<Step>,
}

/// What one block asks for.
#[derive(Debug)]
struct Step {
    /// Line of the first line in the block, from 1.
    line: usize,
    action: Action,
}

#[derive(Debug, PartialEq, Eq)]
enum Action {
    /// Change this file.
    Edit(String, Edit),
    /// Run commands.
    Run(String),
}

/// Why a guide cannot be carried out, and where.
#[derive(Debug)]
pub struct Failure {
    guide: String,
    line: usize,
    cause: Box<Cause>,
}

#[derive(Debug)]
enum Cause {
    /// A block that no sentence explains.
    NoInstruction,
    /// A block without an end.
    Endless,
    /// The change does not fit the file.
    EditError { file: String, misfit: EditError },
    /// A file of the copy cannot be read or written.
    File { file: String, error: anyhow::Error },
    /// The shell does not start.
    Shell(io::Error),
    /// A block to run begins with something else than a command.
    NoCommand,
    /// A command does something else than the guide says.
    Otherwise(console::Otherwise),
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: ", self.guide, self.line)?;
        match &*self.cause {
            Cause::NoInstruction => f.write_str(
                "nothing before this block says what to do with it: New file `F`:, At the end of `F`:, In `F`, after \
                 `TEXT`: (or before), In `F`: and a diff",
            ),
            Cause::Endless => f.write_str("this block has no end"),
            Cause::EditError { file, misfit } => write!(f, "`{file}` {misfit}"),
            Cause::File { file, error } => write!(f, "`{file}`: {error}"),
            Cause::Shell(error) => write!(f, "the shell does not start: {error}"),
            Cause::NoCommand => f.write_str("a console block begins with `$ ` and a command"),
            Cause::Otherwise(otherwise) => otherwise.fmt(f),
        }
    }
}

impl std::error::Error for Failure {}

impl Failure {
    fn new(guide: &str, line: usize, cause: Cause) -> Self {
        Failure { guide: guide.to_owned(), line, cause: Box::new(cause) }
    }
}

impl Guide {
    /// Reads a guide. `path` is where it is, from the root of the repository.
    pub fn read(path: &str, text: &str) -> Result<Self, Failure> {
        let mut steps = Vec::new();
        let mut paragraph = String::new();
        let mut lines = text.lines().zip(1..);
        while let Some((line, number)) = lines.next() {
            let Some(language) = line.strip_prefix("```") else {
                match line.trim() {
                    // A blank line may be between a sentence and its block.
                    "" if paragraph.ends_with(':') => {}
                    "" => paragraph.clear(),
                    words => paragraph = format!("{paragraph} {words}"),
                }
                continue;
            };
            let fail = |cause| Failure::new(path, number, cause);
            let mut block = String::new();
            loop {
                match lines.next() {
                    Some(("```", _)) => break,
                    Some((line, _)) => block += &format!("{line}\n"),
                    None => return Err(fail(Cause::Endless)),
                }
            }
            let action = match language {
                "sh" | "text" => None,
                "console" => Some(Action::Run(block)),
                _ => {
                    Some(instruction(&paragraph, block).ok_or_else(|| fail(Cause::NoInstruction))?)
                }
            };
            steps.extend(action.map(|action| Step { line: number + 1, action }));
            paragraph.clear();
        }
        Ok(Guide { path: path.to_owned(), steps })
    }

    /// Returns the path from the root of the repository.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Returns the files that the guide writes or changes.
    pub fn edited(&self) -> impl Iterator<Item = &str> {
        self.steps.iter().filter_map(|step| match &step.action {
            Action::Edit(file, _) => Some(file.as_str()),
            Action::Run(_) => None,
        })
    }

    /// Returns the blocks of commands.
    pub fn commands(&self) -> impl Iterator<Item = &str> {
        self.steps.iter().filter_map(|step| match &step.action {
            Action::Edit(..) => None,
            Action::Run(block) => Some(block.as_str()),
        })
    }

    /// Carries it out in a copy of the repository. Users have these folders of programs in their search path, as the guide asks
    /// before it begins.
    pub fn carry_out(&self, copy: &Copy, programs: &[PathBuf]) -> Result<(), Failure> {
        for step in &self.steps {
            step.carry_out(copy, programs)
                .map_err(|(line, cause)| Failure::new(&self.path, step.line + line, cause))?;
        }
        Ok(())
    }
}

impl Step {
    /// An error has its line in the block, from 0.
    fn carry_out(&self, copy: &Copy, programs: &[PathBuf]) -> Result<(), (usize, Cause)> {
        match &self.action {
            Action::Edit(file, edit) => {
                change(copy, file, edit).map_err(|cause| (0, cause))?;
            }
            Action::Run(block) => {
                let promises = console::promises(block).ok_or((0, Cause::NoCommand))?;
                console::run(&mut shell(copy, programs), &promises)
                    .map_err(|error| (0, Cause::Shell(error)))?
                    .map_err(|(number, otherwise)| {
                        (promises[number].line, Cause::Otherwise(otherwise))
                    })?;
            }
        }
        Ok(())
    }
}

fn change(copy: &Copy, file: &str, edit: &Edit) -> Result<(), Cause> {
    let unusable = |error| Cause::File { file: file.to_owned(), error };
    let before = match fs::read_to_string(copy.root().join(file)) {
        Ok(text) => Some(text),
        Err(error) if error.kind() == io::ErrorKind::NotFound => None,
        Err(error) => return Err(unusable(error.into())),
    };
    let after = edit
        .apply(before.as_deref())
        .map_err(|misfit| Cause::EditError { file: file.to_owned(), misfit })?;
    copy.put(file, after.as_bytes()).map_err(unusable)
}

/// A shell with the tools in the search path.
fn shell(copy: &Copy, programs: &[PathBuf]) -> Command {
    let mut path = vec![copy.root().join("target/debug")];
    path.extend(programs.iter().cloned());
    path.extend(env::split_paths(&env::var_os("PATH").unwrap_or_default()));
    let path = env::join_paths(path).expect("parts of a search path");
    let mut shell = Command::new("sh");
    // Settings of the cargo of this test, or of a user, do not hold in the copy.
    for name in [
        "RUSTUP_TOOLCHAIN",
        "RUSTFLAGS",
        "CARGO",
        "CARGO_ENCODED_RUSTFLAGS",
        "CARGO_TARGET_DIR",
        "BBZ_SCRIPT",
        "BUZZ_INCLUDE_PATH",
    ] {
        shell.env_remove(name);
    }
    shell.envs(copy.variables()).env("PATH", path).current_dir(copy.root());
    shell
}

/// What the end of a paragraph says about the block below it.
fn instruction(paragraph: &str, block: String) -> Option<Action> {
    let parts: Vec<&str> = paragraph.split('`').collect();
    let (file, edit) = match parts[..] {
        [.., before, file, ":"] if before.ends_with("New file ") => (file, Edit::New(block)),
        [.., before, file, ":"] if before.ends_with("At the end of ") => {
            (file, Edit::Append(block))
        }
        [.., before, file, ":"] if before.ends_with("In ") => (file, Edit::Patch(block)),
        [.., before, file, place, text, ":"] if before.ends_with("In ") => {
            let text = text.to_owned();
            match place {
                ", after " => (file, Edit::After(text, block)),
                ", before " => (file, Edit::Before(text, block)),
                _ => return None,
            }
        }
        _ => return None,
    };
    Some(Action::Edit(file.to_owned(), edit))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn actions(text: &str) -> Vec<Action> {
        let guide = Guide::read("guide.md", text).unwrap();
        guide.steps.into_iter().map(|step| step.action).collect()
    }

    #[test]
    fn the_sentence_before_a_block_is_the_instruction() {
        let edit = |file: &str, edit| vec![Action::Edit(file.to_owned(), edit)];
        let block = || "x\n".to_owned();
        let cases = [
            ("Do it. New file `a/b`:\n\n```toml\nx\n```\n", edit("a/b", Edit::New(block()))),
            ("At the end\nof `a`:\n```toml\nx\n```\n", edit("a", Edit::Append(block()))),
            ("In `a`:\n```diff\nx\n```\n", edit("a", Edit::Patch(block()))),
            (
                "With `c`. In `a`, after `b {`:\n```rust\nx\n```\n",
                edit("a", Edit::After("b {".to_owned(), block())),
            ),
            (
                "In `a`, before `b`:\n```rust\nx\n```\n",
                edit("a", Edit::Before("b".to_owned(), block())),
            ),
            ("Words\n```console\nx\n```\n", vec![Action::Run(block())]),
            ("Words\n```text\nx\n```\n", vec![]),
        ];
        for (text, expected) in cases {
            assert_eq!(actions(text), expected, "{text}");
        }
    }

    #[test]
    fn a_block_without_instruction_has_its_line() {
        for (text, message) in [
            ("\nAs in `a`.\n```rust\nx\n```\n", "guide.md:3: nothing before this block"),
            ("In `a`, under `b`:\n```rust\nx\n```\n", "guide.md:2: nothing before this block"),
            ("In `a`:\n```rust\nx\n```\n```rust\n```\n", "guide.md:5: nothing before this block"),
            ("In `a`:\n\nBut:\n```rust\n```\n", "guide.md:4: nothing before this block"),
            ("```console\n", "guide.md:1: this block has no end"),
        ] {
            let error = Guide::read("guide.md", text).unwrap_err().to_string();
            assert!(error.starts_with(message), "{error}");
        }
    }
}
