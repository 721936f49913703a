//! Height by the time of flight of light (ST VL53L1x, downwards) at 30 Hz, in whole millimeters.
//!
//! The distance is measured along the body's −z axis, except that the beam is a cone: the nearest
//! point in it counts, so a tilt of up to 7.5 degrees does not matter. Bitcraze's firmware assumes
//! the same cone, and the deviation 0.0025 m (1 + exp(k (d − 2.5 m))) with k = 2.92/m (`zranger2.c`).
//! A measurement takes 33 ms, the shortest time in which ST's small driver (VL53L1X ULD) measures up to
//! 4 m; its full driver, which Bitcraze's firmware has, takes 25 ms. ST does not say to which moment of this
//! time a distance belongs: it is the begin here, and [`HeightSensor::set_age_steps`] sets a later one.

use crate::DroneState;
use crate::random::{NoiseConsumer, NoiseStream};
use crate::sensors::SensorFault;
use crate::sensors::delay::DelayLine;
use crate::sensors::fault::FaultGate;

/// Steps between measurements: 33 ms.
const PERIOD_STEPS: u64 = 33;
/// Largest distance in m; the data sheet's range in the dark (recalled).
const DISTANCE_M_MAX: f64 = 4.0;
/// Half the angle of the cone in radians: 7.5 degrees.
const HALF_CONE_RAD: f64 = 7.5 * core::f64::consts::PI / 180.0;
/// Cosine of the largest tilt with an echo (choice: 60 degrees).
const COS_TILT_MIN: f64 = 0.5;

/// One measurement of the height sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeightReading {
    /// Distance to the ground in mm.
    Distance(u16),
    /// No echo: too far, too tilted or below the ground.
    NoEcho,
}

/// A height sensor at the center of mass.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightSensor {
    noise: NoiseStream,
    line: DelayLine<HeightReading, 2>,
    /// Steps from the moment of a distance until it arrives.
    age_steps: u64,
    gate: FaultGate<HeightReading>,
}

/// Returns the standard deviation of a measurement at this distance, in m.
fn deviation_m(distance_m: f64) -> f64 {
    0.0025 * (1.0 + libm::exp(2.92 * (distance_m - 2.5)))
}

impl HeightSensor {
    /// Returns a sensor.
    ///
    /// # Parameters
    /// `seed`: its noise.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        HeightSensor {
            noise: NoiseStream::new(seed, NoiseConsumer::Height),
            line: DelayLine::new(),
            age_steps: PERIOD_STEPS,
            gate: FaultGate::new(),
        }
    }

    /// Sets the time from the moment of a distance until it arrives, at most 33 ms.
    pub fn set_age_steps(&mut self, steps: u64) {
        self.age_steps = steps.min(PERIOD_STEPS);
    }

    /// Sets or clears the fault.
    pub fn set_fault(&mut self, fault: Option<SensorFault>) {
        self.gate.fault = fault;
    }

    /// Follows one step above a ground of this height, and returns a measurement every 33 steps.
    pub fn sample(&mut self, state: &DroneState, ground_m: f64) -> Option<HeightReading> {
        let arrived = self.line.pop(state.steps);
        if state.steps.is_multiple_of(PERIOD_STEPS) {
            let reading = self.measure(state, ground_m);
            self.line.push(state.steps + self.age_steps, reading);
        }
        arrived.and_then(|reading| self.gate.pass(reading))
    }

    /// Returns the measurement of this moment, for a chip that has the period and the age itself.
    pub fn measure(&mut self, state: &DroneState, ground_m: f64) -> HeightReading {
        // A draw in any case keeps later noise independent of the echoes.
        let normal = self.noise.normal();
        let height_m = state.position_m.z - ground_m;
        let beyond_rad = (state.tilt_rad() - HALF_CONE_RAD).max(0.0);
        let distance_m = height_m / libm::cos(beyond_rad);
        let is_seen =
            height_m >= 0.0 && state.cos_tilt() >= COS_TILT_MIN && distance_m <= DISTANCE_M_MAX;
        if !is_seen {
            return HeightReading::NoEcho;
        }
        let noise_m = normal * deviation_m(distance_m) * self.gate.noise_factor();
        // A conversion to an integer limits the number.
        HeightReading::Distance(((distance_m + noise_m) * 1000.0).round() as u16)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DQuat, DVec3};

    fn run(sensor: &mut HeightSensor, mut state: DroneState, count: u64) -> Vec<HeightReading> {
        let mut found = Vec::new();
        for _ in 0..count * PERIOD_STEPS {
            state.steps += 1;
            found.extend(sensor.sample(&state, 0.0));
        }
        found
    }

    fn millimeters(readings: &[HeightReading]) -> Vec<f64> {
        let distance = |reading: &HeightReading| match reading {
            HeightReading::Distance(mm) => Some(f64::from(*mm)),
            HeightReading::NoEcho => None,
        };
        readings.iter().filter_map(distance).collect()
    }

    fn at(height_m: f64, tilt_rad: f64) -> DroneState {
        DroneState {
            attitude: DQuat::from_rotation_x(tilt_rad),
            ..DroneState::at_rest(DVec3::new(0.0, 0.0, height_m), 0.0)
        }
    }

    /// The deviation is 5 mm at 2.5 m, and 0.2 m at 4 m.
    #[test]
    fn noise_grows_with_the_distance() {
        assert!((deviation_m(2.5) - 0.005).abs() < 1e-12);
        assert!((deviation_m(4.0) - 0.2).abs() < 0.003);
        let values = millimeters(&run(&mut HeightSensor::new(1), at(2.5, 0.0), 4000));
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
        assert!((mean - 2500.0).abs() < 0.5 && (square.sqrt() - 5.0).abs() < 0.3);
    }

    /// At 1 m and a tilt of 22.5 degrees, the near rim of the cone is 15 degrees from the vertical.
    #[test]
    fn tilt_lengthens_the_distance_beyond_the_cone() {
        for (degrees, exact) in [(5.0, 1000.0), (22.5, 1000.0 / 15.0_f64.to_radians().cos())] {
            let state = at(1.0, f64::to_radians(degrees));
            let values = millimeters(&run(&mut HeightSensor::new(2), state, 2000));
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            assert!((mean - exact).abs() < 0.5, "{degrees}: {mean} {exact}");
        }
    }

    #[test]
    fn measurements_are_33_ms_old() {
        let mut sensor = HeightSensor::new(3);
        assert_eq!(run(&mut sensor, at(1.0, 0.0), 3).len(), 2);
        let next = DroneState { steps: 3 * PERIOD_STEPS, ..at(2.0, 0.0) };
        let values = millimeters(&run(&mut sensor, next, 2));
        assert!((values[0] - 1000.0).abs() < 20.0 && (values[1] - 2000.0).abs() < 20.0);
    }

    #[test]
    fn a_distance_can_be_of_a_later_moment() {
        let mut sensor = HeightSensor::new(3);
        sensor.set_age_steps(17);
        let mut state = at(1.0, 0.0);
        let arrivals = (1..=100).filter(|step| {
            state.steps = *step;
            sensor.sample(&state, 0.0).is_some()
        });
        assert_eq!(arrivals.collect::<Vec<_>>(), [33 + 17, 66 + 17]);
    }

    #[test]
    fn out_of_range_has_no_echo() {
        for state in [at(5.0, 0.0), at(1.0, 1.2), at(-0.1, 0.0), at(f64::NAN, 0.0)] {
            let readings = run(&mut HeightSensor::new(1), state, 3);
            assert_eq!(readings, [HeightReading::NoEcho; 2]);
        }
    }
}
