//! `bbz-emulate-stm32`: runs the firmware image of an STM32 robot, as it is flashed.
//!
//! Unicorn executes the instructions; [`bittybuzz_chips`] is the board; this program is what stands between
//! them in a Cortex-M4F: exceptions, the interrupt controller, SysTick and the system control block, from the
//! ARMv7-M Architecture Reference Manual (DDI 0403), and what of them a Cortex-M0 has (ARMv6-M, DDI 0419).
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
//! instructions of ARMv8-M that a Cortex-M4 does not know, and floating point before CPACR allows it. In the place of
//! a Cortex-M0 it is refused what ARMv6-M lacks, but not accesses that are not aligned.

mod blocks;
mod core;
mod exception;
mod memory;
mod nvic;
mod private;
mod robot;
mod system;
mod systick;
#[cfg(test)]
mod tests;

use std::process::ExitCode;

use bittybuzz_crazyflie_board::Crazyflie;
use bittybuzz_emulation::Control;
use bittybuzz_zooids_board::Zooid;
use clap::{Parser, ValueEnum};

/// Runs the firmware image of a robot, as it is flashed; reads commands from standard input and writes replies and
/// events to standard output, one JSON object per line (docs/emulation.md). `bbz trace` starts it by itself.
#[derive(Parser)]
#[command(
    version,
    after_help = "Example:\n  \
    printf '%s\\n' '{\"command\":\"load\",\"elf\":\"FIRMWARE\"}' '{\"command\":\"run\",\"until_ns\":1000000000}' \
    | bbz-emulate-stm32"
)]
struct Arguments {
    /// Which robot
    #[arg(long, value_enum, default_value_t = Kind::Crazyflie)]
    robot: Kind,
    /// So many of them, which hear each other's radio (Zooids)
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=100))]
    count: u8,
}

#[derive(Clone, Copy, ValueEnum)]
enum Kind {
    Crazyflie,
    Zooids,
}

fn main() -> ExitCode {
    let Arguments { robot, count } = Arguments::parse();
    let outcome = match robot {
        Kind::Crazyflie => play::<Crazyflie>(count.into()),
        Kind::Zooids => play::<Zooid>(count.into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
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
