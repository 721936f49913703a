//! The chores of the project as commands, so that people and the CI machine run the same ones.
//!
//! Each command prints the programs that it runs, and stops at the first failure. `setup` installs
//! the programs that the commands need, only by the ordinary clients (rustup, apt-get, pip, npm).
//! `demo` needs none of these programs.
//!
//! Benchmarks are in `bench/harness`, long tests in `tests/soak`, and the builds of programs and
//! images that all of them use in `tools/builds`.

mod book;
mod checks;
mod demo;
mod mixed_swarm;
mod package;
mod python;
mod quick;
mod release;
mod side_by_side;
mod site;
mod sizes;
mod vendor;

use bittybuzz_bench_harness as bench;
use bittybuzz_builds::{board, setup};
use bittybuzz_soak as soak;
use clap::builder::PossibleValuesParser;
use clap::{Parser, Subcommand};
use std::process::ExitCode;

#[derive(Debug, Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", about = "The chores of BittyBuzz")]
struct CommandLine {
    #[command(subcommand)]
    task: Task,
}

#[derive(Debug, Subcommand)]
enum Task {
    /// Run a script, explain some errors, simulate a swarm and show it in a page
    Demo {
        /// Go on with robots' firmware in emulation, for which `setup` comes first
        #[arg(long)]
        robots: bool,
        /// Print the address of the page and open no browser
        #[arg(long)]
        no_browser: bool,
    },
    /// Format the sources, lint and test the changed crates, and test the language's conformance
    Quick(quick::QuickArguments),
    /// The tests of every change: on this computer, and the robots' firmware in emulation
    Test,
    /// Install the programs that the other commands need
    Setup,
    /// Build a robot's firmware with a script in it
    Build(board::BoardArguments),
    /// Flash and RAM of each image and of the virtual machine, against the budgets
    Sizes(sizes::SizesArguments),
    /// The playground as a folder of static files, for any web server, and as a zip, for none
    Site,
    /// The book of docs/ as a folder of static files
    Book,
    /// Archives of a release, with checksums
    Package {
        /// Only this part
        part: Option<package::ReleasePart>,
        /// Tools for this kind of computers instead of this computer
        #[arg(long, requires = "part", value_parser = PossibleValuesParser::new(package::targets()))]
        target: Option<String>,
    },
    /// Check that the working copy can be released, and tag its version
    Release {
        /// Print the changes of this version instead
        #[arg(long)]
        notes: bool,
    },
    /// The packages of the page's editor as one file, which is committed
    Vendor,
    /// Cycles or instructions of the benchmark scripts, and of the C BittyBuzz
    Bench(bench::BenchArguments),
    /// Long evidence, which goes on where it was stopped
    Soak {
        /// Only this part
        #[arg(value_parser = PossibleValuesParser::new(soak::names()))]
        part: Option<String>,
    },
    /// All that must pass before a merge: also lints, sizes, QEMU, guides, probe-rs' chips, some mutants
    Ci {
        /// Only this one of the steps, which otherwise follow each other in this order
        step: Option<checks::Step>,
    },
}

fn main() -> ExitCode {
    let (name, result) = match CommandLine::parse().task {
        Task::Demo { robots, no_browser } => ("demo", demo::run(robots, no_browser)),
        Task::Quick(arguments) => ("quick", quick::run(&arguments)),
        Task::Test => ("test", checks::test()),
        Task::Setup => ("setup", setup::run()),
        Task::Build(arguments) => ("build", board::run(&arguments)),
        Task::Sizes(arguments) => ("sizes", sizes::run(&arguments)),
        Task::Site => ("site", site::run()),
        Task::Book => ("book", book::run()),
        Task::Package { part, target } => ("package", package::run(part, target.as_deref())),
        Task::Release { notes } => ("release", release::run(notes)),
        Task::Vendor => ("vendor", vendor::run()),
        Task::Bench(arguments) => ("bench", bench::run(&arguments)),
        Task::Soak { part } => ("soak", soak::run(part.as_deref())),
        Task::Ci { step } => ("ci", checks::ci(step)),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("xtask {name}: {error:#}");
            ExitCode::FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_command_line_is_consistent() {
        CommandLine::command().debug_assert();
    }

    #[test]
    fn command_lines_that_are_understood() {
        for line in [
            "demo --robots",
            "demo --no-browser",
            "quick",
            "quick --base v1 --users",
            "quick --all",
            "build kilobot --script a.bzz",
            "build --script a.bzz crazyflie --profile tiny",
            "build behaviors",
            "build crazyflie --bin",
            "build crazyflie --bin --script a.bzz --id 65535 --output a.zip",
            "sizes --json",
            "sizes --update",
            "site",
            "book",
            "package",
            "package tools",
            "package wheel --target aarch64-unknown-linux-gnu",
            "package tools --target x86_64-pc-windows-gnu",
            "release --notes",
            "vendor",
            "bench --json avr",
            "bench thumbv7em-full --update",
            "bench costs --update avr",
            "bench flight --update",
            "bench slices --update",
            "soak",
            "soak noise",
            "ci",
            "ci on-chip",
            "ci python",
        ] {
            let words = ["xtask"].into_iter().chain(line.split(' '));
            assert!(CommandLine::try_parse_from(words).is_ok(), "{line}");
        }
    }

    #[test]
    fn command_lines_that_are_refused() {
        for line in [
            "",
            "tset",
            "demo fast",
            "quick --users --all",
            "build",
            "build crazyfly",
            "build crazyflie zooids",
            "build crazyflie --script",
            "build crazyflie --profile full",
            "build crazyflie --id 7",
            "build crazyflie --bin --id 65536",
            "build crazyflie --output a.bin",
            "package tools --target x86_64-pc-windows-msvc",
            "package --target x86_64-pc-windows-gnu",
            "sizes --jason",
            "sizes --json --update",
            "bench arm",
            "bench avr host",
            "bench costs --json",
            "bench flight avr",
            "soak mutant",
        ] {
            let words = ["xtask"].into_iter().chain(line.split_whitespace());
            assert!(CommandLine::try_parse_from(words).is_err(), "{line}");
        }
    }
}
