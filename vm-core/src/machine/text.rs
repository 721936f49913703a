//! Text of strings, constant or made at run time, and the library `string`.

use core::cmp::Ordering;

use super::Vm;
use crate::builtin::{self, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::heap::TextBuilder;
use crate::number::{self, Number, Profile};
use crate::value::{Tag, Value};
use crate::verify;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    pub(super) fn is_text(&self, value: Value<P>) -> bool {
        value.is(Tag::STRING) || value.is(Tag::TEXT)
    }

    /// Offset and length of the text of a string of the script.
    fn constant(&self, number: u16) -> Option<(usize, usize)> {
        let program = self.program.as_ref()?;
        if !verify::has_text(program.header()) {
            return None;
        }
        let mut at = usize::from(program.header().text_at);
        let mut left = number.checked_sub(string::COUNT)?;
        loop {
            let first = usize::from(program.code.byte(at));
            let (length, start) = if first < 0x80 {
                (first, at + 1)
            } else {
                ((first & 0x7f) << 8 | usize::from(program.code.byte(at + 1)), at + 2)
            };
            if left == 0 {
                return Some((start, length));
            }
            left -= 1;
            at = start + length;
        }
    }

    /// The text of one of the machine's own strings.
    fn own(number: u16) -> Option<&'static [u8]> {
        builtin::STRINGS.get(usize::from(number)).map(|text| text.as_bytes())
    }

    /// Length of a string in bytes.
    pub(crate) fn text_length(&self, value: Value<P>) -> usize {
        match (value.tag(), Self::own(value.index() as u16)) {
            (Tag::TEXT, _) => self.arena.made_text_length(value.index()),
            (_, Some(text)) => text.len(),
            _ => self.constant(value.index() as u16).map_or(0, |(_, length)| length),
        }
    }

    /// Byte `index` of a string, 0 if it has not so many.
    pub(crate) fn text_byte(&self, value: Value<P>, index: usize) -> u8 {
        match (value.tag(), Self::own(value.index() as u16)) {
            (Tag::TEXT, _) => self.arena.made_text_byte(value.index(), index),
            (_, Some(text)) => text.get(index).copied().unwrap_or(0),
            _ => match (self.constant(value.index() as u16), &self.program) {
                (Some((start, length)), Some(program)) if index < length => {
                    program.code.byte(start + index)
                }
                _ => 0,
            },
        }
    }

    pub(super) fn order_of_texts(&self, a: Value<P>, b: Value<P>) -> Ordering {
        let (a_length, b_length) = (self.text_length(a), self.text_length(b));
        for index in 0..a_length.min(b_length) {
            let order = self.text_byte(a, index).cmp(&self.text_byte(b, index));
            if order != Ordering::Equal {
                return order;
            }
        }
        a_length.cmp(&b_length)
    }

    /// Begins a text and puts it on the stack, so that a collection finds it.
    fn begin_text(&mut self) -> Result<TextBuilder, Stopped> {
        self.reserve()?;
        let text = self.allocate(|vm| vm.arena.new_text())?;
        self.set_top(self.arena.built(&text));
        Ok(text)
    }

    fn add(&mut self, text: &mut TextBuilder, byte: u8) -> Result<(), Stopped> {
        self.allocate(|vm| vm.arena.text_push(text, byte))
    }

    fn add_string(&mut self, text: &mut TextBuilder, value: Value<P>) -> Result<(), Stopped> {
        self.add_part(text, value, 0, self.text_length(value))
    }

    fn add_part(
        &mut self,
        text: &mut TextBuilder,
        value: Value<P>,
        from: usize,
        to: usize,
    ) -> Result<(), Stopped> {
        for index in from..to {
            self.add(text, self.text_byte(value, index))?;
        }
        Ok(())
    }

    /// Takes the finished text off the stack. One that equals a constant is that constant.
    fn end_text(&mut self) -> Value<P> {
        let made = self.pop();
        let strings = self.header().map_or(0, |header| header.strings);
        for number in 0..strings.saturating_add(string::COUNT) {
            let constant = Value::string(number);
            if self.text_length(constant) == self.text_length(made)
                && self.order_of_texts(constant, made) == Ordering::Equal
            {
                return constant;
            }
        }
        made
    }

    /// The built-ins of library `string`, on the arguments in slots `first..end`.
    pub(super) fn string_builtin(
        &mut self,
        number: u8,
        first: usize,
        end: usize,
    ) -> Result<Value<P>, Stopped> {
        let a = self.argument(first, end);
        if a.is(Tag::UNSET) {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        if number == builtin::TO_STRING {
            return self.text_of(a);
        }
        if !self.is_text(a) {
            return Err(self.wrong_type(a, a));
        }
        let length = self.text_length(a);
        match number {
            builtin::LENGTH => Ok(Value::int(length as i32)),
            builtin::SUB => {
                let from = self.argument(first + 1, end);
                let to = self.argument(first + 2, end);
                let Some(from_index) = from.as_int() else { return Err(self.wrong_type(from, from)) };
                let to_index = match to.as_int() {
                    Some(index) => index,
                    None if to.is(Tag::UNSET) => i32::MAX,
                    None => return Err(self.wrong_type(to, to)),
                };
                let from = from_index.max(0) as usize;
                if from >= length || to_index < from_index {
                    return Ok(Value::nil());
                }
                let to = (to_index.max(0) as usize).min(length);
                let mut text = self.begin_text()?;
                self.add_part(&mut text, a, from, to)?;
                Ok(self.end_text())
            }
            builtin::CONCAT => {
                if end < first + 2 {
                    return Err(self.fail(FaultCode::MissingArgument));
                }
                for slot in first..end {
                    let part = self.arena.get(slot);
                    if !self.is_text(part) {
                        return Err(self.wrong_type(part, part));
                    }
                }
                let mut text = self.begin_text()?;
                for slot in first..end {
                    self.add_string(&mut text, self.arena.get(slot))?;
                }
                Ok(self.end_text())
            }
            builtin::STRING_TO_INT => {
                let bytes = (0..length).map(|index| self.text_byte(a, index));
                Ok(number::parse_int(bytes).map_or(Value::nil(), Value::int))
            }
            _ => {
                let bytes = (0..length).map(|index| self.text_byte(a, index));
                Ok(number::parse_float(bytes).map_or(Value::nil(), Value::float))
            }
        }
    }

    /// The string that `log` would print for a value.
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
        Ok(self.end_text())
    }

    fn add_bytes(&mut self, text: &mut TextBuilder, bytes: &[u8]) -> Result<(), Stopped> {
        bytes.iter().try_for_each(|byte| self.add(text, *byte))
    }

    fn add_number(&mut self, text: &mut TextBuilder, number: Number) -> Result<(), Stopped> {
        let mut result = Ok(());
        let mut sink = |byte| {
            if result.is_ok() {
                result = self.add(text, byte);
            }
        };
        match number {
            Number::Int(value) => number::format_int(value, &mut sink),
            Number::Float(value) => number::format_float(value, &mut sink),
        }
        result
    }
}
