//! Optical flow (PixArt PMW3901 on the Flow deck) at 100 Hz, in whole counts.
//!
//! A camera that looks along the body's −z axis sees the ground move. With the velocity v and the
//! rate ω in the body frame, and the distance h to the ground along the axis, the image moves by
//! (vₓ/h − ω_y, v_y/h + ωₓ) radians per second. Bitcraze's firmware assumes 35 pixels in 0.71674 rad
//! and ten counts per pixel, so this sensor returns 488.3 counts per radian.

use glam::DVec2;

use crate::random::{NoiseConsumer, NoiseStream};
use crate::sensors::SensorFault;
use crate::sensors::fault::FaultGate;
use crate::{DroneState, STEP_S};

/// Counts per radian.
const COUNTS_PER_RAD: f64 = 10.0 * 35.0 / 0.716_74;
/// Steps between readings: 10 ms.
const PERIOD_STEPS: u64 = 10;
/// Cosine of the largest tilt at which the sensor tracks the ground (choice: 60 degrees).
const COS_TILT_MIN: f64 = 0.5;

/// The treatment of the fraction of a count that a reading leaves over. Which of both the chip does
/// is not known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuantizationRemainder {
    /// The fraction belongs to the next reading, so slow motion is not lost.
    Carried,
    /// The fraction is lost: motion below half a count is invisible.
    Discarded,
}

/// The floor as the sensor sees it. The model is a choice: of a floor with few features, the sensor
/// follows only a part of the motion, and says so.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorSurface {
    /// Share of the features of a usual floor, 0 to 1, and of the motion that the sensor follows.
    pub texture: f64,
    /// Time of exposure in cycles of the sensor's clock.
    pub shutter: u16,
}

/// Quality that the sensor reports above a usual floor (choice).
const USUAL_QUALITY: f64 = 100.0;

impl FloorSurface {
    /// A usual floor. By Bitcraze's formula this exposure has a noise of 2 counts.
    pub const USUAL: Self = FloorSurface { texture: 1.0, shutter: 1962 };
    /// A white, glossy floor in the dark, of whose motion the sensor sees a fifth.
    pub const FEATURELESS: Self = FloorSurface { texture: 0.2, shutter: 0x1fff };
}

/// The properties of a flow sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowSettings {
    /// Standard deviation of the noise of a reading in counts.
    pub sigma_counts: f64,
    /// Treatment of fractions.
    pub remainder: QuantizationRemainder,
    /// Least distance to the ground in m.
    pub least_height_m: f64,
    /// Largest distance to the ground in m.
    pub most_height_m: f64,
    /// Largest flow in rad/s.
    pub most_flow_rad_s: f64,
}

impl FlowSettings {
    /// The PMW3901. Noise: the deviation that Bitcraze's firmware assumes (2 counts); it depends on
    /// the texture of the ground. Least distance and largest flow are recalled from the data sheet;
    /// the largest distance is a choice.
    pub const PMW3901: Self = FlowSettings {
        sigma_counts: 2.0,
        remainder: QuantizationRemainder::Carried,
        least_height_m: 0.08,
        most_height_m: 4.0,
        most_flow_rad_s: 7.4,
    };
}

/// One reading of the flow sensor: the motion since the last one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlowCounts {
    /// Motion along the body's x axis in counts.
    pub x: i16,
    /// Motion along the body's y axis in counts.
    pub y: i16,
    /// Number of features that the sensor sees, divided by 4.
    pub quality: u8,
    /// Time of exposure in cycles of the sensor's clock.
    pub shutter: u16,
    /// False if the sensor saw no texture: too near, too far, too fast or too tilted.
    pub is_valid: bool,
}

/// A flow sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct FlowSensor {
    settings: FlowSettings,
    surface: FloorSurface,
    noise: NoiseStream,
    sum_counts: DVec2,
    is_valid: bool,
    gate: FaultGate<FlowCounts>,
}

