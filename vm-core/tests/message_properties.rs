//! What holds for every message, and for every sequence of bytes that may be one.

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::content::{ContentItem, ContentReader, ContentWriter, Head};
use bittybuzz_vm_core::message::{
    CLOCK_MAX, Fragment, FrameKind, Ignored, Message, ScriptIdentity, StigmergyEntry, Swarms,
};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use proptest::prelude::*;

const SCRIPT: ScriptIdentity = ScriptIdentity { hash: 0xfeed_fade, strings: 300 };

type TinyMessage<'a> = Message<'a, Tiny>;
type FullMessage<'a> = Message<'a, Full>;

fn sealed<P: Profile>(message: &Message<'_, P>) -> Option<Vec<u8>> {
    let mut frame = [0xee; 64];
    let length = message.encode(SCRIPT, &mut frame)?;
    Some(frame[..length].to_vec())
}

/// All there is in a message: its own words and bits do not lie.
fn meaning<P: Profile>(message: &Message<'_, P>) -> String {
    match message {
        Message::Swarms { robot, swarms } => {
            format!("{robot} {:?}", swarms.iter().collect::<Vec<_>>())
        }
        message => format!("{message:?}"),
    }
}

#[derive(Debug, Clone, Copy)]
enum Plain {
    Nil,
    Int(i32),
    Float(f32),
    String(u16),
}

impl Plain {
    fn value<P: Profile>(self) -> Value<P> {
        match self {
            Plain::Nil => Value::nil(),
            Plain::Int(number) => Value::int(number),
            Plain::Float(number) => Value::float(number),
            Plain::String(number) => Value::string(number),
        }
    }
}

fn values() -> impl Strategy<Value = Plain> {
    prop_oneof![
        Just(Plain::Nil),
        any::<i32>().prop_map(Plain::Int),
        any::<f32>().prop_map(Plain::Float),
        (0..SCRIPT.strings).prop_map(Plain::String),
    ]
}

fn keys() -> impl Strategy<Value = Plain> {
    prop_oneof![any::<i32>().prop_map(Plain::Int), (0..SCRIPT.strings).prop_map(Plain::String),]
}

fn comes_back<P: Profile>(message: &Message<'_, P>) {
    let frame = sealed(message).expect("a frame");
    let read = Message::<P>::decode(&frame, SCRIPT).expect("a message");
    assert_eq!(meaning(&read), meaning(message));
    // A longer packet; one that is cut off.
    if !matches!(message, Message::Fragment(_)) {
        let longer = [&frame[..], &[0xff; 7]].concat();
        let read = Message::<P>::decode(&longer, SCRIPT).expect("a message");
        assert_eq!(meaning(&read), meaning(message));
        for length in 0..frame.len() {
            let cut = Message::<P>::decode(&frame[..length], SCRIPT);
            assert_eq!(cut.map(|_| ()), Err(Ignored::Malformed));
        }
    }
    // No frame where there is no room.
    for room in 0..frame.len() {
        assert_eq!(message.encode(SCRIPT, &mut vec![0; room]), None);
    }
}

/// With other bits of the hash that the frame carries.
fn is_foreign<P: Profile>(message: &Message<'_, P>, bits: u32) {
    let other = ScriptIdentity { hash: SCRIPT.hash ^ bits, ..SCRIPT };
    let read = Message::<P>::decode(&sealed(message).expect("a frame"), other).map(|_| ());
    assert_eq!(read, Err(Ignored::Foreign));
}

fn nothing_else_is_read<P: Profile>(bytes: &[u8]) {
    let Ok(message) = Message::<P>::decode(bytes, SCRIPT) else { return };
    let frame = sealed(&message).expect("what can be read can be written");
    assert!(frame.len() <= bytes.len());
    assert_eq!(FrameKind::of(frame[0]), FrameKind::of(bytes[0]));
    let again = Message::<P>::decode(&frame, SCRIPT).expect("and read again");
    assert_eq!(meaning(&again), meaning(&message));
}

