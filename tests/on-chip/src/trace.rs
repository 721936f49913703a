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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_and_their_order_count() {
        let hash = |words: &[u32]| {
            let mut trace = Trace::default();
            words.iter().for_each(|word| trace.add(*word));
            trace.hash()
        };
        let all = [&[1, 2][..], &[2, 1], &[1, 2, 3], &[1, 3], &[0x8000_0001, 2]].map(hash);
        for (number, hash) in all.iter().enumerate() {
            assert!(!all[..number].contains(hash));
        }
    }
}
