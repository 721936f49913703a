//! The storage of an image.

use crate::network::Sizes;
use crate::number::Profile;
use crate::part::{Part, Parts};
use crate::slots::Slots;

/// Read-only bytes: an image in memory or in flash.
///
/// ARM and the host use a slice. On the AVR the firmware implements the trait by `lpm`, so that no
/// copy is in RAM. A value of this type usually takes no memory or two words, and is passed by
/// value.
pub trait ByteCode: Copy {
    /// The memory of the machine that runs this image: `P::Slots<SLOTS>`, an array in the machine,
    /// or a storage of the host.
    type Slots<P: Profile, const SLOTS: usize>: Slots<P>;

    /// The parts of the machine that runs this image. Firmware with little flash leaves out those
    /// that its scripts do not use.
    const PARTS: Parts = Parts::ALL;

    /// The memory of that machine for other robots, if it is a constant. Then
    /// [`Vm::set_network_capacity`](crate::Vm::set_network_capacity) is not used, and the code is
    /// smaller.
    const SIZES: Option<Sizes> = None;

    /// The only image, if it always lies at the same place. Then the machine stores no reference to
    /// the bytes, and does not check if it has one.
    const ONLY: Option<Self> = None;

    /// Returns the number of bytes.
    fn len(&self) -> usize;

    /// Returns the byte at `at`. If `at` is not below the length, the result is arbitrary, but
    /// always the same.
    fn byte(&self, at: usize) -> u8;

    /// Returns two bytes, little-endian.
    #[hot]
    fn word(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.byte(at), self.byte(at.wrapping_add(1))])
    }

    /// Returns four bytes, little-endian.
    #[hot]
    fn quad(&self, at: usize) -> u32 {
        u32::from(self.word(at)) | u32::from(self.word(at.wrapping_add(2))) << 16
    }

    /// Returns byte `at` of the machine's own tables, [`Profile::ROM`].
    #[hot]
    fn rom<P: Profile>(at: usize) -> u8 {
        let tables = if Self::PARTS.has(Part::Maths) { P::ROM } else { P::ROM_WITHOUT_MATHS };
        match tables.get(at) {
            Some(byte) => *byte,
            None => 0,
        }
    }

    /// Returns true if there are no bytes.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl ByteCode for &[u8] {
    type Slots<P: Profile, const SLOTS: usize> = P::Slots<SLOTS>;

    #[hot]
    fn len(&self) -> usize {
        <[u8]>::len(self)
    }

    #[hot]
    fn byte(&self, at: usize) -> u8 {
        match self.get(at) {
            Some(byte) => *byte,
            None => 0,
        }
    }

    #[hot]
    fn word(&self, at: usize) -> u16 {
        // One check for both bytes, except at the very end.
        match self.get(at..).and_then(<[u8]>::first_chunk) {
            Some(bytes) => u16::from_le_bytes(*bytes),
            None => u16::from(self.byte(at)),
        }
    }

    #[hot]
    fn quad(&self, at: usize) -> u32 {
        match self.get(at..).and_then(<[u8]>::first_chunk) {
            Some(bytes) => u32::from_le_bytes(*bytes),
            None => u32::from(self.word(at)) | u32::from(self.word(at.wrapping_add(2))) << 16,
        }
    }
}

/// Returns the greatest length of an image in a [`FlashArea`] of that size; 0 if there is none.
pub const fn longest_image(area: usize) -> usize {
    match area.saturating_sub(2).checked_ilog2() {
        Some(log) => 1 << log,
        None => 0,
    }
}

/// An image at the start of an area of fixed size, such as a region of flash. Reading needs no
/// check, because positions beyond the area wrap around. The image may fill the largest power of
/// two that leaves two bytes of the area.
#[derive(Clone, Copy, Debug)]
pub struct FlashArea<'a, const BYTES: usize> {
    bytes: &'a [u8; BYTES],
    length: usize,
}

impl<'a, const BYTES: usize> FlashArea<'a, BYTES> {
    /// The greatest length of the image, in bytes.
    pub const LENGTH_MAX: usize = {
        assert!(BYTES > 2);
        longest_image(BYTES)
    };

    /// Returns the image of that length; `None` if it is longer than [`FlashArea::LENGTH_MAX`].
    pub fn new(bytes: &'a [u8; BYTES], length: usize) -> Option<Self> {
        if length > Self::LENGTH_MAX { None } else { Some(FlashArea { bytes, length }) }
    }

    /// Returns an area without an image.
    pub const fn empty(bytes: &'a [u8; BYTES]) -> Self {
        FlashArea { bytes, length: 0 }
    }

    /// Returns the bytes of the image.
    pub fn image(&self) -> &'a [u8] {
        self.bytes.get(..self.length).unwrap_or(self.bytes)
    }
}

impl<const BYTES: usize> ByteCode for FlashArea<'_, BYTES> {
    type Slots<P: Profile, const SLOTS: usize> = P::Slots<SLOTS>;

    #[hot]
    fn len(&self) -> usize {
        self.length
    }

    #[hot]
    fn byte(&self, at: usize) -> u8 {
        self.bytes[at & (Self::LENGTH_MAX - 1)]
    }

    #[hot]
    fn word(&self, at: usize) -> u16 {
        let at = at & (Self::LENGTH_MAX - 1);
        u16::from_le_bytes([self.bytes[at], self.bytes[at + 1]])
    }

    #[hot]
    fn quad(&self, at: usize) -> u32 {
        let place = at & (Self::LENGTH_MAX - 1);
        match self.bytes.get(place..).and_then(<[u8]>::first_chunk) {
            Some(bytes) => u32::from_le_bytes(*bytes),
            None => u32::from(self.word(at)) | u32::from(self.word(at.wrapping_add(2))) << 16,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_area_reads_like_a_slice() {
        let bytes: [u8; 10] = core::array::from_fn(|at| at as u8 * 17);
        let area = FlashArea::new(&bytes, 8).unwrap();
        let slice = &bytes[..8];
        assert_eq!(ByteCode::len(&area), 8);
        for at in 0..8 {
            assert_eq!(area.byte(at), ByteCode::byte(&slice, at));
        }
        for at in 0..7 {
            assert_eq!(area.word(at), ByteCode::word(&slice, at));
        }
        for at in 0..5 {
            assert_eq!(area.quad(at), ByteCode::quad(&slice, at));
        }
        // Bytes beyond the area are arbitrary, but always the same.
        for at in [8, 100, usize::MAX] {
            assert_eq!(area.byte(at), area.byte(at));
            assert_eq!(area.word(at), area.word(at));
            assert_eq!(area.quad(at), area.quad(at));
        }
        assert!(FlashArea::new(&bytes, 9).is_none());
        assert!(FlashArea::empty(&bytes).is_empty());
    }
}
