//! AT42QT1070 touch controller on I2C (data sheet; SwarmUI's qt1070.c).

use bittybuzz_chips::Time;

use super::device::Device;

const CHIP_ID: u8 = 0;
const DETECTION_STATUS: u8 = 2;
const KEY_STATUS: u8 = 3;
const CALIBRATE: u8 = 56;
const RESET: u8 = 57;
const REGISTERS: usize = 58;
const STATUS_TOUCH: u8 = 1 << 0;
const STATUS_CALIBRATE: u8 = 1 << 7;
/// Duration of a calibration. A choice: the data sheet gives no time for seven keys in the Zooid's
/// settings.
const CALIBRATION: Time = Time::from_millis(100);

/// Time from power-on or a reset until the chip answers on the bus. The data sheet gives none; the
/// choice is longer than the firmware takes to its first access.
const START_UP: Time = Time::from_millis(125);

pub(super) struct Touch {
    registers: [u8; REGISTERS],
    pointer: u8,
    calibrated: Time,
    /// The time from which on the chip answers on the bus.
    asleep_until: Time,
    /// True if the status changed since it was read; the pin CHANGE is then low.
    changed: bool,
}

impl Touch {
    /// 7-bit address.
    pub const ADDRESS: u8 = 0x1b;

    pub fn new() -> Self {
        let mut registers = [0; REGISTERS];
        registers[usize::from(CHIP_ID)] = 0x2e;
        registers[1] = 0x15;
        // Negative thresholds and detection integrators have their factory settings.
        registers[32..39].fill(20);
        registers[46..53].fill(4);
        Touch {
            registers,
            pointer: 0,
            calibrated: START_UP + CALIBRATION,
            asleep_until: START_UP,
            changed: false,
        }
    }

    /// Sets the state after power-on; fingers stay where they are.
    pub fn restart(&mut self, now: Time) {
        let keys = self.registers[usize::from(KEY_STATUS)];
        let asleep_until = now + START_UP;
        *self = Touch { calibrated: asleep_until + CALIBRATION, asleep_until, ..Touch::new() };
        self.press(keys);
    }

    /// Puts fingers on these electrodes: bit 0 is KEY1.
    pub fn press(&mut self, keys: u8) {
        let status = &mut self.registers[usize::from(KEY_STATUS)];
        if *status != keys & 0x7f {
            *status = keys & 0x7f;
            self.registers[usize::from(DETECTION_STATUS)] =
                if *status == 0 { 0 } else { STATUS_TOUCH };
            self.changed = true;
        }
    }

    /// Returns the level of the pin CHANGE.
    pub fn change(&self) -> bool {
        !self.changed
    }
}

impl Device for Touch {
    fn is_awake(&self, now: Time) -> bool {
        now >= self.asleep_until
    }

    fn point(&mut self, register: u8) {
        self.pointer = register;
    }

    fn write(&mut self, byte: u8, now: Time) {
        match self.pointer {
            CALIBRATE if byte != 0 => self.calibrated = now + CALIBRATION,
            RESET if byte != 0 => self.restart(now),
            32..=55 => self.registers[usize::from(self.pointer)] = byte,
            _ => {}
        }
        self.pointer = self.pointer.wrapping_add(1);
    }

    fn read(&mut self, now: Time) -> u8 {
        let mut byte = self.registers.get(usize::from(self.pointer)).copied().unwrap_or(0);
        match self.pointer {
            DETECTION_STATUS if now < self.calibrated => byte |= STATUS_CALIBRATE,
            KEY_STATUS => self.changed = false,
            _ => {}
        }
        self.pointer = self.pointer.wrapping_add(1);
        byte
    }
}
