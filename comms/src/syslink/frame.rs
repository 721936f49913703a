//! Frames (a type and up to 64 bytes of data) and their serialization.

/// The maximum length of a frame's data, in bytes.
pub const MTU: usize = 64;
/// The number of bytes around the data: start, type, length and check.
pub(super) const OVERHEAD: usize = 6;
/// The length of the longest frame, in bytes.
pub const FRAME_MAX: usize = MTU + OVERHEAD;
/// The first bytes of every frame.
pub(super) const START: [u8; 2] = [0xbc, 0xcf];

/// A frame with a correct checksum. The content is not checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SyslinkFrame<'a> {
    kind: u8,
    data: &'a [u8],
}

/// A reason why a frame cannot be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameError {
    /// The data has more than [`MTU`] bytes.
    TooLong,
}

impl<'a> SyslinkFrame<'a> {
    /// Returns a frame to be sent; fails with [`FrameError::TooLong`] beyond [`MTU`] bytes.
    pub fn new(kind: u8, data: &'a [u8]) -> Result<Self, FrameError> {
        if data.len() > MTU { Err(FrameError::TooLong) } else { Ok(SyslinkFrame { kind, data }) }
    }

    /// Returns the type byte.
    pub fn kind(&self) -> u8 {
        self.kind
    }

    /// Returns the data, at most [`MTU`] bytes.
    pub fn data(&self) -> &'a [u8] {
        self.data
    }

    /// Serializes the frame as it goes over the wire.
    pub fn bytes(&self) -> Bytes {
        let mut bytes = Bytes::default();
        START.iter().for_each(|byte| bytes.push(*byte));
        let length = self.data.len() as u8;
        let [a, b] = check(self.kind, length, self.data);
        bytes.push(self.kind);
        bytes.push(length);
        self.data.iter().for_each(|byte| bytes.push(*byte));
        bytes.push(a);
        bytes.push(b);
        bytes
    }
}

/// Returns a frame's two check bytes.
pub(super) fn check(kind: u8, length: u8, data: &[u8]) -> [u8; 2] {
    let covered = [kind, length].into_iter().chain(data.iter().copied());
    covered.fold([0, 0], |[a, b], byte| {
        let a: u8 = a.wrapping_add(byte);
        [a, a.wrapping_add(b)]
    })
}

/// The bytes of a serialized frame or of an incomplete one, up to [`FRAME_MAX`].
#[derive(Debug, Clone, Copy)]
pub struct Bytes {
    bytes: [u8; FRAME_MAX],
    length: usize,
}

impl Default for Bytes {
    fn default() -> Self {
        Bytes { bytes: [0; FRAME_MAX], length: 0 }
    }
}

impl Bytes {
    /// Returns the bytes.
    pub fn as_slice(&self) -> &[u8] {
        self.bytes.get(..self.length).unwrap_or(&[])
    }

    /// Adds a byte. A byte beyond [`FRAME_MAX`] would be ignored, but no frame is that long.
    pub(super) fn push(&mut self, byte: u8) {
        if let Some(slot) = self.bytes.get_mut(self.length) {
            *slot = byte;
            self.length += 1;
        }
    }

    /// Drops the first `count` bytes.
    pub(super) fn drop_front(&mut self, count: usize) {
        let count = count.min(self.length);
        // The loop copies element by element, since `copy_within` could panic.
        for at in count..self.length {
            let byte = self.bytes.get(at).copied().unwrap_or(0);
            if let Some(slot) = self.bytes.get_mut(at - count) {
                *slot = byte;
            }
        }
        self.length -= count;
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    fn written(kind: u8, data: &[u8]) -> Vec<u8> {
        SyslinkFrame::new(kind, data).unwrap().bytes().as_slice().to_vec()
    }

    /// Checksums worked out by hand from the definition.
    #[test]
    fn known_frames() {
        assert_eq!(written(0x14, &[]), [0xbc, 0xcf, 0x14, 0x00, 0x14, 0x28]);
        assert_eq!(written(0x0b, &[]), [0xbc, 0xcf, 0x0b, 0x00, 0x0b, 0x16]);
        assert_eq!(written(0x01, &[80]), [0xbc, 0xcf, 0x01, 0x01, 0x50, 0x52, 0x55]);
        assert_eq!(written(0x02, &[2]), [0xbc, 0xcf, 0x02, 0x01, 0x02, 0x05, 0x0a]);
        assert_eq!(
            written(0x05, &[0xe7; 5]),
            [0xbc, 0xcf, 0x05, 0x05, 0xe7, 0xe7, 0xe7, 0xe7, 0xe7, 0x8d, 0xca]
        );
        assert_eq!(
            written(0x0a, &[0, 1, 2, 3]),
            [0xbc, 0xcf, 0x0a, 0x04, 0x00, 0x01, 0x02, 0x03, 0x14, 0x5a]
        );
    }

    #[test]
    fn the_longest_frame_fits() {
        assert_eq!(written(0, &[7; MTU]).len(), FRAME_MAX);
        assert_eq!(SyslinkFrame::new(0, &[7; MTU + 1]), Err(FrameError::TooLong));
    }

    #[test]
    fn dropping_keeps_the_rest() {
        let mut bytes = Bytes::default();
        (0..10).for_each(|byte| bytes.push(byte));
        bytes.drop_front(3);
        assert_eq!(bytes.as_slice(), [3, 4, 5, 6, 7, 8, 9]);
        bytes.drop_front(100);
        assert!(bytes.as_slice().is_empty());
    }
}
