//! An I2C bus between a microcontroller and the chips on it.
//!
//! The microcontroller's peripheral reports complete actions as [`BusAction`]s. A firmware may also
//! set the two lines by hand, to free a bus that a chip holds: a reset of the microcontroller does
//! not reach the chips, and one that was addressed at that moment waits for the clock of its
//! transfer. With the bits of its byte, or to acknowledge one, it may hold SDA low, and then there
//! is no start condition (UM10204 3.1.16).

use crate::{I2cDevice, Time};

/// An action of the master on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusAction {
    /// The master sent a start condition and an address; the answer is an acknowledgement.
    Start {
        /// The address of seven bits.
        address: u8,
        /// True for a transfer to the master.
        read: bool,
    },
    /// The master sent a byte; the answer is an acknowledgement.
    Write(u8),
    /// The master reads; the answer is a byte.
    Read,
    /// The master sent a stop condition and released the bus.
    Stop,
}

/// The state of the bus at the moment when the master let it go: the action on the wire with the
/// number of its bits that were not complete, or `None` between two actions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusRelease(pub Option<(BusAction, u64)>);

/// The answer of the chips on the bus to an action.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusAnswer {
    /// The acknowledgement of an address or a byte.
    Acknowledge(bool),
    /// The byte that the master reads.
    Byte(u8),
    /// A stop condition has no answer.
    None,
}

/// The bits of a byte and its acknowledgement.
const BYTE_BITS: u64 = 9;

/// A transfer without a master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LeftOver {
    /// The device sends these bits, of which `left` follow, and then waits for an acknowledgement.
    Sends { bits: u8, left: u64 },
    /// The device acknowledges after this number of bits, and after each further byte.
    Receives { bits: u64 },
}

/// An I2C bus; its devices are given to each call, because they belong to the board.
#[derive(Debug)]
pub struct I2cBus {
    /// The index of the device that has acknowledged its address, and true if it sends.
    addressed: Option<(usize, bool)>,
    /// The transfer that the master left.
    left_over: Option<LeftOver>,
    /// The levels of SCL and SDA that the firmware sets by hand; high without it.
    lines: [bool; 2],
}

impl Default for I2cBus {
    /// Returns an idle bus.
    fn default() -> Self {
        I2cBus { addressed: None, left_over: None, lines: [true; 2] }
    }
}

impl I2cBus {
    /// Performs a complete action of the master.
    pub fn perform(
        &mut self,
        action: BusAction,
        devices: &mut [&mut dyn I2cDevice],
        now: Time,
    ) -> BusAnswer {
        let addressed = self.addressed.and_then(|(index, _)| devices.get_mut(index));
        match (action, addressed) {
            (BusAction::Start { address, read }, _) => {
                self.left_over = None;
                // Every device sees the start condition, and ends its own transfer.
                self.addressed = None;
                for (index, device) in devices.iter_mut().enumerate() {
                    if device.start(address, read, now) {
                        self.addressed = Some((index, read));
                    }
                }
                BusAnswer::Acknowledge(self.addressed.is_some())
            }
            (BusAction::Write(byte), Some(device)) => {
                BusAnswer::Acknowledge(device.write(byte, now))
            }
            (BusAction::Write(_), None) => BusAnswer::Acknowledge(false),
            (BusAction::Read, Some(device)) => BusAnswer::Byte(device.read(now)),
            // Nobody drives the line, which is pulled up.
            (BusAction::Read, None) => BusAnswer::Byte(0xff),
            (BusAction::Stop, device) => {
                if let Some(device) = device {
                    device.stop(now);
                }
                self.addressed = None;
                self.left_over = None;
                BusAnswer::None
            }
        }
    }

    /// Leaves the devices without a master.
    pub fn release(
        &mut self,
        BusRelease(action): BusRelease,
        devices: &mut [&mut dyn I2cDevice],
        now: Time,
    ) {
        let Some((index, sends)) = self.addressed else { return };
        let next = if sends { BusAction::Read } else { BusAction::Write(0) };
        let (action, bits) = action.unwrap_or((next, BYTE_BITS));
        // The last bit of a byte is its acknowledgement.
        let before = bits.clamp(1, BYTE_BITS) - 1;
        self.left_over = match action {
            BusAction::Read => devices
                .get_mut(index)
                .map(|device| LeftOver::Sends { bits: device.read(now), left: before }),
            BusAction::Start { .. } | BusAction::Write(_) => {
                Some(LeftOver::Receives { bits: before })
            }
            BusAction::Stop => None,
        };
    }

    /// Returns true if a device holds SDA low outside of a transfer: with the rest of a transfer, or
    /// because of a fault of its own.
    pub fn is_held(&self, devices: &[&mut dyn I2cDevice]) -> bool {
        let by_left_over = match self.left_over {
            Some(LeftOver::Sends { bits, left }) => left > 0 && bits >> (left - 1) & 1 == 0,
            Some(LeftOver::Receives { bits }) => bits == 0,
            None => false,
        };
        by_left_over || devices.iter().any(|device| device.holds_sda())
    }

