//! How images get into a linked program: in place of the bytes under [`SYMBOL`], one after the other, a [`Header`] before
//! each and an empty one after the last.

use bittybuzz_vm_core::ByteCode;

/// The symbol under which a program keeps the room for a batch.
pub const SYMBOL: &str = "BATCH";

/// What comes before an image; the numbers least significant byte first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Header {
    /// Bytes of the image; 0 after the last.
    pub length: u16,
    /// Instructions of a slice.
    pub budget: u16,
    /// Slices after which the image is given up.
    pub slices: u32,
}

impl Header {
    /// Bytes of a header.
    pub const LENGTH: usize = 8;

    /// As it is in a batch.
    pub fn to_bytes(self) -> [u8; Header::LENGTH] {
        let ([l0, l1], [b0, b1]) = (self.length.to_le_bytes(), self.budget.to_le_bytes());
        let [s0, s1, s2, s3] = self.slices.to_le_bytes();
        [l0, l1, b0, b1, s0, s1, s2, s3]
    }

    /// Reads a header from the first bytes.
    pub fn read(code: impl ByteCode) -> Header {
        let slices = u32::from(code.word(6)) << 16 | u32::from(code.word(4));
        Header { length: code.word(0), budget: code.word(2), slices }
    }
}

/// Where the images are.
pub trait Batch {
    /// How they are read.
    type Code: ByteCode;

    /// So many bytes from there.
    fn part(&self, at: usize, length: usize) -> Self::Code;

    /// The header and the image that begin there; `None` after the last.
    fn image(&self, at: usize) -> Option<(Header, Self::Code)> {
        let header = Header::read(self.part(at, Header::LENGTH));
        let image = || (header, self.part(at + Header::LENGTH, usize::from(header.length)));
        (header.length != 0).then(image)
    }
}

impl Batch for &'static [u8] {
    type Code = &'static [u8];

    fn part(&self, at: usize, length: usize) -> &'static [u8] {
        self.get(at..).and_then(|rest| rest.get(..length)).unwrap_or(&[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_found_up_to_the_empty_header() {
        let header = |length| Header { length, budget: 0x0102, slices: 0x0304_0506 };
        let mut room = [0xff; 64];
        room[..8].copy_from_slice(&header(3).to_bytes());
        room[8..11].copy_from_slice(b"one");
        room[11..19].copy_from_slice(&header(0).to_bytes());
        let batch: &'static [u8] = std::vec::Vec::from(room).leak();
        assert_eq!(batch.image(0), Some((header(3), &b"one"[..])));
        assert_eq!(batch.image(Header::LENGTH + 3), None);
        // A batch without an end reads as zeros beyond it.
        assert_eq!(batch.image(64), None);
    }
}
