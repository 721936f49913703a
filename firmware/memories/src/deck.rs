//! The decks with which this firmware works.

use crate::memory::DeckDescription;

/// Bitcraze's identification as a vendor.
const BITCRAZE: u8 = 0xbc;

/// A deck with which this firmware works.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deck {
    /// The Flow deck v2: optical flow and the distance to the ground.
    Flow2,
    /// The Z-ranger v2: the distance to the ground.
    ZRanger2,
    /// The Multi-ranger: distances to the front, back, left, right and upwards.
    MultiRanger,
}

impl Deck {
    const ALL: [Deck; 3] = [Deck::Flow2, Deck::ZRanger2, Deck::MultiRanger];

    /// Returns the deck of a description. A deck without a vendor has only its name, as in
    /// crazyflie-firmware (deck_info.c).
    pub fn of(description: &DeckDescription) -> Option<Self> {
        let DeckDescription { vendor, product, name, .. } = description;
        Self::ALL.into_iter().find(|deck| match *vendor {
            0 => name.as_str() == deck.name(),
            vendor => (vendor, *product) == (BITCRAZE, deck.product()),
        })
    }

    /// Returns Bitcraze's name of the deck (flowdeck_v1v2.c, zranger2.c, multiranger.c).
    pub fn name(self) -> &'static str {
        match self {
            Deck::Flow2 => "bcFlow2",
            Deck::ZRanger2 => "bcZRanger2",
            Deck::MultiRanger => "bcMultiranger",
        }
    }

    /// Returns Bitcraze's number of the product, from the same files.
    fn product(self) -> u8 {
        match self {
            Deck::Flow2 => 0x0f,
            Deck::ZRanger2 => 0x0e,
            Deck::MultiRanger => 0x0c,
        }
    }
}

/// The decks that a robot has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeckSet {
    bits: u8,
}

impl DeckSet {
    /// Adds a deck.
    pub fn insert(&mut self, deck: Deck) {
        self.bits |= 1 << deck as u8;
    }

    /// Returns true if the robot has this deck.
    pub fn has(self, deck: Deck) -> bool {
        self.bits & 1 << deck as u8 != 0
    }

    /// Returns the decks of the set.
    pub fn iter(self) -> impl Iterator<Item = Deck> {
        Deck::ALL.into_iter().filter(move |deck| self.has(*deck))
    }
}
