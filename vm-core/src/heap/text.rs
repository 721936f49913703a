//! Strings made at run time, which exist only in the full profile.
//!
//! A text is a chain of cells with four bytes in each slot; the first slot holds the length, and a hash
//! that differs between most texts, so that the search for a key seldom compares their bytes.

use core::cmp::Ordering;

use super::NoCell;
use crate::arena::{Arena, CELL};
use crate::number::Profile;
use crate::slots::Slots;
use crate::value::{Tag, Value};

const SLOT_BYTES: usize = 4;
/// The bits of the length in the first slot. The hash has the others.
const LENGTH_BITS: u32 = 24;
/// The number of bytes in the first cell, after the length.
const IN_HEAD: usize = (CELL - 2) * SLOT_BYTES;
const IN_CELL: usize = (CELL - 1) * SLOT_BYTES;

/// Writes a text byte by byte. The text has its length only after [`Arena::text_end`].
#[derive(Clone, Copy)]
pub(crate) struct TextBuilder {
    head: usize,
    /// The cell that is being filled.
    cell: usize,
    /// The number of bytes still free in this cell.
    room: usize,
    length: usize,
    hash: u32,
}

/// At most four bytes of a text.
#[derive(Clone, Copy)]
pub(crate) struct TextPart {
    /// The bytes, the first one lowest; those after the last one are zero.
    bytes: u32,
    count: usize,
}

impl TextPart {
    pub(crate) fn of(byte: u8) -> Self {
        TextPart { bytes: byte.into(), count: 1 }
    }

    pub(crate) fn count(self) -> usize {
        self.count
    }

    /// Returns the order of two parts that begin at the same offset of their texts.
    fn order(self, other: Self) -> Ordering {
        let bytes = self.bytes.swap_bytes().cmp(&other.bytes.swap_bytes());
        bytes.then(self.count.cmp(&other.count))
    }
}

/// A position in a text.
#[derive(Clone, Copy)]
pub(crate) struct TextCursor {
    cell: usize,
    /// The offset in bytes from the first slot of the cell.
    at: usize,
    left: usize,
}

impl TextCursor {
    /// Returns the number of bytes that follow.
    pub(crate) fn left(&self) -> usize {
        self.left
    }
}

impl TextBuilder {
    /// Returns the number of bytes that it holds now.
    pub(crate) fn length(&self) -> usize {
        self.length
    }
}

impl<P: Profile, S: Slots<P>> Arena<P, S> {
    /// Begins an empty text, which must be on the stack before a collection.
    pub(crate) fn new_text(&mut self) -> Result<TextBuilder, NoCell> {
        let head = self.take_cell()?.get();
        self.set(head + 1, Value::int(0));
        Ok(TextBuilder { head, cell: head, room: IN_HEAD, length: 0, hash: 0 })
    }

    /// Adds a cell to the text. Changes nothing on failure.
    pub(crate) fn text_grow(&mut self, text: &mut TextBuilder) -> Result<(), NoCell> {
        let cell = self.take_cell()?.get();
        self.set_link(text.cell, cell);
        text.cell = cell;
        text.room = IN_CELL;
        Ok(())
    }

    /// Appends bytes to the slot that is being filled, as many as it has room for, and removes them
    /// from `part`. Returns false if the last cell is full.
    #[hot]
    pub(crate) fn text_put(&mut self, text: &mut TextBuilder, part: &mut TextPart) -> bool {
        if text.room == 0 {
            return false;
        }
        let slot = text.cell + CELL - text.room.div_ceil(SLOT_BYTES);
        let used = (SLOT_BYTES - text.room % SLOT_BYTES) % SLOT_BYTES;
        let old = if used == 0 { 0 } else { P::int_to_i32(self.get_fast(slot).raw()) as u32 };
        self.set_fast(slot, Value::int((old | part.bytes << (8 * used)) as i32));
        let count = part.count.min(SLOT_BYTES - used);
        for byte in part.bytes.to_le_bytes().iter().take(count) {
            text.hash = text.hash.wrapping_mul(31).wrapping_add(u32::from(*byte));
        }
        part.bytes = part.bytes.checked_shr(8 * count as u32).unwrap_or(0);
        part.count -= count;
        text.room -= count;
        text.length += count;
        true
    }

    /// Completes the text by storing its length and its hash.
    pub(crate) fn text_end(&mut self, text: &TextBuilder) {
        let first = text.length as u32 | text.hash << LENGTH_BITS;
        self.set(text.head + 1, Value::int(first as i32));
    }

    /// Returns the text that is being built.
    pub(crate) fn built(&self, text: &TextBuilder) -> Value<P> {
        Value::indexed(Tag::TEXT, text.head as u16)
    }

    /// Returns the position of the first byte of a text.
    pub(crate) fn text_start(&self, text: usize) -> TextCursor {
        let first = P::int_to_i32(self.get(text + 1).raw()) as u32;
        let length = (first & ((1 << LENGTH_BITS) - 1)) as usize;
        // The first slot after the length.
        TextCursor { cell: text, at: SLOT_BYTES, left: length }
    }

