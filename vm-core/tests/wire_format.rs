//! The vectors of docs/wire-format.md, both ways. They were computed from its tables, not by the code that they test.

use std::fmt::Write;

use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::content::{ContentItem, ContentReader, ContentWriter, Head};
use bittybuzz_vm_core::message::{
    Fragment, FrameKind, Message, ScriptIdentity, StigmergyEntry, Swarms,
};
use bittybuzz_vm_core::number::{Full, Number, Profile, Tiny};

const DOCUMENT: &str = include_str!("../../docs/wire-format.md");
const SCRIPT: ScriptIdentity = ScriptIdentity { hash: 0x1234_abcd, strings: 40 };

/// Rows of the vectors' table that begins so: text, bytes in the tiny profile, bytes in the full profile.
fn rows(table: &str) -> Vec<[&'static str; 3]> {
    let heading = format!("| {table} | `tiny` | `full` |\n");
    let (_, rows) = DOCUMENT.split_once(&heading).expect("the table");
    let rows = rows.lines().skip(1).take_while(|line| line.starts_with('|'));
    rows.map(|row| {
        let cells: Vec<_> = row.trim_matches('|').split('|').map(str::trim).collect();
        cells.try_into().expect("three cells")
    })
    .collect()
}

/// The bytes in a cell, `None` if there are none.
fn bytes(cell: &str) -> Option<Vec<u8>> {
    let text = cell.strip_prefix('`')?.strip_suffix('`')?;
    Some(text.split(' ').map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect())
}

/// The words of a text, one after the other.
struct Words<'a>(std::str::SplitWhitespace<'a>);

impl<'a> Words<'a> {
    fn of(text: &'a str) -> Self {
        Words(text.split_whitespace())
    }

    fn word(&mut self) -> Option<&'a str> {
        self.0.next().map(|word| word.trim_end_matches(','))
    }

    fn number(&mut self) -> u32 {
        self.word().unwrap().parse().unwrap()
    }

    /// Reads that word and returns the number after it.
    fn named(&mut self, name: &str) -> u32 {
        assert_eq!(self.word(), Some(name));
        self.number()
    }

    fn item<P: Profile>(&mut self) -> Option<ContentItem<P>> {
        Some(match self.word()? {
            "nil" => ContentItem::Plain(Value::nil()),
            "int" => ContentItem::Plain(Value::int(self.word().unwrap().parse().unwrap())),
            "float" => ContentItem::Plain(Value::float(self.word().unwrap().parse().unwrap())),
            "string" => ContentItem::Plain(Value::string(self.number() as u16)),
            "function" => ContentItem::Function(self.number() as u16),
            "table" => ContentItem::Table(self.number() as u8),
            "text" => ContentItem::Text(0),
            word => panic!("{word} is no value"),
        })
    }

    fn value<P: Profile>(&mut self, name: &str) -> Value<P> {
        assert_eq!(self.word(), Some(name));
        match self.item() {
            Some(ContentItem::Plain(value)) => value,
            item => panic!("{item:?}"),
        }
    }
}

/// As the document writes it.
fn shown<P: Profile>(value: Value<P>) -> String {
    match (value.as_number(), value.as_string()) {
        (Some(Number::Int(number)), _) => format!("int {number}"),
        (Some(Number::Float(number)), _) => format!("float {number}"),
        (_, Some(number)) => format!("string {number}"),
        _ => "nil".to_owned(),
    }
}

fn written<P: Profile>(text: &str) -> Vec<u8> {
    let (kind, fields) = text.split_once(": ").expect("a kind");
    let mut words = Words::of(fields);
    let content;
    let message = match kind {
        "broadcast" => Message::Broadcast {
            robot: words.named("robot") as u16,
            topic: words.value::<P>("topic").as_string().unwrap(),
            value: words.value::<P>("value"),
        },
        "entry" => Message::Entry(StigmergyEntry {
            stigmergy: words.named("stigmergy") as u16,
            owner: words.named("owner") as u16,
            clock: words.named("clock"),
            key: words.value("key"),
            value: words.value("value"),
        }),
        "beacon" => Message::Beacon { robot: words.named("robot") as u16 },
        "digest" => {
            let robot = words.named("robot") as u16;
            Message::Digest { robot, digest: words.named("sum"), floor: words.named("floor") }
        }
        "swarms" => {
            let robot = words.named("robot") as u16;
            let mut swarms = Swarms::default();
            while let Some(word) = words.word() {
                let joined = word == "in";
                if !joined {
                    assert_eq!((word, words.word()), ("not", Some("in")));
                }
                assert!(swarms.push(words.number() as u16, joined));
            }
            Message::Swarms { robot, swarms }
        }
        "fragment" => {
            let (robot, number) = (words.named("robot") as u16, words.named("number") as u8);
            let index = words.named("index") as u8;
            let last = fields.contains("last");
            let (_, rest) = fields.split_once("content ").unwrap();
            content = bytes(&format!("`{rest}`")).unwrap();
            Message::Fragment(Fragment { robot, number, index, last, content: &content })
        }
        kind => panic!("{kind} is no kind"),
    };
    let mut frame = [0; 20];
    let length = message.encode(SCRIPT, &mut frame).expect("a frame");
    frame[..length].to_vec()
}

