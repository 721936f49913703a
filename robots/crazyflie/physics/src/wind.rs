//! Wind: a mean velocity and gusts.
//!
//! Each coordinate of the gusts is an Ornstein-Uhlenbeck process, the simplest one with a deviation
//! and a time of correlation: v ← φ·v + σ·√(1−φ²)·n with φ = exp(−t/τ) and n normal. The Dryden model
//! of aircraft (MIL-F-8785C, recalled) has the same spectrum along the flight. The whole robot is in one gust.

use glam::DVec3;

use crate::STEP_S;
use crate::random::{NoiseConsumer, NoiseStream};

/// The properties of a wind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindSettings {
    /// Mean velocity of the air in the world frame, in m/s.
    pub mean_m_s: DVec3,
    /// Standard deviation of each coordinate of the gusts, in m/s.
    pub gust_sigma_m_s: f64,
    /// Time of correlation of the gusts in seconds, above 0.
    pub gust_s: f64,
}

/// The wind at one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Wind {
    settings: WindSettings,
    noise: NoiseStream,
    gust_m_s: DVec3,
}

impl Wind {
    /// Returns a wind whose gust is drawn too, so that it is stationary from the start.
    ///
    /// # Parameters
    /// `seed`: its gusts.
    #[must_use]
    pub fn new(settings: WindSettings, seed: u64) -> Self {
        let mut noise = NoiseStream::new(seed, NoiseConsumer::Wind);
        let gust_m_s = noise.normal_vector() * settings.gust_sigma_m_s;
        Wind { settings, noise, gust_m_s }
    }

    /// Advances by half a millisecond and returns the velocity of the air in m/s.
    pub fn step(&mut self) -> DVec3 {
        let settings = &self.settings;
        let kept = libm::exp(-STEP_S / settings.gust_s);
        let fresh = settings.gust_sigma_m_s * (1.0 - kept * kept).sqrt();
        self.gust_m_s = self.gust_m_s * kept + self.noise.normal_vector() * fresh;
        settings.mean_m_s + self.gust_m_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 4,000 s have 4,000 times of correlation: the deviation is known to 2 %.
    #[test]
    fn gusts_have_their_deviation_and_their_correlation() {
        let mean_m_s = DVec3::new(2.0, 0.0, 0.0);
        let settings = WindSettings { mean_m_s, gust_sigma_m_s: 1.0, gust_s: 1.0 };
        let mut wind = Wind::new(settings, 1);
        let gusts: Vec<f64> = (0..8_000_000).map(|_| wind.step().x - 2.0).collect();
        let mean_of = |lag: usize| {
            let pairs = gusts.iter().zip(&gusts[lag..]);
            pairs.map(|(one, other)| one * other).sum::<f64>() / (gusts.len() - lag) as f64
        };
        assert!((mean_of(0) - 1.0).abs() < 0.1, "{}", mean_of(0));
        // A second later the correlation is 1/e.
        assert!((mean_of(2000) / mean_of(0) - 0.368).abs() < 0.05, "{}", mean_of(2000));
    }
}
