//! The memories of a Crazyflie: the EEPROM with its configuration, and a memory on each of its
//! expansion decks, which identifies the deck.
//!
//! # Principles
//! 1. **A robot flies only with decks that it knows.** [`DeckScan::result`] returns the decks with
//!    which this firmware works, or the reason why it must not fly: a deck that is unknown or not
//!    supported, a memory that is damaged or cannot be read, decks that disturb each other.
//! 2. **The search is a state machine without a clock.** The caller sends [`DeckScan::request`] to
//!    the nRF51, passes on the answers, and decides when to send a request again and when to give
//!    up.
//! 3. **Errors have one variant per cause**, and no content of a memory panics.
//!
//! # Features and cost
//! There are no features. A [`DeckScan`] takes about 0.3 kB.
//!
//! # What it will not do
//! The crate writes no memories, and does not know the decks of newer boards, which are found over
//! I2C. It ignores the serial number of a memory and data for a deck's driver.
//!
//! # Sources
//! The format is that of Bitcraze's deck_memory_format.md, the requests are those of ow_syslink.c
//! (crazyflie-firmware) and memory.c (crazyflie2-nrf-firmware); the configuration is that of
//! configblockeeprom.c. The tests read contents that
//! Bitcraze's cflib wrote.

#![no_std]
#![forbid(unsafe_code)]

mod configuration;
mod conflict;
mod deck;
mod memory;
mod scan;

pub use configuration::{CONFIGURATION_BYTES, Configuration, ConfigurationError, Trim};
pub use conflict::DeckConflict;
pub use deck::{Deck, DeckSet};
pub use memory::{BoardName, DeckDescription, MEMORY_BYTES, MemoryFault};
pub use scan::{DeckRefusal, DeckScan, OneWireRequest, kind};
