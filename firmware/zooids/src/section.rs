//! The script's own section of flash: length and image, as the build or `bbz flash` has written it.

use core::hint::black_box;

use bittybuzz_vm_core::Area;

use crate::robot::{SCRIPT_ADDRESS, SCRIPT_SIZE};

/// What the build puts there. Never read by this name: another script may have been flashed since.
#[used]
#[unsafe(link_section = ".script")]
static BUILT_IN: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/script.bin")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/script.bin"));

/// Where the image lies, behind its length.
pub type Section = Area<'static, { SCRIPT_SIZE - LENGTH }>;

/// Bytes of the length.
const LENGTH: usize = size_of::<u32>();

/// The image that is in flash now. Empty, and so no image, if the section holds none.
pub fn image() -> Section {
    // SAFETY: the section is flash that nothing writes while the program runs, and lies within the chip.
    let (length, bytes) = unsafe {
        let section = black_box(SCRIPT_ADDRESS as *const u8);
        (section.cast::<u32>().read(), &*section.add(LENGTH).cast())
    };
    let length = usize::try_from(length).unwrap_or(usize::MAX);
    Area::new(bytes, length).unwrap_or(Area::empty(bytes))
}
