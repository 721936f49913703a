//! The script in program memory.

use bittybuzz_bench::{HEADER, ROOM};
use bittybuzz_progmem as progmem;
use bittybuzz_vm_core::ByteCode;
use bittybuzz_vm_core::number::Profile;

#[unsafe(no_mangle)]
#[unsafe(link_section = ".progmem.data")]
static BENCH_SCRIPT: [u8; ROOM] = [0; ROOM];

/// Returns the address of a byte of the script.
#[inline(always)]
fn script(at: usize) -> usize {
    (&raw const BENCH_SCRIPT as usize).wrapping_add(at)
}

/// The image in program memory.
#[derive(Clone, Copy)]
pub struct Flash;

impl Flash {
    /// Returns the number of the global with the result.
    pub fn global() -> u16 {
        progmem::word(script(0))
    }
}

impl ByteCode for Flash {
    type Slots<P: Profile, const SLOTS: usize> = P::Slots<SLOTS>;

    const ONLY: Option<Self> = Some(Flash);

    fn len(&self) -> usize {
        usize::from(progmem::word(script(2)))
    }

    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        progmem::byte(script(at.wrapping_add(HEADER)))
    }

    fn rom<P: Profile>(at: usize) -> u8 {
        progmem::rom(Self::PARTS, at)
    }

    #[inline(always)]
    fn word(&self, at: usize) -> u16 {
        progmem::word(script(at.wrapping_add(HEADER)))
    }
}
