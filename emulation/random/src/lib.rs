//! The random numbers of simulated and emulated worlds.
//!
//! # Principles
//! 1. **Reproducible.** Equal seeds give equal numbers on every machine, natively and as
//!    WebAssembly, so recordings of a run can be compared by their bytes.
//! 2. **A stream for each purpose.** A consumer has its own stream, so its draws do not depend on
//!    the number of draws of others.
//!
//! # Not included
//! Secrets: everybody who knows the seed knows the numbers. The scripts' `rand` has a generator of
//! 32 bits in vm-core, because it runs on chips.

use std::fmt;

use rand::{Rng, RngExt, SeedableRng};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::SplitMix64;

/// The generator SplitMix64 (Steele, Lea and Flood 2014).
#[derive(Clone, PartialEq, Eq)]
pub struct Random(SplitMix64);

/// Writes the generator alone: digests of runs contain the text of a world's streams, so this type
/// may wrap the generator of a stream without a change of the digests.
impl fmt::Debug for Random {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl Default for Random {
    fn default() -> Self {
        Random::new(0)
    }
}

impl Random {
    /// Creates a generator. Equal seeds give equal sequences.
    pub fn new(seed: u64) -> Self {
        Random(SplitMix64::seed_from_u64(seed))
    }

    /// Creates the generator of item `number` of several items that share a seed. Each item has its
    /// own sequence.
    pub fn for_item(seed: u64, number: u64) -> Self {
        Random::new(seed ^ number.wrapping_mul(0xd134_2543_de82_ef95)).fork()
    }

    /// Creates the generator of a purpose among several that share a seed. Purposes have independent
    /// sequences, which also differ from those of [`Random::for_item`].
    pub fn for_purpose(seed: u64, purpose: u64) -> Self {
        // An odd multiplier keeps different inputs different; the generator itself mixes them.
        Random::new(seed ^ purpose.wrapping_mul(0xd6e8_feb8_6659_fd93)).fork()
    }

    /// Returns a new generator that is independent of later draws from this one.
    pub fn fork(&mut self) -> Self {
        Random::new(self.bits())
    }

    /// Returns the next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Returns a number from 0 (inclusive) to 1 (exclusive).
    pub fn unit(&mut self) -> f64 {
        self.0.random()
    }

    /// Returns a number from 0 (inclusive) to 1 (exclusive), drawn in single precision.
    pub fn unit_f32(&mut self) -> f32 {
        self.0.random()
    }

    /// Returns a number from 0 (inclusive) to `end` (exclusive).
    pub fn below(&mut self, end: u32) -> u32 {
        ((u64::from(self.0.next_u32()) * u64::from(end)) >> 32) as u32
    }

    /// Returns true with the given probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
    }

    /// Returns a number that is uniform between -`limit` and `limit`.
    pub fn uniform(&mut self, limit: f64) -> f64 {
        limit * (2.0 * self.unit() - 1.0)
    }

    /// Returns a normally distributed number with mean 0 and deviation 1.
    pub fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splitmix64_as_published() {
        // First outputs for seed 1234567 in the reference implementation's test.
        let mut random = Random::new(1_234_567);
        assert_eq!(random.bits(), 6_457_827_717_110_365_317);
        assert_eq!(random.bits(), 3_203_168_211_198_807_973);
    }

    #[test]
    fn purposes_have_uncorrelated_sequences() {
        let mut one = Random::for_purpose(7, 2);
        let mut other = Random::for_purpose(7, 3);
        let count = 20_000;
        let sum: f64 = (0..count).map(|_| one.normal() * other.normal()).sum();
        // Three deviations of a mean of 20,000 products are 0.021.
        assert!((sum / f64::from(count)).abs() < 0.021);
    }

    #[test]
    fn moments_match_the_distributions() {
        let mut random = Random::for_purpose(1, 1);
        let count = 40_000;
        let normal: f64 = (0..count).map(|_| random.normal().powi(2)).sum();
        assert!((normal / f64::from(count) - 1.0).abs() < 0.03);
        // A uniform number in ±2 has the variance 4/3.
        let uniform: f64 = (0..count).map(|_| random.uniform(2.0).powi(2)).sum();
        assert!((uniform / f64::from(count) - 4.0 / 3.0).abs() < 0.03);
        let hits = (0..count).filter(|_| random.chance(0.25)).count();
        assert!((hits as f64 / f64::from(count) - 0.25).abs() < 0.01);
    }
}
