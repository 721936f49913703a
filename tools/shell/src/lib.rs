//! Runs programs. Each command is printed, so that people can follow the run and repeat a failed
//! command.

pub mod cargo_test;

use anyhow::{Context, Error, Result, anyhow};
use std::io;
use std::panic::resume_unwind;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Output, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

/// Returns the root of the repository, in which every program runs.
pub fn root() -> &'static Path {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    own.ancestors().nth(2).unwrap_or(own)
}

/// A program with its arguments.
pub struct Invocation {
    /// The command as a user would type it.
    text: String,
    /// True if the command is printed when it runs.
    announced: bool,
    command: Command,
}

/// Set by [`keep_lock_files`].
static KEEPS_LOCK_FILES: AtomicBool = AtomicBool::new(false);

/// Cargo commands that write the lock file if it does not fit the manifests.
const RESOLVING: [&str; 7] = ["build", "check", "clippy", "doc", "metadata", "run", "test"];

/// Makes cargo fail instead of writing a lock file. Checks before a merge call this, because a lock
/// file that does not fit its manifests is a mistake of the change. Other chores do not, because
/// the user may be changing the manifests.
pub fn keep_lock_files() {
    KEEPS_LOCK_FILES.store(true, Ordering::Relaxed);
}

impl Invocation {
    /// Creates a cargo command, which fails instead of writing a lock file once [`keep_lock_files`]
    /// was called.
    pub fn cargo(arguments: &[&str]) -> Invocation {
        Invocation::new("cargo", &locked(arguments, KEEPS_LOCK_FILES.load(Ordering::Relaxed)))
    }

    /// Creates a command for a program in the search path.
    pub fn new(program: &str, arguments: &[&str]) -> Invocation {
        Invocation::named(program, Path::new(program), arguments)
    }

    /// Creates a command for a program at another place, printed by its name.
    pub fn named(name: &str, program: &Path, arguments: &[&str]) -> Invocation {
        let text = [&[name], arguments].concat().join(" ");
        let mut command = Command::new(program);
        command.args(arguments).current_dir(root());
        Invocation { text, announced: true, command }
    }

    /// Sets an environment variable.
    pub fn env(mut self, name: &str, value: &str) -> Invocation {
        self.text = format!("{name}={value} {}", self.text);
        self.command.env(name, value);
        self
    }

    /// Runs the command in a folder that is a workspace of its own. The folder's toolchain and
    /// flags apply, not those of the cargo that runs this program. A relative path starts at the
    /// root.
    pub fn in_workspace(mut self, folder: &str) -> Invocation {
        self.text = format!("cd {folder} && {}", self.text);
        self.command.current_dir(root().join(folder));
        ["RUSTUP_TOOLCHAIN", "RUSTFLAGS", "CARGO", "CARGO_ENCODED_RUSTFLAGS"]
            .iter()
            .fold(self, |line, name| line.without_env(name))
    }

    /// Runs the command in a folder that belongs to the workspace of this program.
    pub fn in_folder(mut self, folder: &Path) -> Invocation {
        self.command.current_dir(folder);
        self
    }

    /// Clears an environment variable.
    pub fn without_env(mut self, name: &str) -> Invocation {
        self.command.env_remove(name);
        self
    }

    /// Does not print the command, so that standard output holds only the result of the task.
    pub fn unannounced(mut self) -> Invocation {
        self.announced = false;
        self
    }

    /// Prints the command now instead of when it runs, so that the output of several threads keeps
    /// its order.
    pub fn announced(self) -> Invocation {
        self.announce();
        self.unannounced()
    }

    /// Runs the command and shows its output. Fails unless the command succeeds.
    pub fn run(mut self) -> Result<()> {
        self.announce();
        let status = self.command.status().map_err(|reason| self.not_started(reason))?;
        match status.success() {
            true => Ok(()),
            false => Err(unexpected(&self.text, status)),
        }
    }

    /// Runs the command, shows its errors and returns its output. Fails unless the command succeeds.
    pub fn shown_errors(mut self) -> Result<String> {
        self.command.stderr(Stdio::inherit());
        Ok(String::from_utf8(self.output(0)?.stdout)?)
    }

    /// Runs the command and returns its output. Fails unless the command ends with this status.
    pub fn output(self, expected: i32) -> Result<Output> {
        self.output_if(|output| output.status.code() == Some(expected))
    }

