//! Lines of text from standard input, or from probe-rs beside a robot.

use std::io::{self, BufRead, BufReader, Read};
use std::path::Path;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::Duration;

use bittybuzz_robots::Robot;

use crate::interrupt::Interrupt;
use crate::probe_rs::{self, ProbeRs};
use crate::problem::Problem;

use super::lines;
use super::teller::Teller;

/// Lines that may wait to be printed.
const WAITING: usize = 1024;

/// Time between two looks at Ctrl-C.
const PATIENCE: Duration = Duration::from_millis(50);

/// Prints what comes on standard input.
pub fn standard_input(teller: &mut Teller<'_>, interrupt: &mut Interrupt) -> Result<(), Problem> {
    let lines = read_aside(io::stdin());
    tell(&lines, teller, interrupt)
}

/// Prints what probe-rs reads from the robot.
pub fn probe(
    robot: &Robot,
    firmware: &Path,
    teller: &mut Teller<'_>,
    interrupt: &mut Interrupt,
) -> Result<(), Problem> {
    std::fs::File::open(firmware).map_err(|error| Problem::unreadable(firmware, error))?;
    let chip = probe_rs::chip(robot)?;
    // Whoever watches must not hold the robot up: a core that the probe stops at a fault could not stop the motors any
    // more, nor could firmware that waits, with interrupts masked, for a full buffer to be read.
    let mut child = ProbeRs::new("attach", chip)
        .args(["--no-catch-hardfault", "--no-catch-reset", "--rtt-channel-mode", "no-block-skip"])
        .args(["--log-format", lines::FORMAT])
        .arg(firmware)
        .spawn()?;
    let lines = read_aside(child.take_stdout());
    tell(&lines, teller, interrupt)?;
    if teller.is_over() || interrupt.is_raised() { child.end() } else { child.finish() }
}

/// Prints lines until there are no more, nobody wants more, or Ctrl-C.
fn tell(
    lines: &Receiver<io::Result<String>>,
    teller: &mut Teller<'_>,
    interrupt: &mut Interrupt,
) -> Result<(), Problem> {
    while !teller.is_over() && !interrupt.is_raised() {
        match lines.recv_timeout(PATIENCE) {
            Ok(line) => teller.tell(&lines::parse(&line.map_err(Problem::Input)?)),
            Err(RecvTimeoutError::Timeout) => teller.flush(),
            Err(RecvTimeoutError::Disconnected) => break,
        }
    }
    Ok(())
}

/// Reads lines in another thread: a read cannot be interrupted, a wait for this one can.
fn read_aside(input: impl Read + Send + 'static) -> Receiver<io::Result<String>> {
    let (sender, receiver) = mpsc::sync_channel(WAITING);
    thread::spawn(move || {
        for line in BufReader::new(input).split(b'\n') {
            let line = line.map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
            if sender.send(line).is_err() {
                return;
            }
        }
    });
    receiver
}
