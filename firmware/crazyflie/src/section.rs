//! The flash sectors of scripts. They hold a log, in which the newest complete script counts
//! ([`bittybuzz_runtime::places`]).

use core::hint::black_box;

pub use bittybuzz_crazyflie_machine::Section;
use bittybuzz_runtime::places::{self, IMAGE_AREA, PLACE};
use bittybuzz_vm_core::FlashArea;

use crate::robot::{SCRIPT_ADDRESS, SCRIPT_SIZE};

const SCRIPT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/script.bin"));
const MARK: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/script_mark.bin"));

/// Puts the bytes of the build's script into flash. The program never reads them by name, since
/// another script may have been flashed later. Flashing them erases both sectors, so that no older
/// script is left.
macro_rules! built_in {
    ($name:ident, $section:literal, $bytes:ident) => {
        #[used]
        #[unsafe(link_section = $section)]
        static $name: [u8; $bytes.len()] = *$bytes.first_chunk().expect("its own length");
    };
}

built_in!(BUILT_IN, ".script", SCRIPT);
built_in!(BUILT_IN_MARK, ".script_mark", MARK);
built_in!(COPY, ".script_copy", SCRIPT);
built_in!(COPY_MARK, ".script_copy_mark", MARK);

/// Returns the image that runs. It is empty, which is not a valid image, if the log holds none.
pub fn image() -> Section {
    let region = black_box(SCRIPT_ADDRESS as *const [[u8; PLACE]; SCRIPT_SIZE / PLACE]);
    // SAFETY: the region is flash, lies within the chip, and is not written while the program runs.
    let (log, any) = unsafe { (&*region, &*region.cast::<[u8; IMAGE_AREA]>()) };
    let stored = places::newest(log).map(|stored| FlashArea::new(stored.bytes, stored.length));
    stored.flatten().unwrap_or(FlashArea::empty(any))
}
