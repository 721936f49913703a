//! `bbz-emulate-m0`: runs the firmware image of a Zooid, as it is flashed, on other cores than `bbz-emulate-stm32`.
//!
//! There are two cores: that of `bittybuzz-cortex-m0`, which is fast, and the Cortex-M0+ of
//! `rp2040-emu`, an independent implementation that serves as a second opinion. Board, protocol and
//! image are those of `bbz-emulate-stm32`.
//!
//! # What is different from `bbz-emulate-stm32`
//! * Instructions take the cycles of the core's manual, with memory without wait states.
//! * Unaligned accesses are faults, as on the chip.
//!
//! The documentation of each core's crate lists its limits. The emulation was not compared with
//! hardware.

use std::io::{BufWriter, ErrorKind, stdin, stdout};
use std::process::ExitCode;

use bittybuzz_cortex_m0::CortexM0;
use bittybuzz_emulation::{Core, serve};
use bittybuzz_rp2040::Rp2040Core;
use bittybuzz_zooids_board::ZooidBoard;
use clap::{Parser, ValueEnum};

/// Runs the firmware image of a Zooid; reads commands from standard input and writes replies and events to standard
/// output, one JSON object per line (docs/emulation.md).
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Number of robots, which hear each other's radio
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=100))]
    count: u8,
    /// Which robot: there is only one that has this core
    #[arg(long, default_value = "zooids", value_parser = ["zooids"])]
    robot: String,
    /// Which core
    #[arg(long, value_enum, default_value_t = CoreName::Own)]
    core: CoreName,
}

#[derive(Clone, Copy, ValueEnum)]
enum CoreName {
    /// bittybuzz-cortex-m0: fast
    Own,
    /// rp2040-emu: written by others
    Rp2040,
}

fn main() -> ExitCode {
    let Arguments { count, core, .. } = Arguments::parse();
    match core {
        CoreName::Own => play::<CortexM0<ZooidBoard>>(count.into()),
        CoreName::Rp2040 => play::<Rp2040Core<ZooidBoard>>(count.into()),
    }
}

/// Emulates robots with this core until the input ends.
fn play<C: Core>(count: usize) -> ExitCode {
    let output = BufWriter::new(stdout().lock());
    match serve::<C>(count, stdin().lock(), output) {
        // The program at the other end of the pipe has ended.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
        _ => ExitCode::SUCCESS,
    }
}
