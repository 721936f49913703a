//! The robot's id.

use core::hint::black_box;

use bittybuzz_runtime::id::Id;
use bittybuzz_vm_core::hash::fnv_1a;
use embassy_stm32::uid;

use crate::robot::ID_ADDRESS;

/// Returns the id in flash, or else one from the chip's unique id.
pub fn find() -> Id {
    // SAFETY: the section is flash, lies within the chip, and is not written while the program
    // runs.
    Id::new(unsafe { black_box(ID_ADDRESS as *const [u16; 2]).read() }, chip())
}

/// Returns a hash of the chip's unique id.
pub fn chip() -> u32 {
    fnv_1a(&uid::uid())
}
