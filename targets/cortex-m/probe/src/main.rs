//! The probe of Cortex-M cores, see `bittybuzz_probe`.

#![no_std]
#![no_main]
#![expect(clippy::empty_loop, reason = "a pause would add to the size of the probe")]

use bittybuzz_probe::{PARTS, SLOTS};
#[cfg(feature = "full")]
use bittybuzz_vm_core::number::Full as Numbers;
use bittybuzz_vm_core::number::Profile;
#[cfg(not(feature = "full"))]
use bittybuzz_vm_core::number::Tiny as Numbers;
use bittybuzz_vm_core::{ByteCode, Image, Parts, Vm};

/// An image for a machine with these parts.
#[derive(Clone, Copy)]
struct Code(&'static [u8]);

impl ByteCode for Code {
    type Slots<P: Profile, const SLOTS: usize> = P::Slots<SLOTS>;

    const PARTS: Parts = PARTS;

    #[inline(always)]
    fn len(&self) -> usize {
        ByteCode::len(&self.0)
    }

    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        self.0.byte(at)
    }

    #[inline(always)]
    fn word(&self, at: usize) -> u16 {
        self.0.word(at)
    }
}

/// The image. `black_box` hides its bytes from the compiler, which could otherwise predict the
/// script.
#[used]
static IMAGE: [u8; 64] = [0; 64];

#[cortex_m_rt::entry]
fn main() -> ! {
    // The entry macro turns this into a reference, because main runs once.
    static mut VM: Vm<Numbers, Code, SLOTS> = Vm::new();
    if cfg!(not(feature = "empty")) {
        let image = Code(core::hint::black_box(&IMAGE));
        bittybuzz_probe::run(VM, |vm| vm.load(Image::new(image), |hash| hash == 1));
    }
    loop {}
}
