//! The targets of measurements.

use bittybuzz_robot_spec::Profile;

/// A machine for a core.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Target {
    Host,
    Avr,
    Thumbv6m,
    Thumbv7em,
    #[value(name = "thumbv6m-full")]
    Thumbv6mFull,
    #[value(name = "thumbv7em-full")]
    Thumbv7emFull,
}

impl Target {
    pub const ALL: [Target; 6] = [
        Target::Host,
        Target::Avr,
        Target::Thumbv6m,
        Target::Thumbv7em,
        Target::Thumbv6mFull,
        Target::Thumbv7emFull,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Target::Host => "host",
            Target::Avr => "avr",
            Target::Thumbv6m => "thumbv6m",
            Target::Thumbv7em => "thumbv7em",
            Target::Thumbv6mFull => "thumbv6m-full",
            Target::Thumbv7emFull => "thumbv7em-full",
        }
    }

    pub fn profile(self) -> Profile {
        match self {
            Target::Thumbv6mFull | Target::Thumbv7emFull => Profile::Full,
            _ => Profile::Tiny,
        }
    }

    /// Returns the unit of the target's counts.
    pub fn unit(self) -> &'static str {
        match self {
            Target::Host => "instructions of the host, by Callgrind",
            Target::Avr => "cycles of an ATmega328P, by simavr",
            Target::Thumbv6m | Target::Thumbv6mFull => "instructions of a Cortex-M0, by QEMU",
            Target::Thumbv7em | Target::Thumbv7emFull => "instructions of a Cortex-M4F, by QEMU",
        }
    }
}
