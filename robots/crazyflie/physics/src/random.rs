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
}

impl NoiseConsumer {
    /// Returns the stream of this consumer.
    pub(crate) fn stream(self, seed: u64) -> Random {
        Random::for_purpose(seed, self as u64)
    }
}

/// Returns a vector of three independent normal numbers.
pub(crate) fn normal_vector(random: &mut Random) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| random.normal()))
}

/// Returns a vector whose components are uniform between -`limit` and `limit`.
pub(crate) fn uniform_vector(random: &mut Random, limit: f64) -> DVec3 {
    DVec3::from_array(std::array::from_fn(|_| random.uniform(limit)))
}
