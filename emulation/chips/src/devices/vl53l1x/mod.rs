//! The distance sensor ST VL53L1X of the Flow deck and the Multi-ranger deck.
//!
//! Sources: ST's ULD driver (through the crate vl53l1x-uld), ST's full driver in Bitcraze's
//! firmware (src/lib/vl53l1), and Pololu's library vl53l1x-arduino (recalled).
//!
//! # Limits
//! Thresholds, regions of interest and the calibration have no model; their registers are storage.
//! The registers of signal and noise have constant values, because the physics gives distances
//! only.

#[cfg(test)]
mod tests;
mod timing;

use std::collections::BTreeMap;

use super::SdaHold;
use crate::{I2cDevice, Time};

/// The address after a reset.
pub const DEFAULT_ADDRESS: u8 = 0x29;

const DEVICE_ADDRESS: u16 = 0x0001;
const FAST_OSCILLATOR: u16 = 0x0006;
const GPIO_MUX: u16 = 0x0030;
const GPIO_STATUS: u16 = 0x0031;
const PHASECAL_TIMEOUT: u16 = 0x004b;
const TIMEOUT_A: u16 = 0x005e;
const LASER_PERIOD_A: u16 = 0x0060;
const PERIOD: u16 = 0x006c;
const INTERRUPT_CLEAR: u16 = 0x0086;
const MODE_START: u16 = 0x0087;
const RANGE_STATUS: u16 = 0x0089;
const STREAM_COUNT: u16 = 0x008b;
const SPADS: u16 = 0x008c;
const AMBIENT: u16 = 0x0090;
const DISTANCE: u16 = 0x0096;
const SIGNAL: u16 = 0x0098;
const OSCILLATOR_CALIBRATION: u16 = 0x00de;
const SYSTEM_STATUS: u16 = 0x00e5;
const MODEL_ID: u16 = 0x010f;

const ID: u16 = 0xeacc;
/// Bit 4 of GPIO_MUX is zero for an interrupt that is active high.
const GPIO_ACTIVE_LOW: u8 = 0x10;
const MODES: u8 = 0xf0;
const MODE_SINGLE: u8 = 0x10;
const MODE_BACK_TO_BACK: u8 = 0x20;
const MODE_TIMED: u8 = 0x40;
/// The values of RANGE_STATUS.
const STATUS_VALID: u8 = 9;
const STATUS_NO_SIGNAL: u8 = 4;
/// PHASECAL_TIMEOUT for short distances (ULD driver).
const PHASECAL_SHORT: u8 = 0x14;
/// The largest distances in mm (1.3 m, and 4 m in the dark; recalled from ST's manual UM2356).
const SHORT_MM_MAX: u16 = 1_300;
const LONG_MM_MAX: u16 = 4_000;

/// The values of registers after a reset. The oscillator's frequency is the one that ST's full
/// driver assumes if a chip has none. With its calibration (choice) the ULD driver's configuration
/// has a period of 100 ms.
const RESET_VALUES: [(u16, u16); 3] =
    [(FAST_OSCILLATOR, 0xbccc), (OSCILLATOR_CALIBRATION, 37), (GPIO_MUX, 0x1103)];
/// The results besides the distance (choice): 16 SPADs, an ambient rate and a signal rate.
const RESULTS: [(u16, u16); 3] = [(SPADS, 16 << 8), (AMBIENT, 0x0010), (SIGNAL, 0x0400)];
/// The time from the release of XSHUT until the chip responds (VL53L1_FIRMWARE_BOOT_TIME_US of ST's
/// full driver).
const BOOT: Time = Time::from_micros(1_200);

/// A fault of a distance sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Vl53l1xFault {
    /// The chip has this identification.
    WrongId(u16),
    /// The chip does not acknowledge its address.
    NoAcknowledge,
    /// SDA is held low.
    SdaLow {
        /// The pulses of SCL until the release.
        clock_pulses: u32,
    },
    /// The chip never reports the end of its boot.
    NoBoot,
    /// The chip repeats its last distance, with its status and its interrupts.
    FrozenData,
    /// The measurements do not end.
    NoMeasurement,
}

/// The surface in front of the sensor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RangeTarget {
    /// A surface at this distance in mm.
    Distance(u16),
    /// Nothing that reflects enough light.
    #[default]
    NoEcho,
}

/// The two readings of the register of the distance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DistanceScale {
    /// The register is the distance in mm, as ST's ULD driver uses it.
    #[default]
    Millimeters,
    /// The distance is the register multiplied by 2011/2048, as in ST's full driver (lite ranging
    /// gain factor) and in Pololu's library.
    BeforeGain,
}

