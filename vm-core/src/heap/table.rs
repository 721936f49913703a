//! Tables: keys 0, 1, 2, ... as an array, all others as pairs.
//!
//! The array holds keys 0 to length - 1; nil in it is a gap. A new key that equals the length
//! extends the array, unless it is already stored as a pair. Entries never move between array and
//! pairs, so an iteration survives any change of the table.
//!
//! Iteration visits the keys 0, 1, 2, ... up to the first that is missing, wherever they are
//! stored; then the rest of the array, ascending; then the other pairs in the order of their
//! insertion. An insertion takes the place of the first removed pair, if there is one.

use core::num::NonZeroUsize;

use super::NoCell;
use crate::arena::{Arena, CELL};
use crate::number::Profile;
use crate::slots::Slots;
use crate::value::{Tag, Value};

/// The number of values in an array cell.
const PER_ARRAY: usize = CELL - 1;
/// The slot of a table's head that leads to the first array cell, as a cell's header leads to the
/// next cell.
const CHAIN: usize = 1;
/// The slot of the array's length.
const LENGTH: usize = 2;
/// The number of slots of a table's head before its pairs.
const HEAD: usize = 3;

/// The number of slots of an iteration: its position, the first key that was missing, and key and
/// value of the current entry. All are nil before the first entry.
///
/// The position has a phase in place of a tag. Its payload is the next key or, in the phase of the
/// pairs, a cell.
pub(crate) const ITERATION: usize = 4;
/// The phase of the keys 0, 1, 2, ...
const CONSECUTIVE: u8 = 0;
/// The phase of the array after the first gap. All other phases are pairs; such a phase is the
/// offset of the next pair in its cell, which is odd.
const BEHIND_GAP: u8 = 2;

/// A visit to the entries of a table: first the array, then the pairs. A table that receives the
/// entries in this order iterates over them in the same order.
pub(crate) struct Visit {
    /// The slot of the next element or pair.
    slot: usize,
    /// The end of the current cell; 0 if there is no array.
    end: usize,
    /// The first cell of the pairs, 0 once they are visited.
    pairs: usize,
    /// The next key of the array, and among the pairs the number of places before.
    index: u16,
}

/// The number of numbers in [`Visit::parts`].
pub(crate) const VISIT: usize = 4;

impl Visit {
    /// A visit without entries.
    pub(crate) const NONE: Self = Visit { slot: 0, end: 0, pairs: 0, index: 0 };

    /// Restores a visit from [`Visit::parts`].
    pub(crate) fn of([slot, end, pairs, index]: [u16; VISIT]) -> Self {
        Visit { slot: slot.into(), end: end.into(), pairs: pairs.into(), index }
    }

    /// Returns the visit as numbers that fit into slots.
    pub(crate) fn parts(&self) -> [u16; VISIT] {
        [self.slot as u16, self.end as u16, self.pairs as u16, self.index]
    }

    /// Returns the number of places that were visited, free ones too.
    pub(crate) fn places(&self) -> u16 {
        self.index
    }

    /// Returns the slot of the value that was visited last.
    pub(crate) fn slot(&self) -> usize {
        self.slot - 1
    }

    /// Continues with a cell, from the slot `first` of it on. Does nothing if there is no cell.
    fn enter(&mut self, cell: usize, first: usize) {
        if cell != 0 {
            self.slot = cell + first;
            self.end = cell + CELL;
        }
    }
}

/// The result of a search among the pairs of a table.
struct PairSearch {
    /// The slot of the key, 0 if there is no such pair.
    found: usize,
    /// The slot of the key of the first free pair, 0 if there is none before the key.
    free: usize,
    /// The last cell that was visited.
    last: usize,
}

impl<P: Profile, S: Slots<P>> Arena<P, S> {
    /// Makes an empty table.
    pub(crate) fn new_table(&mut self) -> Result<Value<P>, NoCell> {
        let cell = self.take_cell()?.get();
        self.set(cell + CHAIN, Value::indexed(Tag::CHAIN, 0));
        self.set(cell + LENGTH, Value::int(0));
        Ok(Value::indexed(Tag::TABLE, cell as u16))
    }

