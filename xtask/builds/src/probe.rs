//! The probes: programs for a robot's core that do nothing but load and run an image. They are linked to be measured, and
//! to show that no panic is left in the machine: their panic handler does not exist.

use crate::chip::{AVR_NONE, Program};
use anyhow::Result;
use bittybuzz_vm_core::Parts;
use std::path::PathBuf;

/// A core's probe.
pub struct Probe {
    /// The robot with this core, whose sizes its machine has.
    pub robot: &'static str,
    target: &'static str,
    package: &'static str,
    has_full: bool,
}

/// What a probe has of the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Nothing: what the linker adds to any program.
    Empty,
    /// The [language](Parts::LANGUAGE), which needs nothing of `math`'s functions and of other robots.
    Least,
    /// All of the profile `tiny`. Strings made at run time are for `full` only.
    Tiny,
    /// All of the profile `full`.
    Full,
}

/// The Kilobot's core.
pub const ATMEGA328P: Probe =
    Probe { robot: "kilobot", target: AVR_NONE, package: "probe-avr", has_full: false };

/// The Zooid's core.
pub const CORTEX_M0: Probe = Probe {
    robot: "zooids",
    target: "thumbv6m-none-eabi",
    package: "probe-cortex-m",
    has_full: true,
};

/// The Crazyflie's core.
pub const CORTEX_M4F: Probe =
    Probe { robot: "crazyflie", target: "thumbv7em-none-eabihf", ..CORTEX_M0 };

/// All of them.
pub const PROBES: [&Probe; 3] = [&ATMEGA328P, &CORTEX_M0, &CORTEX_M4F];

impl Probe {
    /// What there is of the machine on this core.
    pub fn extents(&self) -> &'static [Extent] {
        use Extent::{Full, Least, Tiny};
        if self.has_full { &[Least, Tiny, Full] } else { &[Least, Tiny] }
    }

    /// Links it; returns the ELF file.
    pub fn build(&self, extent: Extent, quiet: bool) -> Result<PathBuf> {
        let robot = bittybuzz_robot_files::find(self.robot)?;
        let slots = robot.vm.slots as usize + robot.sizes().slots();
        let (features, parts) = match extent {
            Extent::Empty => ("empty", Parts::ALL),
            Extent::Least => ("", Parts::LANGUAGE),
            Extent::Tiny => ("", Parts::ALL),
            Extent::Full => ("full", Parts::ALL),
        };
        let program = Program { package: self.package, target: self.target, features };
        let variables =
            [("PROBE_SLOTS", slots.to_string()), ("PROBE_PARTS", parts.bits().to_string())];
        program.build(&variables.each_ref().map(|(name, value)| (*name, &**value)), quiet)
    }
}