    /// Runs the command and returns its output. Fails unless the output is as expected.
    pub fn output_if(mut self, expected: impl Fn(&Output) -> bool) -> Result<Output> {
        self.announce();
        let output = self.command.output().map_err(|reason| self.not_started(reason))?;
        if expected(&output) {
            return Ok(output);
        }
        // The errors of the program explain the failure.
        eprint!("{}", String::from_utf8_lossy(&output.stderr));
        Err(unexpected(&self.text, output.status))
    }

    fn announce(&self) {
        if self.announced {
            println!("$ {}", self.text);
        }
    }

    fn not_started(&self, reason: io::Error) -> Error {
        anyhow!("cannot start `{}`: {reason}", self.command.get_program().display())
    }
}

/// Returns cargo's arguments, with `--locked` if lock files are kept and the command may write one.
fn locked<'a>(arguments: &[&'a str], keeps_lock_files: bool) -> Vec<&'a str> {
    let mut all = arguments.to_vec();
    if keeps_lock_files && all.first().is_some_and(|command| RESOLVING.contains(command)) {
        all.insert(1, "--locked");
    }
    all
}

fn unexpected(command: &str, status: ExitStatus) -> Error {
    anyhow!("`{command}` ended with {status}")
}

/// Runs cargo in the root workspace.
pub fn cargo(arguments: &[&str]) -> Result<()> {
    Invocation::cargo(arguments).run()
}

/// Runs two chores at the same time, and returns both results. A second run of cargo uses the
/// processors that the first one leaves idle, if the two build in different profiles: cargo locks the
/// folder of a profile. If both fail, the error of the first one is returned.
pub fn at_once<First, Second: Send>(
    first: impl FnOnce() -> Result<First>,
    second: impl FnOnce() -> Result<Second> + Send,
) -> Result<(First, Second)> {
    thread::scope(|scope| {
        let second = scope.spawn(second);
        let first = first();
        let second = second.join().unwrap_or_else(|panic| resume_unwind(panic));
        Ok((first?, second?))
    })
}

/// Returns cargo's target folder for the root workspace, which contains this program.
pub fn target() -> Result<PathBuf> {
    let own = std::env::current_exe().context("cannot find the program that runs")?;
    // TARGET/PROFILE/xtask
    Ok(own.ancestors().nth(2).unwrap_or(root()).to_owned())
}

/// Returns true if a program is in the search path.
pub fn is_installed(program: &str) -> bool {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::split_paths(&path).any(|folder| folder.join(program).is_file())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Barrier;

    #[test]
    fn a_failing_program_is_named_with_its_arguments() {
        let failure = Invocation::new("false", &["one", "two"]).run().unwrap_err();
        assert_eq!(failure.to_string(), "`false one two` ended with exit status: 1");
        let failure = Invocation::new("no-such-program", &[]).run().unwrap_err();
        assert!(failure.to_string().starts_with("cannot start `no-such-program`: "));
    }

    #[test]
    fn a_status_can_be_expected() {
        assert!(Invocation::new("false", &[]).output(1).is_ok());
        assert!(Invocation::new("true", &[]).output(1).is_err());
        let output = Invocation::new("sh", &["-c", "echo $X"]).env("X", "y").output(0).unwrap();
        assert_eq!(output.stdout, b"y\n");
    }

    #[test]
    fn lock_files_are_kept_where_a_command_would_write_one() {
        assert_eq!(locked(&["test", "--", "x"], true), ["test", "--locked", "--", "x"]);
        assert_eq!(locked(&["fmt", "--check"], true), ["fmt", "--check"]);
        assert_eq!(locked(&["build"], false), ["build"]);
    }

    #[test]
    fn two_chores_run_at_once() {
        // Both wait here: one alone would never go on.
        let both = Barrier::new(2);
        let chore = |result: Result<u8>| {
            both.wait();
            result
        };
        assert_eq!(at_once(|| chore(Ok(1)), || chore(Ok(2))).unwrap(), (1, 2));
        let failed = at_once(|| chore(Ok(1)), || chore(Err(anyhow!("second"))));
        assert_eq!(failed.unwrap_err().to_string(), "second");
        let failed = at_once(|| chore(Err(anyhow!("first"))), || chore(Err(anyhow!("second"))));
        assert_eq!(failed.unwrap_err().to_string(), "first");
    }

    #[test]
    fn programs_are_found() {
        assert!(is_installed("sh") && !is_installed("no-such-program"));
    }
}
