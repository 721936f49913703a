//! `bbz-emulate-m0`: runs the firmware image of a Zooid, as it is flashed, on other cores than `bbz-emulate-stm32`.
//!
//! There are two cores to choose from: that of `bittybuzz-cortex-m0`, for speed, and the Cortex-M0+ of `rp2040-emu`, written by
//! others, as a second opinion. Board, protocol and image are those of `bbz-emulate-stm32`.
//!
//! # What is different from `bbz-emulate-stm32`
//! * Instructions take the cycles of the core's manual, with memory that never waits.
//! * Accesses that are not aligned are faults, as on the chip.
//!
//! # What it will not do
//! * SysTick. Its registers read 0.
//! * With `--core rp2040`, nest interrupts: one waits until the other has returned, whatever their priorities. Nor interrupts 26 to
//!   31: USART1 and USART2, which no robot uses.
//!
//! Not compared with hardware.

mod bus;
mod private;
mod robot;

use std::io::{BufWriter, ErrorKind, stdin, stdout};
use std::process::ExitCode;

use bittybuzz_emulation::Machine;
use bittybuzz_zooids_board::Zooid;
use clap::{Parser, ValueEnum};

/// Runs the firmware image of a Zooid; reads commands from standard input and writes replies and events to standard
/// output, one JSON object per line (docs/emulation.md).
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// So many of them, which hear each other's radio
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=100))]
    count: u8,
    /// Which robot: there is only one that has this core
    #[arg(long, default_value = "zooids", value_parser = ["zooids"])]
    robot: String,
    /// Which core
    #[arg(long, value_enum, default_value_t = Core::Own)]
    core: Core,
}

#[derive(Clone, Copy, ValueEnum)]
enum Core {
    /// bittybuzz-cortex-m0: fast
    Own,
    /// rp2040-emu: written by others
    Rp2040,
}

fn main() -> ExitCode {
    let Arguments { count, core, .. } = Arguments::parse();
    let numbers = 0..usize::from(count);
    match core {
        Core::Own => play(numbers.map(bittybuzz_cortex_m0::Robot::<Zooid>::new).collect()),
        Core::Rp2040 => play(numbers.map(robot::Robot::<Zooid>::new).collect()),
    }
}

fn play<M: Machine>(mut robots: Vec<M>) -> ExitCode {
    let output = BufWriter::new(stdout().lock());
    match bittybuzz_emulation::serve(&mut robots, stdin().lock(), output) {
        // Whoever started this program is gone.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
        _ => ExitCode::SUCCESS,
    }
}
