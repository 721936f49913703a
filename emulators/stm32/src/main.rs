//! `bbz-emulate-stm32`: runs the firmware image of an STM32 robot, as it is flashed.
//!
//! The cores are those of `bittybuzz-unicorn`, whose documentation lists their limits; the boards
//! are those of the robots.

use std::process::ExitCode;

use bittybuzz_crazyflie_board::CrazyflieBoard;
use bittybuzz_emulation::Control;
use bittybuzz_unicorn::UnicornCore;
use bittybuzz_zooids_board::ZooidBoard;
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
    #[arg(long, value_enum, default_value_t = RobotName::Crazyflie)]
    robot: RobotName,
    /// Number of robots, which hear each other's radio (Zooids)
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=100))]
    count: u8,
}

#[derive(Clone, Copy, ValueEnum)]
enum RobotName {
    Crazyflie,
    Zooids,
}

fn main() -> ExitCode {
    let Arguments { robot, count } = Arguments::parse();
    let outcome = match robot {
        RobotName::Crazyflie => play::<CrazyflieBoard>(count.into()),
        RobotName::Zooids => play::<ZooidBoard>(count.into()),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Emulates robots with this board until the input ends.
fn play<B: Control + 'static>(count: usize) -> Result<(), String> {
    let output = std::io::BufWriter::new(std::io::stdout().lock());
    let input = std::io::stdin().lock();
    match bittybuzz_emulation::serve::<UnicornCore<'_, B>>(count, input, output) {
        // The program at the other end of the pipe has ended.
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(error.to_string()),
        _ => Ok(()),
    }
}
