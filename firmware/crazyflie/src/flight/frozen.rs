//! The detection of sensors that repeat their values.
//!
//! The noise of a sensor changes its last bits: the gyroscope's is 2.6 counts rms, the
//! accelerometer's 3.1 (data sheet BST-BMI088-DS001, with the bandwidths of the configuration).
//! Three axes therefore repeat a sample about once in a thousand samples, and not for long.

use bittybuzz_bmp3xx::BarometerCounts;

use super::fault::Sensor;
use super::state::Sample;

/// The number of equal samples of all three axes in a row that reveal a stopped sensor.
const INERTIAL_MAX: u32 = 50;
/// The number of readings of the barometer in a row without a new value: half a second.
const BAROMETER_MAX: u32 = 25;

/// Values and the number of times that they were repeated.
struct Repetition<T> {
    last: Option<T>,
    count: u32,
}

impl<T: PartialEq> Repetition<T> {
    const NONE: Self = Repetition { last: None, count: 0 };

    fn add(&mut self, values: T) {
        let repeats = self.last.as_ref() == Some(&values);
        self.count = if repeats { self.count.saturating_add(1) } else { 0 };
        self.last = Some(values);
    }
}

/// The repetitions of all sensors.
pub struct FrozenCheck {
    gyroscope: Repetition<[i16; 3]>,
    accelerometer: Repetition<[i16; 3]>,
    barometer: Repetition<BarometerCounts>,
}

impl FrozenCheck {
    pub const NEW: Self = FrozenCheck {
        gyroscope: Repetition::NONE,
        accelerometer: Repetition::NONE,
        barometer: Repetition::NONE,
    };

    pub fn add(&mut self, sample: &Sample) {
        self.gyroscope.add(sample.rate_counts.0);
        self.accelerometer.add(sample.acceleration_counts.0);
    }

    /// Adds a reading of the barometer; `None` stands for one without a value.
    pub fn add_barometer(&mut self, counts: Option<BarometerCounts>) {
        match counts.or(self.barometer.last) {
            Some(counts) => self.barometer.add(counts),
            None => self.barometer.count = self.barometer.count.saturating_add(1),
        }
    }

    /// Returns the sensor that repeats its values, if there is one.
    pub fn sensor(&self) -> Option<Sensor> {
        if self.gyroscope.count >= INERTIAL_MAX {
            Some(Sensor::Gyroscope)
        } else if self.accelerometer.count >= INERTIAL_MAX {
            Some(Sensor::Accelerometer)
        } else if self.barometer.count >= BAROMETER_MAX {
            Some(Sensor::Barometer)
        } else {
            None
        }
    }
}
