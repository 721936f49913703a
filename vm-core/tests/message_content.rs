//! Contents of messages in fragments: what is refused, and their check.

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::content::{
    ContentItem, ContentReader, ContentWriter, Head, digest,
};
use bittybuzz_vm_core::message::{CLOCK_MAX, Ignored, ScriptIdentity, crc16};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

const SCRIPT: ScriptIdentity = ScriptIdentity { hash: 0x1234_5678, strings: 20 };

#[test]
fn the_check_is_mcrf4xx() {
    // Its check value, and Kilobots' frames of zeros and ones.
    let of = |bytes: &[u8]| bytes.iter().fold(0xffff, |check, byte| crc16(check, *byte));
    assert_eq!(of(b"123456789"), 0x6f91);
    assert_eq!(of(&[0; 10]), 0x9c87);
    assert_eq!(of(&[0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0]), 0x881d);
}

/// Key -1.5 and the table { string 13: { 0: function 300 } }.
fn content<P: Profile>(head: Head) -> Vec<u8> {
    let mut room = [0xee; 64];
    let mut writer = ContentWriter::new(&mut room, SCRIPT, head);
    writer.item::<P>(ContentItem::Plain(Value::float(-1.5)));
    writer.item::<P>(ContentItem::Table(1));
    writer.item::<P>(ContentItem::Plain(Value::string(13)));
    writer.item::<P>(ContentItem::Table(1));
    writer.item::<P>(ContentItem::Plain(Value::int(0)));
    writer.item::<P>(ContentItem::Function(300));
    let length = writer.finish().expect("room");
    room[..length].to_vec()
}

#[test]
fn a_table_is_its_pairs() {
    let head = Head::Entry { stigmergy: 700, owner: 2, clock: CLOCK_MAX, digest: 0x1b2c };
    let bytes = content::<Tiny>(head);
    let expected = [
        1, 0xbc, 2, 2, 0, 255, 255, 0x3f, 0x2c, 0x1b, 2, 0, 0xbf, 5, 1, 3, 0x85, 0x56, 5, 1, 1, 0,
        0, 6, 44, 1,
    ];
    assert_eq!(bytes[2..], expected);
    let padded = [&bytes[..], &[9, 9]].concat();
    let (read, mut items) = ContentReader::new(&padded, SCRIPT);
    items.check::<Tiny>(|_| {}).unwrap();
    assert_eq!(read, head);
    assert!(matches!(items.item::<Tiny>(), ContentItem::Plain(v) if v.as_f32() == Some(-1.5)));
    assert!(matches!(items.item::<Tiny>(), ContentItem::Table(1)));
    assert!(matches!(items.item::<Tiny>(), ContentItem::Plain(v) if v.as_string() == Some(13)));
    assert!(matches!(items.item::<Tiny>(), ContentItem::Table(1)));
    assert!(matches!(items.item::<Tiny>(), ContentItem::Plain(v) if v.as_int() == Some(0)));
    assert!(matches!(items.item::<Tiny>(), ContentItem::Function(300)));
}

/// A digest is of key and value: robots that put the same at other times have the same one.
#[test]
fn a_digest_is_of_the_items() {
    let of = |owner, clock| {
        let head = Head::Entry { stigmergy: 700, owner, clock, digest: 0 };
        content::<Tiny>(head)
    };
    let bytes = of(1, 1);
    let items = [2, 0, 0xbf, 5, 1, 3, 0x85, 0x56, 5, 1, 1, 0, 0, 6, 44, 1];
    assert!(bytes.ends_with(&items));
    assert_eq!(digest(&bytes), items.iter().fold(0xffff, |check, byte| crc16(check, *byte)));
    assert_eq!(digest(&bytes), digest(&of(2, CLOCK_MAX)));
}

fn checked(bytes: &[u8], script: ScriptIdentity) -> Result<(), Ignored> {
    ContentReader::new(bytes, script).1.check::<Full>(|_| {})
}

#[test]
fn truncated_and_changed_content_is_refused() {
    let bytes = content::<Full>(Head::Broadcast);
    assert_eq!(checked(&bytes, SCRIPT), Ok(()));
    for length in 0..bytes.len() {
        assert_eq!(checked(&bytes[..length], SCRIPT), Err(Ignored::Malformed));
    }
    for bit in 0..8 * bytes.len() {
        let mut changed = bytes.clone();
        changed[bit / 8] ^= 1 << (bit % 8);
        assert!(checked(&changed, SCRIPT).is_err(), "bit {bit}");
    }
    let other = ScriptIdentity { hash: SCRIPT.hash + 1, ..SCRIPT };
    assert_eq!(checked(&bytes, other), Err(Ignored::Foreign));
}

#[test]
fn without_room_there_is_no_content() {
    let mut room = [0; 8];
    let mut writer = ContentWriter::new(&mut room, SCRIPT, Head::Broadcast);
    writer.item::<Tiny>(ContentItem::Plain(Value::string(13)));
    writer.item::<Tiny>(ContentItem::Plain(Value::int(1)));
    assert_eq!(writer.finish(), None);
}

/// The strings of a script have the numbers below their count: a constant beyond them is another script's.
#[test]
fn a_constant_beyond_the_strings_is_foreign() {
    fn run<P: Profile>() {
        for (number, is_known) in [(0, true), (19, true), (20, false), (u16::MAX, false)] {
            let mut room = [0; 64];
            let mut writer = ContentWriter::new(&mut room, SCRIPT, Head::Broadcast);
            writer.item::<P>(ContentItem::Plain(Value::string(13)));
            writer.item::<P>(ContentItem::Plain(Value::string(number)));
            let length = writer.finish().expect("room");
            let (_, reader) = ContentReader::new(&room[..length], SCRIPT);
            let expected = if is_known { Ok(()) } else { Err(Ignored::Foreign) };
            assert_eq!(reader.check::<P>(|_| {}), expected, "{number}");
            let mut values = [Value::<P>::nil(); 2];
            assert_eq!(reader.plain(&mut values).is_some(), is_known, "{number}");
        }
    }
    run::<Tiny>();
    run::<Full>();
}
