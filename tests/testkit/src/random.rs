//! Numbers by chance, the same for the same seed.

/// Marsaglia's xorshift with 64 bits.
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Returns the generator with that seed.
    pub fn new(seed: u64) -> Self {
        // A state of 0 would stay 0, and small seeds differ in few bits.
        Random((seed ^ 0x9e37_79b9_7f4a_7c15).max(1))
    }

    /// Returns a number below `end`, which is not 0.
    pub fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0 % end
    }

    /// Returns true with that probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        const STEPS: u64 = 1 << 32;
        probability > 0.0 && (self.below(STEPS) as f64) < probability * STEPS as f64
    }
}
