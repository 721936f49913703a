//! The data of the individual robot: its id and its settings, which `bbz flash` writes to separate
//! pages.

use core::hint::black_box;

use bittybuzz_runtime::id::{Id, written};
use bittybuzz_vm_core::hash::fnv_1a;
use embassy_stm32::uid;

use crate::robot::{ID_ADDRESS, SETTINGS_ADDRESS};

/// Returns the id in flash, or else one from the chip's unique id.
pub fn id() -> Id {
    Id::new(words(ID_ADDRESS), chip())
}

/// Returns a hash of the chip's unique id.
pub fn chip() -> u32 {
    fnv_1a(&uid::uid())
}

/// Returns the setting at index `place` of its region, if it has a value.
pub fn setting(place: usize) -> Option<u16> {
    written(words(SETTINGS_ADDRESS + place * size_of::<[u16; 2]>()))
}

fn words(address: usize) -> [u16; 2] {
    // SAFETY: both regions are flash, lie within the chip, are aligned, and are not written while
    // the program runs.
    unsafe { black_box(address as *const [u16; 2]).read() }
}