impl FlowSensor {
    /// Returns a sensor.
    ///
    /// # Parameters
    /// `seed`: its noise.
    #[must_use]
    pub fn new(settings: FlowSettings, seed: u64) -> Self {
        FlowSensor {
            settings,
            surface: FloorSurface::USUAL,
            noise: NoiseStream::new(seed, NoiseConsumer::Flow),
            sum_counts: DVec2::ZERO,
            is_valid: true,
            gate: FaultGate::new(),
        }
    }

    /// Sets or clears the fault.
    pub fn set_fault(&mut self, fault: Option<SensorFault>) {
        self.gate.fault = fault;
    }

    /// Replaces the floor, which is a usual one at first.
    pub fn set_surface(&mut self, surface: FloorSurface) {
        self.surface = surface;
    }

    /// Follows one step above a ground of this height, and returns a reading every 10 steps.
    pub fn sample(&mut self, state: &DroneState, ground_m: f64) -> Option<FlowCounts> {
        let cos_tilt = state.cos_tilt();
        let height_m = (state.position_m.z - ground_m) / cos_tilt.max(COS_TILT_MIN);
        let velocity = state.body_velocity_m_s().truncate() / height_m.max(1e-3);
        let rate = state.rate_rad_s;
        let flow = velocity + DVec2::new(-rate.y, rate.x);
        let settings = &self.settings;
        let is_seen = cos_tilt > COS_TILT_MIN
            && (settings.least_height_m..=settings.most_height_m).contains(&height_m)
            && flow.abs().max_element() <= settings.most_flow_rad_s;
        if is_seen {
            self.sum_counts += flow * (COUNTS_PER_RAD * STEP_S * self.surface.texture);
        } else {
            self.is_valid = false;
        }
        if !state.steps.is_multiple_of(PERIOD_STEPS) {
            return None;
        }
        let deviation = settings.sigma_counts * self.gate.noise_factor();
        let noise = DVec2::new(self.noise.normal(), self.noise.normal()) * deviation;
        // A conversion to an integer limits the number.
        let quality = (USUAL_QUALITY * self.surface.texture) as u8;
        let shutter = self.surface.shutter;
        let reading = if self.is_valid {
            let total = self.sum_counts + noise;
            let counts = total.round();
            self.sum_counts = match settings.remainder {
                QuantizationRemainder::Carried => total - counts,
                QuantizationRemainder::Discarded => DVec2::ZERO,
            };
            FlowCounts { x: counts.x as i16, y: counts.y as i16, quality, shutter, is_valid: true }
        } else {
            self.sum_counts = DVec2::ZERO;
            FlowCounts { x: 0, y: 0, quality, shutter, is_valid: false }
        };
        self.is_valid = true;
        self.gate.pass(reading)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{DQuat, DVec3};

    fn noiseless(remainder: QuantizationRemainder) -> FlowSensor {
        let settings = FlowSettings { sigma_counts: 0.0, remainder, ..FlowSettings::PMW3901 };
        FlowSensor::new(settings, 1)
    }

    /// Returns the readings of a state that lasts `readings` periods.
    fn run(sensor: &mut FlowSensor, mut state: DroneState, readings: u64) -> Vec<FlowCounts> {
        let mut found = Vec::new();
        for _ in 0..readings * PERIOD_STEPS {
            state.steps += 1;
            found.extend(sensor.sample(&state, 0.0));
        }
        found
    }

    fn moving(height_m: f64, velocity_m_s: DVec3) -> DroneState {
        DroneState { velocity_m_s, ..DroneState::at_rest(DVec3::new(0.0, 0.0, height_m), 0.0) }
    }

    /// 0.5 m/s at 1 m are 2.44 counts in 10 ms.
    #[test]
    fn counts_add_up_to_the_motion() {
        let state = moving(1.0, DVec3::new(0.5, -0.25, 0.0));
        let sum = |remainder| {
            let readings = run(&mut noiseless(remainder), state, 100);
            assert_eq!(readings.len(), 100);
            readings.iter().fold((0, 0), |sum, r| (sum.0 + r.x, sum.1 + r.y))
        };
        assert_eq!(sum(QuantizationRemainder::Carried), (244, -122));
        assert_eq!(sum(QuantizationRemainder::Discarded), (200, -100));
    }

    /// Independent of the formula: the ground point under the optical axis moves in the image by the
    /// change of its bearing.
    #[test]
    fn flow_is_the_change_of_the_bearing_of_the_ground() {
        let attitude = DQuat::from_rotation_z(0.8)
            * DQuat::from_rotation_y(0.2)
            * DQuat::from_rotation_x(-0.3);
        let state = DroneState {
            attitude,
            rate_rad_s: DVec3::new(0.4, -0.7, 0.9),
            ..moving(0.8, DVec3::new(0.6, 0.3, -0.2))
        };
        let axis = attitude * DVec3::NEG_Z;
        let target = state.position_m + axis * (0.8 / -axis.z);
        // The robot a moment later.
        let seconds = 1e-6;
        let turn = DQuat::from_scaled_axis(state.rate_rad_s * seconds);
        let later = (attitude * turn).conjugate()
            * (target - state.position_m - state.velocity_m_s * seconds);
        let bearing = DVec2::new(later.x, later.y) / later.z / seconds * COUNTS_PER_RAD;
        let readings = run(&mut noiseless(QuantizationRemainder::Carried), state, 200);
        let x: i32 = readings.iter().map(|r| i32::from(r.x)).sum();
        let y: i32 = readings.iter().map(|r| i32::from(r.y)).sum();
        assert!((f64::from(x) - 2.0 * bearing.x).abs() < 1.0, "{x} {bearing}");
        assert!((f64::from(y) - 2.0 * bearing.y).abs() < 1.0, "{y} {bearing}");
    }

    /// 2.44 counts in 10 ms, of which a fifth is seen.
    #[test]
    fn a_floor_without_features_shows_a_part_of_the_motion() {
        let mut sensor = noiseless(QuantizationRemainder::Carried);
        sensor.set_surface(FloorSurface::FEATURELESS);
        let readings = run(&mut sensor, moving(1.0, DVec3::new(0.5, 0.0, 0.0)), 100);
        let sum: i16 = readings.iter().map(|reading| reading.x).sum();
        assert!((48..=49).contains(&sum), "{sum}");
        assert!(readings.iter().all(|r| (r.quality, r.shutter) == (20, 0x1fff)));
    }

    #[test]
    fn noise_has_its_deviation() {
        let mut sensor = FlowSensor::new(FlowSettings::PMW3901, 9);
        let readings = run(&mut sensor, moving(1.0, DVec3::ZERO), 10_000);
        let square: f64 = readings.iter().map(|r| f64::from(r.x).powi(2)).sum::<f64>() / 1e4;
        // Rounding adds 1/12, and carrying the remainder 1/12 again.
        assert!((square - 4.0 - 2.0 / 12.0).abs() < 0.25, "{square}");
    }

    #[test]
    fn readings_out_of_range_are_invalid() {
        let mut sensor = noiseless(QuantizationRemainder::Carried);
        let mut tilted = moving(1.0, DVec3::ZERO);
        tilted.attitude = DQuat::from_rotation_x(1.2);
        for bad in [
            moving(0.05, DVec3::ZERO),
            moving(5.0, DVec3::ZERO),
            moving(0.1, DVec3::new(1.0, 0.0, 0.0)),
            tilted,
        ] {
            assert!(run(&mut sensor, bad, 3).iter().all(|r| !r.is_valid && r.x == 0));
            assert!(run(&mut sensor, moving(1.0, DVec3::X), 1)[0].is_valid);
        }
    }
}
