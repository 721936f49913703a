//! The pressure of the air (Bosch BMP388) in Pa.
//!
//! Pressure falls with height as in air of one temperature. Noise is white; the chip's own filter belongs to
//! its model. The air that the propellers move and gusts change the pressure on a real robot, which has no
//! model here.

use crate::DroneState;
use crate::random::{NoiseConsumer, NoiseStream};

/// Pressure at height 0 in Pa, that of the standard atmosphere.
const GROUND_PA: f64 = 101_325.0;
/// Height in m over which the pressure falls to 1/e, at 15 °C.
const SCALE_HEIGHT_M: f64 = 8434.5;
/// Standard deviation of a measurement in Pa before the chip's filter (choice: 8 cm of height).
const SIGMA_PA: f64 = 1.0;

/// A barometer at the center of mass.
#[derive(Clone, Debug, PartialEq)]
pub struct Barometer {
    noise: NoiseStream,
}

impl Barometer {
    /// Returns a barometer.
    ///
    /// # Parameters
    /// `seed`: its noise.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Barometer { noise: NoiseStream::new(seed, NoiseConsumer::Barometer) }
    }

    /// Returns a measurement of the pressure in Pa.
    pub fn measure(&mut self, state: &DroneState) -> f64 {
        let exact = GROUND_PA * libm::exp(-state.position_m.z / SCALE_HEIGHT_M);
        exact + self.noise.normal() * SIGMA_PA
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DVec3;

    /// 8.3 m of air weigh 100 Pa near the ground (12.01 Pa/m in the standard atmosphere).
    #[test]
    fn pressure_falls_by_12_pa_per_meter() {
        let mut barometer = Barometer::new(1);
        let mut mean = |height_m| {
            let state = DroneState::at_rest(DVec3::new(0.0, 0.0, height_m), 0.0);
            (0..10_000).map(|_| barometer.measure(&state)).sum::<f64>() / 10_000.0
        };
        let fall = (mean(0.0) - mean(10.0)) / 10.0;
        assert!((fall - 12.01).abs() < 0.02, "{fall}");
    }
}
