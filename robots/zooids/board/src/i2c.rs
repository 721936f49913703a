//! The I2C bus of touch controller and motion sensor. Both chips have registers and a register
//! pointer, which the first byte of a write sets.
//!
//! A reset of the microcontroller does not reach these chips. One that was addressed at that moment
//! waits for the clock of its transfer: with the bits of its byte, or to acknowledge one, it may hold
//! SDA low, and then there is no start condition (UM10204 3.1.16).

use bittybuzz_chips::{BusAction, BusRelease, Time};

use super::device::Device;
use super::motion::ZooidMotion;
use super::touch::Touch;

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

pub(super) struct Devices {
    pub touch: Touch,
    pub motion: ZooidMotion,
    /// Address of the device that was addressed, if it answered.
    selected: Option<u8>,
    /// True if the addressed device sends.
    sends: bool,
    /// The transfer that the master left.
    left_over: Option<LeftOver>,
    /// True if the next byte that is written is a register's number.
    points: bool,
    /// The number of times that touch controller and motion sensor were addressed.
    pub addressed: [u64; 2],
}

impl Devices {
    pub fn new() -> Self {
        let (touch, motion) = (Touch::new(), ZooidMotion::new());
        Devices {
            touch,
            motion,
            selected: None,
            sends: false,
            left_over: None,
            points: false,
            addressed: [0; 2],
        }
    }

    /// Restarts both devices, as after a loss of power.
    pub fn restart(&mut self, now: Time) {
        self.touch.restart(now);
        self.motion.restart();
        self.stop();
    }

    fn device(&mut self) -> Option<&mut dyn Device> {
        match self.selected? {
            Touch::ADDRESS => Some(&mut self.touch),
            ZooidMotion::ADDRESS => Some(&mut self.motion),
            _ => None,
        }
    }

    /// Addresses a device, and returns true if one answers to `address`.
    pub fn start(&mut self, address: u8, read: bool, now: Time) -> bool {
        self.left_over = None;
        self.selected = Some(address);
        self.sends = read;
        let known = [Touch::ADDRESS, ZooidMotion::ADDRESS];
        if let Some(device) = known.iter().position(|known| *known == address) {
            self.addressed[device] += 1;
        }
        self.points = !read;
        let is_awake = self.device().is_some_and(|device| device.is_awake(now));
        if !is_awake {
            self.selected = None;
        }
        is_awake
    }

    /// Writes a byte, and returns true if it is acknowledged.
    pub fn write(&mut self, byte: u8, now: Time) -> bool {
        let points = std::mem::take(&mut self.points);
        let Some(device) = self.device() else { return false };
        if points {
            device.point(byte)
        } else {
            device.write(byte, now)
        }
        true
    }

    /// Reads a byte. Without a device that drives the bus, the byte is 0xff.
    pub fn read(&mut self, now: Time) -> u8 {
        self.device().map_or(0xff, |device| device.read(now))
    }

    pub fn stop(&mut self) {
        self.selected = None;
        self.left_over = None;
    }

    /// Leaves the devices without a master.
    pub fn leave(&mut self, BusRelease(action): BusRelease, now: Time) {
        if self.device().is_none() {
            return;
        }
        let next = if self.sends { BusAction::Read } else { BusAction::Write(0) };
        let (action, bits) = action.unwrap_or((next, BYTE_BITS));
        // The last bit of a byte is its acknowledgement.
        let before = bits.clamp(1, BYTE_BITS) - 1;
        self.left_over = match action {
            BusAction::Read => Some(LeftOver::Sends { bits: self.read(now), left: before }),
            BusAction::Start { .. } | BusAction::Write(_) => {
                Some(LeftOver::Receives { bits: before })
            }
            BusAction::Stop => None,
        };
    }

    /// Returns true if a device holds SDA low.
    pub fn holds(&self) -> bool {
        match self.left_over {
            Some(LeftOver::Sends { bits, left }) => left > 0 && bits >> (left - 1) & 1 == 0,
            Some(LeftOver::Receives { bits }) => bits == 0,
            None => false,
        }
    }