    /// Makes a table with the values of three slots, from `first` on, under constant strings.
    #[one_copy]
    pub(crate) fn new_record(&mut self, keys: [u16; 3], first: usize) -> Result<Value<P>, NoCell> {
        let table = self.new_table()?;
        let more = self.take_cell()?.get();
        self.set_link(table.index(), more);
        let pairs = [table.index() + HEAD, table.index() + HEAD + 2, more + 1];
        for ((key, pair), from) in keys.into_iter().zip(pairs).zip(first..) {
            // A key without a value is not stored.
            if !self.get(from).is_nil() {
                self.set(pair, Value::string(key));
                self.copy(from, pair + 1);
            }
        }
        Ok(table)
    }

    /// Puts pairs into a new table if they fit its head and need no comparison with each other: one
    /// or two pairs, with different constant strings as keys and values that are not nil. Otherwise
    /// returns false and changes nothing.
    pub(crate) fn fill_head(&mut self, table: usize, pairs: &[[Value<P>; 2]]) -> bool {
        let fits = match pairs {
            [[key, _]] => key.is(Tag::STRING),
            [[one, _], [other, _]] => {
                one.is(Tag::STRING) && other.is(Tag::STRING) && !one.same(*other)
            }
            _ => false,
        };
        if !fits || pairs.iter().any(|[_, value]| value.is_nil()) {
            return false;
        }
        for (slot, [key, value]) in (table + HEAD..).step_by(2).zip(pairs) {
            self.set(slot, *key);
            self.set(slot + 1, *value);
        }
        true
    }

    /// Copies a table, with its keys and values in the same order. The copy shares the tables among
    /// the values. The table must be reachable from the stack.
    #[one_copy]
    pub(crate) fn copy_table(&mut self, table: usize) -> Result<Value<P>, NoCell> {
        let copy = self.new_table()?;
        let to = copy.index();
        for place in LENGTH..CELL {
            self.copy(table + place, to + place);
        }
        self.copy_cells(self.link(table), to)?;
        self.copy_cells(self.link(table + CHAIN), to + CHAIN)?;
        Ok(copy)
    }

    /// Copies a chain of cells, and appends it to the cell `last`.
    fn copy_cells(&mut self, mut cell: usize, mut last: usize) -> Result<(), NoCell> {
        while cell != 0 {
            let to = self.take_cell()?.get();
            self.set_link(last, to);
            for place in 1..CELL {
                self.copy(cell + place, to + place);
            }
            (last, cell) = (to, self.link(cell));
        }
        Ok(())
    }

    /// Begins to visit the entries of a table as they are stored.
    pub(crate) fn visit(&self, table: usize) -> Visit {
        let mut visit = Visit { pairs: table, ..Visit::NONE };
        visit.enter(self.link(table + CHAIN), 1);
        visit
    }

    /// Returns the next key and value of a table that does not change during the visit.
    #[one_copy]
    pub(crate) fn next_stored(&self, visit: &mut Visit) -> Option<[Value<P>; 2]> {
        loop {
            // An element of the array has one slot, a pair has two.
            let more = usize::from(visit.pairs == 0);
            let Visit { mut slot, end, mut index, .. } = *visit;
            while slot != end && self.is_nil_at(slot + more) {
                slot += 1 + more;
                index += 1;
            }
            visit.slot = slot + 1 + more;
            visit.index = index + 1;
            if slot != end {
                let key = Value::indexed(Tag::INT, index);
                let key = if more == 0 { key } else { self.get_fast(slot) };
                return Some([key, self.get_fast(slot + more)]);
            }
            visit.index = index;
            let next = if end == 0 { 0 } else { self.link(end - CELL) };
            if next != 0 {
                visit.enter(next, 1);
            } else if more == 0 {
                visit.enter(visit.pairs, HEAD);
                visit.pairs = 0;
            } else {
                return None;
            }
        }
    }

