//! The script's section of flash: the header and the image, written by the build or by `bbz flash`
//! ([`bittybuzz_runtime::section`]).

use core::hint::black_box;

use bittybuzz_runtime::section::{HEADER, length};
use bittybuzz_vm_core::FlashArea;

use crate::robot::{SCRIPT_ADDRESS, SCRIPT_SIZE};

/// The script of the build. The program never reads it by this name, since another script may have
/// been flashed later.
#[used]
#[unsafe(link_section = ".script")]
static BUILT_IN: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/script.bin")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/script.bin"));

/// The room for an image, after the header.
pub type Section = FlashArea<'static, { SCRIPT_SIZE - HEADER }>;

/// Returns the image in flash. It is empty, which is not a valid image, if the section holds none.
pub fn image() -> Section {
    // SAFETY: the section is flash, lies within the chip, and is not written while the program
    // runs.
    let (header, bytes) = unsafe {
        let section = black_box(SCRIPT_ADDRESS as *const u8);
        (section.cast::<[u8; HEADER]>().read(), &*section.add(HEADER).cast::<[u8; _]>())
    };
    let image = length(header, bytes).and_then(|length| FlashArea::new(bytes, length));
    image.unwrap_or(FlashArea::empty(bytes))
}