/// The items of a content, `None` if it is refused.
fn items<P: Profile>(content: &[u8]) -> Option<(Head, Vec<ContentItem<P>>, Vec<u8>)> {
    let (head, mut reader) = ContentReader::new(content, SCRIPT);
    reader.check::<P>(|_| {}).ok()?;
    let (mut items, mut text, mut left) = (Vec::new(), Vec::new(), 2_usize);
    while left > 0 {
        left -= 1;
        let item = reader.item::<P>();
        match item {
            ContentItem::Table(pairs) => left += 2 * usize::from(pairs),
            ContentItem::Text(length) => text.extend((0..length).map(|_| reader.byte())),
            _ => {}
        }
        items.push(item);
    }
    Some((head, items, text))
}

fn content_comes_back<P: Profile>(content: &[u8]) {
    let Some((head, items, text)) = items::<P>(content) else { return };
    let mut text = text.into_iter();
    let mut room = vec![0; content.len()];
    let mut writer = ContentWriter::new(&mut room, SCRIPT, head);
    for item in items {
        writer.item(item);
        if let ContentItem::Text(length) = item {
            text.by_ref().take(length.into()).for_each(|byte| writer.byte(byte));
        }
    }
    let length = writer.finish().expect("it had room");
    assert_eq!(room[..length], content[..length]);
}

/// Reading plain values at once gives what the items are, and nothing else.
fn plain_values_are_the_items<P: Profile>(content: &[u8]) {
    let mut values = [Value::nil(); 9];
    let found = ContentReader::new(content, SCRIPT).1.plain::<P>(&mut values);
    let found = found.map(|(count, has_table)| (values[..count].to_vec(), has_table));
    let items = items::<P>(content).map(|(_, items, _)| items);
    let has_table = items.iter().flatten().any(|item| matches!(item, ContentItem::Table(_)));
    let expected = items.and_then(|items| {
        let mut plain = Vec::new();
        for (index, item) in items.iter().enumerate() {
            match item {
                ContentItem::Plain(value) => plain.push(*value),
                // In place of the second value, with all others in it.
                ContentItem::Table(_) if index == 1 => {}
                _ => return None,
            }
        }
        (plain.len() <= values.len()).then_some((plain, has_table))
    });
    assert_eq!(format!("{found:?}"), format!("{expected:?}"), "{content:?}");
}

/// A content of the first two values, or of the first and a table of pairs of the others.
fn written<P: Profile>(values: &[Plain], has_table: bool) -> Vec<u8> {
    let mut room = [0; 100];
    let mut writer = ContentWriter::new(&mut room, SCRIPT, Head::Broadcast);
    let (first, others) = values.split_first().expect("two at least");
    writer.item(ContentItem::Plain(first.value::<P>()));
    let pairs = others.len() / 2;
    let others = if has_table { &others[..2 * pairs] } else { &others[..1] };
    if has_table {
        writer.item::<P>(ContentItem::Table(pairs as u8));
    }
    others.iter().for_each(|value| writer.item(ContentItem::Plain(value.value::<P>())));
    let length = writer.finish().expect("it had room");
    room[..length].to_vec()
}

/// Bytes with the check that a content has to begin with.
fn checked(bytes: &[u8]) -> Vec<u8> {
    let mut content = vec![0; 2];
    let check = bytes
        .iter()
        .fold(SCRIPT.hash as u16, |check, byte| bittybuzz_vm_core::message::crc16(check, *byte));
    content[..2].copy_from_slice(&check.to_le_bytes());
    content.extend(bytes);
    content
}

