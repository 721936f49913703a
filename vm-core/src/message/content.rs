//! The content of messages that are too long for one frame: a check, the kind of the message, and
//! values as items.
//!
//! An item stands for a value. For a table, an item holds only the number of pairs of items that
//! follow, because the machine walks through the heap itself.

use core::slice;

use super::check::wide_crc16;
use super::{CLOCK_MAX, Ignored, ScriptIdentity, crc16};
use crate::number::wide::IS_WIDE;
use crate::number::{Profile, Word};
use crate::value::{Tag, Value};

/// The kind of message in a content.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Head {
    /// `neighbors.broadcast`: topic and value follow.
    Broadcast,
    /// An entry of a stigmergy: key and value follow.
    Entry {
        /// Number of the stigmergy.
        stigmergy: u16,
        /// The robot that wrote the value.
        owner: u16,
        /// The time of the put on the Lamport clock, at most [`CLOCK_MAX`].
        clock: u32,
        /// The digest of key and value, as written by the robot that put them. It travels with the
        /// entry, since a robot that has read a table may write it in another order.
        digest: u16,
    },
}

/// A value, or the start of a text or a table.
#[derive(Clone, Copy, Debug)]
pub enum ContentItem<P: Profile> {
    /// nil, a number or a constant string.
    Plain(Value<P>),
    /// A string made at run time: this number of bytes follows.
    Text(u8),
    /// A table: this number of pairs of items follows, key and value.
    Table(u8),
    /// A function without captured values, by its number. The number is not checked against the
    /// script.
    Function(u16),
}

pub(super) const BROADCAST: u8 = 0;
const ENTRY: u8 = 1;
pub(super) const TEXT: u8 = 4;
const TABLE: u8 = 5;
const FUNCTION: u8 = 6;

/// Bytes of the check.
const CHECK: usize = 2;
/// The number of bytes before the key of an entry.
const ENTRY_HEAD: usize = CHECK + 10;

/// Returns the digest of key and value in a content that was written as an entry.
pub fn digest(content: &[u8]) -> u16 {
    let items = content.get(ENTRY_HEAD..).unwrap_or(&[]);
    items.iter().fold(0xffff, |check, byte| crc16(check, *byte))
}

/// Writes a content: its head, then items.
#[derive(Debug)]
pub struct ContentWriter<'a> {
    room: &'a mut [u8],
    /// The number of bytes written, including those for which there was no room.
    length: usize,
    /// The low bits of the script's hash.
    hash: u16,
}

impl<'a> ContentWriter<'a> {
    /// Begins a content in the buffer `room`.
    pub fn new(room: &'a mut [u8], script: ScriptIdentity, head: Head) -> Self {
        let mut writer = ContentWriter { room, length: CHECK, hash: script.hash as u16 };
        match head {
            Head::Broadcast => writer.byte(BROADCAST),
            Head::Entry { stigmergy, owner, clock, digest } => {
                writer.byte(ENTRY);
                writer.number(stigmergy);
                writer.number(owner);
                writer.number(clock as u16);
                writer.byte((clock >> 16) as u8);
                writer.number(digest);
            }
        }
        writer
    }

    /// Writes the next item.
    #[hot]
    pub fn item<P: Profile>(&mut self, item: ContentItem<P>) {
        match item {
            ContentItem::Plain(value) => {
                let offset = if value.is(Tag::STRING) { self.hash } else { 0 };
                let [b0, b1] = P::raw_to_u16(value.raw()).wrapping_add(offset).to_le_bytes();
                let [_, _, b2, b3] = value.raw().to_u32().to_le_bytes();
                let tag = value.tag().byte();
                match () {
                    () if value.is_nil() => self.byte(tag),
                    () if P::FULL => self.bytes([tag, b0, b1, b2, b3]),
                    () => self.bytes([tag, b0, b1]),
                }
            }
            ContentItem::Text(length) => {
                self.byte(TEXT);
                self.byte(length);
            }
            ContentItem::Table(pairs) => {
                self.byte(TABLE);
                self.byte(pairs);
            }
            ContentItem::Function(number) => {
                self.byte(FUNCTION);
                self.number(number);
            }
        }
    }

    /// Writes the next byte of a text.
    pub fn byte(&mut self, byte: u8) {
        self.bytes([byte]);
    }

