//! Decks that disturb each other.
//!
//! Two chips must not drive a line to different levels. A memory names the pins that its deck
//! drives, but most decks leave that empty (the example in deck_memory_format.md, too), and
//! crazyflie-firmware compares the pins of its drivers instead. Here both count.
//!
//! The range finders of Flow deck and Z-ranger have no pin by which the robot could keep one of
//! them silent, so both would answer at the same address.

use crate::deck::Deck;
use crate::memory::DeckDescription;

/// The bits of the pins that are driven low; those of the same pins driven high follow.
const PINS: u32 = 16;
/// IO_3, which is PB4, driven low and high.
const IO_3: u32 = 1 << 6 | 1 << 6 << PINS;

/// The address of a VL53L1X after power-on.
const RANGE_FINDER: u8 = 0x29;
/// The address of the port expander of the Multi-ranger.
const EXPANDER: u8 = 0x20;

/// A reason why two decks cannot work together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DeckConflict {
    /// Both drive a pin, which has this number in deck_memory_format.md (6 is IO_3).
    Pin(u8),
    /// Both have a chip with this address on the same bus.
    Address(u8),
}

/// A supported deck together with the pins that its memory names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FoundDeck {
    pub deck: Deck,
    pins: u32,
}

impl FoundDeck {
    pub fn new(deck: Deck, description: &DeckDescription) -> Self {
        let of_driver = if deck == Deck::Flow2 { IO_3 } else { 0 };
        FoundDeck { deck, pins: description.pins | of_driver }
    }

    /// Returns the address that a chip of the deck keeps, since nothing holds it in reset.
    fn address(self) -> u8 {
        match self.deck {
            Deck::Flow2 | Deck::ZRanger2 => RANGE_FINDER,
            Deck::MultiRanger => EXPANDER,
        }
    }

    /// Returns the conflict between two decks, if there is one. Several decks may drive a pin low,
    /// as on a bus with open drains.
    pub fn conflict_with(self, other: Self) -> Option<DeckConflict> {
        let (high, other_high) = (self.pins >> PINS, other.pins >> PINS);
        let (low, other_low) = (self.pins & 0xffff, other.pins & 0xffff);
        let pins = high & (other_high | other_low) | other_high & low;
        if pins != 0 {
            return Some(DeckConflict::Pin(pins.trailing_zeros() as u8));
        }
        (self.address() == other.address()).then(|| DeckConflict::Address(self.address()))
    }
}
