//! Where an image is kept.

use crate::rom;

/// Read-only bytes: an image in memory or in flash.
///
/// ARM and the host use a slice; on the AVR the firmware implements it by `lpm`, so that no copy is in RAM. It is
/// usually zero sized or two words, and is kept by value.
pub trait ByteCode: Copy {
    /// How many bytes.
    fn len(&self) -> usize;

    /// The byte at `at`; anything, but always the same, if `at` is not below the length.
    fn byte(&self, at: usize) -> u8;

    /// Two bytes, little-endian.
    #[inline(always)]
    fn word(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.byte(at), self.byte(at.wrapping_add(1))])
    }

    /// Byte `at` of the machine's own tables, [`crate::rom::BYTES`].
    #[inline(always)]
    fn rom(at: usize) -> u8 {
        match rom::BYTES.get(at) {
            Some(byte) => *byte,
            None => 0,
        }
    }

    /// Whether there are no bytes.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl ByteCode for &[u8] {
    #[inline(always)]
    fn len(&self) -> usize {
        <[u8]>::len(self)
    }

    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        match self.get(at) {
            Some(byte) => *byte,
            None => 0,
        }
    }
}