    fn number(&mut self, number: u16) {
        self.bytes(number.to_le_bytes());
    }

    #[one_copy]
    fn bytes<const N: usize>(&mut self, bytes: [u8; N]) {
        let room = self.room.get_mut(self.length..).unwrap_or(&mut []);
        if let Some(room) = room.first_chunk_mut() {
            *room = bytes;
        }
        self.length = self.length.saturating_add(N);
    }

    /// Returns the number of bytes written, including the check.
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// Adds one to a byte that was already written.
    pub(crate) fn increment(&mut self, at: usize) {
        if let Some(byte) = self.room.get_mut(at) {
            *byte = byte.wrapping_add(1);
        }
    }

    /// Returns true if there was room for everything that was written.
    pub fn fits(&self) -> bool {
        self.length <= self.room.len()
    }

    /// Writes the check and returns the length of the content in bytes; `None` if there is no room
    /// for it.
    pub fn finish(self) -> Option<usize> {
        let (place, checked) = self.room.get_mut(..self.length)?.split_first_chunk_mut()?;
        let hash = self.hash;
        let check =
            if IS_WIDE { wide_crc16(hash, checked) } else { check_of(checked.iter(), hash) };
        *place = check.to_le_bytes();
        Some(self.length)
    }
}

/// Returns the check of a content's bytes, which starts from the low bits of the script's hash.
#[one_copy]
fn check_of<'a>(bytes: impl Iterator<Item = &'a u8>, hash: u16) -> u16 {
    bytes.fold(hash, |check, byte| crc16(check, *byte))
}

/// Reads a content.
#[derive(Clone, Debug)]
pub struct ContentReader<'a> {
    rest: slice::Iter<'a, u8>,
    /// The bytes after the check. The check covers those of them that belong to the head and the
    /// items.
    checked: &'a [u8],
    /// The low bits of the script's hash.
    hash: u16,
    /// The number of constant strings.
    strings: u16,
    /// The check that the content carries.
    expected: u16,
    wrong: Option<Ignored>,
}

impl<'a> ContentReader<'a> {
    /// Begins to read a complete content, which more bytes may follow. If [`ContentReader::check`]
    /// accepts it, [`ContentReader::item`] returns the items that were written.
    #[one_copy]
    pub fn new(content: &'a [u8], script: ScriptIdentity) -> (Head, Self) {
        let hash = script.hash as u16;
        let (rest, strings) = (content.iter(), script.strings);
        let mut reader =
            ContentReader { rest, checked: &[], hash, strings, expected: 0, wrong: None };
        reader.expected = reader.number();
        reader.checked = reader.rest.as_slice();
        let head = match reader.byte() {
            BROADCAST => Head::Broadcast,
            ENTRY => {
                let (stigmergy, owner) = (reader.number(), reader.number());
                let clock = u32::from(reader.number()) | u32::from(reader.byte()) << 16;
                if clock > CLOCK_MAX {
                    reader.wrong = Some(Ignored::Malformed);
                }
                Head::Entry { stigmergy, owner, clock, digest: reader.number() }
            }
            _ => {
                reader.wrong = Some(Ignored::Malformed);
                Head::Broadcast
            }
        };
        (head, reader)
    }

    /// Fails unless all items are valid and the check is right. Passes each item to `show`; for an
    /// invalid content it may pass only some.
    pub fn check<P: Profile>(&self, mut show: impl FnMut(ContentItem<P>)) -> Result<(), Ignored> {
        let mut reader = self.clone();
        // A content has two values: topic or key, and value. Each item takes at least a byte, so
        // the content ends before `left` can overflow.
        let mut left = 2_usize;
        while left != 0 && reader.wrong.is_none() {
            left -= 1;
            let item = reader.item::<P>();
            match item {
                ContentItem::Text(length) if P::FULL => {
                    for _ in 0..length {
                        reader.byte();
                    }
                }
                ContentItem::Table(pairs) => left += 2 * usize::from(pairs),
                _ => {}
            }
            show(item);
        }
        if let Some(wrong) = reader.wrong {
            return Err(wrong);
        }
        // More bytes may follow the last item.
        let length = self.checked.len() - reader.rest.len();
        let found = if IS_WIDE {
            wide_crc16(self.hash, self.checked.get(..length).unwrap_or(&[]))
        } else {
            check_of(self.checked.iter().take(length), self.hash)
        };
        if found == self.expected { Ok(()) } else { Err(Ignored::Foreign) }
    }

