//! The chips, and what plays them.

use crate::emulator::{Emulator, Feed};
use bittybuzz_on_chip::{Header, Report, run, slots};
use bittybuzz_vm_core::Vm;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

/// A chip with a profile, and what plays it.
pub struct Target {
    pub name: &'static str,
    pub full: bool,
    pub emulator: Emulator,
    /// The host with the same sizes.
    host: Run,
}

const SIMAVR: Emulator = Emulator {
    program: "simavr",
    // As in avr/.cargo/config.toml.
    machine: ["-m", "atmega328p"],
    arguments: &["-f", "16000000"],
    feed: Feed::Elf,
};

/// The Arduino Uno has this chip.
const QEMU_AVR: Emulator = Emulator {
    program: "qemu-system-avr",
    machine: ["-M", "uno"],
    arguments: &["-nographic", "-monitor", "none", "-serial", "stdio", "-bios"],
    feed: Feed::Flash,
};

const M0: Emulator = qemu_arm("microbit");
const M4F: Emulator = qemu_arm("mps2-an386");

const fn qemu_arm(machine: &'static str) -> Emulator {
    let arguments = &[
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
    ];
    Emulator { program: "qemu-system-arm", machine: ["-M", machine], arguments, feed: Feed::Elf }
}

const TARGETS: [Target; 6] = [
    tiny("avr", SIMAVR, host::<Tiny, { slots::KILOBOT }>),
    tiny("avr-qemu", QEMU_AVR, host::<Tiny, { slots::KILOBOT }>),
    tiny("thumbv6m", M0, host::<Tiny, { slots::ZOOIDS }>),
    tiny("thumbv7em", M4F, host::<Tiny, { slots::CRAZYFLIE }>),
    full("thumbv6m-full", M0, host::<Full, { slots::ZOOIDS }>),
    full("thumbv7em-full", M4F, host::<Full, { slots::CRAZYFLIE }>),
];

type Run = fn(Header, &[u8]) -> Report;

const fn tiny(name: &'static str, emulator: Emulator, host: Run) -> Target {
    Target { name, full: false, emulator, host }
}

const fn full(name: &'static str, emulator: Emulator, host: Run) -> Target {
    Target { full: true, ..tiny(name, emulator, host) }
}

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
    run(&mut Vm::<P, &[u8], SLOTS>::new(), image, header)
}
