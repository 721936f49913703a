//! The inertial sensor Bosch BMI088: an accelerometer and a gyroscope that share a package and an
//! I2C bus.
//!
//! Sources: data sheet BST-BMI088-DS001 (revision 1.3) and Bosch's BMI08x-Sensor-API. The values of
//! registers after a reset are recalled from the data sheet's maps of registers.
//!
//! # Limits
//! The FIFOs, the synchronization of both parts and the pins INT1, INT2 and INT4 have no model;
//! their registers are storage. The physics gives counts of the largest ranges, so that smaller
//! ranges have no finer steps. Filters belong to the physics.

mod accelerometer;
#[cfg(test)]
mod driver_tests;
mod gyroscope;
mod latch;
#[cfg(test)]
mod tests;

use self::accelerometer::Accelerometer;
use self::gyroscope::Gyroscope;
use self::latch::AxisLatch;
use super::{RegisterPointer, SampleClock, SdaHold};
use crate::{I2cDevice, Time};

/// The accelerometer's address when pin SDO1 is low.
pub const ACCELEROMETER_ADDRESS: u8 = 0x18;
/// The gyroscope's address when pin SDO2 is high.
pub const GYROSCOPE_ADDRESS: u8 = 0x69;
/// Largest deviation of the rate of samples, in millionths.
const DEVIATION_PPM_MAX: i32 = 3_000;
/// The time from power-on until a part acknowledges its address (recalled from the data sheet).
const POWER_ON: Time = Time::from_millis(1);

/// A fault of a BMI088.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bmi088Fault {
    /// The accelerometer has this identification.
    AccelerometerId(u8),
    /// The gyroscope has this identification.
    GyroscopeId(u8),
    /// Both parts do not acknowledge their addresses.
    NoAcknowledge,
    /// SDA is held low.
    SdaLow {
        /// The pulses of SCL until the release.
        clock_pulses: u32,
    },
    /// Both parts repeat their last sample. Data-ready continues.
    FrozenData,
    /// The gyroscope samples, but pin INT3 gives no pulses.
    NoDataReady,
    /// The pulses at pin INT3 begin this time after their samples.
    LateDataReady(Time),
    /// Both self-tests fail.
    FailedSelfTest,
}

/// The two readings of the data sheet about the start of the accelerometer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AccelerometerStart {
    /// The accelerometer measures when ACC_PWR_CONF is 0 and ACC_PWR_CTRL is 4, as Bosch's driver
    /// sets them.
    #[default]
    BothRegisters,
    /// ACC_PWR_CTRL alone starts the accelerometer (chapter 3, as the driver bmi088 reads it).
    PowerControl,
}

/// The properties of a BMI088 that differ from chip to chip, or that its data sheet leaves open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Bmi088Settings {
    /// Deviation of the gyroscope's rate of samples, in millionths; limited to ±3000.
    pub gyroscope_deviation_ppm: i32,
    /// Deviation of the accelerometer's rate of samples, in millionths; limited to ±3000.
    pub accelerometer_deviation_ppm: i32,
    /// Start of the accelerometer.
    pub start: AccelerometerStart,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    Accelerometer,
    Gyroscope,
}

/// A BMI088 on an I2C bus.
pub struct Bmi088 {
    accelerometer: Accelerometer,
    gyroscope: Gyroscope,
    /// The part that takes part in the current transfer.
    selected: Option<Part>,
    fault: Option<Bmi088Fault>,
    sda: SdaHold,
}

impl Bmi088 {
    /// Returns a chip that is powered on at `now`.
    pub fn new(settings: Bmi088Settings, now: Time) -> Self {
        Bmi088 {
            accelerometer: Accelerometer::new(&settings, now),
            gyroscope: Gyroscope::new(&settings, now),
            selected: None,
            fault: None,
            sda: SdaHold::default(),
        }
    }

    /// Sets the present motion. Samples before `now` have the former one.
    ///
    /// # Parameters
    /// `rate_counts`: angular rate in counts of the range ±2000 °/s.
    /// `force_counts`: specific force in counts of the range ±24 g.
    pub fn set_motion(&mut self, rate_counts: [i16; 3], force_counts: [i16; 3], now: Time) {
        self.advance(now);
        self.gyroscope.rate_counts = rate_counts;
        self.accelerometer.force_counts = force_counts;
    }

    /// Sets the present motion as [`Self::set_motion`] does, and lets the accelerometer take a sample of it
    /// at once.
    ///
    /// The physics of a body gives one value per millisecond, with the vibration of that moment. The
    /// sensor's own 1,600 samples per second would repeat some values and leave others out, and fold
    /// a vibration of 400 Hz to 0 Hz.
    pub fn sample_motion(&mut self, rate_counts: [i16; 3], force_counts: [i16; 3], now: Time) {
        self.set_motion(rate_counts, force_counts, now);
        self.accelerometer.sample_now();
    }

    /// Sets the chip's temperature in °C.
    pub fn set_temperature_c(&mut self, temperature_c: f64, now: Time) {
        self.advance(now);
        self.accelerometer.temperature_c = temperature_c;
    }

    /// Sets or clears the fault.
    pub fn set_fault(&mut self, fault: Option<Bmi088Fault>, now: Time) {
        self.advance(now);
        self.fault = fault;
        self.accelerometer.fault = fault;
        self.gyroscope.fault = fault;
        self.sda.set(match fault {
            Some(Bmi088Fault::SdaLow { clock_pulses }) => clock_pulses,
            _ => 0,
        });
    }

    /// Returns the time of the next change at pin INT3.
    pub fn next_event(&self) -> Option<Time> {
        self.gyroscope.next_event()
    }

    /// Handles everything that happens until `now`.
    pub fn advance(&mut self, now: Time) {
        self.accelerometer.advance(now);
        self.gyroscope.advance(now);
    }

    /// Returns the level of pin INT3, or `None` while nothing drives it.
    pub fn int3(&self) -> Option<bool> {
        self.gyroscope.int3()
    }
}

impl I2cDevice for Bmi088 {
    fn start(&mut self, address: u8, reads: bool, now: Time) -> bool {
        self.advance(now);
        self.selected = None;
        if self.fault == Some(Bmi088Fault::NoAcknowledge) || self.sda.is_low() {
            return false;
        }
        self.selected = match address {
            ACCELEROMETER_ADDRESS if self.accelerometer.start(reads, now) => {
                Some(Part::Accelerometer)
            }
            GYROSCOPE_ADDRESS if self.gyroscope.start(reads, now) => Some(Part::Gyroscope),
            _ => None,
        };
        self.selected.is_some()
    }

    fn write(&mut self, byte: u8, now: Time) -> bool {
        self.advance(now);
        match self.selected {
            Some(Part::Accelerometer) => self.accelerometer.write(byte, now),
            Some(Part::Gyroscope) => self.gyroscope.write(byte, now),
            None => return false,
        }
        true
    }

    fn read(&mut self, now: Time) -> u8 {
        self.advance(now);
        match self.selected {
            Some(Part::Accelerometer) => self.accelerometer.read(now),
            Some(Part::Gyroscope) => self.gyroscope.read(now),
            // Nothing drives SDA.
            None => 0xff,
        }
    }

    fn stop(&mut self, _now: Time) {
        self.selected = None;
    }

    fn holds_sda(&self) -> bool {
        self.sda.is_low()
    }

    fn clock_pulse(&mut self) {
        self.sda.clock_pulse();
    }
}