fn read<P: Profile>(frame: &[u8]) -> String {
    match Message::<P>::decode(frame, SCRIPT).expect("a message") {
        Message::Broadcast { robot, topic, value } => {
            format!("broadcast: robot {robot}, topic string {topic}, value {}", shown(value))
        }
        Message::Entry(StigmergyEntry { stigmergy, owner, clock, key, value }) => format!(
            "entry: stigmergy {stigmergy}, owner {owner}, clock {clock}, key {}, value {}",
            shown(key),
            shown(value)
        ),
        Message::Beacon { robot } => format!("beacon: robot {robot}"),
        Message::Digest { robot, digest, floor } => {
            format!("digest: robot {robot}, sum {digest}, floor {floor}")
        }
        Message::Swarms { robot, swarms } => {
            let mut text = format!("swarms: robot {robot}");
            assert_eq!(swarms.iter().count(), usize::from(swarms.count()));
            for (id, joined) in swarms.iter() {
                write!(text, ", {}in {id}", if joined { "" } else { "not " }).unwrap();
            }
            text
        }
        Message::Fragment(Fragment { robot, number, index, last, content }) => {
            let last = if last { ", last" } else { "" };
            let mut text =
                format!("fragment: robot {robot}, number {number}, index {index}{last}, content");
            content.iter().for_each(|byte| write!(text, " {byte:02x}").unwrap());
            text
        }
    }
}

#[test]
fn frames_are_as_documented() {
    let rows = rows("Frame");
    for [text, tiny, full] in &rows {
        let (tiny, full) = (bytes(tiny).unwrap(), bytes(full).unwrap());
        assert_eq!(written::<Tiny>(text), tiny, "{text}");
        assert_eq!(written::<Full>(text), full, "{text}");
        assert_eq!(read::<Tiny>(&tiny), *text);
        assert_eq!(read::<Full>(&full), *text);
        // More than the frame.
        if !text.starts_with("fragment") {
            assert_eq!(read::<Tiny>(&[&tiny[..], &[1, 2, 3]].concat()), *text);
            assert_eq!(read::<Full>(&[&full[..], &[1, 2, 3]].concat()), *text);
        }
    }
    for kind in [
        FrameKind::Broadcast,
        FrameKind::Entry,
        FrameKind::Beacon,
        FrameKind::Digest,
        FrameKind::Swarms,
        FrameKind::Fragment,
    ] {
        let is_of =
            |[_, tiny, _]: &&[&str; 3]| FrameKind::of(bytes(tiny).unwrap()[0]) == Some(kind);
        assert!(rows.iter().any(|row| is_of(&row)), "{kind:?}");
    }
}

fn content<P: Profile>(text: &str) -> Vec<u8> {
    let (kind, fields) = text.split_once(": ").expect("a kind");
    let mut words = Words::of(fields);
    let head = match kind {
        "broadcast" => Head::Broadcast,
        "entry" => Head::Entry {
            stigmergy: words.named("stigmergy") as u16,
            owner: words.named("owner") as u16,
            clock: words.named("clock"),
            digest: words.named("digest") as u16,
        },
        kind => panic!("{kind} is no kind"),
    };
    let mut room = [0; 64];
    let mut writer = ContentWriter::new(&mut room, SCRIPT, head);
    while let Some(item) = words.item::<P>() {
        if let ContentItem::Text(_) = item {
            let text = words.word().unwrap();
            writer.item::<P>(ContentItem::Text(text.len() as u8));
            text.bytes().for_each(|byte| writer.byte(byte));
        } else {
            writer.item(item);
        }
    }
    let length = writer.finish().expect("room");
    room[..length].to_vec()
}

fn read_content<P: Profile>(content: &[u8]) -> String {
    let (head, mut reader) = ContentReader::new(content, SCRIPT);
    reader.check::<P>(|_| {}).expect("a content");
    let mut text = match head {
        Head::Broadcast => "broadcast:".to_owned(),
        Head::Entry { stigmergy, owner, clock, digest } => {
            format!("entry: stigmergy {stigmergy}, owner {owner}, clock {clock}, digest {digest},")
        }
    };
    let mut left = 2;
    let mut top = 0;
    while left > 0 {
        left -= 1;
        top += 1;
        match reader.item::<P>() {
            ContentItem::Plain(value) => write!(text, " {}", shown(value)).unwrap(),
            ContentItem::Function(number) => write!(text, " function {number}").unwrap(),
            ContentItem::Table(pairs) => {
                write!(text, " table {pairs}").unwrap();
                left += 2 * pairs;
            }
            ContentItem::Text(length) => {
                text.push_str(" text ");
                (0..length).for_each(|_| text.push(char::from(reader.byte())));
            }
        }
        if top == 1 {
            text.push(',');
        }
    }
    text
}

#[test]
fn contents_are_as_documented() {
    for [text, tiny, full] in rows("Content") {
        if let Some(tiny) = bytes(tiny) {
            assert_eq!(content::<Tiny>(text), tiny, "{text}");
            assert_eq!(read_content::<Tiny>(&tiny), text);
        }
        let full = bytes(full).unwrap();
        assert_eq!(content::<Full>(text), full, "{text}");
        assert_eq!(read_content::<Full>(&full), text);
    }
}
