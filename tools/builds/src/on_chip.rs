//! Builds the programs of `targets` that run images on chips, and runs `tests/on-chip`, which
//! compares their output with that of the host.

use crate::cargo_test::all_tests;
use crate::chip::{AVR_NONE, ChipProgram};
use anyhow::Result;

/// A chip with a number profile, and the emulator that runs its programs.
pub struct ChipTarget {
    /// The name that the test uses.
    pub name: &'static str,
    program: ChipProgram,
}

const fn avr(name: &'static str) -> ChipTarget {
    let program = ChipProgram { package: "on-chip-avr", target: AVR_NONE, features: "" };
    ChipTarget { name, program }
}

const fn cortex_m(name: &'static str, target: &'static str, features: &'static str) -> ChipTarget {
    ChipTarget { name, program: ChipProgram { package: "on-chip-cortex-m", target, features } }
}

/// All targets.
pub const TARGETS: [ChipTarget; 6] = [
    avr("avr"),
    avr("avr-qemu"),
    cortex_m("thumbv6m", "thumbv6m-none-eabi", ""),
    cortex_m("thumbv7em", "thumbv7em-none-eabihf", ""),
    cortex_m("thumbv6m-full", "thumbv6m-none-eabi", "full"),
    cortex_m("thumbv7em-full", "thumbv7em-none-eabihf", "full"),
];

/// Seeds of the generated programs that are compared before every merge.
const SAMPLE: &str = "0..200";

/// The target whose processor has instructions for floats of the machine.
pub const FLOATS: ChipTarget = cortex_m("thumbv7em-full", "thumbv7em-none-eabihf", "full");

/// Blocks of the sweep over pairs of floats that are compared before every merge.
const SAMPLE_OF_FLOATS: &str = "0..2";

/// Compares the conformance scripts and some generated programs on every target, and some pairs of floats.
pub fn sample() -> Result<()> {
    for target in TARGETS {
        for seeds in [None, Some(SAMPLE)] {
            println!("{}: {}", target.name, target.compare(seeds)?);
        }
    }
    println!("{}: {}", FLOATS.name, FLOATS.compare_floats(SAMPLE_OF_FLOATS)?);
    Ok(())
}

impl ChipTarget {
    /// Compares the target with the host: on the generated programs of these seeds, or on the
    /// conformance scripts if there are no seeds. Returns a summary of the run.
    pub fn compare(&self, seeds: Option<&str>) -> Result<String> {
        self.test("a_chip_does_what_the_host_does", seeds)
    }

    /// Compares the results of the processor's instructions with integers and with the host, for the pairs of
    /// floats of these blocks. Returns a summary of the run.
    pub fn compare_floats(&self, blocks: &str) -> Result<String> {
        self.test("floats::a_chip_computes_floats_like_integers_and_the_host", Some(blocks))
    }

    fn test(&self, name: &str, seeds: Option<&str>) -> Result<String> {
        let program = self.program.build(&[], true)?;
        let test = all_tests(&["--test", "same"], &["--ignored", "--nocapture", "--exact", name])
            .env("BITTYBUZZ_TARGET", self.name)
            .env("BITTYBUZZ_PROGRAM", &program.display().to_string());
        let test = match seeds {
            Some(seeds) => test.env("BITTYBUZZ_SEEDS", seeds),
            None => test,
        };
        let output = test.output(0)?;
        let output = String::from_utf8_lossy(&output.stdout).into_owned();
        let summary = output.lines().find_map(|line| line.strip_prefix("compared: "));
        Ok(summary.unwrap_or("all the same").to_owned())
    }
}