    /// Reads a content of two plain values, or of one plain value and a table of plain ones, into
    /// `values`. Returns the number of values, and true if there is a table. Returns `None` for any
    /// other content, if [`ContentReader::check`] would fail, or if `values` is too short.
    /// Computers read most contents in one pass with this function; robots check them first.
    pub fn plain<P: Profile>(&self, values: &mut [Value<P>]) -> Option<(usize, bool)> {
        let mut rest = self.rest.as_slice();
        let (mut left, mut count, mut has_table) = (2, 0, false);
        while left != 0 {
            let (tag, behind) = rest.split_first()?;
            left -= 1;
            if *tag == TABLE && count == 1 && !has_table {
                let (pairs, behind) = behind.split_first()?;
                (left, has_table, rest) = (2 * usize::from(*pairs), true, behind);
                continue;
            }
            let value = values.get_mut(count)?;
            count += 1;
            if *tag == Tag::NIL.byte() {
                (*value, rest) = (Value::nil(), behind);
                continue;
            }
            let (word, behind) = if P::FULL {
                let (word, behind) = behind.split_first_chunk()?;
                (*word, behind)
            } else {
                let ([low, high], behind) = behind.split_first_chunk()?;
                ([*low, *high, 0, 0], behind)
            };
            rest = behind;
            *value = match *tag {
                1 | 2 => Value::new(Tag::of(*tag), P::literal_from_le(word)),
                3 => self.known(Value::new(Tag::STRING, P::literal_from_le(word)))?,
                _ => return None,
            };
        }
        let length = self.checked.len() - rest.len();
        let found = wide_crc16(self.hash, self.checked.get(..length).unwrap_or(&[]));
        (self.wrong.is_none() && found == self.expected).then_some((count, has_table))
    }

    /// Returns the next item; nil after the last one.
    #[one_copy]
    pub fn item<P: Profile>(&mut self) -> ContentItem<P> {
        let tag = self.byte();
        match tag {
            0..=3 => {
                let mut value = Value::nil();
                if tag != 0 {
                    let [b0, b1] = self.number().to_le_bytes();
                    let [b2, b3] = if P::FULL { self.number().to_le_bytes() } else { [0; 2] };
                    value = Value::new(Tag::of(tag), P::literal_from_le([b0, b1, b2, b3]));
                    if tag == Tag::STRING.byte() {
                        value = self.string(value);
                    }
                }
                ContentItem::Plain(value)
            }
            TEXT if P::FULL => ContentItem::Text(self.byte()),
            TABLE => ContentItem::Table(self.byte()),
            FUNCTION => ContentItem::Function(self.number()),
            _ => {
                self.wrong = Some(Ignored::Malformed);
                ContentItem::Plain(Value::nil())
            }
        }
    }

    /// Returns the string of a word. If the script has no such string, the content is marked as
    /// foreign.
    fn string<P: Profile>(&mut self, word: Value<P>) -> Value<P> {
        let low = P::raw_to_u16(word.raw());
        let number = low.wrapping_sub(self.hash);
        if number >= self.strings || P::raw_from_u16(low) != word.raw() {
            self.wrong.get_or_insert(Ignored::Foreign);
        }
        Value::string(number)
    }

    /// Returns the string of a word; `None` if the script has no such string.
    fn known<P: Profile>(&self, word: Value<P>) -> Option<Value<P>> {
        let low = P::raw_to_u16(word.raw());
        let number = low.wrapping_sub(self.hash);
        let is_known = number < self.strings && P::raw_from_u16(low) == word.raw();
        is_known.then(|| Value::string(number))
    }

    /// Reads the next byte of a text; 0 after the end of the content.
    #[one_copy]
    pub fn byte(&mut self) -> u8 {
        match self.rest.next() {
            Some(byte) => *byte,
            None => {
                self.wrong = Some(Ignored::Malformed);
                0
            }
        }
    }

    #[one_copy]
    fn number(&mut self) -> u16 {
        // One check for both bytes, except at the very end.
        if IS_WIDE && let Some((bytes, rest)) = self.rest.as_slice().split_first_chunk() {
            self.rest = rest.iter();
            return u16::from_le_bytes(*bytes);
        }
        u16::from_le_bytes([self.byte(), self.byte()])
    }
}
