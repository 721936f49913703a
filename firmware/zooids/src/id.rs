//! Which robot this is.

use core::hint::black_box;

use embassy_stm32::uid;

use crate::robot::ID_ADDRESS;

/// Which robot this is, and how that is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Id {
    /// `bbz flash --id` has assigned it.
    Assigned(u16),
    /// A hash of the chip's unique id: some other robot may have the same.
    OfChip(u16),
}

impl Id {
    /// The one that is in flash, else the chip's.
    pub fn find() -> Self {
        // SAFETY: the section is flash that nothing writes while the program runs, and lies within the chip.
        let [id, complement] = unsafe { black_box(ID_ADDRESS as *const [u16; 2]).read() };
        if id == !complement { Id::Assigned(id) } else { Id::OfChip(fold(chip())) }
    }

    /// The number.
    pub fn number(self) -> u16 {
        match self {
            Id::Assigned(number) | Id::OfChip(number) => number,
        }
    }
}

/// A hash of the chip's unique id: 32-bit FNV-1a.
pub fn chip() -> u32 {
    let of_byte = |hash: u32, byte: &u8| (hash ^ u32::from(*byte)).wrapping_mul(0x0100_0193);
    uid::uid().iter().fold(0x811c_9dc5, of_byte)
}

fn fold(hash: u32) -> u16 {
    (hash >> 16) as u16 ^ hash as u16
}
