//! The Flow deck v2: an optical flow sensor on SPI1 and a distance sensor on I2C1.

use bittybuzz_chips::devices::one_wire::{DeckDescription, DeckMemory};
use bittybuzz_chips::devices::pmw3901::{EarlyRead, Pmw3901};
use bittybuzz_chips::devices::vl53l1x::{DistanceScale, RangeTarget, Vl53l1x};
use bittybuzz_chips::{SpiDevice, Time};

/// Port and pin of IO_3, which selects the flow sensor while it is low.
pub(crate) const SELECT: (usize, u8) = (1, 4);

/// The distance from the sensor to the ground below a robot that stands on it (choice).
const GROUND_MM: u16 = 15;

/// The sensors of a deck. Both are powered whenever the STM32 is.
pub(crate) struct FlowDeck {
    flow: Pmw3901,
    pub distance: Vl53l1x,
    is_selected: bool,
}

impl FlowDeck {
    /// Returns a deck whose power is turned on at `now`, below a robot that stands on the ground.
    pub fn new(now: Time) -> Self {
        let mut distance = Vl53l1x::new(DistanceScale::default(), true, now);
        distance.set_target(RangeTarget::Distance(GROUND_MM), now);
        FlowDeck { flow: Pmw3901::new(EarlyRead::default(), now), distance, is_selected: false }
    }

    /// Returns the memory by which a firmware discovers the deck. The serial number is arbitrary.
    pub fn memory() -> DeckMemory {
        DeckMemory::new(*b"flow01", &DeckDescription::flow_v2())
    }

    /// Sets the level of [`SELECT`].
    pub fn set_select(&mut self, high: bool, now: Time) {
        if high == std::mem::replace(&mut self.is_selected, !high) {
            self.flow.select(!high, now);
        }
    }

    /// Exchanges a byte with the flow sensor; none if it is not selected.
    pub fn exchange(&mut self, byte: u8, end: Time) -> Option<u8> {
        self.is_selected.then(|| self.flow.exchange(byte, end))
    }
}
