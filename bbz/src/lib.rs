//! The command line tool of BittyBuzz: checks, builds, runs and explains Buzz scripts.
//!
//! The program `bbz` calls [`main`], and so can a program that carries the tool, such as a module
//! of an interpreter.
//!
//! # Principles
//! * Results go to standard output, messages to standard error.
//! * The exit status reports the outcome; `bbz --help` lists the numbers.
//! * A message names the place and the remedy.
//! * No robot is needed: a script runs on the same virtual machine as on the robots.
//! * [`Launch`] alone describes the running process, so that the tool works in any process.
//!
//! # Features
//! * `view` (default): `bbz view` and `bbz sim --view`. It adds 1 MB of the page's files to the
//!   program, and an HTTP server.
//!
//! # What it will not do
//! * It has no robots built in: it reads them from the files of `robots/`.
//! * It is no interface for programs: [`main`] takes words and returns a status. Programs use the
//!   compiler, the machine and the simulator.

mod build;
mod check;
mod checks;
mod chunks;
mod completions;
mod costs;
mod data;
mod disasm;
mod drive;
mod emulator;
mod escape;
mod exit;
mod explain;
mod export;
mod fence;
mod file_error;
mod firmware;
mod flash;
mod grade;
mod guide;
mod hex;
mod host;
mod import;
mod interrupt;
mod isp;
mod json;
mod launch;
mod manual;
mod messages;
mod new;
mod output;
mod plot;
mod probe_rs;
mod problem;
mod program;
#[cfg(test)]
mod proportion;
mod recording_error;
#[cfg(feature = "view")]
mod redirect;
mod report;
mod robots;
mod run;
mod scratch;
mod selection;
mod shell;
mod sim;
mod stubs;
mod trace;
mod unfinished;
#[cfg(feature = "view")]
mod view;
mod whole_file;
mod world;

use std::ffi::OsString;
use std::io::{self, Write};
use std::thread;

use bittybuzz_live::Defect;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use exit::ExitStatus;
pub use launch::Launch;
use problem::Problem;

const EXAMPLES: &str = "\
Examples:
  bbz new flock --robot kilobot          make a folder with a script and a scenario to begin with
  bbz run hello.bzz                      run a script on this computer
  bbz check hello.bzz --robot kilobot    find mistakes without running it
  bbz build hello.bzz --robot kilobot    make the image that the robot runs
  bbz sim swarm.toml                     simulate the robots of a scenario
  bbz sim hello.bzz --robot kilobot --count 20    or of a script without one
  bbz plot study 'mean(global.hops)' -o hops.svg    draw the runs of bbz sim --runs 30 --data study
  bbz import field.argos -o field.toml   write a scenario for an experiment of ARGoS
  bbz flash hello.bzz --robot crazyflie  write it to the robot
  bbz trace robot.elf --robot crazyflie --script hello.bzz    print its log and errors
  bbz robots kilobot                     list what a script can call on a robot
  bbz explain E0201                      explain a message
  bbz guide                              print all of this as one page, also for coding assistants

Exit status: 0, or 1 run-time error, 2 compile error, 3 wrong command line or file, 101 defect of bbz.";

#[derive(Debug, Parser)]
#[command(version, about = "Checks, builds, runs and explains Buzz scripts for robots", after_help = EXAMPLES)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Make a folder with a script, a scenario and a README that run
    New(new::NewArguments),
    /// Find the mistakes of a script
    Check(check::CheckArguments),
    /// Make the image that a robot runs
    Build(build::BuildArguments),
    /// Run a script on this computer
    Run(run::RunArguments),
    /// Simulate the robots of a scenario and check its expectations
    Sim(sim::SimArguments),
    /// Simulate many runs in a folder that processes and computers share
    Sweep(sim::sweep::SweepArguments),
    /// Show a recording of a simulation in a page
    #[cfg(feature = "view")]
    View(view::ViewArguments),
    /// Convert a recording to a table for Python, R or a spreadsheet
    Export(export::ExportArguments),
    /// Draw the tables of runs as curves with quartiles
    Plot(plot::PlotArguments),
    /// Run the results of an assignment again
    Grade(grade::GradeArguments),
    /// Write a script to a robot, and if asked the firmware
    Flash(flash::FlashArguments),
    /// Print a robot's log lines and errors, live
    Trace(trace::TraceArguments),
    /// Show the instructions that a script compiles to
    Disasm(disasm::DisasmArguments),
    /// List the robots, or the functions and limits of one
    Robots(robots::RobotsArguments),
    /// Write a robot file for the robot functions that a script calls
    Stubs(stubs::StubsArguments),
    /// Write a scenario for an experiment of ARGoS
    Import(import::ImportArguments),
    /// Explain the code of a message
    Explain(explain::ExplainArguments),
    /// Print the language, all functions and the commands as one page
    Guide(guide::GuideArguments),
    /// Print the script by which a shell completes command lines of bbz
    Completions(completions::CompletionsArguments),
    /// Write the manual pages of all commands
    Manual(manual::ManualArguments),
}

