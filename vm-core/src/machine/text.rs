//! The text of strings, both constants and those made at run time, and the library `string`.

use core::cmp::Ordering;

use super::{MemoryView, Vm};
use crate::builtin::{self, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::heap::{TextBuilder, TextCursor, TextPart};
use crate::message::content::ContentReader;
use crate::number::{self, Number, Profile, TextWork};
use crate::value::{Tag, Value};

/// The most bytes of a text on a chip. Making a longer one, comparing it or reading its digits would
/// take longer than a slice, and these instructions do not pause.
const TEXT_MAX: usize = 1000;

/// The most slots of a machine on a chip. Larger ones run on computers, and their texts have no limit.
const CHIP_SLOTS_MAX: usize = 4096;

/// A position in a string, from which its next byte is read.
#[derive(Clone, Copy)]
enum Cursor {
    /// The rest of one of the machine's own strings.
    Own(&'static [u8]),
    /// The rest of a constant of the script: its first and end offset in the image.
    Image(usize, usize),
    /// The rest of a text on the heap.
    Made(TextCursor),
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> MemoryView<'_, P, C, SLOTS> {
    /// Returns start and end of the text whose count is at `at` in the image.
    fn image_text(&self, at: usize) -> (usize, usize) {
        let byte = |at: usize| self.program.as_ref().map_or(0, |program| program.code.byte(at));
        let first = usize::from(byte(at));
        let (start, length) = if first < 0x80 {
            (at + 1, first)
        } else {
            (at + 2, (first & 0x7f) << 8 | usize::from(byte(at + 1)))
        };
        (start, start + length)
    }

    /// Returns the offset of the text of the script's first string; `None` if the image has no
    /// text.
    fn first_text(&self) -> Option<usize> {
        let header = self.program?.header();
        header.has_text().then_some(usize::from(header.text_at()))
    }

    /// Returns start and end of the text of a string of the script. Steps over the texts before it.
    fn constant(&self, number: u16) -> Option<(usize, usize)> {
        let mut at = self.first_text()?;
        for _ in 0..number.checked_sub(string::COUNT)? {
            at = self.image_text(at).1;
        }
        Some(self.image_text(at))
    }

    /// Returns the cursor at the first byte of a string.
    fn cursor(&self, value: Value<P>) -> Cursor {
        if value.is(Tag::TEXT) {
            return Cursor::Made(self.arena.text_start(value.index()));
        }
        match builtin::STRINGS.get(value.index()) {
            Some(own) => Cursor::Own(own.as_bytes()),
            None => match self.constant(value.index() as u16) {
                Some((start, end)) => Cursor::Image(start, end),
                None => Cursor::Own(&[]),
            },
        }
    }

    /// Returns the number of bytes left.
    fn left(&self, cursor: &Cursor) -> usize {
        match cursor {
            Cursor::Own(bytes) => bytes.len(),
            Cursor::Image(from, to) => to - from,
            Cursor::Made(made) => made.left(),
        }
    }

    /// Steps over at most `bytes`.
    fn skip(&self, cursor: &mut Cursor, bytes: usize) {
        match cursor {
            Cursor::Own(own) => *own = own.get(bytes..).unwrap_or_default(),
            Cursor::Image(from, to) => *from = (*from + bytes).min(*to),
            Cursor::Made(made) => self.arena.text_skip(made, bytes),
        }
    }

    fn next(&self, cursor: &mut Cursor) -> Option<u8> {
        match cursor {
            Cursor::Own(bytes) => {
                let (first, rest) = bytes.split_first()?;
                *bytes = rest;
                Some(*first)
            }
            Cursor::Image(from, to) => {
                if from >= to {
                    return None;
                }
                *from += 1;
                self.program.as_ref().map(|program| program.code.byte(*from - 1))
            }
            Cursor::Made(made) => self.arena.text_next(made),
        }
    }

    /// Returns the length of a string in bytes.
    pub(crate) fn text_length(&self, value: Value<P>) -> usize {
        self.left(&self.cursor(value))
    }

    /// Returns the bytes of a string.
    pub(crate) fn text_bytes(&self, value: Value<P>) -> impl Iterator<Item = u8> {
        let mut cursor = self.cursor(value);
        core::iter::from_fn(move || self.next(&mut cursor))
    }

    /// Returns the number of the constant with the same bytes.
    fn equal_constant(&self, made: Value<P>) -> Option<u16> {
        let made = self.cursor(made);
        for (number, own) in builtin::STRINGS.iter().enumerate() {
            if self.same(made, Cursor::Own(own.as_bytes())) {
                return Some(number as u16);
            }
        }
        let mut at = self.first_text()?;
        for number in 0..self.program?.header().strings() {
            let (start, end) = self.image_text(at);
            if self.same(made, Cursor::Image(start, end)) {
                return Some(string::COUNT + number);
            }
            at = end;
        }
        None
    }

    fn same(&self, mut a: Cursor, mut b: Cursor) -> bool {
        if self.left(&a) != self.left(&b) {
            return false;
        }
        loop {
            match (self.next(&mut a), self.next(&mut b)) {
                (None, None) => return true,
                (one, other) if one != other => return false,
                _ => {}
            }
        }
    }
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    pub(super) fn is_text(&self, value: Value<P>) -> bool {
        value.is(Tag::STRING) || value.is(Tag::TEXT)
    }

    pub(super) fn order_of_texts(&self, a: Value<P>, b: Value<P>) -> Ordering {
        if P::FULL && a.is(Tag::TEXT) && b.is(Tag::TEXT) {
            return self.arena.order_of_texts(a.index(), b.index());
        }
        self.view().text_bytes(a).cmp(self.view().text_bytes(b))
    }

    /// Begins a text and pushes it, so that a collection finds it.
    fn begin_text(&mut self) -> Result<TextBuilder, Stopped> {
        self.reserve(1)?;
        let text = self.allocate(|vm| vm.arena.new_text())?;
        self.set_top(self.arena.built(&text));
        Ok(text)
    }

    #[hot]
    fn add(&mut self, text: &mut TextBuilder, mut part: TextPart) -> Result<(), Stopped> {
        while part.count() != 0 {
            if !self.arena.text_put(text, &mut part) {
                self.allocate(|vm| vm.arena.text_grow(text))?;
            }
        }
        Ok(())
    }

    fn add_byte(&mut self, text: &mut TextBuilder, byte: u8) -> Result<(), Stopped> {
        self.add(text, TextPart::of(byte))
    }

    /// Returns a string of the next `length` bytes of a message.
    pub(super) fn read_text(
        &mut self,
        reader: &mut ContentReader<'_>,
        length: u8,
    ) -> Result<Value<P>, Stopped> {
        let mut text = self.begin_text()?;
        for _ in 0..length {
            self.add_byte(&mut text, reader.byte())?;
        }
        Ok(self.end_text(&text))
    }

    /// Appends bytes `from..to` of a string.
    fn add_part(
        &mut self,
        text: &mut TextBuilder,
        value: Value<P>,
        from: usize,
        to: usize,
    ) -> Result<(), Stopped> {
        let mut cursor = self.view().cursor(value);
        self.view().skip(&mut cursor, from);
        let mut left = self.view().left(&cursor).min(to - from);
        let is_on_chip = self.arena.top() <= CHIP_SLOTS_MAX;
        if is_on_chip && text.length() + left > TEXT_MAX {
            return Err(self.fail(FaultCode::TextTooLong));
        }
        self.charge(left);
        // Most long texts were made at run time.
        if let Cursor::Made(made) = &mut cursor {
            while left != 0 {
                let part = self.arena.text_part(made, left);
                left -= part.count();
                self.add(text, part)?;
            }
            return Ok(());
        }
        while left != 0
            && let Some(byte) = self.view().next(&mut cursor)
        {
            left -= 1;
            self.add_byte(text, byte)?;
        }
        Ok(())
    }

    /// Charges the time of text to the budget, so that a slice with much text takes no longer than
    /// any other. A byte takes about the time of two instructions.
    fn charge(&mut self, bytes: usize) {
        let instructions = u16::try_from(2 * bytes).unwrap_or(u16::MAX);
        self.work.add(instructions);
    }

    /// Takes the finished text off the stack. Returns the constant with the same bytes in its
    /// place, if there is one, so that no text has the bytes of a constant.
    fn end_text(&mut self, text: &TextBuilder) -> Value<P> {
        self.arena.text_end(text);
        let made = self.pop();
        self.view().equal_constant(made).map_or(made, Value::string)
    }

    /// Computes a built-in of the library `string` from the `count` topmost values.
    pub(super) fn string_builtin(&mut self, number: u8, count: u8) -> Result<Value<P>, Stopped> {
        let a = self.argument(0, count);
        if number == builtin::TO_STRING {
            return self.text_of(a);
        }
        if !self.is_text(a) {
            return Err(self.wrong_type(a, a));
        }
        match number {
            builtin::LENGTH => Ok(Value::int(self.view().text_length(a) as i32)),
            builtin::SUB => {
                let from = self.argument(1, count);
                let to = self.argument(2, count);
                self.substring(a, from, to)
            }
            builtin::CONCAT => {
                if count < 2 {
                    return Err(self.fail(FaultCode::MissingArgument));
                }
                let end = usize::from(self.sp);
                let first = end - usize::from(count);
                for slot in first..end {
                    let part = self.arena.get(slot);
                    if !self.is_text(part) {
                        return Err(self.wrong_type(part, part));
                    }
                }
                let mut text = self.begin_text()?;
                for slot in first..end {
                    self.add_part(&mut text, self.arena.get(slot), 0, usize::MAX)?;
                }
                Ok(self.end_text(&text))
            }
            builtin::STRING_TO_INT => {
                Ok(number::parse_int(self.view().text_bytes(a)).map_or(Value::nil(), Value::int))
            }
            _ => {
                Ok(number::parse_float(self.view().text_bytes(a))
                    .map_or(Value::nil(), Value::float))
            }
        }
    }

    /// Computes `string.sub(s, from[, to])`.
    fn substring(
        &mut self,
        text: Value<P>,
        from: Value<P>,
        to: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        let Some(from_index) = from.as_int() else { return Err(self.wrong_type(from, from)) };
        let to_index = match to.as_int() {
            Some(index) => index,
            None if to.is(Tag::UNSET) => i32::MAX,
            None => return Err(self.wrong_type(to, to)),
        };
        let first = from_index.max(0) as usize;
        if first >= self.view().text_length(text) || to_index < from_index {
            return Ok(Value::nil());
        }
        let mut part = self.begin_text()?;
        self.add_part(&mut part, text, first, to_index.max(0) as usize)?;
        Ok(self.end_text(&part))
    }

    /// Returns the string that `log` would print for a value.
    fn text_of(&mut self, value: Value<P>) -> Result<Value<P>, Stopped> {
        if self.is_text(value) {
            return Ok(value);
        }
        let mut text = self.begin_text()?;
        match (value.as_number(), value.tag()) {
            (Some(number), _) => self.add_number(&mut text, number)?,
            (None, Tag::NIL) => self.add_bytes(&mut text, b"[nil]")?,
            (None, Tag::TABLE) => {
                let size = self.table_size(value) as i32;
                self.add_bytes(&mut text, b"[table with ")?;
                self.add_number(&mut text, Number::Int(size))?;
                self.add_bytes(&mut text, b" elems]")?;
            }
            _ => self.add_bytes(&mut text, b"[closure]")?,
        }
        Ok(self.end_text(&text))
    }

    fn add_bytes(&mut self, text: &mut TextBuilder, bytes: &[u8]) -> Result<(), Stopped> {
        bytes.iter().try_for_each(|byte| self.add_byte(text, *byte))
    }

    fn add_number(&mut self, text: &mut TextBuilder, number: Number) -> Result<(), Stopped> {
        let mut result = Ok(());
        let mut sink = |byte| {
            if result.is_ok() {
                result = self.add_byte(text, byte);
            }
        };
        match number {
            Number::Int(value) => number::format_int(value, &mut sink),
            Number::Float(value) => number::format_float(value, &mut sink),
        }
        result
    }
}
