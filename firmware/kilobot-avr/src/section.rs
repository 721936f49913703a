//! The script. It is the last part of the program in flash, so that a longer script can replace it
//! in the file that is sent to robots.

use core::arch::global_asm;

use bittybuzz_progmem as progmem;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Parts, Sizes};

use crate::toml::{self, SCRIPT_HEADER};

/// The mark and the image; `spec/robot/src/trailing.rs` defines the format.
const BYTES: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/script.bin"));

// The linker puts `.fini0` after everything else of the program. The start-up code's `exit`, which
// is never called, would be there too, as would the end of `abort`. Both are therefore defined
// here, in another section.
global_asm!(".global exit, abort", "exit:", "abort: rjmp abort");

#[unsafe(link_section = ".fini0")]
static SCRIPT: [u8; BYTES.len()] = *include_bytes!(concat!(env!("OUT_DIR"), "/script.bin"));

/// The offset of the length, two bytes before the image.
const LENGTH: usize = SCRIPT_HEADER - 2;

/// The image in flash.
#[derive(Clone, Copy)]
pub struct Section;

#[inline(always)]
fn address(at: usize) -> usize {
    (&raw const SCRIPT as usize).wrapping_add(at)
}

impl ByteCode for Section {
    type Slots<P: Profile, const SLOTS: usize> = P::Slots<SLOTS>;

    const PARTS: Parts = Parts::from_bits(toml::PARTS);
    const SIZES: Option<Sizes> = Some(toml::SIZES);
    const ONLY: Option<Self> = Some(Section);

    fn len(&self) -> usize {
        progmem::word(address(LENGTH)).into()
    }

    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        progmem::byte(address(SCRIPT_HEADER.wrapping_add(at)))
    }

    #[inline(always)]
    fn word(&self, at: usize) -> u16 {
        progmem::word(address(SCRIPT_HEADER.wrapping_add(at)))
    }

    fn rom<P: Profile>(at: usize) -> u8 {
        progmem::rom(Self::PARTS, at)
    }
}
