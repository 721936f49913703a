//! The chores of the project, so that people and the CI machine run the same commands.
//!
//! Each command prints what it runs and stops at the first failure. What a command needs and can be fetched by
//! the ordinary clients (rustup, apt-get) is fetched by `setup`; nothing is installed in another way.

mod bench;
mod beside;
mod board;
mod checks;
mod demo;
mod elf;
mod failure;
mod on_chip;
mod probe;
mod setup;
mod shell;
mod sizes;
mod soak;
mod unlike;

use failure::Failure;
use std::process::ExitCode;

/// A command of xtask.
struct Task {
    name: &'static str,
    /// What may follow the name; nothing if empty.
    arguments: &'static str,
    help: &'static str,
    run: fn(&[String]) -> Result<(), Failure>,
}

const TASKS: &[Task] = &[
    Task {
        name: "demo",
        arguments: "",
        help: "run the examples, show how errors are explained, and boot a robot in emulation",
        run: |_| demo::run(),
    },
    Task {
        name: "test",
        arguments: "",
        help: "the tests of every change: on this computer, and the Crazyflie's firmware in emulation on Unicorn",
        run: |_| checks::test(),
    },
    Task {
        name: "setup",
        arguments: "",
        help: "install what the other commands need",
        run: |_| setup::run(),
    },
    Task {
        name: "build",
        arguments: "BOARD [--script FILE] [--profile tiny]",
        help: "build a robot's firmware with a script in it; BOARD is crazyflie, zooids or kilobot, or behaviours: an image for each of examples/kilobot",
        run: board::run,
    },
    Task {
        name: "sizes",
        arguments: "[--json]",
        help: "flash and RAM of each image and of the virtual machine, against the budgets",
        run: sizes::run,
    },
    Task {
        name: "bench",
        arguments: "[costs] [--json] [--update] [TARGET]",
        help: "cycles or instructions of the benchmark scripts, beside the C BittyBuzz; costs: of each instruction",
        run: bench::run,
    },
    Task {
        name: "soak",
        arguments: "[PART]",
        help: "long evidence, goes on where it was stopped; PART is convergence, day, fuzz, kilobots, ...",
        run: soak::run,
    },
    Task {
        name: "ci",
        arguments: "",
        help: "all that must pass before a merge: also lints, sizes, QEMU, guides, probe-rs' chips, some mutants",
        run: |_| checks::ci(),
    },
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (task, rest) = match chosen(&arguments) {
        Ok(Some(chosen)) => chosen,
        Ok(None) => {
            print!("{}", usage());
            return ExitCode::SUCCESS;
        }
        Err(error) => return misused(&error),
    };
    match (task.run)(rest) {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failure::Usage(error)) => misused(&error),
        Err(failure) => {
            eprintln!("xtask {}: {failure}", task.name);
            ExitCode::FAILURE
        }
    }
}

fn misused(error: &str) -> ExitCode {
    eprint!("error: {error}\n\n{}", usage());
    ExitCode::from(2)
}

/// The task that the arguments ask for, and its own arguments; `None` if they ask for help.
fn chosen(arguments: &[String]) -> Result<Option<(&'static Task, &[String])>, String> {
    let Some((name, rest)) = arguments.split_first() else {
        return Err("which command?".to_owned());
    };
    if [name].into_iter().chain(rest).any(|argument| argument == "--help" || argument == "-h") {
        return Ok(None);
    }
    let task = TASKS.iter().find(|task| task.name == name);
    let task = task.ok_or_else(|| format!("there is no command `{name}`"))?;
    match rest {
        [argument, ..] if task.arguments.is_empty() => {
            Err(format!("`{name}` takes no arguments, but got `{argument}`"))
        }
        _ => Ok(Some((task, rest))),
    }
}

fn usage() -> String {
    let tasks = TASKS.iter().map(|Task { name, arguments, help, .. }| {
        let call = format!("{name} {arguments}");
        format!("  {call:<36}{help}\n")
    });
    format!("usage: cargo xtask COMMAND\n\n{}", tasks.collect::<String>())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn choose(arguments: &[&str]) -> Result<Option<(&'static str, usize)>, String> {
        let arguments: Vec<String> = arguments.iter().map(|a| (*a).to_owned()).collect();
        chosen(&arguments).map(|chosen| chosen.map(|(task, rest)| (task.name, rest.len())))
    }

    #[test]
    fn arguments() {
        assert_eq!(choose(&["ci"]), Ok(Some(("ci", 0))));
        assert_eq!(choose(&["soak", "noise"]), Ok(Some(("soak", 1))));
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
