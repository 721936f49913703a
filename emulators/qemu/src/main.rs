//! `bbz-emulate-qemu`: boots a robot's firmware in stock QEMU, with the peripherals of `bittybuzz-chips`.
//!
//! The core is that of `bittybuzz-qemu`, whose documentation lists its limits; the boards are those
//! of the robots.

use std::io::{stdin, stdout};
use std::process::ExitCode;

use bittybuzz_crazyflie_board::CrazyflieBoard;
use bittybuzz_emulation::{Control, serve};
use bittybuzz_qemu::QemuCore;
use bittybuzz_zooids_board::ZooidBoard;
use clap::{Parser, ValueEnum};

/// Emulates a robot with stock QEMU; reads commands from standard input and writes replies and events to
/// standard output, one JSON object per line (docs/emulation.md).
#[derive(Parser)]
#[command(
    version,
    after_help = "Example:\n  \
    printf '%s\\n' '{\"command\":\"load\",\"elf\":\"crazyflie\"}' '{\"command\":\"run\",\"until_ns\":1000000000}' \
    | bbz-emulate-qemu\n\n\
    Needs qemu-system-arm 7.2 or later (package qemu-system-arm)."
)]
struct Arguments {
    /// Which robot
    #[arg(long, value_enum, default_value_t = RobotName::Crazyflie)]
    robot: RobotName,
}

#[derive(Clone, Copy, ValueEnum)]
enum RobotName {
    Crazyflie,
    Zooids,
}

fn main() -> ExitCode {
    match Arguments::parse().robot {
        RobotName::Crazyflie => play::<CrazyflieBoard>(),
        RobotName::Zooids => play::<ZooidBoard>(),
    }
}

/// Emulates a robot with this board until the input ends.
fn play<B: Control>() -> ExitCode {
    match serve::<QemuCore<B>>(1, stdin().lock(), stdout().lock()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bbz-emulate-qemu: the pipe to the caller broke: {error}");
            ExitCode::FAILURE
        }
    }
}
