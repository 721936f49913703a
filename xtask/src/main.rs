//! The chores of the project, so that people and the CI machine run the same commands.
//!
//! Each command prints what it runs and stops at the first failure. What a command needs and can be fetched by
//! the ordinary clients (rustup, apt-get) is fetched by `setup`; nothing is installed in another way.

mod checks;
mod demo;
mod setup;
mod shell;

use shell::Failure;
use std::process::ExitCode;

/// A command of xtask.
struct Task {
    name: &'static str,
    help: &'static str,
    run: fn() -> Result<(), Failure>,
}

const TASKS: &[Task] = &[
    Task {
        name: "demo",
        help: "run the examples, and show how errors are explained",
        run: demo::run,
    },
    Task { name: "test", help: "run the tests that need no robot", run: checks::test },
    Task { name: "setup", help: "install what the other commands need", run: setup::run },
    Task {
        name: "ci",
        help: "everything that must pass before a change is merged",
        run: checks::ci,
    },
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let task = match chosen(&arguments) {
        Ok(Some(task)) => task,
        Ok(None) => {
            print!("{}", usage());
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            eprint!("error: {error}\n\n{}", usage());
            return ExitCode::from(2);
        }
    };
    match (task.run)() {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("xtask {}: {failure}", task.name);
            ExitCode::FAILURE
        }
    }
}

/// The task that the arguments ask for; `None` if they ask for help.
fn chosen(arguments: &[String]) -> Result<Option<&'static Task>, String> {
    let Some((name, rest)) = arguments.split_first() else {
        return Err("which command?".to_owned());
    };
    if [name].into_iter().chain(rest).any(|argument| argument == "--help" || argument == "-h") {
        return Ok(None);
    }
    let task = TASKS.iter().find(|task| task.name == name);
    let task = task.ok_or_else(|| format!("there is no command `{name}`"))?;
    match rest {
        [] => Ok(Some(task)),
        [argument, ..] => Err(format!("`{name}` takes no arguments, but got `{argument}`")),
    }
}

fn usage() -> String {
    let tasks: String =
        TASKS.iter().map(|task| format!("  {:<8}{}\n", task.name, task.help)).collect();
    format!("usage: cargo xtask COMMAND\n\n{tasks}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choose(arguments: &[&str]) -> Result<Option<&'static str>, String> {
        let arguments: Vec<String> = arguments.iter().map(|a| (*a).to_owned()).collect();
        chosen(&arguments).map(|task| task.map(|task| task.name))
    }

    #[test]
    fn arguments() {
        assert_eq!(choose(&["ci"]), Ok(Some("ci")));
        assert_eq!(choose(&["--help"]), Ok(None));
        assert_eq!(choose(&["test", "-h"]), Ok(None));
        assert!(choose(&[]).is_err());
        assert!(choose(&["tset"]).is_err_and(|error| error.contains("`tset`")));
        assert!(choose(&["demo", "fast"]).is_err_and(|error| error.contains("`fast`")));
    }

    #[test]
    fn usage_lists_every_task() {
        assert!(
            TASKS.iter().all(|task| usage().contains(task.name) && usage().contains(task.help))
        );
    }
}
