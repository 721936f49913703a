//! Frames and contents that wait in a queue: which of them a newer one replaces, and the topics of broadcasts.

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::content::{ContentItem, ContentWriter, Head};
use bittybuzz_vm_core::message::{
    Fragment, FrameKind, Message, ScriptIdentity, replaces, replaces_content, topic_of, topic_set,
};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

const SCRIPT: ScriptIdentity = ScriptIdentity { hash: 0x1234_5678, strings: 300 };

fn broadcast<P: Profile>(robot: u16, topic: u16, value: i32) -> Vec<u8> {
    let mut frame = [0; 20];
    let message: Message<'_, P> = Message::Broadcast { robot, topic, value: Value::int(value) };
    let length = message.encode(SCRIPT, &mut frame).expect("it fits");
    frame[..length].to_vec()
}

/// A stale broadcast is replaced by one of the same robot on the same topic, if it has all bytes.
fn stale_broadcasts<P: Profile>() {
    let waiting = broadcast::<P>(7, 3, 5);
    let is_replaced =
        |new: &[u8], waiting: &[u8]| replaces::<P>(FrameKind::Broadcast, new, waiting, true);
    assert!(is_replaced(&broadcast::<P>(7, 3, 6), &waiting));
    assert!(!replaces::<P>(FrameKind::Broadcast, &broadcast::<P>(7, 3, 6), &waiting, false));
    for other in [(8, 3), (7 + 256, 3), (7, 4)] {
        assert!(!is_replaced(&broadcast::<P>(other.0, other.1, 5), &waiting), "{other:?}");
    }
    for length in 0..waiting.len() {
        assert!(!is_replaced(&waiting, &waiting[..length]), "{length}");
        assert!(!is_replaced(&waiting[..length], &waiting), "{length}");
    }
}

#[test]
fn a_stale_broadcast_is_replaced_on_its_topic() {
    stale_broadcasts::<Tiny>();
    stale_broadcasts::<Full>();
}

/// A topic or key.
#[derive(Clone, Copy)]
enum Name {
    Int(i32),
    String(u16),
    Text(&'static str),
}

fn content<P: Profile>(head: Head, name: Name, value: i32) -> Vec<u8> {
    let mut room = [0; 128];
    let mut writer = ContentWriter::new(&mut room, SCRIPT, head);
    match name {
        Name::Int(number) => writer.item::<P>(ContentItem::Plain(Value::int(number))),
        Name::String(number) => writer.item::<P>(ContentItem::Plain(Value::string(number))),
        Name::Text(text) => {
            writer.item::<P>(ContentItem::Text(text.len() as u8));
            text.bytes().for_each(|byte| writer.byte(byte));
        }
    }
    writer.item::<P>(ContentItem::Table(1));
    writer.item::<P>(ContentItem::Plain(Value::int(0)));
    writer.item::<P>(ContentItem::Plain(Value::int(value)));
    let length = writer.finish().expect("room");
    room[..length].to_vec()
}

const TEXTS: [&str; 8] = [
    "",
    "a",
    "b",
    "ab",
    "abc",
    "a text of some more bytes",
    "a text of some other byte",
    "a text of some more byte.",
];

/// The names of contents are different ones, whether they are constants or texts.
fn contents<P: Profile>(names: &[Name]) {
    let entry = |stigmergy, owner, clock| Head::Entry { stigmergy, owner, clock, digest: 9 };
    for (at, waiting) in names.iter().enumerate() {
        for (other, new) in names.iter().enumerate() {
            let of = |head, name, value| content::<P>(head, name, value);
            let is_same = at == other;
            let message = of(Head::Broadcast, *waiting, 1);
            let newer = of(Head::Broadcast, *new, 2);
            assert_eq!(replaces_content::<P>(&newer, &message, true), is_same, "{at} {other}");
            assert!(!replaces_content::<P>(&newer, &message, false));
            let message = of(entry(700, 1, 5), *waiting, 1);
            let newer = of(entry(700, 2, 9), *new, 2);
            assert_eq!(replaces_content::<P>(&newer, &message, false), is_same, "{at} {other}");
            for stigmergy in [701, 700 + 256] {
                let elsewhere = of(entry(stigmergy, 1, 9), *new, 2);
                assert!(!replaces_content::<P>(&elsewhere, &message, false));
            }
            // A broadcast is no entry.
            let broadcast = of(Head::Broadcast, *new, 1);
            assert!(!replaces_content::<P>(&broadcast, &message, true));
            assert!(!replaces_content::<P>(&message, &broadcast, true));
        }
    }
}

#[test]
fn a_content_is_replaced_under_its_name() {
    let strings = [2, 3, 19, 2 + 256].map(Name::String);
    let numbers = [1, 2, 1 + 256].map(Name::Int);
    contents::<Tiny>(&[strings.as_slice(), &numbers].concat());
    let numbers = [1, 2, 1 + 256, 1 + (1 << 16), 1 + (1 << 24)].map(Name::Int);
    contents::<Full>(&[strings.as_slice(), &numbers, &TEXTS.map(Name::Text)].concat());
}

/// The first fragment of a long broadcast, with as many bytes of the content.
fn first_fragment(content: &[u8], bytes: usize) -> Vec<u8> {
    let fragment =
        Fragment { robot: 7, number: 1, index: 0, last: false, content: &content[..bytes] };
    let mut frame = [0; 64];
    let message: Message<'_, Full> = Message::Fragment(fragment);
    let length = message.encode(SCRIPT, &mut frame).expect("it fits");
    frame[..length].to_vec()
}

/// A constant has the same topic in a frame and in a fragment.
fn topics<P: Profile>() {
    for number in 0..20 {
        let content = content::<P>(Head::Broadcast, Name::String(number), 1);
        let short = topic_of::<P>(&broadcast::<P>(7, number, 1));
        assert_eq!(topic_of::<P>(&first_fragment(&content, 8)), short, "{number}");
        assert_eq!(short, topic_set((number as u8).wrapping_add(SCRIPT.hash as u8)));
    }
}

#[test]
fn fragments_have_the_topic_of_their_message() {
    topics::<Tiny>();
    topics::<Full>();
    for text in TEXTS {
        let content = content::<Full>(Head::Broadcast, Name::Text(text), 1);
        let sum = text.bytes().fold(text.len() as u8, u8::wrapping_add);
        let frame = first_fragment(&content, 5 + text.len());
        assert_eq!(topic_of::<Full>(&frame), topic_set(sum), "{text}");
    }
    // Entries have none.
    let head = Head::Entry { stigmergy: 3, owner: 4, clock: 5, digest: 6 };
    let entry = content::<Full>(head, Name::String(3), 1);
    assert_eq!(topic_of::<Full>(&first_fragment(&entry, 8)), 0);
}
