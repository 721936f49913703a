//! Lines of text from standard input, or from probe-rs on a robot's debug port.

use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use bittybuzz_robot_spec::Robot;
use bittybuzz_toml_reader::file;

use crate::file_error::FileError;
use crate::interrupt::Interrupt;
use crate::probe_rs::{self, ProbeRs};
use crate::problem::Problem;

use super::lines;
use super::printer::TracePrinter;

/// Standard input, or the output of another program, cannot be read.
#[derive(Debug, thiserror::Error)]
#[error("cannot read the robot's messages: {0}")]
pub struct LinesError(io::Error);

impl Problem for LinesError {}

/// The most lines that wait to be printed.
const WAITING: usize = 1024;

/// The most bytes of a line. A robot prints far fewer, so a longer one is not text from a robot.
const LINE_BYTES_MAX: u64 = 1 << 20;

/// Time between two checks for Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(50);

/// Prints the lines of standard input.
pub fn standard_input(
    printer: &mut TracePrinter<'_>,
    interrupt: &mut Interrupt,
) -> Result<(), LinesError> {
    let lines = read_aside(io::stdin());
    print(&lines, printer, interrupt)
}

/// Prints the bytes that probe-rs reads from the robot.
pub fn probe(
    robot: &Robot,
    firmware: &Path,
    printer: &mut TracePrinter<'_>,
    interrupt: &mut Interrupt,
) -> Result<(), Box<dyn Problem>> {
    file::open(firmware).map_err(|error| FileError::reading(firmware, error))?;
    let chip = probe_rs::chip(robot)?;
    // A trace must not stall the robot: a core that the probe halts at a fault could not stop the
    // motors any more, nor could firmware that waits, with interrupts masked, until a full buffer
    // is read.
    let mut child = ProbeRs::new("attach", chip)
        .args(["--no-catch-hardfault", "--no-catch-reset", "--rtt-channel-mode", "no-block-skip"])
        .args(["--log-format", lines::FORMAT])
        .arg(firmware)
        .spawn()?;
    let lines = read_aside(child.take_stdout());
    print(&lines, printer, interrupt)?;
    if printer.is_over() || interrupt.is_raised() {
        child.end()?;
    } else {
        child.finish()?;
    }
    Ok(())
}

/// Prints lines until the input ends, the printer is over, or Ctrl-C.
fn print(
    lines: &Receiver<io::Result<String>>,
    printer: &mut TracePrinter<'_>,
    interrupt: &mut Interrupt,
) -> Result<(), LinesError> {
    while !printer.is_over() && !interrupt.is_raised() {
        match lines.recv_timeout(PATIENCE) {
            Ok(line) => printer.print(&lines::parse(&line.map_err(LinesError)?)),
            Err(RecvTimeoutError::Timeout) => printer.flush(),
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    Ok(())
}

/// Reads lines in another thread, because a read cannot be interrupted, but a wait for this thread
/// can.
fn read_aside(input: impl Read + Send + 'static) -> Receiver<io::Result<String>> {
    let (sender, receiver) = mpsc::sync_channel(WAITING);
    thread::spawn(move || {
        let mut input = BufReader::new(input);
        // After an error nothing more is read.
        while let Some(line) = read_line(&mut input).transpose() {
            let is_last = line.is_err();
            if sender.send(line).is_err() || is_last {
                return;
            }
        }
    });
    receiver
}

/// Reads a line without its line break; `None` at the end of the input.
fn read_line(input: &mut impl BufRead) -> io::Result<Option<String>> {
    let mut line = Vec::new();
    input.take(LINE_BYTES_MAX + 1).read_until(b'\n', &mut line)?;
    if line.is_empty() {
        return Ok(None);
    }
    if line.last() == Some(&b'\n') {
        line.pop();
    } else if line.len() as u64 > LINE_BYTES_MAX {
        return Err(io::Error::other("a line has more than 1 MiB"));
    }
    Ok(Some(String::from_utf8_lossy(&line).into_owned()))
}