/// Bytes that are often the head of a content and items.
fn contents() -> impl Strategy<Value = Vec<u8>> {
    let word = || {
        let string = (0..SCRIPT.strings).prop_map(|number| number.wrapping_add(SCRIPT.hash as u16));
        prop_oneof![any::<u16>(), string].prop_map(|word| word.to_le_bytes().to_vec())
    };
    let item = prop_oneof![
        Just(vec![0]),
        (1..4_u8, word()).prop_map(|(tag, word)| [&[tag], &word[..]].concat()),
        (1..4_u8, word()).prop_map(|(tag, word)| [&[tag], &word[..], &[0, 0]].concat()),
        (0..5_u8).prop_map(|length| [&[4, length][..], &vec![b'x'; length.into()]].concat()),
        (0..3_u8).prop_map(|pairs| vec![5, pairs]),
        any::<u16>().prop_map(|number| [&[6], &number.to_le_bytes()[..]].concat()),
        prop::collection::vec(any::<u8>(), 0..4),
    ];
    let head = prop_oneof![
        Just(vec![0]),
        prop::collection::vec(any::<u8>(), 6).prop_map(|rest| [&[1], &rest[..], &[0x3f]].concat()),
    ];
    (head, prop::collection::vec(item, 0..8))
        .prop_map(|(head, items)| checked(&[head, items.concat()].concat()))
}

/// Bytes of the script's hash that are wrong in the same way do not hide each other.
#[test]
fn equal_errors_of_a_digest_are_two() {
    let frame = sealed(&TinyMessage::Digest { robot: 1, digest: 77, floor: 5 }).expect("it fits");
    for bit in [0x40, 0x80] {
        let mut changed = frame.clone();
        changed[3] ^= bit;
        changed[6] ^= bit;
        assert!(matches!(TinyMessage::decode(&changed, SCRIPT), Err(Ignored::Foreign)), "{bit}");
    }
}

#[test]
fn the_latest_floor_has_a_frame() {
    let of = |floor| sealed(&TinyMessage::Digest { robot: 1, digest: 0xff_ffff, floor });
    assert!(of(CLOCK_MAX).is_some() && of(CLOCK_MAX + 1).is_none());
}

