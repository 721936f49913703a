//! Deterministic pseudo-random numbers.

/// The generator SplitMix64.
#[derive(Clone, Copy, Debug, Default)]
pub struct Random(u64);

impl Random {
    /// Creates a generator. Equal seeds give equal sequences.
    pub const fn new(seed: u64) -> Self {
        Random(seed)
    }

    /// Creates the generator of item `number` of several items that share a seed. Each item has its
    /// own sequence.
    pub fn of(seed: u64, number: u64) -> Self {
        let mut root = Random(seed ^ number.wrapping_mul(0xd134_2543_de82_ef95));
        Random(root.bits())
    }

    /// Returns the next 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Returns a number from 0 (inclusive) to 1 (exclusive).
    pub fn unit(&mut self) -> f64 {
        // An `f64` holds 53 significant bits.
        (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Returns true with the given probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.unit() < probability
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
}
