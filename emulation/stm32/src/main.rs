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

const USAGE: &str = "\
bbz-emulate-stm32: runs the firmware image of a Crazyflie, as it is flashed

It takes no arguments. It reads commands from standard input and writes replies and events to standard
output, one JSON object per line; docs/emulation.md describes them. `bbz trace` starts it by itself.

Try: echo '{\"command\":\"load\",\"elf\":\"FIRMWARE\"}
           {\"command\":\"run\",\"until_ns\":1000000000}' | bbz-emulate-stm32
";

fn main() -> ExitCode {
    if let Some(argument) = std::env::args_os().nth(1) {
        if argument == "--help" || argument == "-h" {
            print!("{USAGE}");
            return ExitCode::SUCCESS;
        }
        eprint!("error: no argument is expected\n\n{USAGE}");
        return ExitCode::from(3);
    }
    let mut robot = match robot::Robot::new() {
        Ok(robot) => robot,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::FAILURE;
        }
    };
    let output = std::io::BufWriter::new(std::io::stdout().lock());
    match bittybuzz_emulation::serve(&mut robot, std::io::stdin().lock(), output) {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever started this program is gone.
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
