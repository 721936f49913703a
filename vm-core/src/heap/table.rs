//! Tables: keys 0, 1, 2, ... as an array, all others as pairs.
//!
//! The array holds keys 0 to length - 1; nil in it is a gap. A key joins it when it equals the length and is not yet a
//! pair; entries never move between array and pairs, so an iteration survives any change of the table.
//!
//! Order of iteration: keys 0, 1, 2, ... up to the first that is missing, wherever they are stored; then the rest of
//! the array, ascending; then the other pairs as they were inserted, an insertion taking the place of the first removed
//! pair if there is one.

use super::{LIVE, NoCell};
use crate::arena::{Arena, CELL};
use crate::number::Profile;
use crate::value::{Tag, Value};

/// Values in an array cell.
const PER_ARRAY: usize = CELL - 1;
/// Slots of a table's head before its pairs.
const HEAD: usize = 3;

/// Position of an iteration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Cursor {
    phase: Phase,
    /// Key, array index or number of the pair to look at next.
    at: u16,
    /// The first key that was missing.
    gap: u16,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Consecutive,
    Array,
    Pairs,
}

impl Cursor {
    /// Before the first entry.
    pub(crate) const START: Cursor = Cursor { phase: Phase::Consecutive, at: 0, gap: 0 };

    /// As two values that may stay on the stack.
    pub(crate) fn pack<P: Profile>(self) -> [Value<P>; 2] {
        // The tag is free to tell the phase; none of these is a heap tag.
        let tag = match self.phase {
            Phase::Consecutive => Tag::INT,
            Phase::Array => Tag::FLOAT,
            Phase::Pairs => Tag::NIL,
        };
        [Value::indexed(tag, self.at), Value::indexed(Tag::INT, self.gap)]
    }

    /// From the values that [`Cursor::pack`] made.
    pub(crate) fn unpack<P: Profile>(first: Value<P>, second: Value<P>) -> Cursor {
        let phase = match first.tag() {
            Tag::INT => Phase::Consecutive,
            Tag::FLOAT => Phase::Array,
            _ => Phase::Pairs,
        };
        Cursor { phase, at: first.index() as u16, gap: second.index() as u16 }
    }
}

impl<P: Profile, const SLOTS: usize> Arena<P, SLOTS> {
    /// A new empty table.
    pub(crate) fn new_table(&mut self) -> Result<Value<P>, NoCell> {
        let cell = self.take_cell(LIVE).ok_or(NoCell)?;
        self.set(cell + 2, Value::int(0));
        Ok(Value::indexed(Tag::TABLE, cell as u16))
    }

    #[inline(always)]
    fn array_length(&self, table: usize) -> usize {
        self.get(table + 2).index()
    }

    /// Slot of array element `index`, which is below the length.
    #[inline(always)]
    fn array_slot(&self, table: usize, mut index: usize) -> usize {
        let mut cell = self.get(table + 1).index();
        while index >= PER_ARRAY {
            cell = self.link(cell);
            index -= PER_ARRAY;
        }
        cell + 1 + index
    }

    /// The key as an array index, if it is an integer that could be one.
    #[inline(always)]
    fn array_index(key: Value<P>) -> Option<usize> {
        if !key.is(Tag::INT) {
            return None;
        }
        let index = key.index();
        // In `tiny` a negative key reads as 0x8000 or more, above every length.
        if P::FULL && P::int_to_i32(key.raw()) as u32 > 0xffff { None } else { Some(index) }
    }

    /// The slot of the key of that pair. A `key` of nil finds the first pair that is free.
    #[inline(never)]
    fn find_pair(&self, table: usize, key: Value<P>) -> Option<usize> {
        let mut at = table + HEAD;
        let mut end = table + CELL;
        let mut next = self.link(table);
        loop {
            while at < end {
                let here = self.get(at);
                if here.same(key) || self.same_text(here, key) {
                    return Some(at);
                }
                at += 2;
            }
            if next == 0 {
                return None;
            }
            at = next + 1;
            end = next + CELL;
            next = self.link(next);
        }
    }

    /// The value under a key (normalised), nil if there is none.
    #[inline(never)]
    pub(crate) fn table_get(&self, table: usize, key: Value<P>) -> Value<P> {
        if let Some(index) = Self::array_index(key)
            && index < self.array_length(table)
        {
            return self.get(self.array_slot(table, index));
        }
        match self.find_pair(table, key) {
            Some(slot) if !key.is_nil() => self.get(slot + 1),
            _ => Value::nil(),
        }
    }

