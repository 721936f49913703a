//! The decks on the expansion port: their sensors on I2C1 and SPI1, and their memories, which the
//! nRF51 reads.

use bittybuzz_chips::devices::one_wire::{CAPACITY, DeckDescription, DeckMemories, DeckMemory};
use bittybuzz_chips::devices::pca9554::Pca9554;
use bittybuzz_chips::devices::pmw3901::{EarlyRead, FlowImage, Pmw3901, Pmw3901Fault};
use bittybuzz_chips::devices::vl53l1x::{DistanceScale, RangeTarget, Vl53l1x, Vl53l1xFault};
use bittybuzz_chips::{I2cDevice, SpiDevice, Time};
use bittybuzz_crazyflie_physics::sensors::{FlowCounts, HeightReading};

/// Port and pin of IO_3, which selects the flow sensor while it is low.
pub(crate) const SELECT: (usize, u8) = (1, 4);

/// The distance from the sensor to the ground below a robot that stands on it (choice).
const GROUND_MM: u16 = 15;

/// The pins of the expander that lead to XSHUT of the sensors upwards, back, right, front and left
/// (multiranger.c).
const SHUTDOWN_PINS: [u8; DIRECTIONS] = [0, 1, 2, 4, 6];
const DIRECTIONS: usize = 5;

/// Distances around a robot, in mm; `None` for nothing in range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RangesMm {
    /// Distance to the ground.
    pub down: Option<u16>,
    /// Distance to the front.
    pub front: Option<u16>,
    /// Distance to the back.
    pub back: Option<u16>,
    /// Distance to the left.
    pub left: Option<u16>,
    /// Distance to the right.
    pub right: Option<u16>,
    /// Distance upwards.
    pub up: Option<u16>,
}

impl Default for RangesMm {
    /// Returns the distances of a robot that stands on the ground with nothing around it.
    fn default() -> Self {
        let [front, back, left, right, up] = [None; 5];
        RangesMm { down: Some(GROUND_MM), front, back, left, right, up }
    }
}

/// A deck on the expansion port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AttachedDeck {
    /// The Flow deck v2: an optical flow sensor on SPI1 and a distance sensor on I2C1.
    FlowV2,
    /// The Z-ranger v2: a distance sensor on I2C1.
    ZRangerV2,
    /// The Multi-ranger: five distance sensors on I2C1, and a port expander with their pins.
    MultiRanger,
    /// A deck with this content of its memory, and without chips on the buses.
    Memory([u8; CAPACITY]),
}

impl AttachedDeck {
    /// Returns the memory by which a firmware discovers the deck. The serial number is arbitrary.
    fn memory(&self) -> DeckMemory {
        let description = match self {
            AttachedDeck::FlowV2 => DeckDescription::flow_v2(),
            AttachedDeck::ZRangerV2 => DeckDescription::z_ranger_v2(),
            AttachedDeck::MultiRanger => DeckDescription::multi_ranger(),
            AttachedDeck::Memory(content) => return DeckMemory::with_content(*b"deck01", *content),
        };
        DeckMemory::new(*b"deck01", &description)
    }
}

/// The optical flow sensor of a Flow deck.
struct FlowSensor {
    sensor: Pmw3901,
    is_selected: bool,
}

/// The chips of a Multi-ranger.
struct MultiRanger {
    expander: Pca9554,
    sensors: [Vl53l1x; DIRECTIONS],
}

/// The chips of the decks. All are powered whenever the STM32 is.
#[derive(Default)]
pub(crate) struct Decks {
    attached: Vec<AttachedDeck>,
    ranges: RangesMm,
    flow: Option<FlowSensor>,
    /// The sensors towards the ground, which nothing keeps silent.
    down: Vec<Vl53l1x>,
    multi_rangers: Vec<MultiRanger>,
}

impl Decks {
    /// Returns decks whose power is turned on at `now`, on a robot that stands on the ground with
    /// nothing around it.
    pub fn new(attached: Vec<AttachedDeck>, now: Time) -> Self {
        let mut decks = Decks::default();
        let range_finder = || Vl53l1x::new(DistanceScale::default(), true, now);
        for deck in &attached {
            match deck {
                AttachedDeck::FlowV2 => {
                    let sensor = Pmw3901::new(EarlyRead::default(), now);
                    decks.flow = Some(FlowSensor { sensor, is_selected: false });
                    decks.down.push(range_finder());
                }
                AttachedDeck::ZRangerV2 => decks.down.push(range_finder()),
                AttachedDeck::MultiRanger => {
                    let sensors = std::array::from_fn(|_| range_finder());
                    decks.multi_rangers.push(MultiRanger { expander: Pca9554::new(), sensors });
                }
                AttachedDeck::Memory(_) => {}
            }
        }
        decks.set_ranges(RangesMm::default(), now);
        Decks { attached, ..decks }
    }

    /// Turns the power of all decks off and on again.
    pub fn restart(&mut self, now: Time) {
        let ranges = self.ranges;
        *self = Decks::new(std::mem::take(&mut self.attached), now);
        self.set_ranges(ranges, now);
    }

    /// Sets the distances that the range finders measure from now on.
    pub fn set_ranges(&mut self, ranges: RangesMm, now: Time) {
        self.ranges = ranges;
        let target = |mm: Option<u16>| mm.map_or(RangeTarget::NoEcho, RangeTarget::Distance);
        let RangesMm { down, front, back, left, right, up } = ranges;
        self.down.iter_mut().for_each(|sensor| sensor.set_target(target(down), now));
        for deck in &mut self.multi_rangers {
            for (sensor, mm) in deck.sensors.iter_mut().zip([up, back, right, front, left]) {
                sensor.set_target(target(mm), now);
            }
        }
    }

