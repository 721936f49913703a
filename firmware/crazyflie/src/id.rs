//! Which robot this is.

use core::hint::black_box;

use bittybuzz_runtime::id::Id;
use bittybuzz_vm_core::hash::fnv_1a;
use embassy_stm32::uid;

use crate::robot::ID_ADDRESS;

/// The id that is in flash, else the chip's.
pub fn find() -> Id {
    // SAFETY: the section is flash that nothing writes while the program runs, and lies within the chip.
    Id::new(unsafe { black_box(ID_ADDRESS as *const [u16; 2]).read() }, chip())
}

/// A hash of the chip's unique id.
pub fn chip() -> u32 {
    fnv_1a(&uid::uid())
}
