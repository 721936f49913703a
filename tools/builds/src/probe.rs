//! The probes: programs for a robot's core that only load and run an image. They are linked to
//! measure the machine, and to show that the machine cannot panic: their panic handler does not
//! exist.

use crate::chip::{AVR_NONE, ChipProgram};
use anyhow::Result;
use bittybuzz_vm_core::Parts;
use std::path::PathBuf;

/// A core's probe.
pub struct PanicProbe {
    /// The robot with this core, whose sizes the probe's machine has.
    pub robot: &'static str,
    target: &'static str,
    package: &'static str,
    has_full: bool,
}

/// The parts of the machine that a probe contains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Extent {
    /// Nothing but the code that the linker adds to any program.
    Empty,
    /// The [language](Parts::LANGUAGE), which needs neither the functions of `math` nor other
    /// robots.
    Least,
    /// All of the profile `tiny`. Only `full` makes strings at run time.
    Tiny,
    /// All of the profile `full`.
    Full,
}

/// The Kilobot's core.
pub const ATMEGA328P: PanicProbe =
    PanicProbe { robot: "kilobot", target: AVR_NONE, package: "probe-avr", has_full: false };

/// The Zooid's core.
pub const CORTEX_M0: PanicProbe = PanicProbe {
    robot: "zooids",
    target: "thumbv6m-none-eabi",
    package: "probe-cortex-m",
    has_full: true,
};

/// The Crazyflie's core.
pub const CORTEX_M4F: PanicProbe =
    PanicProbe { robot: "crazyflie", target: "thumbv7em-none-eabihf", ..CORTEX_M0 };

impl PanicProbe {
    /// Returns the extents that can be built for this core.
    pub fn extents(&self) -> &'static [Extent] {
        use Extent::{Full, Least, Tiny};
        if self.has_full { &[Least, Tiny, Full] } else { &[Least, Tiny] }
    }

    /// Links the probe, and returns the ELF file.
    pub fn build(&self, extent: Extent, quiet: bool) -> Result<PathBuf> {
        let robot = bittybuzz_robot_files::find(self.robot)?;
        let slots = robot.vm.slots as usize + robot.sizes().slots();
        let (features, parts) = match extent {
            Extent::Empty => ("empty", Parts::ALL),
            Extent::Least => ("", Parts::LANGUAGE),
            Extent::Tiny => ("", Parts::ALL),
            Extent::Full => ("full", Parts::ALL),
        };
        let program = ChipProgram { package: self.package, target: self.target, features };
        let variables =
            [("PROBE_SLOTS", slots.to_string()), ("PROBE_PARTS", parts.bits().to_string())];
        program.build(&variables.each_ref().map(|(name, value)| (*name, &**value)), quiet)
    }
}