/// A measurement on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Measurement {
    begin: Time,
    end: Time,
    /// The surface at the begin.
    target: RangeTarget,
}

/// A distance sensor on an I2C bus.
pub struct Vl53l1x {
    scale: DistanceScale,
    registers: BTreeMap<u16, u8>,
    /// The present address on the bus.
    address: u8,
    /// The register of the next byte, and the number of its bytes that are still to come.
    register: u16,
    register_bytes: u8,
    is_selected: bool,
    /// The level of pin XSHUT.
    is_enabled: bool,
    responds_at: Time,
    measurement: Option<Measurement>,
    /// The interrupt is pending.
    is_raised: bool,
    target: RangeTarget,
    fault: Option<Vl53l1xFault>,
    sda: SdaHold,
}

impl Vl53l1x {
    /// Returns a chip that is powered on at `now`.
    ///
    /// # Parameters
    /// `is_enabled`: the level of pin XSHUT.
    pub fn new(scale: DistanceScale, is_enabled: bool, now: Time) -> Self {
        let mut chip = Vl53l1x {
            scale,
            registers: BTreeMap::new(),
            address: DEFAULT_ADDRESS,
            register: 0,
            register_bytes: 0,
            is_selected: false,
            is_enabled,
            responds_at: now,
            measurement: None,
            is_raised: false,
            target: RangeTarget::NoEcho,
            fault: None,
            sda: SdaHold::default(),
        };
        chip.reset(now);
        chip
    }

    /// Sets the level of pin XSHUT. Low switches the chip off, and it forgets its address.
    pub fn set_xshut(&mut self, level: bool, now: Time) {
        self.advance(now);
        if level != self.is_enabled {
            self.is_enabled = level;
            self.reset(now);
        }
    }

    /// Sets the surface in front of the sensor. A measurement has the surface at its begin.
    pub fn set_target(&mut self, target: RangeTarget, now: Time) {
        self.advance(now);
        self.target = target;
    }

    /// Sets or clears the fault.
    pub fn set_fault(&mut self, fault: Option<Vl53l1xFault>, now: Time) {
        self.advance(now);
        self.fault = fault;
        self.sda.set(match fault {
            Some(Vl53l1xFault::SdaLow { clock_pulses }) => clock_pulses,
            _ => 0,
        });
    }

    /// Returns the time of the next measurement's end, which can change pin GPIO1.
    pub fn next_event(&self) -> Option<Time> {
        let end = self.measurement.map(|measurement| measurement.end);
        end.filter(|_| self.fault != Some(Vl53l1xFault::NoMeasurement))
    }

    /// Returns the level of pin GPIO1: an open drain with a pull-up resistor.
    pub fn gpio1(&self) -> bool {
        let is_active_low = self.byte(GPIO_MUX) & GPIO_ACTIVE_LOW != 0;
        !self.is_enabled || self.is_raised != is_active_low
    }

    /// Handles everything that happens until `now`.
    pub fn advance(&mut self, now: Time) {
        while let Some(measurement) = self.measurement.filter(|measurement| measurement.end <= now)
        {
            if self.fault == Some(Vl53l1xFault::NoMeasurement) {
                return;
            }
            self.finish(measurement);
        }
    }

    fn reset(&mut self, now: Time) {
        self.registers.clear();
        for (register, value) in RESET_VALUES {
            self.set_word(register, value);
        }
        self.address = DEFAULT_ADDRESS;
        self.responds_at = now + BOOT;
        self.measurement = None;
        self.is_raised = false;
    }

    fn byte(&self, register: u16) -> u8 {
        self.registers.get(&register).copied().unwrap_or(0)
    }

    fn word(&self, register: u16) -> u16 {
        u16::from_be_bytes([self.byte(register), self.byte(register + 1)])
    }

    fn set_word(&mut self, register: u16, value: u16) {
        let [high, low] = value.to_be_bytes();
        self.registers.insert(register, high);
        self.registers.insert(register + 1, low);
    }

    /// Begins a measurement.
    fn begin(&mut self, begin: Time) {
        let (timeout, laser) = (self.word(TIMEOUT_A), self.byte(LASER_PERIOD_A));
        let end = begin + timing::duration(timeout, laser, self.word(FAST_OSCILLATOR));
        self.measurement = Some(Measurement { begin, end, target: self.target });
    }