/// The stack of the thread that does everything, in bytes: that of the first thread on Linux. There,
/// `ulimit -s` may make it smaller, and on Windows it has 1 MiB, but a script's memory is as large.
const STACK: usize = 8 << 20;

/// Runs the tool in this process and returns its exit status, once per process: a second call is
/// refused with status 3.
///
/// The tool has the process to itself. It works on a thread of its own while the caller waits. It
/// takes over panics, and Ctrl-C and SIGTERM while a command has something to finish, whatever handled
/// them before. At other times they end the process by their default actions: a caller that has
/// handlers of its own, such as an interpreter, removes them first.
pub fn main(launch: Launch) -> u8 {
    let Some(launch) = launch::begin(launch) else {
        let help = "start another process for another command".to_owned();
        report::mistake("this process has run a command of bbz before", None, Some(help));
        return ExitStatus::Usage as u8;
    };
    Defect::print_uncaught_by(report::defect);
    interrupt::outlive_file_limit();
    let worker = thread::Builder::new().stack_size(STACK).spawn(|| run_command_line(launch));
    let status = match worker {
        // The hook has printed the defect that ended the thread.
        Ok(worker) => worker.join().unwrap_or(ExitStatus::Defect),
        // There is no room for another stack.
        Err(_) => run_command_line(launch),
    };
    // Only programs of Rust write the rest of this buffer at their end. A failure was reported.
    let _ = io::stdout().flush();
    status as u8
}

/// Parses the command line and carries it out.
fn run_command_line(launch: &Launch) -> ExitStatus {
    let command_line = match parse(launch) {
        Ok(command_line) => command_line,
        Err(message) => {
            // Help is a message too, but no mistake. If printing fails, there is no reader.
            report::command_line(&message);
            return if message.use_stderr() { ExitStatus::Usage } else { ExitStatus::Success };
        }
    };
    execute(&command_line.command).unwrap_or_else(|problem| {
        report::problem(&*problem);
        ExitStatus::Usage
    })
}

/// Parses the command line. Usage lines begin with the words that started the tool.
fn parse(launch: &Launch) -> Result<CommandLine, clap::Error> {
    let name = launch.name();
    let mut command = CommandLine::command().bin_name(&name);
    let words = [OsString::from(name)].into_iter().chain(launch.arguments.iter().cloned());
    let matches = command.try_get_matches_from_mut(words)?;
    CommandLine::from_arg_matches(&matches).map_err(|message| message.format(&mut command))
}

/// Carries out a command.
fn execute(command: &Command) -> Result<ExitStatus, Box<dyn Problem>> {
    match command {
        Command::New(arguments) => new::execute(arguments),
        Command::Check(arguments) => check::execute(arguments),
        Command::Build(arguments) => build::execute(arguments),
        Command::Run(arguments) => run::execute(arguments),
        Command::Sim(arguments) => sim::execute(arguments),
        Command::Sweep(arguments) => sim::sweep::execute(arguments),
        #[cfg(feature = "view")]
        Command::View(arguments) => view::execute(arguments),
        Command::Export(arguments) => export::execute(arguments),
        Command::Plot(arguments) => plot::execute(arguments),
        Command::Grade(arguments) => grade::execute(arguments),
        Command::Flash(arguments) => flash::execute(arguments),
        Command::Trace(arguments) => trace::execute(arguments),
        Command::Disasm(arguments) => disasm::execute(arguments),
        Command::Robots(arguments) => robots::execute(arguments),
        Command::Stubs(arguments) => stubs::execute(arguments),
        Command::Import(arguments) => import::execute(arguments),
        Command::Explain(arguments) => explain::execute(arguments),
        Command::Guide(arguments) => guide::execute(arguments, CommandLine::command()),
        Command::Completions(arguments) => {
            Ok(completions::execute(arguments, CommandLine::command())?)
        }
        Command::Manual(arguments) => Ok(manual::execute(arguments, CommandLine::command())?),
    }
}
