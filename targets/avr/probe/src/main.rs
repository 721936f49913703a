//! The probe of the ATmega328P, see `bittybuzz_probe`.

#![no_std]
#![no_main]

use bittybuzz_probe::{PARTS, SLOTS};
use bittybuzz_progmem as progmem;
use bittybuzz_vm_core::number::{Profile, Tiny};
use bittybuzz_vm_core::seal::{self, SealedImage};
use bittybuzz_vm_core::{ByteCode, Parts, Sizes, Vm};

/// The functions and sizes that the robot offers to scripts.
const ROBOT: u16 =
    seal::robot::<Tiny>(bittybuzz_vm_core::features::<Tiny>(), Sizes::NONE, PARTS, &[1]);

#[unsafe(link_section = ".progmem.data")]
static IMAGE: [u8; 64] = [0; 64];

/// The image. It is read by assembly, whose result the compiler cannot predict.
#[derive(Clone, Copy)]
struct Flash;

impl ByteCode for Flash {
    type Slots<P: Profile, const SLOTS: usize> = P::Slots<SLOTS>;

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
        bittybuzz_probe::run(vm, |vm| vm.load_sealed(SealedImage::new(Flash), ROBOT));
    }
    chip_avr::stop()
}