    /// Stores a value under a key (normalised, not nil); nil removes. Changes nothing if it fails, and cannot fail
    /// where the key is there already.
    #[inline(never)]
    pub(crate) fn table_set(
        &mut self,
        table: usize,
        key: Value<P>,
        value: Value<P>,
    ) -> Result<(), NoCell> {
        let length = self.array_length(table);
        let index = Self::array_index(key);
        if let Some(index) = index
            && index < length
        {
            let slot = self.array_slot(table, index);
            self.set(slot, value);
            if value.is_nil() && index + 1 == length {
                self.shorten(table, index);
            }
            return Ok(());
        }
        if let Some(slot) = self.find_pair(table, key) {
            self.set(slot + 1, value);
            if value.is_nil() {
                self.set(slot, Value::nil());
            }
            return Ok(());
        }
        if value.is_nil() {
            return Ok(());
        }
        if index == Some(length) {
            return self.append(table, length, value);
        }
        let slot = match self.find_pair(table, Value::nil()) {
            Some(slot) => slot,
            None => self.extend(table)? + 1,
        };
        self.set(slot, key);
        self.set(slot + 1, value);
        Ok(())
    }

    /// Adds element `length` to the array.
    fn append(&mut self, table: usize, length: usize, value: Value<P>) -> Result<(), NoCell> {
        let slot = if length == 0 {
            let cell = self.take_cell(LIVE).ok_or(NoCell)?;
            self.set(table + 1, Value::indexed(Tag::CHAIN, cell as u16));
            cell + 1
        } else {
            let last = self.array_slot(table, length - 1);
            // The element before stands in the last slot of its cell if the array is a whole number of cells.
            if length.is_multiple_of(PER_ARRAY) {
                let cell = self.take_cell(LIVE).ok_or(NoCell)?;
                self.set_link(last + 1 - CELL, cell);
                cell + 1
            } else {
                last + 1
            }
        };
        self.set(slot, value);
        self.set(table + 2, Value::int(length as i32 + 1));
        Ok(())
    }

    /// Element `length` was removed and was the last: the array ends before it and before any gaps there.
    fn shorten(&mut self, table: usize, mut length: usize) {
        while length > 0 && self.get(self.array_slot(table, length - 1)).is_nil() {
            length -= 1;
        }
        self.set(table + 2, Value::int(length as i32));
        // Lets go of the cells that are empty now.
        if length == 0 {
            self.set(table + 1, Value::nil());
        } else {
            let last = self.array_slot(table, (length - 1) / PER_ARRAY * PER_ARRAY);
            self.set_link(last - 1, 0);
        }
    }

    /// Adds a cell of pairs to the end of the chain.
    fn extend(&mut self, table: usize) -> Result<usize, NoCell> {
        let cell = self.take_cell(LIVE).ok_or(NoCell)?;
        let mut last = table;
        loop {
            let next = self.link(last);
            if next == 0 {
                break;
            }
            last = next;
        }
        self.set_link(last, cell);
        Ok(cell)
    }

    /// The slot of the key of pair number `number`.
    fn pair_slot(&self, table: usize, number: usize) -> Option<usize> {
        const IN_HEAD: usize = (CELL - HEAD) / 2;
        const IN_CELL: usize = (CELL - 1) / 2;
        if number < IN_HEAD {
            return Some(table + HEAD + 2 * number);
        }
        let mut number = number - IN_HEAD;
        let mut cell = self.link(table);
        while number >= IN_CELL && cell != 0 {
            cell = self.link(cell);
            number -= IN_CELL;
        }
        if cell == 0 { None } else { Some(cell + 1 + 2 * number) }
    }

    /// The next entry of an iteration.
    #[inline(never)]
    pub(crate) fn table_next(
        &self,
        table: usize,
        cursor: &mut Cursor,
    ) -> Option<(Value<P>, Value<P>)> {
        if cursor.phase == Phase::Consecutive {
            let key = Value::indexed(Tag::INT, cursor.at);
            let value = self.table_get(table, key);
            if !value.is_nil() {
                cursor.at = cursor.at.wrapping_add(1);
                return Some((key, value));
            }
            cursor.gap = cursor.at;
            cursor.phase = Phase::Array;
        }
        if cursor.phase == Phase::Array {
            while (cursor.at as usize) < self.array_length(table) {
                let index = cursor.at;
                cursor.at = index.wrapping_add(1);
                let value = self.get(self.array_slot(table, index as usize));
                if !value.is_nil() {
                    return Some((Value::indexed(Tag::INT, index), value));
                }
            }
            cursor.phase = Phase::Pairs;
            cursor.at = 0;
        }
        loop {
            let slot = self.pair_slot(table, cursor.at as usize)?;
            cursor.at = cursor.at.wrapping_add(1);
            let key = self.get(slot);
            let visited = matches!(Self::array_index(key), Some(i) if i < cursor.gap as usize);
            if !key.is_nil() && !visited {
                return Some((key, self.get(slot + 1)));
            }
        }
    }

    /// How many entries.
    pub(crate) fn table_size(&self, table: usize) -> usize {
        let mut size = 0;
        let mut cursor = Cursor::START;
        while self.table_next(table, &mut cursor).is_some() {
            size += 1;
        }
        size
    }

    #[cfg(not(feature = "strings"))]
    #[inline(always)]
    pub(crate) fn same_text(&self, _: Value<P>, _: Value<P>) -> bool {
        false
    }
}
