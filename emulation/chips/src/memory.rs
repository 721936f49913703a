//! The content of memory after an event for which no data sheet promises it.

use crate::Random;

/// The content of memory after a reset, a power-on or a brown-out. On a robot with several parts
/// that a brown-out concerns, this value also says how deep the supply fell: with `Kept` it stayed
/// high enough that none of them noticed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Memory {
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

impl Memory {
    /// Returns the sequence that [`content`](Self::content) takes noise from.
    pub fn noise(self) -> Random {
        match self {
            Memory::Noise { seed } => Random::new(seed),
            Memory::Kept | Memory::Zeroed => Random::default(),
        }
    }

    /// Returns the new content of `bytes` bytes, or none if they are unchanged.
    pub fn content(self, bytes: u32, noise: &mut Random) -> Option<Vec<u8>> {
        match self {
            Memory::Kept => None,
            Memory::Zeroed => Some(vec![0; bytes as usize]),
            Memory::Noise { .. } => Some((0..bytes).map(|_| noise.bits() as u8).collect()),
        }
    }
}
