//! The script's own section of flash: length and image, as the build or `bbz flash` has written it.

use core::hint::black_box;

use crate::robot::{SCRIPT_ADDRESS, SCRIPT_SIZE};

/// What the build puts there. Never read by this name: another script may have been flashed since.
#[used]
#[unsafe(link_section = ".script")]
static BUILT_IN: [u8; include_bytes!(concat!(env!("OUT_DIR"), "/script.bin")).len()] =
    *include_bytes!(concat!(env!("OUT_DIR"), "/script.bin"));

/// The image that is in flash now. Empty, and so no image, if the section holds none.
pub fn image() -> &'static [u8] {
    // SAFETY: the section is flash that nothing writes while the program runs, and lies within the chip.
    let section: &'static [u8] =
        unsafe { core::slice::from_raw_parts(black_box(SCRIPT_ADDRESS as *const u8), SCRIPT_SIZE) };
    let Some((length, rest)) = section.split_first_chunk() else { return &[] };
    let length = u32::from_le_bytes(*length);
    usize::try_from(length).ok().and_then(|length| rest.get(..length)).unwrap_or(&[])
}