    #[hot]
    fn array_length(&self, table: usize) -> usize {
        self.index_at(table + LENGTH)
    }

    /// Returns the cell of array element `index`, which is at most the length, and the element's
    /// place in it. The cell is 0 if the element needs a new one.
    #[hot]
    fn array_place(&self, table: usize, mut index: usize) -> (usize, usize) {
        let mut cell = self.index_at(table + CHAIN);
        while index >= PER_ARRAY {
            cell = self.link(cell);
            index -= PER_ARRAY;
        }
        (cell, index)
    }

    /// Returns the slot of array element `index`, which is at most the length. The result is 1, as
    /// for cell 0, if the element needs a new cell.
    #[one_copy]
    fn array_slot(&self, table: usize, index: usize) -> usize {
        let (cell, place) = self.array_place(table, index);
        cell + 1 + place
    }

    /// Returns index and slot of the first array element from `index` on that is no gap. The slot
    /// is 0 if there is none.
    #[one_copy]
    fn next_element(&self, table: usize, mut index: usize) -> (usize, usize) {
        let length = self.array_length(table);
        if index < length {
            let (mut cell, mut place) = self.array_place(table, index);
            while index < length {
                if place == PER_ARRAY {
                    cell = self.link(cell);
                    place = 0;
                }
                place += 1;
                if !self.is_nil_at(cell + place) {
                    return (index, cell + place);
                }
                index += 1;
            }
        }
        (index, 0)
    }

    /// Returns the key as an array index, if it is an integer that could be one.
    #[hot]
    fn array_index(key: Value<P>) -> Option<usize> {
        if !key.is(Tag::INT) {
            return None;
        }
        let index = key.index();
        // In `tiny` a negative key reads as 0x8000 or more, above every length.
        if P::FULL && P::int_to_i32(key.raw()) as u32 > 0xffff { None } else { Some(index) }
    }

    /// Returns the slot of the key of a pair, 0 if there is no such pair. With a `key` of nil,
    /// returns the first free pair.
    #[one_copy]
    fn find_pair(&self, table: usize, key: Value<P>) -> usize {
        let mut at = table + HEAD;
        let mut end = table + CELL;
        let mut next = self.link(table);
        loop {
            while at < end {
                let here = self.get_fast(at);
                if here.same(key) || self.same_text(here, key) {
                    return at;
                }
                at += 2;
            }
            if next == 0 {
                return 0;
            }
            at = next + 1;
            end = next + CELL;
            next = self.link(next);
        }
    }

    /// Searches a pair like [`Arena::find_pair`], and finds in the same pass what an insertion of the
    /// key needs: in a large memory each pass over the pairs takes long.
    #[one_copy]
    fn search_pairs(&self, table: usize, key: Value<P>) -> PairSearch {
        let is_text = key.is(Tag::TEXT);
        let mut search = PairSearch { found: 0, free: 0, last: table };
        let mut at = table + HEAD;
        loop {
            let end = search.last + CELL;
            while at < end {
                let tag = self.slots.tag_at(at);
                if tag == key.tag() {
                    let here = self.get_fast(at);
                    if here.same(key) || is_text && self.same_text(here, key) {
                        search.found = at;
                        return search;
                    }
                } else if tag == Tag::NIL && search.free == 0 {
                    search.free = at;
                }
                at += 2;
            }
            let next = self.link(search.last);
            if next == 0 {
                return search;
            }
            search.last = next;
            at = next + 1;
        }
    }

    /// Returns the slot of the value under a constant string, if it is in the table's head or one of the next
    /// `cells` cells; otherwise 0.
    #[hot]
    pub(crate) fn field_in_cells(&self, table: usize, key: Value<P>, cells: u8) -> usize {
        for pair in [table + HEAD, table + HEAD + 2] {
            if self.get_fast(pair).same(key) {
                return pair + 1;
            }
        }
        self.field_after_head(table, key, cells)
    }