    /// Handles a falling edge of the clock while no master has the bus. SDA is high unless a device
    /// holds it.
    pub fn clock(&mut self) {
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

    const NOW: Time = Time::from_millis(500);

    fn read(devices: &mut Devices, address: u8, register: u8, count: usize) -> Vec<u8> {
        assert!(devices.start(address, false, NOW));
        assert!(devices.write(register, NOW));
        assert!(devices.start(address, true, NOW));
        let bytes = (0..count).map(|_| devices.read(NOW)).collect();
        devices.stop();
        bytes
    }

    fn write(devices: &mut Devices, address: u8, bytes: &[u8]) {
        assert!(devices.start(address, false, NOW));
        assert!(bytes.iter().all(|byte| devices.write(*byte, NOW)));
        devices.stop();
    }

    #[test]
    fn the_chips_return_their_identity() {
        let mut devices = Devices::new();
        assert_eq!(read(&mut devices, Touch::ADDRESS, 0, 1), [0x2e]);
        assert_eq!(read(&mut devices, ZooidMotion::ADDRESS, 0x0f, 1), [0x69]);
        assert!(!devices.start(0x42, true, NOW));
    }

    /// The number of clocks until a transfer that was left no longer holds SDA, at most 20.
    fn clocks_until_free(devices: &mut Devices, release: BusRelease) -> usize {
        devices.leave(release, NOW);
        (0..20).take_while(|_| devices.holds().then(|| devices.clock()).is_some()).count()
    }

    /// UM10204 3.1.16: the device releases the bus within nine clocks.
    #[test]
    fn a_device_that_was_left_frees_the_bus_within_nine_clocks() {
        for bits in 1..=BYTE_BITS {
            let mut devices = Devices::new();
            read(&mut devices, Touch::ADDRESS, 3, 0);
            devices.start(Touch::ADDRESS, true, NOW);
            // The keys: no finger, eight bits of zero.
            let release = BusRelease(Some((BusAction::Read, bits)));
            assert_eq!(clocks_until_free(&mut devices, release), bits as usize - 1);

            devices.start(Touch::ADDRESS, false, NOW);
            let release = BusRelease(Some((BusAction::Write(0), bits)));
            // The device holds SDA only while it acknowledges.
            assert_eq!(clocks_until_free(&mut devices, release), usize::from(bits == 1));
        }
        // Between two bytes, a device that sends has put the first bit of the next one on the bus.
        let mut devices = Devices::new();
        read(&mut devices, Touch::ADDRESS, 3, 0);
        devices.start(Touch::ADDRESS, true, NOW);
        assert_eq!(clocks_until_free(&mut devices, BusRelease(None)), 8);
        // No device is addressed.
        devices.stop();
        assert_eq!(clocks_until_free(&mut devices, BusRelease(None)), 0);
    }

    #[test]
    fn after_power_on_the_touch_controller_does_not_answer_for_a_while() {
        let mut devices = Devices::new();
        assert!(!devices.start(Touch::ADDRESS, false, Time::from_millis(124)));
        assert!(!devices.write(2, NOW), "no device was addressed");
        assert!(devices.start(Touch::ADDRESS, false, Time::from_millis(125)));
        write(&mut devices, Touch::ADDRESS, &[57, 1]);
        assert!(!devices.start(Touch::ADDRESS, false, NOW));
        assert!(devices.start(ZooidMotion::ADDRESS, false, NOW));
    }

    #[test]
    fn a_touch_pulls_change_until_its_status_is_read() {
        let mut devices = Devices::new();
        assert!(devices.touch.change());
        devices.touch.press(0b10);
        assert!(!devices.touch.change());
        assert_eq!(read(&mut devices, Touch::ADDRESS, 2, 2), [1, 0b10]);
        assert!(devices.touch.change());
        devices.touch.press(0);
        assert!(!devices.touch.change());
        assert_eq!(read(&mut devices, Touch::ADDRESS, 2, 2), [0, 0]);
    }

    #[test]
    fn setups_are_kept_and_calibration_takes_a_while() {
        let mut devices = Devices::new();
        write(&mut devices, Touch::ADDRESS, &[32, 25, 25]);
        assert_eq!(read(&mut devices, Touch::ADDRESS, 32, 3), [25, 25, 20]);
        write(&mut devices, Touch::ADDRESS, &[56, 1]);
        assert_eq!(read(&mut devices, Touch::ADDRESS, 2, 1), [0x80]);
        devices.start(Touch::ADDRESS, false, NOW);
        devices.write(2, NOW);
        assert_eq!(devices.touch.read(NOW + CALIBRATED), 0);
    }

    const CALIBRATED: Time = Time::from_millis(100);

    #[test]
    fn gravity_and_turning_are_measured_once_the_sensors_are_on() {
        let mut devices = Devices::new();
        devices.motion.turn_degrees_s = -90.0;
        assert_eq!(read(&mut devices, ZooidMotion::ADDRESS, 0x1e, 1), [0]);
        assert_eq!(read(&mut devices, ZooidMotion::ADDRESS, 0x22, 12), [0; 12]);
        // 416 Hz, 2 g and 245 dps.
        write(&mut devices, ZooidMotion::ADDRESS, &[0x10, 0x60, 0x60]);
        assert_eq!(read(&mut devices, ZooidMotion::ADDRESS, 0x1e, 1), [3]);
        let outputs = read(&mut devices, ZooidMotion::ADDRESS, 0x22, 12);
        let word = |at: usize| f64::from(i16::from_le_bytes([outputs[at], outputs[at + 1]]));
        assert!((word(4) * 8.75e-3 + 90.0).abs() < 0.01, "dps");
        assert!((word(10) * 0.061e-3 - 1.0).abs() < 1e-4, "g");
    }
}
