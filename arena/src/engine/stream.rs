//! Random numbers: a stream for each purpose, robot and tick, so that nobody's chance depends on who came before.

use rand::{Rng, RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::SplitMix64;

/// What a stream is for. Streams of unlike purposes share nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    /// Differences between robots of one kind.
    Build = 1,
    /// What happens to frames on the way.
    Hear = 2,
    /// When a frame is first tried.
    Send = 3,
    /// When it is tried again.
    BackOff = 6,
    /// Errors of the position estimate.
    Estimate = 4,
    /// For brains.
    Brain = 5,
}

/// A stream of random numbers, the same on every machine.
#[derive(Clone, Debug)]
pub struct Stream(SplitMix64);

impl Stream {
    /// The stream of one robot for one purpose in one tick.
    pub(crate) fn new(seed: u64, purpose: Purpose, robot: u16, tick: u64) -> Self {
        // Odd multipliers keep unlike inputs unlike; the generator itself mixes.
        let place = ((purpose as u64) << 56) ^ (u64::from(robot) << 40) ^ tick;
        let mut outer = SplitMix64::seed_from_u64(seed ^ place.wrapping_mul(0xd6e8_feb8_6659_fd93));
        Stream(SplitMix64::seed_from_u64(outer.next_u64()))
    }

    /// A stream of a robot's own, for its brain.
    #[must_use]
    pub fn for_brain(seed: u64, robot: u16) -> Self {
        Stream::new(seed, Purpose::Brain, robot, 0)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f32 {
        self.0.random()
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f32) -> bool {
        probability > 0.0 && self.unit() < probability
    }

    /// In 0..end.
    pub fn below(&mut self, end: u32) -> u32 {
        ((u64::from(self.0.next_u32()) * u64::from(end)) >> 32) as u32
    }

    /// Normally distributed around 0, with deviation 1.
    pub fn normal(&mut self) -> f32 {
        StandardNormal.sample(&mut self.0)
    }

    /// A factor around 1 that never leaves three deviations, nor becomes negative.
    pub(crate) fn gain(&mut self, sigma: f32) -> f32 {
        (1.0 + sigma * self.normal().clamp(-3.0, 3.0)).max(0.0)
    }
}
