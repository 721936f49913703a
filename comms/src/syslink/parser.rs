//! The parser, which turns a stream of bytes into frames.

use super::frame::{Bytes, MTU, OVERHEAD, START, SyslinkFrame, check};

/// Finds the frames in a stream.
///
/// The parser keeps the bytes of a possible frame. If they turn out not to be one (a wrong
/// checksum, a length above the limit), it looks for a start after the first of these bytes. It
/// therefore finds a frame that follows a truncated one, even if the truncated one seemed to
/// contain it.
#[derive(Debug, Clone, Default)]
pub struct SyslinkParser {
    pending: Bytes,
    rejected: u32,
}

/// The result of examining the pending bytes.
enum Pending {
    /// The beginning of a frame, or nothing.
    Incomplete,
    /// Not a frame: drop this number of bytes.
    Garbage(usize),
    /// A frame of this number of bytes.
    Complete(usize),
}

impl SyslinkParser {
    /// Returns a parser at the beginning of a stream.
    pub fn new() -> Self {
        SyslinkParser::default()
    }

    /// Adds one byte and passes each frame that it completes to `sink`. This is usually at most
    /// one; there are more only if a false start had hidden some.
    pub fn push(&mut self, byte: u8, mut sink: impl FnMut(SyslinkFrame<'_>)) {
        self.pending.push(byte);
        loop {
            match self.pending() {
                Pending::Incomplete => return,
                Pending::Garbage(count) => self.pending.drop_front(count),
                Pending::Complete(length) => {
                    if let [_, _, kind, _, rest @ ..] = self.pending.as_slice()
                        && let Some(data) = rest.get(..length - OVERHEAD)
                        && let Ok(frame) = SyslinkFrame::new(*kind, data)
                    {
                        sink(frame);
                    }
                    self.pending.drop_front(length);
                }
            }
        }
    }

    /// Returns the number of false starts: frames with a wrong checksum or length. The count wraps.
    pub fn rejected(&self) -> u32 {
        self.rejected
    }

    fn pending(&mut self) -> Pending {
        let bytes = self.pending.as_slice();
        let start = bytes.iter().position(|byte| *byte == START[0]);
        match (start, bytes) {
            (None, []) => return Pending::Incomplete,
            (None, _) => return Pending::Garbage(bytes.len()),
            (Some(0), _) => {}
            (Some(at), _) => return Pending::Garbage(at),
        }
        let [_, second, rest @ ..] = bytes else { return Pending::Incomplete };
        if *second != START[1] {
            // A first start byte alone is noise, and does not count as a rejected frame.
            return Pending::Garbage(1);
        }
        let [kind, length, rest @ ..] = rest else { return Pending::Incomplete };
        let (kind, length) = (*kind, *length);
        let data_length = usize::from(length);
        if data_length > MTU {
            self.rejected = self.rejected.wrapping_add(1);
            return Pending::Garbage(1);
        }
        let (Some(data), Some(found)) =
            (rest.get(..data_length), rest.get(data_length..data_length + 2))
        else {
            return Pending::Incomplete;
        };
        if found == check(kind, length, data) {
            Pending::Complete(data_length + OVERHEAD)
        } else {
            self.rejected = self.rejected.wrapping_add(1);
            Pending::Garbage(1)
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use std::vec::Vec;

    fn parse(stream: &[u8]) -> (Vec<(u8, Vec<u8>)>, u32) {
        let mut parser = SyslinkParser::new();
        let mut frames = Vec::new();
        for byte in stream {
            parser.push(*byte, |frame| frames.push((frame.kind(), frame.data().to_vec())));
        }
        (frames, parser.rejected())
    }

    fn frame(kind: u8, data: &[u8]) -> Vec<u8> {
        SyslinkFrame::new(kind, data).unwrap().bytes().as_slice().to_vec()
    }

    const GOOD: [u8; 7] = [0xbc, 0xcf, 0x01, 0x01, 0x50, 0x52, 0x55];

    #[test]
    fn frames_follow_each_other() {
        let stream = [frame(1, &[80]), frame(0x0b, &[]), frame(0, &[9; 64])].concat();
        let expected = [(1, std::vec![80]), (0x0b, std::vec![]), (0, std::vec![9; 64])].to_vec();
        assert_eq!(parse(&stream), (expected, 0));
    }

    #[test]
    fn noise_before_a_frame_is_passed_over() {
        for noise in [&[0u8, 1, 2][..], &[0xbc], &[0xbc, 0xbc], &[0xcf, 0xbc, 0x00]] {
            let (frames, rejected) = parse(&[noise, &GOOD].concat());
            assert_eq!((frames.len(), rejected), (1, 0), "{noise:?}");
        }
    }

    /// After a wrong checksum the parser drops one byte. To drop two would give the same frames,
    /// because the second byte is always 0xcf, and no frame begins with it.
    #[test]
    fn a_wrong_checksum_or_length_is_counted_and_the_next_frame_found() {
        for broken in [
            &[0xbc, 0xcf, 0x01, 0x01, 0x51, 0x52, 0x55][..],
            &[0xbc, 0xcf, 0x01, 0x01, 0x50, 0x53, 0x55],
            &[0xbc, 0xcf, 0x01, 0x01, 0x50, 0x52, 0x56],
            &[0xbc, 0xcf, 0x01, 65],
        ] {
            let (frames, rejected) = parse(&[broken, &GOOD].concat());
            assert_eq!((frames.len(), rejected), (1, 1), "{broken:x?}");
        }
    }

    #[test]
    fn a_truncated_frame_does_not_hide_the_next_ones() {
        let long = frame(0, &[3; 40]);
        for length in 0..long.len() {
            // The parser waits for more bytes than one good frame has. As soon as it finds the
            // truncated frame to be false, it passes on the good frames that the truncated one
            // seemed to contain.
            let stream = [&long[..length], &GOOD.repeat(8)].concat();
            assert_eq!(parse(&stream).0.len(), 8, "{length} bytes of the frame");
        }
    }

    #[test]
    fn start_bytes_in_the_data_are_data() {
        let data = [0xbc, 0xcf, 0x01, 0x01, 0x50, 0x52, 0x55, 0xbc];
        assert_eq!(parse(&frame(9, &data)).0, [(9, data.to_vec())]);
    }
}
