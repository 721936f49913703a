//! Swarm messages in the infrared messages of Kilobots.
//!
//! ```text
//! data (9 bytes) | type | check (u16, low byte first)
//! ```
//! The type is the first byte of a swarm frame, and the data is the rest of the frame, padded with
//! zeros. The check is CRC-16/MCRF4XX from 0xffff over data and type. The types 0, 1 and from 0x80
//! on control the robot itself (program, calibrate, sleep). Source: kilolib, `message.h` and
//! `message_crc.c`. The types 0x0e and 0x0f report faults of a script; see [`FaultReport`].

use bittybuzz_vm_core::message::{FrameKind, crc16};
use bittybuzz_vm_core::{Fault, FaultCode, Type};

/// The length of a message, in bytes.
pub const MESSAGE: usize = 12;
/// The length of the longest frame in a message, in bytes.
pub const FRAME: usize = 1 + DATA;
const DATA: usize = 9;

/// Packs a swarm frame into a message; `None` if the frame is longer than [`FRAME`], or no swarm
/// frame.
pub fn message_of(frame: &[u8]) -> Option<[u8; MESSAGE]> {
    let (kind, payload) = frame.split_first()?;
    FrameKind::of(*kind)?;
    let mut data = [0; DATA];
    data.get_mut(..payload.len())?.copy_from_slice(payload);
    Some(sealed(*kind, &data))
}

/// Returns the message of type `kind` with `data` and the check.
pub fn sealed(kind: u8, data: &[u8; DATA]) -> [u8; MESSAGE] {
    let mut message = [kind; MESSAGE];
    let [payload @ .., _, _, _] = &mut message;
    *payload = *data;
    let [content @ .., low, high] = &mut message;
    [*low, *high] = check(content).to_le_bytes();
    message
}

/// Returns the type and the data of a message; `None` if it was damaged.
pub fn opened(message: &[u8; MESSAGE]) -> Option<(u8, &[u8; DATA])> {
    let [content @ .., low, high] = message;
    let is_whole = check(content) == u16::from_le_bytes([*low, *high]);
    let [data @ .., kind] = content;
    is_whole.then_some((*kind, data))
}

/// Returns the swarm frame in a message; `None` if the message was damaged, or is of another type.
pub fn frame_of(message: &[u8; MESSAGE]) -> Option<[u8; FRAME]> {
    let (kind, data) = opened(message)?;
    FrameKind::of(kind)?;
    Some(frame(kind, data))
}

/// Returns the frame in a message of type `kind` with `data`. The caller has to check that `kind`
/// is one of a swarm frame.
pub fn frame(kind: u8, data: &[u8; DATA]) -> [u8; FRAME] {
    let mut frame = [kind; FRAME];
    let [_, payload @ ..] = &mut frame;
    *payload = *data;
    frame
}

/// Parses a line from a Kilobot that forwards messages to a computer: `ir` and two hexadecimal
/// digits for each byte (`firmware/kilobot-avr/src/bin/ear.rs`). Returns `None` for another line.
pub fn from_line(line: &[u8]) -> Option<[u8; MESSAGE]> {
    let digits = line.trim_ascii_end().strip_prefix(b"ir ")?;
    let mut message = [0; MESSAGE];
    let (pairs, rest) = digits.as_chunks::<2>();
    if pairs.len() != MESSAGE || !rest.is_empty() {
        return None;
    }
    for (byte, pair) in message.iter_mut().zip(pairs) {
        let [high, low] = pair.map(|digit| char::from(digit).to_digit(16));
        *byte = (high? << 4 | low?) as u8;
    }
    Some(message)
}

/// Returns the check of data and type.
#[inline(never)]
fn check(content: &[u8; FRAME]) -> u16 {
    content.iter().fold(0xffff, |check, byte| crc16(check, *byte))
}

/// The type of a [`FaultReport`] of a script that stopped, for good or until its restart.
pub const FAULT: u8 = 0x0f;
/// The type of a [`FaultReport`] of a script that goes on.
pub const CONTAINED: u8 = 0x0e;

/// The report of a script's fault, for robots without a debug probe, which repeat it. The host
/// finds file and line with the script's symbols.
///
/// ```text
/// robot (u16) | script (u16) | cause, 0 if the robot refused the image | position (u16) | types of the operands | detail
/// ```
/// Numbers have their low byte first. The script field is the lower half of the script's hash, and
/// the detail field is the lower byte of the detail. The type of the first operand is in the lower
/// four bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaultReport {
    /// The id of the robot that reports.
    pub robot: u16,
    /// The lower half of the hash of the script.
    pub script: u16,
    /// The fault; `None` if the robot refused the image.
    pub fault: Option<Fault>,
    /// True if the fault ended only a listener or a conflict handler.
    pub is_contained: bool,
}

impl FaultReport {
    /// Returns the message with this report.
    pub fn message(&self) -> [u8; MESSAGE] {
        let [robot, robot_high] = self.robot.to_le_bytes();
        let [script, script_high] = self.script.to_le_bytes();
        let mut data = [robot, robot_high, script, script_high, 0, 0, 0, 0, 0];
        if let Some(fault) = self.fault {
            let [position, position_high] = fault.position.to_le_bytes();
            let [first, second] = fault.operands.map(|operand| operand as u8);
            let what = [
                fault.code as u8,
                position,
                position_high,
                first | second << 4,
                fault.detail as u8,
            ];
            let [_, _, _, _, place @ ..] = &mut data;
            *place = what;
        }
        sealed(if self.is_contained { CONTAINED } else { FAULT }, &data)
    }