    /// Searches the cells after a table's head like [`Arena::field_in_cells`].
    #[one_copy]
    fn field_after_head(&self, table: usize, key: Value<P>, cells: u8) -> usize {
        let mut cell = self.link(table);
        for _ in 0..cells {
            if cell == 0 {
                break;
            }
            for pair in [cell + 1, cell + 3, cell + 5] {
                if self.get_fast(pair).same(key) {
                    return pair + 1;
                }
            }
            cell = self.link(cell);
        }
        0
    }

    /// Returns the slot of an element of the array, if it is in one of the first `cells` cells; otherwise 0.
    #[hot]
    pub(crate) fn element_in_cells(&self, table: usize, index: i32, cells: usize) -> usize {
        let index = index as u32 as usize;
        if index >= self.array_length(table) || index >= cells * PER_ARRAY {
            return 0;
        }
        let (cell, place) = self.array_place(table, index);
        cell + 1 + place
    }

    /// Appends a value that is not nil to the array, if that needs no search and no cell: the index is the length, the
    /// last cell has room and is one of the first `cells`, and the table has no pairs, among which the index could be.
    /// Returns false and changes nothing otherwise.
    #[one_copy]
    pub(crate) fn append_in_cell(
        &mut self,
        table: usize,
        index: i32,
        value: Value<P>,
        cells: usize,
    ) -> bool {
        let length = self.array_length(table);
        let has_room = !length.is_multiple_of(PER_ARRAY) && length < cells * PER_ARRAY;
        let has_pairs = self.link(table) != 0
            || !self.is_nil_at(table + HEAD)
            || !self.is_nil_at(table + HEAD + 2);
        if index as u32 as usize != length || !has_room || has_pairs {
            return false;
        }
        let slot = self.array_slot(table, length);
        self.set_fast(slot, value);
        self.set_fast(table + LENGTH, Value::int(length as i32 + 1));
        true
    }

    /// Returns the value under a normalized key, nil if there is none.
    #[one_copy]
    pub(crate) fn table_get(&self, table: usize, key: Value<P>) -> Value<P> {
        if let Some(index) = Self::array_index(key)
            && index < self.array_length(table)
        {
            return self.get(self.array_slot(table, index));
        }
        self.pair(table, key)
    }

    /// Returns the value of the pair with a normalized key, nil if there is none.
    #[one_copy]
    pub(crate) fn pair(&self, table: usize, key: Value<P>) -> Value<P> {
        let slot = if Self::PAUSES {
            self.search_pairs(table, key).found
        } else {
            self.find_pair(table, key)
        };
        if slot == 0 { Value::nil() } else { self.get_fast(slot + 1) }
    }