proptest! {
    #[test]
    fn broadcasts_round_trip(
        robot: u16, topic in 0..SCRIPT.strings, value in values(), bits in 1..=0xff_ffff_u32,
    ) {
        let tiny = TinyMessage::Broadcast { robot, topic, value: value.value() };
        let full = FullMessage::Broadcast { robot, topic, value: value.value() };
        comes_back(&tiny);
        comes_back(&full);
        is_foreign(&tiny, bits);
        is_foreign(&full, bits);
    }

    #[test]
    fn entries_round_trip(
        stigmergy in 0..3_u16, owner: u16, clock in 0..=CLOCK_MAX, key in keys(), value in values(),
        bits in 1..16_u32,
    ) {
        let tiny = StigmergyEntry::<Tiny> { stigmergy, owner, clock, key: key.value(), value: value.value() };
        let full = StigmergyEntry::<Full> { stigmergy, owner, clock, key: key.value(), value: value.value() };
        comes_back(&Message::Entry(tiny));
        comes_back(&Message::Entry(full));
        is_foreign(&Message::Entry(tiny), bits << 28);
        is_foreign(&Message::Entry(full), bits << 28);
        is_foreign(&Message::Entry(full), bits << 8);
    }

    #[test]
    fn values_without_a_frame_are_reported(
        stigmergy in 0..6_u16, clock in 0..=2 * CLOCK_MAX, key in values(), value in values(),
        index in 0..8_u8,
    ) {
        let (key, value) = (key.value::<Full>(), value.value());
        let entry = Message::Entry(StigmergyEntry { stigmergy, owner: 1, clock, key, value });
        let has_key = key.as_int().is_some() || key.as_string().is_some();
        let has_frame = stigmergy < 3 && clock <= CLOCK_MAX && has_key;
        prop_assert_eq!(sealed(&entry).is_some(), has_frame);
        let none = Swarms::default();
        prop_assert_eq!(sealed(&FullMessage::Swarms { robot: 1, swarms: none }), None);
        let content = &[][..];
        let empty = Fragment { robot: 1, number: 2, index, last: true, content };
        prop_assert_eq!(sealed(&FullMessage::Fragment(empty)), None);
    }

    #[test]
    fn other_messages_round_trip(
        robot: u16, ids in prop::collection::vec(any::<(u16, bool)>(), 1..=4), number: u8,
        index in 0..8_u8, last: bool, content in prop::collection::vec(any::<u8>(), 1..50),
        bits in 1..=0xffff_u32, digest in 0..1_u32 << 24, floor in 0..=CLOCK_MAX,
    ) {
        comes_back(&TinyMessage::Beacon { robot });
        is_foreign(&TinyMessage::Beacon { robot }, bits);
        is_foreign(&TinyMessage::Beacon { robot }, bits << 16);
        comes_back(&TinyMessage::Digest { robot, digest, floor });
        is_foreign(&TinyMessage::Digest { robot, digest, floor }, 1 + bits % 0xff);
        is_foreign(&TinyMessage::Digest { robot, digest, floor }, (1 + bits % 3) << 30);
        let beyond = TinyMessage::Digest { robot, digest: digest | 1 << 24, floor };
        prop_assert_eq!(sealed(&beyond), None);
        let beyond = TinyMessage::Digest { robot, digest, floor: CLOCK_MAX + 1 + floor };
        prop_assert_eq!(sealed(&beyond), None);
        let mut swarms = Swarms::default();
        prop_assert!(ids.iter().all(|(id, joined)| swarms.push(*id, *joined)));
        prop_assert!(swarms.iter().eq(ids.iter().copied()));
        let full = FullMessage::Swarms { robot, swarms };
        comes_back(&full);
        is_foreign(&full, bits);
        let tiny = TinyMessage::Swarms { robot, swarms };
        if ids.len() > 2 {
            prop_assert_eq!(sealed(&tiny), None);
        } else {
            comes_back(&tiny);
        }
        let content = &content[..];
        comes_back(&TinyMessage::Fragment(Fragment { robot, number, index, last, content }));
    }

    #[test]
    fn decoded_messages_encode_to_the_same_bytes(
        bytes in prop::collection::vec(any::<u8>(), 0..24), kind in 0..0x80_u8, ours: bool,
    ) {
        let mut bytes = bytes;
        if let Some(first) = bytes.first_mut() {
            *first = kind;
        }
        // Often with this script's hash where entries and beacons have it.
        if ours && let Some(hash) = bytes.get_mut(3..7) {
            hash.copy_from_slice(&SCRIPT.hash.to_le_bytes());
            bytes[5] = if kind < 0x20 { bytes[5] } else { bytes[5] & 0x0f | 0xf0 };
        }
        nothing_else_is_read::<Full>(&bytes);
        nothing_else_is_read::<Tiny>(&bytes);
    }

    #[test]
    fn damaged_content_is_refused_or_reads_as_written(
        bytes in prop::collection::vec(any::<u8>(), 0..40), content in contents(),
    ) {
        for content in [bytes.clone(), checked(&bytes), content] {
            content_comes_back::<Tiny>(&content);
            content_comes_back::<Full>(&content);
            plain_values_are_the_items::<Tiny>(&content);
            plain_values_are_the_items::<Full>(&content);
        }
    }

    #[test]
    fn plain_values_are_read_at_once(
        values in prop::collection::vec(values(), 2..13), has_table in any::<bool>(), change in any::<(u8, u8)>(),
    ) {
        for content in [written::<Tiny>(&values, has_table), written::<Full>(&values, has_table)] {
            plain_values_are_the_items::<Tiny>(&content);
            plain_values_are_the_items::<Full>(&content);
            let (at, bits) = change;
            let mut changed = content.clone();
            changed[usize::from(at) % content.len()] ^= bits;
            plain_values_are_the_items::<Full>(&changed);
            // Its check is right again.
            plain_values_are_the_items::<Full>(&checked(&changed[2..]));
            plain_values_are_the_items::<Full>(&content[..usize::from(at) % content.len()]);
        }
    }
}
