//! `bbz-emulate-qemu`: boots a robot's firmware in stock QEMU, with the peripherals of `bittybuzz-chips`.
//!
//! A second opinion: the core is QEMU's, not Unicorn's; board, protocol and image are those of
//! `bbz-emulate-stm32`. Nothing is patched, neither QEMU nor the image.
//!
//! # How
//! * Accesses to peripherals meet a watchpoint; the bridge decodes the instruction and does it with the
//!   board's registers. WFE, WFI, SEV and branches to themselves meet breakpoints: the bridge keeps the event
//!   register, and lets the board's time jump to the next event while the core waits.
//! * An instruction takes one clock of the core, whose rate the RCC registers say. QEMU counts them, and stops
//!   a busy core at the board's next event (core.rs). Runs are reproducible.
//! * Interrupt lines are QEMU's own inputs, so priorities, masking and nesting are QEMU's.
//!
//! # What it will not do
//! * Be fast: a stop costs 0.1 to 0.2 ms, and every byte of the radio's processor ten of them.
//! * Give the firmware SysTick, which it needs itself; an access is reported as hardware error. Cycle counter
//!   and MPU are as in QEMU: none.
//! * Count exceptions, or how long interrupts were masked: these statistics stay 0.
//! * Keep RAM across a lockup: QEMU ends then, and a new one is started.
//! * Hide that QEMU 7.2 lacks core-coupled memory: see [`memory::Layout`].
//! * DMA and flash programming, which only the Zooid's board models; several robots in one program.
//!
//! Not compared with hardware.

mod access;
mod bridge;
mod core;
mod memory;
mod robot;
mod sites;
mod thumb;

use std::io::{stdin, stdout};
use std::process::ExitCode;

use bittybuzz_crazyflie_board::Crazyflie;
use bittybuzz_emulate_qemu::{gdb, qemu, qtest, registers};
use bittybuzz_emulation::Control;
use bittybuzz_zooids_board::Zooid;
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
    #[arg(long, value_enum, default_value_t = Kind::Crazyflie)]
    robot: Kind,
}

#[derive(Clone, Copy, ValueEnum)]
enum Kind {
    Crazyflie,
    Zooids,
}

fn main() -> ExitCode {
    match Arguments::parse().robot {
        Kind::Crazyflie => play::<Crazyflie>(),
        Kind::Zooids => play::<Zooid>(),
    }
}

fn play<B: Control>() -> ExitCode {
    let mut bridges = [bridge::Bridge::<B>::new()];
    match bittybuzz_emulation::serve(&mut bridges, stdin().lock(), stdout().lock()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("bbz-emulate-qemu: the pipe to the caller broke: {error}");
            ExitCode::FAILURE
        }
    }
}
