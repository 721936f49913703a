//! `bbz-emulate-stm32`: runs the firmware image of an STM32 robot, as it is flashed.
//!
//! Unicorn executes the instructions; [`bittybuzz_chips`] is the board; this program is what stands between
//! them in a Cortex-M4F: exceptions, the interrupt controller, SysTick and the system control block, from the
//! ARMv7-M Architecture Reference Manual (DDI 0403).
//!
//! # Principles
//! 1. **One clock cycle per instruction**, and those that a Cortex-M4 takes to enter and leave an exception.
//!    Blocks are counted when they begin, so what happens within one happens at its end. The robot is slower
//!    than that: by wait states, by the pipeline, by division.
//! 2. **The core sleeps for free.** While it waits for an event, time jumps to the next one.
//! 3. **Faults are the firmware's.** A bad access, an undefined instruction, a bad return enter its handlers;
//!    a fault within those is the lockup that it is on the chip.
//!
//! # What it will not do
//! Flush a pipeline, protect memory (MPU), alias bits (bit-banding), or halt for a debugger. Floating-point
//! registers are stacked at once, never lazily. Unicorn's Cortex-M is a Cortex-M33: it also executes
//! instructions of ARMv8-M that a Cortex-M4 does not know, and floating point before CPACR allows it.

mod blocks;
mod clock;
mod core;
mod exception;
mod nvic;
mod private;
mod robot;
mod system;
mod systick;
#[cfg(test)]
mod tests;

use std::process::ExitCode;

use bittybuzz_chips::{Crazyflie, Zooid};
use bittybuzz_emulation::Control;

const USAGE: &str = "\
bbz-emulate-stm32: runs the firmware image of a robot, as it is flashed

Options:
  --robot ROBOT    crazyflie [default] or zooids
  --count N        so many of them, 1 to 100, which hear each other's radio [default: 1]

It reads commands from standard input and writes replies and events to standard output, one JSON object
per line; docs/emulation.md describes them. `bbz trace` starts it by itself.

Try: echo '{\"command\":\"load\",\"elf\":\"FIRMWARE\"}
           {\"command\":\"run\",\"until_ns\":1000000000}' | bbz-emulate-stm32
";

/// More would be a mistake: a robot takes some MiB.
const MOST: usize = 100;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args_os()
        .skip(1)
        .map(|argument| argument.to_string_lossy().into_owned())
        .collect();
    let mut robot = "crazyflie";
    let mut count = 1;
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        match argument.as_str() {
            "--help" | "-h" => {
                print!("{USAGE}");
                return ExitCode::SUCCESS;
            }
            "--robot" => match rest.next().map(String::as_str) {
                Some(name @ ("crazyflie" | "zooids")) => robot = name,
                _ => return refuse("--robot is crazyflie or zooids"),
            },
            "--count" => match rest.next().and_then(|count| count.parse().ok()) {
                Some(number @ 1..=MOST) => count = number,
                _ => return refuse("--count is a number from 1 to 100"),
            },
            other => return refuse(&format!("what is {other}?")),
        }
    }
    let outcome = match robot {
        "zooids" => play::<Zooid>(count),
        _ => play::<Crazyflie>(count),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn refuse(mistake: &str) -> ExitCode {
    eprint!("error: {mistake}\n\n{USAGE}");
    ExitCode::from(3)
}

/// Plays so many robots with this board until the input ends.
fn play<B: Control + 'static>(count: usize) -> Result<(), String> {
    let robots: Result<Vec<_>, _> = (0..count).map(robot::Robot::<B>::new).collect();
    let mut robots = robots.map_err(|error| error.to_string())?;
    let output = std::io::BufWriter::new(std::io::stdout().lock());
    match bittybuzz_emulation::serve(&mut robots, std::io::stdin().lock(), output) {
        // Whoever started this program is gone.
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.to_string()),
        _ => Ok(()),
    }
}
