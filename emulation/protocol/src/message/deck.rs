//! The decks of a Crazyflie in the messages.

use serde::{Deserialize, Serialize};

/// A deck on a Crazyflie's expansion port.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Deck {
    /// The Flow deck v2.
    FlowV2,
    /// The Z-ranger v2.
    ZRangerV2,
    /// The Multi-ranger.
    MultiRanger,
    /// A deck with these bytes in its memory, in hexadecimal, and without chips on the buses. The
    /// rest of the memory is erased.
    Memory(#[serde(with = "super::hex")] Vec<u8>),
}
