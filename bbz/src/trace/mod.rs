//! `bbz trace`: the reports of a robot about its script and itself.
//!
//! A source (a robot on a debug probe, an emulated robot, lines of text) gives
//! [`message::PrintedMessage`]s; a [`TracePrinter`] prints them.

mod emulated;
mod json;
mod lines;
mod message;
mod printer;
mod source;
#[cfg(feature = "view")]
mod view;

#[cfg(test)]
pub use lines::parse as parse_line;

use std::path::{Path, PathBuf};
use std::time::Duration;

use bittybuzz_robot_spec::Robot;
use clap::Args;

use crate::exit::ExitStatus;
use crate::interrupt::Interrupt;
use crate::problem::Problem;
use crate::program::LoadedProgram;
use crate::report;
use crate::selection::SelectionArguments;

use emulated::TracedEmulation;
use printer::{TraceFormat, TracePrinter, TracedScript};

/// A reason why there is nothing to trace.
#[derive(Debug, thiserror::Error)]
enum TraceError {
    /// `--emulate` was given without a firmware file.
    #[error("there is no firmware to emulate")]
    NoFirmware,
    /// The source needs a robot, and none is named.
    #[error("the robot is not named")]
    NoRobot,
}

impl Problem for TraceError {
    fn help(&self) -> Option<String> {
        let help = match self {
            TraceError::NoFirmware => "name the firmware (ELF) in place of -",
            TraceError::NoRobot => "name it, as in --robot NAME; `bbz robots` lists them",
        };
        Some(help.to_owned())
    }
}

const EXAMPLES: &str = "\
Examples:
  bbz trace firmware.elf --robot crazyflie --script blink.bzz
                                         a robot on a debug probe, until Ctrl-C
  bbz trace firmware.elf --robot crazyflie --script blink.bzz --emulate
                                         an emulated robot with that script, until Ctrl-C
  bbz trace firmware.elf --robot crazyflie --script blink.bzz --emulate --seconds 10 --outputs
                                         ten simulated seconds at full speed, with LEDs and motors
  cargo run --locked --release | bbz trace - --script blink.sym
                                         what another program has read from the robot
  stty -F /dev/ttyUSB0 38400 raw; bbz trace - --robot kilobot --script blink.bzz < /dev/ttyUSB0
                                         Kilobots that stop, heard by one that listens (firmware/kilobot-avr)
  bbz trace firmware.elf --robot crazyflie --script blink.bzz --emulate --seconds 2 --plain
                                         only what the script logs, as `bbz run` prints it
  bbz trace firmware.elf --robot crazyflie --script blink.bzz --view
                                         in a page: log lines, and faults with their lines
  bbz trace kilobot.elf --robot kilobot --script blink.bzz --emulate --outputs
                                         an emulated Kilobot, started by its controller; it reports faults only

A line is the time in seconds, what it is about, and the text. The time is the robot's own clock, of an emulated
robot the time since power-on. `step N` is a line that the script logged after N complete steps; levels such as INFO
are messages of the firmware.

The robot on a probe is read by probe-rs (environment variable PROBE_RS_PROBE chooses among several probes). Not
tried on hardware. Emulators are programs beside bbz or in PATH; with --script the script is written to the
emulated robot, a real one keeps its own (`bbz flash` changes it).

Exit status: 0, or 1 the script or the firmware has failed, 2 compile error, 3 wrong command line or file, an image
that the robot refuses, no probe.";

