//! The script's own section of flash: header and image, as the build or `bbz flash` has written it
//! ([`bittybuzz_runtime::section`]).

use core::hint::black_box;

use bittybuzz_runtime::section::{HEADER, length};
use bittybuzz_vm_core::Area;

use crate::robot::{SCRIPT_ADDRESS, SCRIPT_SIZE};

/// The script that the build puts there. Never read by this name: another script may have been
/// flashed since.
#[used]
#[unsafe(link_section = ".script")]
static BUILT_IN: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/script.bin")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/script.bin"));

/// The room of the image, after its header.
pub type Section = Area<'static, { SCRIPT_SIZE - HEADER }>;

/// The image that is in flash now. Empty, and so no image, if the section holds none.
pub fn image() -> Section {
    // SAFETY: the section is flash that nothing writes while the program runs, and lies within the chip.
    let (header, bytes) = unsafe {
        let section = black_box(SCRIPT_ADDRESS as *const u8);
        (section.cast::<[u8; HEADER]>().read(), &*section.add(HEADER).cast::<[u8; _]>())
    };
    let image = length(header, bytes).and_then(|length| Area::new(bytes, length));
    image.unwrap_or(Area::empty(bytes))
}
