//! The faults of the decks' sensors.

use bittybuzz_pmw3901 as pmw3901;
use bittybuzz_vl53l1x as vl53l1x;

use crate::bus::BusError;

/// A direction in which a range finder looks.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum Direction {
    Down,
    Front,
    Back,
    Left,
    Right,
    Up,
}

/// A chip on a deck.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum DeckSensor {
    Range(Direction),
    /// The port expander of the Multi-ranger.
    Expander,
    Flow,
}

/// A reason why a deck is not fit for flight.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct DeckFault {
    pub sensor: DeckSensor,
    pub cause: DeckFaultCause,
}

/// The cause of a [`DeckFault`].
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum DeckFaultCause {
    /// The chip has not started since power-on.
    NotStarted,
    /// The bus has an error.
    Bus(BusError),
    /// The chip has another identity.
    WrongId(u16),
    /// The chip does not take its settings.
    Refused,
    /// The start did not end in time.
    Timeout,
    /// The chip gives no new values.
    Silent,
}

impl From<vl53l1x::Error<BusError>> for DeckFaultCause {
    fn from(error: vl53l1x::Error<BusError>) -> Self {
        match error {
            vl53l1x::Error::Bus(error) => DeckFaultCause::Bus(error),
            vl53l1x::Error::WrongId { found } => DeckFaultCause::WrongId(found),
            vl53l1x::Error::AddressReserved { .. }
            | vl53l1x::Error::ConfigurationRefused { .. } => DeckFaultCause::Refused,
            vl53l1x::Error::BootTimeout | vl53l1x::Error::CalibrationTimeout => {
                DeckFaultCause::Timeout
            }
        }
    }
}

impl<E> From<pmw3901::Error<E>> for DeckFaultCause {
    fn from(error: pmw3901::Error<E>) -> Self {
        match error {
            // SPI has no acknowledgement: only the DMA controller reports errors.
            pmw3901::Error::Bus(_) => DeckFaultCause::Bus(BusError::Dma),
            pmw3901::Error::WrongId { found, .. } => DeckFaultCause::WrongId(found.into()),
            pmw3901::Error::ConfigurationRefused { .. } => DeckFaultCause::Refused,
        }
    }
}

impl defmt::Format for DeckSensor {
    fn format(&self, f: defmt::Formatter<'_>) {
        match *self {
            DeckSensor::Range(direction) => defmt::write!(f, "range finder {}", direction),
            DeckSensor::Expander => defmt::write!(f, "the expander of the Multi-ranger"),
            DeckSensor::Flow => defmt::write!(f, "the flow sensor"),
        }
    }
}

impl defmt::Format for DeckFault {
    fn format(&self, f: defmt::Formatter<'_>) {
        let sensor = self.sensor;
        match self.cause {
            DeckFaultCause::NotStarted => defmt::write!(f, "{} has not started yet", sensor),
            DeckFaultCause::Bus(error) => defmt::write!(f, "{} does not answer: {}", sensor, error),
            DeckFaultCause::WrongId(id) => {
                defmt::write!(f, "{} is another chip, with id {=u16:#x}", sensor, id)
            }
            DeckFaultCause::Refused => defmt::write!(f, "{} does not take its settings", sensor),
            DeckFaultCause::Timeout => defmt::write!(f, "{} does not start", sensor),
            DeckFaultCause::Silent => defmt::write!(f, "{} gives no new values", sensor),
        }
    }
}
