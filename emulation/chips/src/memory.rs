//! Memory that an event leaves in a state that no data sheet promises.

use crate::Random;

/// The content of memory after such an event. It also says how deep the supply fell at a brown-out, where a robot has more than
/// one part that this concerns: with `Kept` not so deep that any of them noticed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Memory {
    /// Unchanged.
    #[default]
    Kept,
    /// All zeros.
    Zeroed,
    /// Anything.
    Noise {
        /// Start of the pseudo-random sequence.
        seed: u64,
    },
}

impl Memory {
    /// The sequence that [`content`](Self::content) takes noise from.
    pub fn noise(self) -> Random {
        match self {
            Memory::Noise { seed } => Random::new(seed),
            Memory::Kept | Memory::Zeroed => Random::default(),
        }
    }

    /// New content for this number of bytes; none if they are unchanged.
    pub fn content(self, bytes: u32, noise: &mut Random) -> Option<Vec<u8>> {
        match self {
            Memory::Kept => None,
            Memory::Zeroed => Some(vec![0; bytes as usize]),
            Memory::Noise { .. } => Some((0..bytes).map(|_| noise.bits() as u8).collect()),
        }
    }
}
