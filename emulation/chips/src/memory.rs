//! The content of memory after an event for which no data sheet promises it.

use crate::Random;

/// The content of memory after a reset, a power-on or a brown-out. On a robot with several parts
/// that a brown-out concerns, this value also says how deep the supply fell: with `Kept` it stayed
/// high enough that none of them noticed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MemoryContent {
    /// The content is unchanged.
    #[default]
    Kept,
    /// All zeros.
    Zeroed,
    /// Pseudo-random bytes.
    Noise {
        /// Start of the pseudo-random sequence.
        seed: u64,
    },
}

impl MemoryContent {
    /// Returns the sequence that [`content`](Self::content) takes noise from.
    pub fn noise(self) -> Random {
        match self {
            MemoryContent::Noise { seed } => Random::new(seed),
            MemoryContent::Kept | MemoryContent::Zeroed => Random::default(),
        }
    }

    /// Returns the new content of `bytes` bytes, or none if they are unchanged.
    pub fn content(self, bytes: u32, noise: &mut Random) -> Option<Vec<u8>> {
        match self {
            MemoryContent::Kept => None,
            MemoryContent::Zeroed => Some(vec![0; bytes as usize]),
            MemoryContent::Noise { .. } => Some((0..bytes).map(|_| noise.bits() as u8).collect()),
        }
    }
}
