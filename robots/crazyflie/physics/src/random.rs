//! Random numbers that are identical on every machine.

use glam::DVec3;
use rand::{Rng, RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::SplitMix64;

/// The consumer of a stream. Streams of different consumers are independent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NoiseConsumer {
    /// Differences between motors of one kind.
    Motors = 1,
    /// The inertial sensors.
    Imu = 2,
    /// The flow sensor.
    Flow = 3,
    /// The height sensor.
    Height = 4,
    /// Motion capture.
    MotionCapture = 5,
}

/// A stream of random numbers of one consumer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NoiseStream(SplitMix64);

impl NoiseStream {
    /// Returns the stream of this consumer.
    pub(crate) fn new(seed: u64, consumer: NoiseConsumer) -> Self {
        // An odd multiplier keeps different inputs different; the generator itself mixes them.
        let place = (consumer as u64).wrapping_mul(0xd6e8_feb8_6659_fd93);
        let mut outer = SplitMix64::seed_from_u64(seed ^ place);
        NoiseStream(SplitMix64::seed_from_u64(outer.next_u64()))
    }

    /// Returns a normally distributed number with mean 0 and deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// Returns a vector of three independent normal numbers.
    pub(crate) fn normal_vector(&mut self) -> DVec3 {
        let x = self.normal();
        let y = self.normal();
        DVec3::new(x, y, self.normal())
    }

    /// Returns a number that is uniform between -`limit` and `limit`.
    pub(crate) fn uniform(&mut self, limit: f64) -> f64 {
        let unit: f64 = self.0.random();
        limit * (2.0 * unit - 1.0)
    }

    /// Returns a vector whose components are uniform between -`limit` and `limit`.
    pub(crate) fn uniform_vector(&mut self, limit: f64) -> DVec3 {
        let x = self.uniform(limit);
        let y = self.uniform(limit);
        DVec3::new(x, y, self.uniform(limit))
    }

    /// Returns true with this probability.
    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        let unit: f64 = self.0.random();
        unit < probability
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consumers_have_uncorrelated_streams() {
        let mut one = NoiseStream::new(7, NoiseConsumer::Imu);
        let mut other = NoiseStream::new(7, NoiseConsumer::Flow);
        let count = 20_000;
        let sum: f64 = (0..count).map(|_| one.normal() * other.normal()).sum();
        // Three deviations of a mean of 20,000 products are 0.021.
        assert!((sum / f64::from(count)).abs() < 0.021);
    }

    #[test]
    fn moments_match_the_distributions() {
        let mut stream = NoiseStream::new(1, NoiseConsumer::Motors);
        let count = 40_000;
        let normal: f64 = (0..count).map(|_| stream.normal().powi(2)).sum();
        assert!((normal / f64::from(count) - 1.0).abs() < 0.03);
        // A uniform number in ±2 has the variance 4/3.
        let uniform: f64 = (0..count).map(|_| stream.uniform(2.0).powi(2)).sum();
        assert!((uniform / f64::from(count) - 4.0 / 3.0).abs() < 0.03);
        let hits = (0..count).filter(|_| stream.chance(0.25)).count();
        assert!((hits as f64 / f64::from(count) - 0.25).abs() < 0.01);
    }
}
