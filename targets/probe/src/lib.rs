//! The common part of the probes. A probe loads an image and runs its entries. It is only linked to
//! measure the virtual machine, and is never started.
//!
//! The panic handler calls a function that does not exist, so that a probe only links if it
//! contains no panic.
//!
//! This crate is empty on processors with an operating system.

#![no_std]
#![cfg(target_os = "none")]

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Entry, Host, ImageError, Part, Parts, Reply, RobotFault,
    Sighting, Sizes, Value, Vm,
};

/// Slots of the measured machine, those of a robot.
pub const SLOTS: usize = match option_env!("PROBE_SLOTS") {
    None => 400,
    Some(slots) => match usize::from_str_radix(slots, 10) {
        Ok(slots) => slots,
        Err(_) => panic!("PROBE_SLOTS is no number"),
    },
};

/// The parts of the measured machine, as bits; all parts by default.
pub const PARTS: Parts = match option_env!("PROBE_PARTS") {
    None => Parts::ALL,
    Some(bits) => match u16::from_str_radix(bits, 10) {
        Ok(bits) => Parts::from_bits(bits),
        Err(_) => panic!("PROBE_PARTS is no number"),
    },
};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn the_program_contains_a_panic() -> !;
    }
    // SAFETY: the function does not exist, so this call never links.
    unsafe { the_program_contains_a_panic() }
}

/// A robot whose functions do nothing, and which receives frames without end.
struct Probe;

impl<P: Profile> Host<P> for Probe {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        _: u16,
        _: CallArguments<'_, P, C, SLOTS>,
        _: bool,
    ) -> Result<Reply<P>, RobotFault> {
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, _: CallArguments<'_, P, C, SLOTS>) {}

    fn delay_is_over(&mut self, _: i32, again: bool) -> bool {
        again
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        // The compiler must not know the received bytes; otherwise it would remove the code that
        // handles them.
        let length = core::hint::black_box(&mut *frame).len();
        sighting.place = Some([Value::int(length as i32); 3]);
        Some(length)
    }

    fn send(&mut self, frame: &[u8]) {
        core::hint::black_box(frame);
    }
}

/// Gives the machine its image with `load`, and runs all entries.
pub fn run<P: Profile, C: ByteCode>(
    vm: &mut Vm<P, C, SLOTS>,
    load: impl FnOnce(&mut Vm<P, C, SLOTS>) -> Result<(), ImageError>,
) {
    if PARTS.has(Part::Neighbors) {
        vm.set_network_capacity(core::hint::black_box(Sizes::NONE));
    }
    if load(vm).is_ok() {
        for entry in [Entry::Global, Entry::Init, Entry::Step, Entry::Reset, Entry::Destroy] {
            if vm.begin(entry) {
                core::hint::black_box(vm.run(&mut Probe, 1000));
            }
        }
    }
}