    /// Returns the number of the cause in a message that [`FaultReport::message`] made; 0 if the
    /// robot refused the image.
    pub const fn number(message: &[u8; MESSAGE]) -> u8 {
        let [_, _, _, _, number, ..] = message;
        *number
    }

    /// Returns the report in a message; `None` if it is another message.
    pub fn of(message: &[u8; MESSAGE]) -> Option<Self> {
        let (kind @ (FAULT | CONTAINED), data) = opened(message)? else { return None };
        let [robot, robot_high, script, script_high, code, position, position_high, types, detail] =
            *data;
        let fault = match code {
            0 => None,
            _ => Some(Fault {
                code: FaultCode::ALL.into_iter().find(|known| *known as u8 == code)?,
                position: u16::from_le_bytes([position, position_high]),
                operands: [
                    *Type::ALL.get(usize::from(types & 15))?,
                    *Type::ALL.get(usize::from(types >> 4))?,
                ],
                detail: detail.into(),
            }),
        };
        Some(FaultReport {
            robot: u16::from_le_bytes([robot, robot_high]),
            script: u16::from_le_bytes([script, script_high]),
            fault,
            is_contained: kind == CONTAINED,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_comes_back() {
        for code in FaultCode::ALL {
            for [first, second] in [[Type::Nil, Type::Unset], [Type::Table, Type::Int]] {
                let fault =
                    Fault { code, position: 0x1234, operands: [first, second], detail: 200 };
                for is_contained in [false, true] {
                    let fault = Some(fault);
                    let report = FaultReport { robot: 0xbeef, script: 0xcafe, fault, is_contained };
                    assert_eq!(FaultReport::of(&report.message()), Some(report));
                    assert_eq!(FaultReport::number(&report.message()), code as u8);
                    assert_eq!(frame_of(&report.message()), None, "no frame of a swarm");
                }
            }
        }
        let refused = FaultReport { robot: 1, script: 2, fault: None, is_contained: false };
        assert_eq!(FaultReport::of(&refused.message()), Some(refused));
        // The bytes follow the table in the documentation of `FaultReport`.
        assert_eq!(refused.message()[..10], [1, 0, 2, 0, 0, 0, 0, 0, 0, 0x0f]);
        let fault =
            Fault { code: FaultCode::WrongType, position: 3, operands: [Type::Nil; 2], detail: 0 };
        let contained = FaultReport { robot: 1, script: 2, fault: Some(fault), is_contained: true };
        assert_eq!(contained.message()[..10], [1, 0, 2, 0, 1, 3, 0, 0, 0, 0x0e]);
    }

    #[test]
    fn a_line_is_twelve_bytes_in_hexadecimal() {
        let message = [8, 1, 0, 0xab, 0xcd, 6, 7, 8, 9, 10, 0xfe, 0xff];
        for line in [&b"ir 080100abcd060708090afeff"[..], b"ir 080100ABCD060708090AFEFF\r"] {
            assert_eq!(from_line(line), Some(message), "{line:?}");
        }
        for line in [
            &b""[..],
            b"ir ",
            b"ir 08010",
            b"ir 080100abcd060708090afeff0",
            b"ir 080100abcd0607080a0gfeff",
            b"rx 080100abcd06070809",
        ] {
            assert_eq!(from_line(line), None, "{line:?}");
        }
    }

    #[test]
    fn other_messages_are_no_fault_reports() {
        assert_eq!(FaultReport::of(&sealed(8, &[0; 9])), None);
        assert_eq!(
            FaultReport::of(&sealed(FAULT, &[1, 0, 2, 0, 99, 0, 0, 0, 0])),
            None,
            "no such cause"
        );
        assert_eq!(
            FaultReport::of(&sealed(FAULT, &[1, 0, 2, 0, 1, 0, 0, 0x70, 0])),
            None,
            "no such type"
        );
        let mut damaged = sealed(FAULT, &[0; 9]);
        damaged[3] ^= 1;
        assert_eq!(FaultReport::of(&damaged), None);
    }

    /// The values are those of kilolib, which uses avr-libc's `_crc_ccitt_update`.
    #[test]
    fn checks_are_kilolib_s() {
        assert_eq!(sealed(0, &[0xff; 9])[10..], 0x881d_u16.to_le_bytes());
        assert_eq!(sealed(0, &[0; 9])[10..], 0x9c87_u16.to_le_bytes());
        assert_eq!(sealed(0x88, &[0; 9])[10..], 0x94c7_u16.to_le_bytes());
        assert_eq!(sealed(0, &[1, 2, 3, 4, 5, 6, 7, 8, 9])[10..], 0xa718_u16.to_le_bytes());
        assert_eq!(sealed(0x80, &[0; 9])[10..], 0x188f_u16.to_le_bytes());
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
    fn other_messages_are_no_swarm_frames() {
        assert_eq!(message_of(&[]), None);
        assert_eq!(message_of(&[8; FRAME + 1]), None);
        assert!(message_of(&[8; FRAME]).is_some());
        for kind in [0, 1, 2, 3, 0x0b, 0x0e, 0x0f, 0x80, 0x88, 0xff] {
            assert_eq!(message_of(&[kind, 1, 2]), None, "{kind}");
            assert_eq!(frame_of(&sealed(kind, &[0; 9])), None, "{kind}");
        }
    }
}