/// Arguments of `bbz trace`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct TraceArguments {
    /// Firmware that runs on the robot (ELF), or - for lines of text on standard input
    firmware: PathBuf,
    #[command(flatten)]
    selection: SelectionArguments,
    /// The script that the robot runs (.bzz, .bo, .bbi or .sym), for names, lines and strings
    #[arg(long, value_name = "FILE", visible_alias = "symbols")]
    script: Option<PathBuf>,
    /// Folder to search for included files; may be given several times
    #[arg(short = 'I', value_name = "DIR")]
    include: Vec<PathBuf>,
    /// Emulate the robot instead of reading from one
    #[arg(long)]
    emulate: bool,
    /// Program that emulates, such as bbz-emulate-qemu [default: bbz-emulate-avr for Kilobots, else bbz-emulate-stm32]
    #[arg(long, value_name = "PROGRAM", requires = "emulate")]
    emulator: Option<PathBuf>,
    /// Simulated seconds, at full speed [default: in real time until Ctrl-C]
    #[arg(long, value_name = "N", value_parser = seconds, requires = "emulate")]
    seconds: Option<Duration>,
    /// Also print what LEDs and motors do
    #[arg(long, requires = "emulate")]
    outputs: bool,
    /// Print only what the script logs
    #[arg(long)]
    plain: bool,
    /// Print a JSON object per line
    #[arg(long, conflicts_with = "plain")]
    json: bool,
    /// Show it in a page on this computer, instead of printing it
    #[cfg(feature = "view")]
    #[arg(long, conflicts_with_all = ["plain", "json"])]
    view: bool,
    /// Print the address of the page and open no browser
    #[cfg(feature = "view")]
    #[arg(long, requires = "view")]
    no_browser: bool,
    /// End when the script stops
    #[arg(long)]
    until_fault: bool,
}

/// Carries out the command.
pub fn execute(arguments: &TraceArguments) -> Result<ExitStatus, Box<dyn Problem>> {
    let selection = arguments.selection.select()?;
    let program = match &arguments.script {
        None => None,
        Some(path) => match LoadedProgram::open_with_symbols(path, &arguments.include, &selection)?
        {
            Some(program) => Some(program),
            None => return Ok(ExitStatus::CompileError),
        },
    };
    let format = match (arguments.plain, arguments.json) {
        (true, _) => TraceFormat::Plain,
        (false, true) => TraceFormat::Json,
        (false, false) => TraceFormat::Text,
    };
    let robot = selection.robot.as_ref();
    let script = arguments.script.as_deref().zip(program.as_ref());
    let script_for_reports = script.map(|(path, program)| TracedScript {
        name: report::printable(&path.to_string_lossy()),
        program,
    });
    let printer = TracePrinter::new(script_for_reports, robot, format, arguments.until_fault);
    let interrupt = Interrupt::install()?;
    #[cfg(feature = "view")]
    if arguments.view {
        let kind = robot.map_or("robot", |robot| &robot.name);
        return view::show(arguments.no_browser, kind, printer, interrupt, |printer, interrupt| {
            listen(arguments, robot, script, printer, interrupt)
        });
    }
    let (mut printer, mut interrupt) = (printer, interrupt);
    listen(arguments, robot, script, &mut printer, &mut interrupt)?;
    Ok(printer.finish()?)
}

/// Passes the messages of the source on until the source ends, or Ctrl-C.
fn listen(
    arguments: &TraceArguments,
    robot: Option<&Robot>,
    script: Option<(&Path, &LoadedProgram)>,
    printer: &mut TracePrinter<'_>,
    interrupt: &mut Interrupt,
) -> Result<(), Box<dyn Problem>> {
    if arguments.firmware == Path::new("-") {
        if arguments.emulate {
            return Err(TraceError::NoFirmware.into());
        }
        return Ok(source::standard_input(printer, interrupt)?);
    }
    let robot = robot.ok_or(TraceError::NoRobot)?;
    if arguments.emulate {
        let emulation = TracedEmulation {
            program: arguments.emulator.as_deref(),
            firmware: &arguments.firmware,
            robot,
            script,
            duration: arguments.seconds,
            outputs: arguments.outputs,
        };
        emulation.run(printer, interrupt)
    } else {
        source::probe(robot, &arguments.firmware, printer, interrupt)
    }
}

/// Parses a number of seconds, such as `10` or `0.5`.
fn seconds(text: &str) -> Result<Duration, String> {
    let number: f64 = text.parse().map_err(|_| "not a number".to_owned())?;
    Duration::try_from_secs_f64(number).map_err(|error| error.to_string())
}
