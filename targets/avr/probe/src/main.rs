//! Loads an image and runs its entries. The program is only linked to measure it, and is never
//! started.
//!
//! The panic handler calls a function that does not exist, so that the program only links if it
//! contains no panic.

#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::arch::asm;

use bittybuzz_progmem as progmem;
use bittybuzz_vm_core::number::{Profile, Tiny};
use bittybuzz_vm_core::seal::{self, SealedImage};
use bittybuzz_vm_core::{
    Axis, ByteCode, CallArguments, Entry, Host, Part, Parts, Reply, RobotFault, Sighting, Sizes,
    Value, Vm,
};

// avr-libc's float and memory functions are smaller and faster than those of compiler_builtins.
#[link(name = "m", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

#[link(name = "c", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

/// Slots of the measured machine, those of a robot.
const SLOTS: usize = match option_env!("PROBE_SLOTS") {
    None => 400,
    Some(slots) => match usize::from_str_radix(slots, 10) {
        Ok(slots) => slots,
        Err(_) => panic!("PROBE_SLOTS is no number"),
    },
};

/// The parts of the measured machine, as bits; all parts by default.
const PARTS: Parts = match option_env!("PROBE_PARTS") {
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

/// The functions and sizes that the robot offers to scripts.
const ROBOT: u16 =
    seal::robot::<Tiny>(bittybuzz_vm_core::features::<Tiny>(), Sizes::NONE, PARTS, &[1]);

struct Probe;

impl Host<Tiny> for Probe {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        _: u16,
        _: CallArguments<'_, Tiny, C, SLOTS>,
        _: bool,
    ) -> Result<Reply<Tiny>, RobotFault> {
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, _: CallArguments<'_, Tiny, C, SLOTS>) {}

    fn delay_is_over(&mut self, _: i32, again: bool) -> bool {
        again
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<Tiny>) -> Option<usize> {
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

#[unsafe(link_section = ".progmem.data")]
static IMAGE: [u8; 64] = [0; 64];

/// The image. It is read by assembly, whose result the compiler cannot predict.
#[derive(Clone, Copy)]
struct Flash;

impl ByteCode for Flash {
    const PARTS: Parts = PARTS;
    const ONLY: Option<Self> = Some(Flash);

    fn len(&self) -> usize {
        IMAGE.len()
    }

    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        progmem::byte((&raw const IMAGE as usize).wrapping_add(at))
    }

    #[inline(always)]
    fn word(&self, at: usize) -> u16 {
        progmem::word((&raw const IMAGE as usize).wrapping_add(at))
    }

    fn rom<P: Profile>(at: usize) -> u8 {
        progmem::rom(Self::PARTS, at)
    }
}

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    static mut VM: Vm<Tiny, Flash, SLOTS> = Vm::new();
    if cfg!(not(feature = "empty")) {
        let place = &raw mut VM;
        // SAFETY: this is the only reference to the machine, because main runs once.
        let vm = unsafe { &mut *place };
        if PARTS.has(Part::Neighbors) {
            vm.set_network_capacity(core::hint::black_box(Sizes::NONE));
        }
        if vm.load_sealed(SealedImage::new(Flash), ROBOT).is_ok() {
            for entry in [Entry::Global, Entry::Init, Entry::Step, Entry::Reset, Entry::Destroy] {
                if vm.begin(entry) {
                    core::hint::black_box(vm.run(&mut Probe, 1000));
                }
            }
        }
    }
    loop {
        // SAFETY: the program has ended; the instructions only stop the core.
        unsafe { asm!("cli", "sleep") };
    }
}
