//! The chips, and what plays them.

use crate::emulator::{Emulator, Feed};
use bittybuzz_on_chip::{Header, ROBOT_ID, Report, run, slots};
use bittybuzz_vm_core::Vm;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

/// A chip with a profile, and what plays it.
pub struct Target {
    pub name: &'static str,
    pub full: bool,
    pub emulator: Emulator,
    /// The host with the same sizes.
    host: fn(Header, &[u8]) -> Report,
}

const SIMAVR: Emulator = Emulator {
    program: "simavr",
    // As in avr/.cargo/config.toml.
    arguments: &["-m", "atmega644p", "-f", "16000000"],
    feed: Feed::Elf,
};

/// The core of the ATmega328P in the machine of Arduino Mega: the machine with all its features and a batch do not fit
/// the Uno's 32 kB yet.
const QEMU_AVR: Emulator = Emulator {
    program: "qemu-system-avr",
    arguments: &["-M", "mega", "-nographic", "-monitor", "none", "-serial", "stdio", "-bios"],
    feed: Feed::Flash,
};

const fn qemu_arm(arguments: &'static [&'static str]) -> Emulator {
    Emulator { program: "qemu-system-arm", arguments, feed: Feed::Elf }
}

macro_rules! arm {
    ($machine:literal) => {
        qemu_arm(&[
            "-M",
            $machine,
            "-nographic",
            "-monitor",
            "none",
            "-serial",
            "none",
            "-chardev",
            "stdio,id=out",
            "-semihosting-config",
            "enable=on,target=native,chardev=out",
            "-kernel",
        ])
    };
}

const M0: Emulator = arm!("microbit");
const M4F: Emulator = arm!("mps2-an386");

const TARGETS: [Target; 6] = [
    Target { name: "avr", full: false, emulator: SIMAVR, host: host::<Tiny, { slots::KILOBOT }> },
    Target {
        name: "avr-qemu",
        full: false,
        emulator: QEMU_AVR,
        host: host::<Tiny, { slots::KILOBOT }>,
    },
    Target { name: "thumbv6m", full: false, emulator: M0, host: host::<Tiny, { slots::ZOOIDS }> },
    Target {
        name: "thumbv7em",
        full: false,
        emulator: M4F,
        host: host::<Tiny, { slots::CRAZYFLIE }>,
    },
    Target {
        name: "thumbv6m-full",
        full: true,
        emulator: M0,
        host: host::<Full, { slots::ZOOIDS }>,
    },
    Target {
        name: "thumbv7em-full",
        full: true,
        emulator: M4F,
        host: host::<Full, { slots::CRAZYFLIE }>,
    },
];

impl Target {
    /// # Panics
    /// If there is none of that name.
    pub fn find(name: &str) -> Target {
        let target = TARGETS.into_iter().find(|target| target.name == name);
        target.unwrap_or_else(|| panic!("there is no target `{name}`"))
    }

    /// What the host reports.
    pub fn expected(&self, header: Header, image: &[u8]) -> Report {
        (self.host)(header, image)
    }
}

/// In a new machine, on which nothing has run before.
fn host<P: Profile, const SLOTS: usize>(header: Header, image: &[u8]) -> Report {
    run(&mut Vm::<P, &[u8], SLOTS>::new(ROBOT_ID), image, header)
}
