//! `bbz-emulate-avr`: runs the firmware image of Kilobots, as it is flashed.
//!
//! simavr executes instructions, `bittybuzz-chips` has the rest of the ATmega328P, and
//! `bittybuzz-kilobot-board` the rest of the robot. This program connects them: it has interrupts
//! and sleep, and the light between robots.
//!
//! # Principles
//! 1. **Cycles are those of the data sheet**: instructions take the cycles that simavr counts,
//!    interrupts and halts those of the data sheet, and each robot's oscillator gives the length of
//!    its cycles.
//! 2. **Light is pulses, not messages.** A robot sends the edges of its pin. A neighbor's program
//!    receives edges of the comparator and readings of the converter. Two robots that send at the
//!    same time are seen at the same time.
//! 3. **Results are reproducible**: the same commands give the same answers, on one thread or on
//!    many.
//!
//! # Windows of time
//! Light takes no time, and a program may turn its LED on at any instruction, so no robot can
//! safely run ahead of another. Robots therefore run speculatively for a window of half a
//! millisecond, independently and on all threads, and save their state at its beginning (RAM,
//! registers and board: 5 KB, and the flash pages that they wrote). Then the program compares their
//! pulses with those that the other robots assumed. A robot that should have seen other light goes
//! back and runs the window again. Each round is correct until a later moment than the round
//! before, so rounds end, with the result that running instruction by instruction would have.
//!
//! A robot that sends has its interrupts masked and reads its receiver at one place only, for 4.4
//! ms. So robots that were sending at the end of the last window run first, and all others run with
//! their pulses known: a second round is rare, except where a message begins. A robot that sleeps
//! and sees no light is not run at all.
//!
//! # What it will not do
//! It does not model parts that no Kilobot uses: SPI, TWI, external and pin change interrupts, the
//! receiver of the USART, lock bits, fuses (assumed: 8 MHz, boot section of 2048 words, reset at
//! 0), reading the signature by `lpm`.

mod air;
mod fleet;
mod robot;

use std::io::{BufWriter, ErrorKind, stdin, stdout};
use std::process::ExitCode;

use bittybuzz_simavr::SimavrChip;
use clap::{Parser, ValueEnum};

/// Runs the firmware image of Kilobots; reads commands from standard input and writes replies and events to standard
/// output, one JSON object per line (docs/emulation.md).
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Number of robots, which see each other's infrared light
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=100))]
    count: u8,
    /// Which robot: there is only one that has this core
    #[arg(long, default_value = "kilobot", value_parser = ["kilobot"])]
    robot: String,
    /// A larger chip runs programs for which a Kilobot has no room
    #[arg(long, value_enum, default_value = "atmega328p")]
    chip: ChipName,
    /// Number of threads; as many as the computer has if not given
    #[arg(long, default_value_t = 0)]
    threads: usize,
}

#[derive(Clone, Copy, ValueEnum)]
enum ChipName {
    /// The chip of Kilobots
    Atmega328p,
    /// A chip for programs that are too large for a Kilobot. Registers and interrupts are taken to be those of the smaller
    /// chip
    Atmega1284p,
}

fn main() -> ExitCode {
    let Arguments { count, chip, threads, .. } = Arguments::parse();
    if let Err(error) = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global() {
        eprintln!("error: {error}");
        return ExitCode::FAILURE;
    }
    let chip = match chip {
        ChipName::Atmega328p => SimavrChip::Atmega328p,
        ChipName::Atmega1284p => SimavrChip::Atmega1284p,
    };
    let mut fleet = fleet::KilobotFleet::new(count.into(), chip);
    let output = BufWriter::new(stdout().lock());
    match bittybuzz_emulation::serve_robots(&mut fleet, stdin().lock(), output) {
        // The program that started this one has ended.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
        _ => ExitCode::SUCCESS,
    }
}
