//! The facts that are this robot's own: its id and its settings, which `bbz flash` has written to
//! pages of their own.

use core::hint::black_box;

use bittybuzz_runtime::id::{Id, written};
use bittybuzz_vm_core::hash::fnv_1a;
use embassy_stm32::uid;

use crate::robot::{ID_ADDRESS, SETTINGS_ADDRESS};

/// The robot's id: the one that is in flash, else the chip's.
pub fn id() -> Id {
    Id::new(words(ID_ADDRESS), chip())
}

/// A hash of the chip's unique id.
pub fn chip() -> u32 {
    fnv_1a(&uid::uid())
}

/// The setting with this place in its region, if it has a value.
pub fn setting(place: usize) -> Option<u16> {
    written(words(SETTINGS_ADDRESS + place * size_of::<[u16; 2]>()))
}

fn words(address: usize) -> [u16; 2] {
    // SAFETY: both regions are flash that nothing writes while the program runs, lie within the chip, and are aligned.
    unsafe { black_box(address as *const [u16; 2]).read() }
}