    /// Applies the levels that the firmware gives to SCL and SDA by hand; true is high, or left to
    /// the pull-up resistor. A falling SCL clocks a device that waits, and an edge of SDA while SCL
    /// is high is a start or a stop condition (UM10204 3.1.4).
    pub fn set_lines(
        &mut self,
        scl: bool,
        sda: bool,
        devices: &mut [&mut dyn I2cDevice],
        now: Time,
    ) {
        let [old_scl, old_sda] = std::mem::replace(&mut self.lines, [scl, sda]);
        if old_scl && !scl {
            self.clock();
            devices.iter_mut().for_each(|device| device.clock_pulse());
        } else if old_scl && scl && old_sda != sda && !self.is_held(devices) {
            // Both conditions end the transfer of the device that waits.
            self.left_over = None;
            let addressed = self.addressed.take();
            if sda && let Some(device) = addressed.and_then(|(index, _)| devices.get_mut(index)) {
                device.stop(now);
            }
        }
    }

    /// Handles a falling edge of the clock while no master has the bus. SDA is high unless a device
    /// holds it.
    fn clock(&mut self) {
        self.left_over = match self.left_over {
            // No master acknowledges the byte, so the device sends no other.
            Some(LeftOver::Sends { left: 0, .. }) | None => None,
            Some(LeftOver::Sends { bits, left }) => Some(LeftOver::Sends { bits, left: left - 1 }),
            Some(LeftOver::Receives { bits: 0 }) => {
                Some(LeftOver::Receives { bits: BYTE_BITS - 1 })
            }
            Some(LeftOver::Receives { bits }) => Some(LeftOver::Receives { bits: bits - 1 }),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Time = Time::ZERO;

    /// A device that records what it sees, and sends one byte for ever.
    struct Recorder {
        address: u8,
        byte: u8,
        seen: Vec<String>,
    }

    impl Recorder {
        fn new(address: u8, byte: u8) -> Self {
            Recorder { address, byte, seen: Vec::new() }
        }
    }

    impl I2cDevice for Recorder {
        fn start(&mut self, address: u8, reads: bool, _: Time) -> bool {
            let answers = address == self.address;
            if answers {
                self.seen.push(format!("start {reads}"));
            }
            answers
        }

        fn write(&mut self, byte: u8, _: Time) -> bool {
            self.seen.push(format!("write {byte}"));
            byte != 0
        }

        fn read(&mut self, _: Time) -> u8 {
            self.byte
        }

        fn stop(&mut self, _: Time) {
            self.seen.push("stop".into());
        }
    }

    fn start(address: u8, read: bool) -> BusAction {
        BusAction::Start { address, read }
    }

    #[test]
    fn only_the_addressed_device_answers() {
        let (mut a, mut b) = (Recorder::new(0x18, 0xaa), Recorder::new(0x69, 0xbb));
        let mut bus = I2cBus::default();
        let mut perform = |action| bus.perform(action, &mut [&mut a, &mut b], NOW);
        assert_eq!(perform(start(0x42, false)), BusAnswer::Acknowledge(false));
        assert_eq!(perform(BusAction::Read), BusAnswer::Byte(0xff), "the line is pulled up");
        assert_eq!(perform(start(0x69, false)), BusAnswer::Acknowledge(true));
        assert_eq!(perform(BusAction::Write(7)), BusAnswer::Acknowledge(true));
        assert_eq!(perform(BusAction::Write(0)), BusAnswer::Acknowledge(false));
        assert_eq!(perform(start(0x18, true)), BusAnswer::Acknowledge(true));
        assert_eq!(perform(BusAction::Read), BusAnswer::Byte(0xaa));
        assert_eq!(perform(BusAction::Stop), BusAnswer::None);
        assert_eq!(a.seen, ["start true", "stop"]);
        assert_eq!(b.seen, ["start false", "write 7", "write 0"]);
    }

    /// Counts the clocks by hand until SDA is high, as UM10204 3.1.16 asks for: nine at most.
    fn clocks_until_free(bus: &mut I2cBus, device: &mut Recorder) -> usize {
        let clocks = (0..).take_while(|_| {
            let was_held = bus.is_held(&[device]);
            if was_held {
                bus.set_lines(false, true, &mut [device], NOW);
                bus.set_lines(true, true, &mut [device], NOW);
            }
            was_held
        });
        clocks.take(20).count()
    }

    #[test]
    fn clocks_by_hand_free_a_bus_that_a_device_holds() {
        // The device sends 0b0000_0001: seven bits hold SDA low, the eighth lets it go.
        for (left, clocks) in [(9, 7), (5, 3), (2, 0), (1, 0)] {
            let mut device = Recorder::new(0x18, 1);
            let mut bus = I2cBus::default();
            bus.perform(start(0x18, true), &mut [&mut device], NOW);
            bus.release(BusRelease(Some((BusAction::Read, left))), &mut [&mut device], NOW);
            assert_eq!(clocks_until_free(&mut bus, &mut device), clocks, "{left} bits");
        }
    }

    #[test]
    fn a_stop_by_hand_reaches_the_device() {
        let mut device = Recorder::new(0x50, 0xff);
        let mut bus = I2cBus::default();
        bus.perform(start(0x50, false), &mut [&mut device], NOW);
        bus.release(BusRelease(None), &mut [&mut device], NOW);
        // SDA falls while SCL is low, and rises while SCL is high.
        for (scl, sda) in [(false, true), (false, false), (true, false), (true, true)] {
            bus.set_lines(scl, sda, &mut [&mut device], NOW);
        }
        assert_eq!(device.seen, ["start false", "stop"]);
    }
}
