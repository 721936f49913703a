//! Frames: the layout, round trips, and what is refused.

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::{Entry, Ignored, Message, PLAIN_MAX, Script};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

const SCRIPT: Script = Script { hash: 0x1234_5678, strings: 20 };

fn encoded<P: Profile>(message: Message<'_, P>) -> Vec<u8> {
    let mut frame = [0; PLAIN_MAX];
    let length = message.encode(SCRIPT, &mut frame).expect("a frame");
    frame[..length].to_vec()
}

#[test]
fn the_layout_is_the_document_s() {
    let tiny: Message<Tiny> =
        Message::Broadcast { robot: 0x0102, topic: 13, value: Value::int(-2) };
    assert_eq!(encoded(tiny), [5, 2, 1, 0x85, 0x56, 0xfe, 0xff, 0x78, 0x56, 0x34]);
    let full: Message<Full> =
        Message::Broadcast { robot: 0x0102, topic: 13, value: Value::string(14) };
    let expected = [7, 2, 1, 0x85, 0x56, 0, 0, 0x86, 0x56, 0, 0, 0x78, 0x56, 0x34];
    assert_eq!(encoded(full), expected);
    let entry = Entry {
        stigmergy: 2,
        owner: 0x0304,
        clock: 0x2a_bcde,
        key: Value::string(13),
        value: Value::nil(),
    };
    let frame = encoded::<Tiny>(Message::Entry(entry));
    assert_eq!(frame, [0x60 | 2 << 3 | 1 << 2, 4, 3, 0xde, 0xbc, 0x1a, 0x85, 0x56, 0, 0]);
}

#[test]
fn short_frames_are_malformed_and_others_foreign() {
    let frame = encoded::<Tiny>(Message::Beacon { robot: 1 });
    for length in 0..frame.len() {
        let short = Message::<Tiny>::decode(&frame[..length], SCRIPT);
        assert_eq!(short.unwrap_err(), Ignored::Malformed);
    }
    let other = Script { hash: SCRIPT.hash ^ 1 << 31, ..SCRIPT };
    assert_eq!(Message::<Tiny>::decode(&frame, other).unwrap_err(), Ignored::Foreign);
}
