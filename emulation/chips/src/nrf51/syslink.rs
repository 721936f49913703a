//! Frames of the serial link: `BC CF type length payload A B`, A and B a Fletcher-8 sum over all from the
//! type on.

/// Longest payload of a frame.
pub const MAX_PAYLOAD: usize = 64;

/// A frame of the link, without its sum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frame {
    kind: u8,
    payload: Vec<u8>,
}

impl Frame {
    /// A frame of type `kind`; none if `payload` is longer than [`MAX_PAYLOAD`].
    pub fn new(kind: u8, payload: impl Into<Vec<u8>>) -> Option<Frame> {
        let payload = payload.into();
        (payload.len() <= MAX_PAYLOAD).then_some(Frame { kind, payload })
    }

    /// Its type.
    pub fn kind(&self) -> u8 {
        self.kind
    }

    /// Its content.
    pub fn payload(&self) -> &[u8] {
        &self.payload
    }

    /// As it stands on the wire.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![0xbc, 0xcf, self.kind, self.payload.len() as u8];
        bytes.extend_from_slice(&self.payload);
        let (a, b) = fletcher(&bytes[2..]);
        bytes.extend([a, b]);
        bytes
    }
}

fn fletcher(bytes: &[u8]) -> (u8, u8) {
    bytes.iter().fold((0, 0), |(a, b): (u8, u8), byte| {
        let a = a.wrapping_add(*byte);
        (a, b.wrapping_add(a))
    })
}
