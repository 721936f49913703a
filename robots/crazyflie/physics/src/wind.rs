//! Wind: a mean velocity and gusts with the spectrum of Dryden.
//!
//! The specification MIL-F-8785C (read in the Modelica Standard Library's block and in MathWorks' pages
//! of it) gives gusts of deviation σ and length L the spectra σ²·(2L/π)/(1 + (LΩ)²) along the wind, and
//! σ²·(L/π)·(1 + 3(LΩ)²)/(1 + (LΩ)²)² across it and upwards, over the spatial frequency Ω. The air moves
//! past the robot with the wind, so τ = L/V turns lengths into times. The specification's lengths begin
//! at a height of 10 feet; robots fly lower, so τ is a setting, one for all axes. The whole robot is in
//! one gust.

use core::f64::consts::FRAC_1_SQRT_2;

use glam::{DVec2, DVec3};

use crate::STEP_S;
use crate::random::{NoiseConsumer, NoiseStream};

/// The square root of 3, the share of the first stage in a gust across the wind.
const SQRT_3: f64 = 1.732_050_807_568_877_2;

/// The properties of a wind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindSettings {
    /// Mean velocity of the air in the world frame, in m/s.
    pub mean_m_s: DVec3,
    /// Standard deviation of each coordinate of the gusts, in m/s.
    pub gust_sigma_m_s: f64,
    /// Time of correlation τ of the gusts in seconds, above 0.
    pub gust_s: f64,
}

/// The wind at one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    settings: WindSettings,
    /// The share of a lag's state that a step keeps.
    kept: f64,
    noise: NoiseStream,
    /// Direction of the mean wind over the ground; x without one.
    along: DVec2,
    /// Noise after one lag of τ, with deviation 1: along the wind, across it and upwards.
    first: DVec3,
    /// The same after a second lag of τ.
    second: DVec3,
}

impl Wind {
    /// Returns a wind whose gust is drawn too, so that it is stationary from the start.
    ///
    /// # Parameters
    /// `seed`: its gusts.
    #[must_use]
    pub fn new(settings: WindSettings, seed: u64) -> Self {
        let mut noise = NoiseStream::new(seed, NoiseConsumer::Wind);
        let along = settings.mean_m_s.truncate().try_normalize().unwrap_or(DVec2::X);
        let first = noise.normal_vector();
        // Of stationary lags, the second has half of the variance, and a covariance of a half.
        let second = (first + noise.normal_vector()) / 2.0;
        let kept = libm::exp(-STEP_S / settings.gust_s);
        Wind { settings, kept, noise, along, first, second }
    }

    /// Advances by a millisecond and returns the velocity of the air in m/s.
    pub fn step(&mut self) -> DVec3 {
        let (settings, kept) = (&self.settings, self.kept);
        self.second = self.second * kept + self.first * (1.0 - kept);
        let fresh = (1.0 - kept * kept).sqrt();
        self.first = self.first * kept + self.noise.normal_vector() * fresh;
        // (1 + √3·τs)/(1 + τs)² = √3/(1 + τs) + (1 − √3)/(1 + τs)², whose variance is 2.
        let across = (self.first * SQRT_3 + self.second * (1.0 - SQRT_3)) * FRAC_1_SQRT_2;
        let flat = self.along.rotate(DVec2::new(self.first.x, across.y));
        settings.mean_m_s + flat.extend(across.z) * settings.gust_sigma_m_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The correlation functions of the two spectra are exp(−t/τ) and (1 − t/2τ)·exp(−t/τ). 4,000 s have
    /// 4,000 times of correlation: the deviation is known to 2 %.
    #[test]
    fn gusts_have_drydens_correlations() {
        let mean_m_s = DVec3::new(0.0, 2.0, 0.0);
        let settings = WindSettings { mean_m_s, gust_sigma_m_s: 1.5, gust_s: 1.0 };
        let mut wind = Wind::new(settings, 1);
        let gusts: Vec<DVec3> = (0..4_000_000).map(|_| (wind.step() - mean_m_s) / 1.5).collect();
        let mean_of = |lag_s: f64| {
            let lag = (lag_s / STEP_S) as usize;
            let products = gusts.iter().zip(&gusts[lag..]).map(|(one, other)| *one * *other);
            products.sum::<DVec3>() / (gusts.len() - lag) as f64
        };
        for lag_s in [0.0, 0.5, 1.0, 3.0] {
            let along = libm::exp(-lag_s);
            let across = along * (1.0 - lag_s / 2.0);
            // The wind blows along y.
            let error = mean_of(lag_s) - DVec3::new(across, along, across);
            assert!(error.abs().max_element() < 0.07, "{lag_s}: {error}");
        }
    }
}
