//! Random numbers: one stream for each consumer.

use bittybuzz_random::Random;
use glam::DVec3;

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
    /// Gusts of wind.
    Wind = 6,
    /// The pressure sensor.
    Barometer = 7,
}

/// A stream of random numbers of one consumer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct NoiseStream(Random);

impl NoiseStream {
    /// Returns the stream of this consumer.
    pub(crate) fn new(seed: u64, consumer: NoiseConsumer) -> Self {
        NoiseStream(Random::for_purpose(seed, consumer as u64))
    }

    /// Returns a normally distributed number with mean 0 and deviation 1.
    pub(crate) fn normal(&mut self) -> f64 {
        self.0.normal()
    }

    /// Returns a vector of three independent normal numbers.
    pub(crate) fn normal_vector(&mut self) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.0.normal()))
    }

    /// Returns a number that is uniform between -`limit` and `limit`.
    pub(crate) fn uniform(&mut self, limit: f64) -> f64 {
        self.0.uniform(limit)
    }

    /// Returns a vector whose components are uniform between -`limit` and `limit`.
    pub(crate) fn uniform_vector(&mut self, limit: f64) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| self.0.uniform(limit)))
    }

    /// Returns true with this probability.
    pub(crate) fn chance(&mut self, probability: f64) -> bool {
        self.0.chance(probability)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digests_show_the_generator_of_a_stream() {
        let stream = NoiseStream(Random::new(7));
        assert_eq!(format!("{stream:?}"), "NoiseStream(SplitMix64 { x: 7 })");
    }
}