    /// Sets the distance to the ground.
    pub fn set_height(&mut self, height: HeightReading, now: Time) {
        let down = match height {
            HeightReading::Distance(mm) => Some(mm),
            HeightReading::NoEcho => None,
        };
        self.set_ranges(RangesMm { down, ..self.ranges }, now);
    }

    /// Moves the picture of the ground by counts along the axes of the robot. A sensor that sees no
    /// texture reports a quality of 0.
    pub fn add_flow(&mut self, counts: FlowCounts) {
        let Some(flow) = &mut self.flow else { return };
        let FlowCounts { x, y, quality, shutter, is_valid } = counts;
        let squal = if is_valid { quality } else { 0 };
        let image = FlowImage { squal, shutter, ..FlowImage::default() };
        flow.sensor.add_motion([y.saturating_neg(), x.saturating_neg()], image);
    }

    /// Returns true if a deck has a flow sensor.
    pub fn has_flow(&self) -> bool {
        self.flow.is_some()
    }

    /// Sets or ends the fault of the flow sensor.
    pub fn set_flow_fault(&mut self, fault: Option<Pmw3901Fault>) {
        if let Some(flow) = &mut self.flow {
            flow.sensor.set_fault(fault);
        }
    }

    /// Sets or ends the fault of the sensors towards the ground.
    pub fn set_distance_fault(&mut self, fault: Option<Vl53l1xFault>, now: Time) {
        self.down.iter_mut().for_each(|sensor| sensor.set_fault(fault, now));
    }

    /// Returns the memories of the decks.
    pub fn memories(&self) -> DeckMemories {
        DeckMemories::new(self.attached.iter().map(AttachedDeck::memory).collect())
    }

    /// Returns true if no deck is on the port.
    pub fn is_empty(&self) -> bool {
        self.attached.is_empty()
    }

    /// Returns the chips on I2C1.
    pub fn i2c_devices(&mut self) -> impl Iterator<Item = &mut dyn I2cDevice> {
        let down = self.down.iter_mut().map(|sensor| sensor as &mut dyn I2cDevice);
        let around = self.multi_rangers.iter_mut().flat_map(|deck| {
            let sensors = deck.sensors.iter_mut().map(|sensor| sensor as &mut dyn I2cDevice);
            sensors.chain([&mut deck.expander as &mut dyn I2cDevice])
        });
        down.chain(around)
    }

    /// Passes the levels of the expanders' pins on to the sensors.
    pub fn settle(&mut self, now: Time) {
        for deck in &mut self.multi_rangers {
            let levels = deck.expander.levels();
            for (sensor, pin) in deck.sensors.iter_mut().zip(SHUTDOWN_PINS) {
                sensor.set_xshut(levels & 1 << pin != 0, now);
            }
        }
    }

    /// Sets the level of [`SELECT`].
    pub fn set_select(&mut self, high: bool, now: Time) {
        if let Some(flow) = &mut self.flow
            && high == std::mem::replace(&mut flow.is_selected, !high)
        {
            flow.sensor.select(!high, now);
        }
    }

    /// Exchanges a byte with the flow sensor; none if it is not selected.
    pub fn exchange(&mut self, byte: u8, end: Time) -> Option<u8> {
        let flow = self.flow.as_mut().filter(|flow| flow.is_selected)?;
        Some(flow.sensor.exchange(byte, end))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first byte of a burst of the flow sensor (pmw3901.c).
    const BURST: u8 = 0x16;

    /// Reads a burst as Bitcraze's driver does: motion, deltas along x and y, and quality.
    fn burst(deck: &mut Decks, mut now: Time) -> (u8, [i16; 2], u8) {
        deck.set_select(false, now);
        now = now + Time::from_micros(50);
        deck.exchange(BURST, now);
        now = now + Time::from_micros(50);
        let bytes = [(); 12].map(|()| deck.exchange(0, now).expect("it is selected"));
        deck.set_select(true, now);
        let delta = [2, 4].map(|at| i16::from_le_bytes([bytes[at], bytes[at + 1]]));
        (bytes[0], delta, bytes[6])
    }

    /// flowdeck_v1v2.c of Bitcraze's firmware: `accpx = -deltaY` and `accpy = -deltaX` are the
    /// motion along the robot's x and y, and it uses readings with motion 0xb0 only.
    #[test]
    fn bitcrazes_driver_gets_the_motion_of_the_robot() {
        let mut deck = Decks::new(vec![AttachedDeck::FlowV2], Time::ZERO);
        let now = Time::from_millis(100);
        let seen = FlowCounts { x: 12, y: -5, quality: 100, shutter: 1962, is_valid: true };
        deck.add_flow(seen);
        deck.add_flow(FlowCounts { x: 1, y: 0, ..seen });
        let (motion, [delta_x, delta_y], quality) = burst(&mut deck, now);
        assert_eq!((motion, [-delta_y, -delta_x], quality), (0xb0, [13, -5], 100));
        deck.add_flow(FlowCounts { x: 0, y: 0, is_valid: false, ..seen });
        let (motion, _, quality) = burst(&mut deck, now + Time::from_millis(10));
        assert_eq!((motion, quality), (0x30, 0));
    }
}
