//! The hash of what happened.

/// Changes with every word and with their order.
#[derive(Clone, Copy, Debug, Default)]
pub struct Trace {
    hash: u32,
}

impl Trace {
    /// A step that can be undone for each word: two traces that differ in one word stay different.
    #[inline(never)]
    pub fn add(&mut self, word: u32) {
        self.hash = (self.hash.rotate_left(5) ^ word).wrapping_mul(0x9e37_79b1);
    }

    /// What was added so far.
    pub fn hash(self) -> u32 {
        self.hash
    }
}
