//! The reasons why the robot must not arm.

use bittybuzz_memories::DeckRefusal;

use crate::decks;
use crate::decks::fault::DeckFault;
use crate::flight::fault::SensorRefusal;
use crate::flight::state;
use crate::settings;

/// A reason why the robot must not arm.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum ArmingRefusal {
    /// The sensors on the board are not fit for flight.
    Sensors(SensorRefusal),
    /// The decks are not known yet.
    DecksUnknown,
    /// The robot must not fly with its decks.
    Decks(DeckRefusal),
    /// A sensor of a deck is not fit for flight.
    DeckSensor(DeckFault),
    /// A limit of the flight in flash is damaged.
    Limits,
}

impl defmt::Format for ArmingRefusal {
    fn format(&self, f: defmt::Formatter<'_>) {
        match *self {
            ArmingRefusal::Sensors(refusal) => defmt::write!(f, "{}", refusal),
            ArmingRefusal::DecksUnknown => defmt::write!(f, "the decks are not known yet"),
            ArmingRefusal::DeckSensor(fault) => defmt::write!(f, "{}", fault),
            ArmingRefusal::Decks(refusal) => defmt::write!(f, "{}", decks::Shown(refusal)),
            ArmingRefusal::Limits => defmt::write!(
                f,
                "a limit of the flight in flash is damaged: `bbz flash --set` writes the limits"
            ),
        }
    }
}

/// Returns the first reason why the robot must not arm; `None` if there is none.
pub fn refusal() -> Option<ArmingRefusal> {
    if settings::are_limits_damaged() {
        return Some(ArmingRefusal::Limits);
    }
    if let Some(refusal) = state::refusal() {
        return Some(ArmingRefusal::Sensors(refusal));
    }
    match decks::result() {
        None => Some(ArmingRefusal::DecksUnknown),
        Some(Err(refusal)) => Some(ArmingRefusal::Decks(refusal)),
        Some(Ok(_)) => decks::fault().map(ArmingRefusal::DeckSensor),
    }
}
