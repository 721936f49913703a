//! The targets of measurements.

use bittybuzz_robot_spec::NumberProfile;

/// A machine for a core.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum BenchTarget {
    Host,
    Avr,
    Thumbv6m,
    Thumbv7em,
    #[value(name = "thumbv6m-full")]
    Thumbv6mFull,
    #[value(name = "thumbv7em-full")]
    Thumbv7emFull,
}

impl BenchTarget {
    pub const ALL: [BenchTarget; 6] = [
        BenchTarget::Host,
        BenchTarget::Avr,
        BenchTarget::Thumbv6m,
        BenchTarget::Thumbv7em,
        BenchTarget::Thumbv6mFull,
        BenchTarget::Thumbv7emFull,
    ];

    pub fn name(self) -> &'static str {
        match self {
            BenchTarget::Host => "host",
            BenchTarget::Avr => "avr",
            BenchTarget::Thumbv6m => "thumbv6m",
            BenchTarget::Thumbv7em => "thumbv7em",
            BenchTarget::Thumbv6mFull => "thumbv6m-full",
            BenchTarget::Thumbv7emFull => "thumbv7em-full",
        }
    }

    pub fn profile(self) -> NumberProfile {
        match self {
            BenchTarget::Thumbv6mFull | BenchTarget::Thumbv7emFull => NumberProfile::Full,
            _ => NumberProfile::Tiny,
        }
    }

    /// Returns true if the machine has the slots of a Crazyflie.
    pub fn has_many_slots(self) -> bool {
        matches!(self, BenchTarget::Thumbv7em | BenchTarget::Thumbv7emFull)
    }

    /// Returns the unit of the target's counts.
    pub fn unit(self) -> &'static str {
        match self {
            BenchTarget::Host => "instructions of the host, by Callgrind",
            BenchTarget::Avr => "cycles of an ATmega328P, by simavr",
            BenchTarget::Thumbv6m | BenchTarget::Thumbv6mFull => {
                "instructions of a Cortex-M0, by QEMU"
            }
            BenchTarget::Thumbv7em | BenchTarget::Thumbv7emFull => {
                "instructions of a Cortex-M4F, by QEMU"
            }
        }
    }
}