    /// Stores the result of a measurement, and begins the next one. A result that was not read is
    /// overwritten (choice).
    fn finish(&mut self, measurement: Measurement) {
        self.measurement = None;
        let is_short = self.byte(PHASECAL_TIMEOUT) == PHASECAL_SHORT;
        let distance_mm_max = if is_short { SHORT_MM_MAX } else { LONG_MM_MAX };
        let (status, distance_mm) = match measurement.target {
            RangeTarget::Distance(distance_mm) if distance_mm <= distance_mm_max => {
                (STATUS_VALID, distance_mm)
            }
            _ => (STATUS_NO_SIGNAL, 0),
        };
        if self.fault != Some(Vl53l1xFault::FrozenData) {
            self.registers.insert(RANGE_STATUS, status);
            self.set_word(DISTANCE, self.scaled(distance_mm));
            for (register, value) in RESULTS {
                self.set_word(register, value);
            }
        }
        // The counter continues at 128 after 255.
        let count = self.byte(STREAM_COUNT).checked_add(1).unwrap_or(128);
        self.registers.insert(STREAM_COUNT, count);
        self.is_raised = true;
        if self.byte(MODE_START) & MODES == MODE_TIMED {
            let high = u32::from(self.word(PERIOD)) << 16;
            let code = high | u32::from(self.word(PERIOD + 2));
            let period = timing::period(code, self.word(OSCILLATOR_CALIBRATION));
            self.begin(measurement.end.max(measurement.begin + period));
        }
    }

    /// Returns the content of the register for a distance.
    fn scaled(&self, distance_mm: u16) -> u16 {
        match self.scale {
            DistanceScale::Millimeters => distance_mm,
            DistanceScale::BeforeGain => (f64::from(distance_mm) * 2048.0 / 2011.0).round() as u16,
        }
    }

    fn write_register(&mut self, register: u16, value: u8, now: Time) {
        self.registers.insert(register, value);
        match register {
            DEVICE_ADDRESS => self.address = value & 0x7f,
            INTERRUPT_CLEAR if value & 1 != 0 => {
                self.is_raised = false;
                let mode = self.byte(MODE_START) & MODES;
                if mode == MODE_BACK_TO_BACK && self.measurement.is_none() {
                    self.begin(now);
                }
            }
            MODE_START => match value & MODES {
                MODE_SINGLE | MODE_BACK_TO_BACK | MODE_TIMED => self.begin(now),
                // Stop and abort.
                _ => self.measurement = None,
            },
            _ => {}
        }
    }

    fn read_register(&self, register: u16) -> u8 {
        let id = match self.fault {
            Some(Vl53l1xFault::WrongId(id)) => id,
            _ => ID,
        };
        let [high, low] = id.to_be_bytes();
        match register {
            DEVICE_ADDRESS => self.address,
            GPIO_STATUS => self.byte(GPIO_STATUS) & !1 | u8::from(self.gpio1()),
            SYSTEM_STATUS => u8::from(self.fault != Some(Vl53l1xFault::NoBoot)),
            MODEL_ID => high,
            _ if register == MODEL_ID + 1 => low,
            _ => self.byte(register),
        }
    }
}

impl I2cDevice for Vl53l1x {
    fn start(&mut self, address: u8, reads: bool, now: Time) -> bool {
        self.advance(now);
        let is_silent = self.fault == Some(Vl53l1xFault::NoAcknowledge) || self.sda.is_low();
        let is_running = self.is_enabled && now >= self.responds_at;
        self.is_selected = address == self.address && is_running && !is_silent;
        self.register_bytes = if reads { 0 } else { 2 };
        self.is_selected
    }

    fn write(&mut self, byte: u8, now: Time) -> bool {
        self.advance(now);
        if !self.is_selected {
            return false;
        }
        if self.register_bytes > 0 {
            self.register_bytes -= 1;
            self.register = self.register << 8 | u16::from(byte);
        } else {
            self.write_register(self.register, byte, now);
            self.register = self.register.wrapping_add(1);
        }
        true
    }

    fn read(&mut self, now: Time) -> u8 {
        self.advance(now);
        if !self.is_selected {
            // Nothing drives SDA.
            return 0xff;
        }
        let byte = self.read_register(self.register);
        self.register = self.register.wrapping_add(1);
        byte
    }

    fn stop(&mut self, _now: Time) {
        self.is_selected = false;
    }

    fn holds_sda(&self) -> bool {
        self.sda.is_low()
    }

    fn clock_pulse(&mut self) {
        self.sda.clock_pulse();
    }
}
