//! In what this robot differs from others: its id and its settings, which `bbz flash` has written to pages of their own.

use core::hint::black_box;

use embassy_stm32::uid;

use crate::robot::{ID_ADDRESS, SETTINGS_ADDRESS};

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
        match number(ID_ADDRESS) {
            Some(id) => Id::Assigned(id),
            None => Id::OfChip((chip() >> 16) as u16 ^ chip() as u16),
        }
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

/// The setting with this place in its region, if it has a value.
pub fn setting(place: usize) -> Option<u16> {
    number(SETTINGS_ADDRESS + place * size_of::<[u16; 2]>())
}

/// The number that is written there with its complement.
fn number(address: usize) -> Option<u16> {
    // SAFETY: both regions are flash that nothing writes while the program runs, lie within the chip, and are aligned.
    let [number, complement] = unsafe { black_box(address as *const [u16; 2]).read() };
    (number == !complement).then_some(number)
}
