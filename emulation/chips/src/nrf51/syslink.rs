//! Frames of the serial link: `BC CF type length payload A B`, where A and B are a Fletcher-8
//! checksum over all bytes from the type on.

/// Longest payload of a frame.
pub const FRAME_PAYLOAD_MAX: usize = 64;

const START: [u8; 2] = [0xbc, 0xcf];
/// The bytes of a frame without payload.
const FRAME_BYTES_MIN: usize = 6;

/// A frame of the link, without its checksum.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LinkFrame {
    pub(super) kind: u8,
    pub(super) payload: Vec<u8>,
}

impl LinkFrame {
    /// Creates a frame of type `kind`. Returns `None` if `payload` is longer than
    /// [`FRAME_PAYLOAD_MAX`].
    pub fn new(kind: u8, payload: impl Into<Vec<u8>>) -> Option<LinkFrame> {
        let payload = payload.into();
        (payload.len() <= FRAME_PAYLOAD_MAX).then_some(LinkFrame { kind, payload })
    }

    /// Returns the type byte.
    pub fn kind(&self) -> u8 {
        self.kind
    }

    /// Returns the bytes after type and length.
    pub fn payload(&self) -> &[u8] {
        &self.payload
    }

    /// Returns the bytes on the wire.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = vec![START[0], START[1], self.kind, self.payload.len() as u8];
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

/// The receiver's result for a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Arrived {
    pub frame: LinkFrame,
    pub first_sum_good: bool,
    pub second_sum_good: bool,
}

/// Finds frames in a stream of bytes, as the nRF51's firmware does. After a byte that does not fit,
/// the parser waits for the next start of a frame.
#[derive(Default)]
pub(crate) struct Nrf51Parser {
    /// The bytes of the frame so far, including the two start bytes.
    bytes: Vec<u8>,
}

impl Nrf51Parser {
    pub fn push(&mut self, byte: u8) -> Option<Arrived> {
        self.bytes.push(byte);
        let bytes = self.bytes.as_slice();
        let length = usize::from(bytes.get(3).copied().unwrap_or(0));
        let misfit = match bytes.len() {
            position @ (1 | 2) => byte != START[position - 1],
            4 => length > FRAME_PAYLOAD_MAX,
            _ => false,
        };
        if misfit {
            self.bytes.clear();
            return None;
        }
        if bytes.len() < 4 || bytes.len() < length + FRAME_BYTES_MIN {
            return None;
        }
        let (content, sums) = bytes[2..].split_at(length + 2);
        let (a, b) = fletcher(content);
        let arrived = Arrived {
            frame: LinkFrame { kind: content[0], payload: content[2..].to_vec() },
            first_sum_good: sums[0] == a,
            second_sum_good: sums[1] == b,
        };
        self.bytes.clear();
        Some(arrived)
    }

    /// Returns the number of further bytes after which a frame of type `kind` with a payload may be
    /// complete, at the earliest.
    pub fn bytes_to(&self, kind: u8) -> usize {
        const SHORTEST: usize = FRAME_BYTES_MIN + 1;
        let bytes = self.bytes.as_slice();
        let whole =
            bytes.get(3).map_or(FRAME_BYTES_MIN, |length| FRAME_BYTES_MIN + usize::from(*length));
        match bytes.get(2) {
            Some(other) if *other != kind => whole - bytes.len() + SHORTEST,
            _ => whole.max(SHORTEST) - bytes.len(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Frames as Bitcraze's firmwares put them on the wire.
    const VECTORS: [(&[u8], u8, &[u8]); 5] = [
        (&[0xbc, 0xcf, 0x14, 0x00, 0x14, 0x28], 0x14, &[]),
        (&[0xbc, 0xcf, 0x0b, 0x00, 0x0b, 0x16], 0x0b, &[]),
        (&[0xbc, 0xcf, 0x01, 0x01, 0x50, 0x52, 0x55], 0x01, &[0x50]),
        (
            &[0xbc, 0xcf, 0x05, 0x05, 0xe7, 0xe7, 0xe7, 0xe7, 0xe7, 0x8d, 0xca],
            0x05,
            &[0xe7, 0xe7, 0xe7, 0xe7, 0xe7],
        ),
        (&[0xbc, 0xcf, 0x0a, 0x04, 0, 1, 2, 3, 0x14, 0x5a], 0x0a, &[0, 1, 2, 3]),
    ];

    #[test]
    fn vectors_both_ways() {
        let mut parser = Nrf51Parser::default();
        for (bytes, kind, payload) in VECTORS {
            let frame = LinkFrame::new(kind, payload).unwrap();
            assert_eq!(frame.to_bytes(), bytes);
            let arrived: Vec<Arrived> = bytes.iter().filter_map(|b| parser.push(*b)).collect();
            assert_eq!(arrived, [Arrived { frame, first_sum_good: true, second_sum_good: true }]);
        }
    }

    #[test]
    fn finds_a_frame_after_garbage_and_sees_a_bad_sum() {
        let mut parser = Nrf51Parser::default();
        for byte in [0x00, 0xbc, 0xff, 0xbc, 0xcf, 0x01, 65] {
            assert_eq!(parser.push(byte), None);
        }
        let mut bytes = VECTORS[2].0.to_vec();
        bytes[4] ^= 1;
        let arrived: Vec<Arrived> = bytes.iter().filter_map(|b| parser.push(*b)).collect();
        assert!(!arrived[0].first_sum_good && !arrived[0].second_sum_good);
    }

    #[test]
    fn no_frame_is_complete_before_the_stated_bytes() {
        const P2P: u8 = 0x0a;
        let shortest = LinkFrame::new(P2P, [11]).unwrap().to_bytes();
        assert_eq!(Nrf51Parser::default().bytes_to(P2P), shortest.len());
        for (bytes, _, _) in VECTORS {
            let mut parser = Nrf51Parser::default();
            let stream = [bytes, &shortest].concat();
            for (number, byte) in stream.iter().enumerate() {
                let stated = parser.bytes_to(P2P);
                let mut rest = stream[number..].iter();
                let mut ahead = Nrf51Parser { bytes: parser.bytes.clone() };
                let is_p2p = |arrived: Arrived| arrived.frame.kind() == P2P;
                let left = 1 + rest.position(|byte| ahead.push(*byte).is_some_and(is_p2p)).unwrap();
                assert!(stated <= left, "{stated} bytes stated, {left} left of {stream:02x?}");
                if parser.bytes.len() >= 4 {
                    assert_eq!(stated, left);
                }
                parser.push(*byte);
            }
        }
    }

    #[test]
    fn payloads_have_a_limit() {
        assert!(LinkFrame::new(0, vec![0; FRAME_PAYLOAD_MAX]).is_some());
        assert_eq!(LinkFrame::new(0, vec![0; FRAME_PAYLOAD_MAX + 1]), None);
    }
}
