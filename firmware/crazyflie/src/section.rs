//! The scripts' own sectors of flash: a log, of which the newest whole script counts ([`bittybuzz_runtime::places`]).

use core::hint::black_box;

use bittybuzz_runtime::places::{self, MOST, PLACE};
use bittybuzz_vm_core::Area;

use crate::robot::{SCRIPT_ADDRESS, SCRIPT_SIZE};

const SCRIPT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/script.bin"));
const MARK: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/script_mark.bin"));

/// Places the bytes of the build's script. They are never read by name: another script may have been flashed since. Flashing
/// them erases both sectors, so that no older script is left.
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

/// Room of the longest image.
pub type Section = Area<'static, MOST>;

/// The image that counts now. Empty, and so no image, if the log holds none.
pub fn image() -> Section {
    let region = black_box(SCRIPT_ADDRESS as *const [[u8; PLACE]; SCRIPT_SIZE / PLACE]);
    // SAFETY: the region is flash that nothing writes while the program runs, and lies within the chip.
    let (log, any) = unsafe { (&*region, &*region.cast::<[u8; MOST]>()) };
    let stored = places::newest(log).map(|stored| Area::new(stored.bytes, stored.length));
    stored.flatten().unwrap_or(Area::empty(any))
}
