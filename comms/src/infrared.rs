//! Swarm messages in the infrared messages of Kilobots.
//!
//! ```text
//! data (9 bytes) | type | check (u16, low byte first)
//! ```
//! The type is the first byte of a swarm's frame, and the data is the rest of it, with zeros behind. The check is CRC-16/MCRF4XX from
//! 0xffff over data and type. Types 0 and 1 and those from 0x80 on are the robot's own (program, calibrate, sleep). Source:
//! kilolib, `message.h` and `message_crc.c`.

use bittybuzz_vm_core::message::{Kind, crc16};

/// Bytes of a message.
pub const MESSAGE: usize = 12;
/// Bytes of the longest frame in one.
pub const FRAME: usize = 1 + DATA;
const DATA: usize = 9;

/// The message with that frame of a swarm; `None` if it is longer than [`FRAME`], or no such frame.
pub fn message_of(frame: &[u8]) -> Option<[u8; MESSAGE]> {
    let (kind, payload) = frame.split_first()?;
    Kind::of(*kind)?;
    let mut message = [0; MESSAGE];
    let [data @ .., place, low, high] = &mut message;
    data.get_mut(..payload.len())?.copy_from_slice(payload);
    *place = *kind;
    [*low, *high] = check(data, *kind).to_le_bytes();
    Some(message)
}

/// The frame of a swarm in a message; `None` if it was damaged, or is one of the robot's own.
pub fn frame_of(message: &[u8; MESSAGE]) -> Option<[u8; FRAME]> {
    let [data @ .., kind, low, high] = message;
    Kind::of(*kind)?;
    if check(data, *kind) != u16::from_le_bytes([*low, *high]) {
        return None;
    }
    let mut frame = [*kind; FRAME];
    let [_, payload @ ..] = &mut frame;
    *payload = *data;
    Some(frame)
}

/// The check of those data and that type.
pub fn check(data: &[u8; DATA], kind: u8) -> u16 {
    data.iter().chain([&kind]).fold(0xffff, |check, byte| crc16(check, *byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As kilolib computes them, with avr-libc's `_crc_ccitt_update`.
    #[test]
    fn checks_are_kilolib_s() {
        assert_eq!(check(&[0xff; 9], 0), 0x881d);
        assert_eq!(check(&[0; 9], 0), 0x9c87);
        assert_eq!(check(&[0; 9], 0x88), 0x94c7);
        assert_eq!(check(&[1, 2, 3, 4, 5, 6, 7, 8, 9], 0), 0xa718);
        assert_eq!(check(&[0; 9], 0x80), 0x188f);
    }

    #[test]
    fn a_frame_comes_back_with_zeros_behind() {
        let message = message_of(&[8, 1, 0, 0x78, 0x56, 0x34, 0x12]);
        let message = message.expect("a beacon fits");
        assert_eq!(message[..10], [1, 0, 0x78, 0x56, 0x34, 0x12, 0, 0, 0, 8]);
        assert_eq!(frame_of(&message), Some([8, 1, 0, 0x78, 0x56, 0x34, 0x12, 0, 0, 0]));
        for bit in 0..8 * MESSAGE {
            let mut damaged = message;
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(frame_of(&damaged), None, "bit {bit}");
        }
    }

    #[test]
    fn what_is_no_frame_of_a_swarm_stays_out() {
        assert_eq!(message_of(&[]), None);
        assert_eq!(message_of(&[8; FRAME + 1]), None);
        assert!(message_of(&[8; FRAME]).is_some());
        for kind in [0, 1, 2, 3, 0x0a, 0x0f, 0x80, 0x88, 0xff] {
            assert_eq!(message_of(&[kind, 1, 2]), None, "{kind}");
            let [low, high] = check(&[0; 9], kind).to_le_bytes();
            assert_eq!(frame_of(&[0, 0, 0, 0, 0, 0, 0, 0, 0, kind, low, high]), None, "{kind}");
        }
    }
}
