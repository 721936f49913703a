//! The way in which a user started the tool.
//!
//! All that depends on the running process is here: its words, and the folder of its program. They are not the tool's own
//! if another program, such as an interpreter, carries the tool.

use std::env;
use std::ffi::{OsStr, OsString};
use std::path::{self, Path, PathBuf};
use std::sync::OnceLock;

use crate::shell;

/// The name of the tool.
pub const NAME: &str = env!("CARGO_PKG_NAME");

/// The way in which a user started the tool.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Launch {
    /// The words of a shell command that start the tool, such as `bbz` or `python3 -m bittybuzz`.
    /// Usage lines, and messages that repeat a command, begin with them.
    pub program: Vec<OsString>,
    /// The words of the command after `program`: `sim`, `swarm.toml`.
    pub arguments: Vec<OsString>,
    /// The folder in which emulator programs are searched before PATH; `None` searches PATH alone.
    pub emulators: Option<PathBuf>,
}

impl Launch {
    /// Returns the launch of a process that is the program `bbz` itself. Emulators are searched next
    /// to it.
    pub fn of_program() -> Launch {
        let mut words = env::args_os();
        let program = words.next().into_iter().collect();
        // Without the path of this program, only PATH is searched.
        let this = env::current_exe().ok();
        let emulators = this.as_deref().and_then(Path::parent).map(Path::to_owned);
        Launch { program, arguments: words.collect(), emulators }
    }

    /// Returns the words that start the tool, as a usage line shows them: without folders.
    pub(crate) fn name(&self) -> String {
        let (first, rest) = self.program.split_first().unzip();
        let first = first.map(Path::new).and_then(Path::file_name).unwrap_or(OsStr::new(NAME));
        let rest = rest.into_iter().flatten().map(OsString::as_os_str);
        shell::words([first].into_iter().chain(rest))
    }

    fn command_line(&self) -> String {
        shell::words(self.program.iter().chain(&self.arguments))
    }
}

/// Returns the words of a shell command that start the tool from any folder.
pub fn from_anywhere() -> String {
    let program = LAUNCH.get().map_or(&[][..], |launch| &launch.program);
    let (first, rest) = program.split_first().unzip();
    let first = first.map_or(OsStr::new(NAME), OsString::as_os_str);
    // A word without folders is searched in PATH.
    let is_path = Path::new(first).components().count() > 1;
    let path = path::absolute(first).ok().filter(|_| is_path);
    let first = path.as_deref().map_or(first, Path::as_os_str);
    let rest = rest.into_iter().flatten().map(OsString::as_os_str);
    shell::words([first].into_iter().chain(rest))
}

/// The launch of this process. Panics and pages report its command, and no caller can pass it to them.
static LAUNCH: OnceLock<Launch> = OnceLock::new();

/// Keeps the launch of this process. Returns `None` if the process has one already.
pub fn begin(launch: Launch) -> Option<&'static Launch> {
    LAUNCH.set(launch).ok()?;
    LAUNCH.get()
}

/// Returns the shell command that repeats this run.
pub fn command_line() -> String {
    LAUNCH.get().map_or_else(|| NAME.to_owned(), Launch::command_line)
}

/// Returns a shell command of the tool with these arguments.
pub fn command(arguments: impl IntoIterator<Item: AsRef<OsStr>>) -> String {
    let name = LAUNCH.get().map_or_else(|| NAME.to_owned(), Launch::name);
    format!("{name} {}", shell::words(arguments.into_iter()))
}

/// Returns the folder in which emulator programs are searched before PATH.
pub fn emulators() -> Option<&'static Path> {
    LAUNCH.get()?.emulators.as_deref()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn launch(program: &[&str], arguments: &[&str]) -> Launch {
        let words = |words: &[&str]| words.iter().map(OsString::from).collect();
        Launch { program: words(program), arguments: words(arguments), emulators: None }
    }

    #[test]
    fn a_command_is_repeated_as_it_was_typed() {
        let program = launch(&["./target/debug/bbz"], &["sim", "my swarm.toml"]);
        assert_eq!(program.command_line(), "./target/debug/bbz sim 'my swarm.toml'");
        assert_eq!(program.name(), "bbz");
        let module = launch(&["/usr/bin/python3", "-m", "bittybuzz"], &["check", "a.bzz"]);
        assert_eq!(module.command_line(), "/usr/bin/python3 -m bittybuzz check a.bzz");
        assert_eq!(module.name(), "python3 -m bittybuzz");
    }

    #[test]
    fn a_command_without_a_first_word_has_the_name_of_the_tool() {
        assert_eq!(launch(&[], &["sim"]).name(), "bbz");
        assert_eq!(launch(&["/"], &[]).name(), "bbz");
        assert_eq!(launch(&[], &["sim"]).command_line(), "sim");
    }

    #[test]
    fn emulators_of_the_program_are_next_to_it() {
        let folder = Launch::of_program().emulators.unwrap();
        assert_eq!(Some(folder.as_path()), env::current_exe().unwrap().parent());
    }
}