    /// Stores a value under a normalized key that is not nil; the value nil removes the key.
    /// Changes nothing on failure, and cannot fail if the table already has the key.
    #[one_copy]
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
                self.shorten(table);
            }
            return Ok(());
        }
        let mut pairs = PairSearch { found: 0, free: 0, last: table };
        let mut slot = if Self::PAUSES {
            pairs = self.search_pairs(table, key);
            pairs.found
        } else {
            self.find_pair(table, key)
        };
        if slot != 0 {
            if value.is_nil() {
                self.set(slot, value);
            }
        } else if value.is_nil() {
            return Ok(());
        } else if index == Some(length) {
            slot = self.array_slot(table, length) - 1;
            if slot == 0 {
                slot = self.extend(table + CHAIN)?.get();
            }
            self.set(table + LENGTH, Value::int(length as i32 + 1));
        } else {
            slot = if Self::PAUSES { pairs.free } else { self.find_pair(table, Value::nil()) };
            if slot == 0 {
                slot = self.extend(pairs.last)?.get() + 1;
            }
            self.set(slot, key);
        }
        self.set(slot + 1, value);
        Ok(())
    }

    /// Shortens the array after its last element was removed: it ends after the last value that is
    /// left, and the later cells are released. Each cell is searched from its end, so a full cell
    /// takes one look.
    #[one_copy]
    fn shorten(&mut self, table: usize) {
        let mut last = table + CHAIN;
        let mut length = 0;
        let mut before = 0;
        let mut cell = self.link(last);
        while cell != 0 {
            let mut place = PER_ARRAY;
            while place != 0 && self.is_nil_at(cell + place) {
                place -= 1;
            }
            if place != 0 {
                last = cell;
                length = before + place;
            }
            before += PER_ARRAY;
            cell = self.link(cell);
        }
        self.set(table + LENGTH, Value::int(length as i32));
        self.set_link(last, 0);
    }

    /// Appends a cell to a chain, and returns it.
    #[one_copy]
    fn extend(&mut self, mut last: usize) -> Result<NonZeroUsize, NoCell> {
        let cell = self.take_cell()?;
        loop {
            let next = self.link(last);
            if next == 0 {
                break;
            }
            last = next;
        }
        self.set_link(last, cell.get());
        Ok(cell)
    }

    /// Moves the iteration in the slots from `iteration` on to its next entry. Returns false if
    /// there is none.
    #[one_copy]
    pub(crate) fn table_next(&mut self, table: usize, iteration: usize) -> bool {
        let place = self.get(iteration);
        let mut phase = place.tag().byte();
        let mut at = place.index();
        loop {
            let key;
            let mut value;
            if phase & 1 == 0 {
                let mut index = at;
                if phase == CONSECUTIVE {
                    value = self.table_get(table, Value::indexed(Tag::INT, at as u16));
                    if value.is_nil() {
                        self.set(iteration + 1, Value::indexed(Tag::INT, at as u16));
                        phase = BEHIND_GAP;
                    }
                } else {
                    let slot;
                    (index, slot) = self.next_element(table, at);
                    if slot == 0 {
                        phase = HEAD as u8;
                        at = table;
                        continue;
                    }
                    value = self.get(slot);
                }
                key = Value::indexed(Tag::INT, index as u16);
                at = index.wrapping_add(1);
            } else {
                if usize::from(phase) >= CELL {
                    at = self.get(at).index();
                    if at == 0 {
                        return false;
                    }
                    phase = 1;
                }
                let slot = at.wrapping_add(usize::from(phase));
                phase = phase.wrapping_add(2);
                key = self.get(slot);
                value = self.get(slot + 1);
                // All consecutive keys were already visited.
                let gap = self.get(iteration + 1).index();
                if matches!(Self::array_index(key), Some(index) if index < gap) {
                    value = Value::nil();
                }
            }
            if !value.is_nil() {
                self.set(iteration, Value::indexed(Tag::of(phase), at as u16));
                self.set(iteration + 2, key);
                self.set(iteration + 3, value);
                return true;
            }
        }
    }

    /// Returns the number of entries. It counts the slots that are not nil: one for each element of
    /// the array, two for each pair, and two of the head itself.
    #[one_copy]
    pub(crate) fn table_size(&self, table: usize) -> usize {
        self.count(self.index_at(table + CHAIN)) + self.count(table) / 2 - 1
    }

    /// Returns the number of slots in a chain of cells that are not nil.
    #[one_copy]
    fn count(&self, mut cell: usize) -> usize {
        let mut count = 0;
        while cell != 0 {
            for at in cell + 1..cell + CELL {
                count += usize::from(!self.is_nil_at(at));
            }
            cell = self.link(cell);
        }
        count
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::arena::TestArena;
    use crate::number::{Full, Tiny};
    use std::vec::Vec;

    type Memory = TestArena<Tiny, 2000>;

    fn key(number: i32) -> Value<Tiny> {
        // Even numbers are integer keys, odd ones strings.
        if number % 2 == 0 { Value::int(number / 2) } else { Value::string(number as u16) }
    }

    /// The slot at which these tests keep an iteration.
    const HERE: usize = 0;

    fn entries(memory: &mut Memory, table: usize) -> Vec<(Value<Tiny>, i32)> {
        memory.fill(HERE, HERE + ITERATION);
        let mut found = Vec::new();
        while memory.table_next(table, HERE) {
            found.push((memory.get(HERE + 2), memory.get(HERE + 3).as_int().unwrap()));
        }
        found
    }

    /// Returns the next number of a small generator, so that runs are the same everywhere.
    fn random(state: &mut u32) -> u32 {
        *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        *state >> 16
    }

    #[test]
    fn keeps_insertion_order_after_the_consecutive_keys() {
        let mut state = 7;
        for round in 0..200 {
            let mut memory = Memory::full();
            let table = memory.new_table().unwrap().index();
            let mut model: Vec<(i32, i32)> = Vec::new();
            for step in 0..random(&mut state) % 60 {
                let number = (random(&mut state) % 40) as i32;
                let value = step as i32 + 1;
                memory.table_set(table, key(number), Value::int(value)).unwrap();
                match model.iter_mut().find(|entry| entry.0 == number) {
                    Some(entry) => entry.1 = value,
                    None => model.push((number, value)),
                }
            }
            let mut expected = Vec::new();
            for index in 0.. {
                match model.iter().position(|entry| entry.0 == 2 * index) {
                    Some(at) => expected.push(model.remove(at)),
                    None => break,
                }
            }
            expected.extend(model);
            let found = entries(&mut memory, table);
            assert_eq!(found.len(), expected.len(), "round {round}");
            for (found, expected) in found.iter().zip(&expected) {
                assert!(found.0.same(key(expected.0)), "round {round}: {found:?} {expected:?}");
                assert_eq!(found.1, expected.1);
            }
            assert_eq!(memory.table_size(table), expected.len());
        }
    }

    #[test]
    fn removal_leaves_every_other_entry() {
        let mut state = 3;
        for round in 0..300 {
            let mut memory = Memory::full();
            let table = memory.new_table().unwrap().index();
            let mut model: Vec<(i32, i32)> = Vec::new();
            for step in 0..random(&mut state) % 120 {
                let number = (random(&mut state) % 30) as i32;
                model.retain(|entry| entry.0 != number);
                if random(&mut state).is_multiple_of(2) {
                    memory.table_set(table, key(number), Value::nil()).unwrap();
                } else {
                    let value = step as i32 + 1;
                    memory.table_set(table, key(number), Value::int(value)).unwrap();
                    model.push((number, value));
                }
                let there = model.iter().any(|entry| entry.0 == number);
                assert_eq!(!memory.table_get(table, key(number)).is_nil(), there);
            }
            let found = entries(&mut memory, table);
            assert_eq!(found.len(), model.len(), "round {round}");
            for entry in &model {
                let matching = found.iter().filter(|f| f.0.same(key(entry.0)));
                assert_eq!(matching.map(|f| f.1).collect::<Vec<_>>(), [entry.1], "round {round}");
            }
            // The consecutive keys come first, ascending.
            let run = (0..).take_while(|i| model.iter().any(|e| e.0 == 2 * i)).count();
            for (index, entry) in found.iter().take(run).enumerate() {
                assert_eq!(entry.0.as_int(), Some(index as i32), "round {round}");
            }
        }
    }

    #[test]
    fn an_iteration_survives_any_change() {
        let mut state = 11;
        for round in 0..500 {
            let mut memory = Memory::full();
            let table = memory.new_table().unwrap().index();
            for number in 0..random(&mut state) % 25 {
                let at = (random(&mut state) % 30) as i32;
                memory.table_set(table, key(at), Value::int(number as i32)).unwrap();
            }
            let before: Vec<Value<Tiny>> =
                entries(&mut memory, table).iter().map(|entry| entry.0).collect();
            let mut removed: Vec<Value<Tiny>> = Vec::new();
            let mut visited: Vec<Value<Tiny>> = Vec::new();
            memory.fill(HERE, HERE + ITERATION);
            while memory.table_next(table, HERE) {
                let found = memory.get(HERE + 2);
                assert!(!visited.iter().any(|v| v.same(found)), "round {round}: twice {found:?}");
                assert!(!removed.iter().any(|v| v.same(found)), "round {round}: removed {found:?}");
                visited.push(found);
                assert!(visited.len() < 100, "round {round}: no end");
                // Remove an old entry, add a new one under a key that no old entry has, or change
                // one.
                match random(&mut state) % 3 {
                    0 if !before.is_empty() => {
                        let at = before[random(&mut state) as usize % before.len()];
                        memory.table_set(table, at, Value::nil()).unwrap();
                        removed.push(at);
                    }
                    1 if visited.len() < 40 => {
                        let at = key(60 + (random(&mut state) % 20) as i32);
                        memory.table_set(table, at, Value::int(1)).unwrap();
                    }
                    _ => {
                        if !memory.table_get(table, found).is_nil() {
                            memory.table_set(table, found, Value::int(99)).unwrap();
                        }
                    }
                }
            }
            for old in before {
                let gone = removed.iter().any(|r| r.same(old));
                assert!(
                    gone || visited.iter().any(|v| v.same(old)),
                    "round {round}: missed {old:?}"
                );
            }
        }
    }

    #[test]
    fn an_array_uses_and_frees_one_slot_per_value() {
        let mut memory = Memory::full();
        let empty = memory.unused();
        let table = memory.new_table().unwrap();
        memory.reserved = 0;
        for index in 0..150 {
            memory.table_set(table.index(), Value::int(index), Value::int(2 * index)).unwrap();
        }
        // A head and 25 cells of six values.
        assert_eq!(empty - memory.unused(), 26 * CELL);
        for index in (0..150).rev() {
            assert_eq!(
                memory.table_get(table.index(), Value::int(index)).as_int(),
                Some(2 * index)
            );
            memory.table_set(table.index(), Value::int(index), Value::nil()).unwrap();
        }
        memory.mark(table);
        memory.sweep();
        assert_eq!(empty - memory.unused(), CELL);
    }

    #[test]
    fn a_full_heap_changes_nothing() {
        let mut memory: TestArena<Tiny, 30> = Arena::full();
        memory.reserved = 1;
        let table = memory.new_table().unwrap().index();
        let mut stored = 0;
        while memory.table_set(table, Value::string(stored), Value::int(1)).is_ok() {
            stored += 1;
        }
        // Two pairs in the head, three in each of the other three cells.
        assert_eq!(stored, 11);
        assert_eq!(memory.table_size(table), 11);
        assert!(memory.table_set(table, Value::string(3), Value::int(7)).is_ok(), "no new cell");
        assert!(memory.table_set(table, Value::string(3), Value::nil()).is_ok());
        assert!(memory.table_set(table, Value::string(99), Value::int(7)).is_ok(), "a free pair");
        assert_eq!(memory.table_set(table, Value::int(0), Value::int(7)), Err(NoCell));
    }

    #[test]
    fn keys_of_the_full_profile_are_not_cut() {
        let mut memory: TestArena<Full, 200> = Arena::full();
        let table = memory.new_table().unwrap().index();
        memory.table_set(table, Value::int(0), Value::int(1)).unwrap();
        for key in [0x1_0000, -0x1_0000, i32::MIN] {
            assert!(memory.table_get(table, Value::int(key)).is_nil(), "{key}");
            memory.table_set(table, Value::int(key), Value::int(2)).unwrap();
        }
        assert_eq!(memory.table_get(table, Value::int(0)).as_int(), Some(1));
        assert_eq!(memory.table_size(table), 4);
    }
}