    /// Moves a position forward by at most `bytes`.
    pub(crate) fn text_skip(&self, cursor: &mut TextCursor, bytes: usize) {
        let bytes = bytes.min(cursor.left);
        cursor.left -= bytes;
        cursor.at += bytes;
        while cursor.at > IN_CELL {
            cursor.cell = self.link(cursor.cell);
            cursor.at -= IN_CELL;
        }
    }

    /// Returns the bytes of a text up to the end of a slot, at most `most` of them, and moves the
    /// position after them.
    #[hot]
    pub(crate) fn text_part(&self, cursor: &mut TextCursor, most: usize) -> TextPart {
        if cursor.at == IN_CELL && cursor.left != 0 {
            cursor.cell = self.link(cursor.cell);
            cursor.at = 0;
        }
        let slot = cursor.cell + 1 + cursor.at / SLOT_BYTES;
        let before = cursor.at % SLOT_BYTES;
        let count = (SLOT_BYTES - before).min(cursor.left).min(most);
        let word = P::int_to_i32(self.get_fast(slot).raw()) as u32 >> (8 * before);
        let unused = 8 * (SLOT_BYTES - count) as u32;
        cursor.at += count;
        cursor.left -= count;
        TextPart { bytes: word & u32::MAX.checked_shr(unused).unwrap_or(0), count }
    }

    /// Returns the next byte of a text.
    #[hot]
    pub(crate) fn text_next(&self, cursor: &mut TextCursor) -> Option<u8> {
        if cursor.left == 0 {
            return None;
        }
        if cursor.at == IN_CELL {
            cursor.cell = self.link(cursor.cell);
            cursor.at = 0;
        }
        let slot = cursor.cell + 1 + cursor.at / SLOT_BYTES;
        let word = P::int_to_i32(self.get_fast(slot).raw()) as u32;
        let byte = (word >> (8 * (cursor.at % SLOT_BYTES))) as u8;
        cursor.at += 1;
        cursor.left -= 1;
        Some(byte)
    }

    /// Returns the order of two texts by their bytes.
    pub(crate) fn order_of_texts(&self, a: usize, b: usize) -> Ordering {
        let (mut a, mut b) = (self.text_start(a), self.text_start(b));
        loop {
            let (one, other) =
                (self.text_part(&mut a, SLOT_BYTES), self.text_part(&mut b, SLOT_BYTES));
            let order = one.order(other);
            if order != Ordering::Equal || one.count == 0 {
                return order;
            }
        }
    }

    /// Returns true if both are texts with the same bytes.
    #[hot]
    pub(crate) fn same_text(&self, a: Value<P>, b: Value<P>) -> bool {
        P::FULL && a.is(Tag::TEXT) && b.is(Tag::TEXT) && self.same_bytes(a.index(), b.index())
    }

    #[one_copy]
    fn same_bytes(&self, a: usize, b: usize) -> bool {
        // Unused bytes and slots are zero, so equal texts have equal slots. The first slot is
        // length and hash.
        let (mut a, mut b) = (a, b);
        while (1..CELL)
            .all(|place| self.get_fast(a + place).raw() == self.get_fast(b + place).raw())
        {
            (a, b) = (self.link(a), self.link(b));
            if a == 0 || b == 0 {
                return true;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arena::TestArena;
    use crate::number::Full;

    fn push(memory: &mut TestArena<Full, 400>, text: &mut TextBuilder, byte: u8) {
        let mut part = TextPart::of(byte);
        if !memory.text_put(text, &mut part) {
            memory.text_grow(text).unwrap();
            assert!(memory.text_put(text, &mut part));
        }
    }

    #[test]
    fn holds_every_byte_of_any_length() {
        let mut memory: TestArena<Full, 400> = Arena::full();
        for length in [0, 1, 3, 4, 5, 19, 20, 21, 43, 44, 45, 68, 69, 150] {
            let mut text = memory.new_text().unwrap();
            for index in 0..length {
                push(&mut memory, &mut text, (index * 7 + 200) as u8);
            }
            memory.text_end(&text);
            let mut cursor = memory.text_start(memory.built(&text).index());
            assert_eq!(cursor.left(), length);
            for index in 0..length {
                assert_eq!(
                    memory.text_next(&mut cursor),
                    Some((index * 7 + 200) as u8),
                    "{index} of {length}"
                );
            }
            assert_eq!(memory.text_next(&mut cursor), None);
        }
    }

    #[test]
    fn equal_bytes_are_the_same_text() {
        let mut memory: TestArena<Full, 400> = Arena::full();
        let mut make = |bytes: &[u8]| {
            let mut text = memory.new_text().unwrap();
            bytes.iter().for_each(|byte| push(&mut memory, &mut text, *byte));
            memory.text_end(&text);
            memory.built(&text)
        };
        let (a, b, c, d) = (make(b"swarm"), make(b"swarm"), make(b"swarn"), make(b"swar"));
        assert!(memory.same_text(a, b));
        assert!(!memory.same_text(a, c) && !memory.same_text(a, d));
    }
}
