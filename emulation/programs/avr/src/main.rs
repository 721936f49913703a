//! `bbz-emulate-avr`: runs the firmware image of Kilobots, as it is flashed.
//!
//! simavr decodes instructions; `bittybuzz-chips` has the rest of the ATmega328P, `bittybuzz-kilobot-board` the robot around it; this program has what
//! stands between them, interrupts and sleep, and the light between robots.
//!
//! # Principles
//! 1. **Cycles are the data sheet's**: instructions take as long as simavr says, interrupts and halts as long as the data sheet
//!    says, and each robot's cycles as long as its oscillator makes them.
//! 2. **Pulses, not messages.** What a robot sends are the edges of its pin, what a neighbour receives is what its program
//!    makes of the comparator's edges and of the converter's readings. Two who send at once are seen at once.
//! 3. **The same commands give the same answers**, on one thread or on many.
//!
//! # How time is cut
//! Light takes no time, and a program may turn its LED on at any instruction: no robot can run ahead of another and be sure. So
//! robots run ahead without being sure, for a window of half a millisecond, each on its own and on all threads, and keep what
//! they were at its beginning (RAM, registers and board: 5 KB, and the flash pages that it wrote). Then their pulses are compared
//! with those that others assumed; who should have seen anything else goes back and runs the window once more. Each round is right
//! until a later moment than the one before, so rounds end, with the result that running instruction by instruction would
//! have.
//!
//! A robot that sends has its interrupts masked and looks at its receiver in one place only, for 4.4 ms. So those who were
//! sending at the end of the last window run first, and everybody else runs with their pulses known: a second round is rare, but
//! where a message begins. A robot that sleeps, and sees no light, is not run at all.
//!
//! # What it will not do
//! Model what no Kilobot uses: SPI, TWI, external and pin change interrupts, the receiver of the USART, lock bits, fuses (they
//! are assumed: 8 MHz, boot section of 2048 words, reset at 0), reading the signature by `lpm`.

mod air;
mod fleet;
mod robot;

use std::io::{BufWriter, ErrorKind, stdin, stdout};
use std::process::ExitCode;

use bittybuzz_simavr::Chip;
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
        ChipName::Atmega328p => Chip::Atmega328p,
        ChipName::Atmega1284p => Chip::Atmega1284p,
    };
    let mut fleet = fleet::Fleet::new(count.into(), chip);
    let output = BufWriter::new(stdout().lock());
    match bittybuzz_emulation::serve_robots(&mut fleet, stdin().lock(), output) {
        // The program that started this one is gone.
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
        _ => ExitCode::SUCCESS,
    }
}
