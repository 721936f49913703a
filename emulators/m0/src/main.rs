//! `bbz-emulate-m0`: runs the firmware image of a Zooid, as it is flashed, on the fast core of
//! `bittybuzz-cortex-m0`. Board, protocol and image are those of `bbz-emulate-stm32`.
//!
//! # What is different from `bbz-emulate-stm32`
//! * Instructions take the cycles of the core's manual, with memory without wait states.
//! * Unaligned accesses are faults, as on the chip.
//!
//! The documentation of the core's crate lists its limits. The emulation was not compared with
//! hardware.

use std::io::{BufWriter, ErrorKind, stdin, stdout};
use std::process::ExitCode;

use bittybuzz_cortex_m0::CortexM0;
use bittybuzz_emulation::serve;
use bittybuzz_zooids_board::ZooidBoard;
use clap::Parser;

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
    /// Which core: there is only one, that of bittybuzz-cortex-m0
    #[arg(long, default_value = "own", value_parser = ["own"])]
    core: String,
}

fn main() -> ExitCode {
    let Arguments { count, .. } = Arguments::parse();
    let output = BufWriter::new(stdout().lock());
    match serve::<CortexM0<ZooidBoard>>(count.into(), stdin().lock(), output) {
        // The program at the other end of the pipe has ended.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
        _ => ExitCode::SUCCESS,
    }
}
