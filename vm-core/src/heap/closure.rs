//! Closures and bound functions.

use super::NoCell;
use crate::arena::{Arena, CELL};
use crate::number::Profile;
use crate::slots::Slots;
use crate::value::{Tag, Value};

/// The number of captured values in the closure's first cell, after function and self.
const IN_HEAD: usize = CELL - 3;
const IN_CELL: usize = CELL - 1;

impl<P: Profile, S: Slots<P>> Arena<P, S> {
    /// Makes a closure of `function` with the values in slots `from..to`: first its self if it
    /// `has_self`, then the captured values.
    pub(crate) fn new_closure(
        &mut self,
        function: Value<P>,
        has_self: bool,
        from: usize,
        to: usize,
    ) -> Result<Value<P>, NoCell> {
        let head = self.take_cell()?.get();
        self.set(head + 1, function);
        let mut last = head;
        let mut slot = if has_self { head + 2 } else { head + 3 };
        for value in from..to {
            if slot == last + CELL {
                let cell = self.take_cell()?.get();
                self.set_link(last, cell);
                last = cell;
                slot = cell + 1;
            }
            self.copy(value, slot);
            slot += 1;
        }
        Ok(Value::indexed(Tag::CLOSURE, head as u16))
    }

    /// Returns `function` bound to `self_value`. Reuses `cell`, the cell of a new table to which
    /// nothing else refers.
    pub(crate) fn bound(
        &mut self,
        cell: usize,
        function: Value<P>,
        self_value: Value<P>,
    ) -> Value<P> {
        self.set(cell + 1, function);
        self.set(cell + 2, self_value);
        Value::indexed(Tag::BOUND, cell as u16)
    }

    /// Returns the function of a closure or bound function.
    #[hot]
    pub(crate) fn closure_function(&self, closure: usize) -> Value<P> {
        self.get(closure + 1)
    }

    /// Returns the self of a closure or bound function.
    #[hot]
    pub(crate) fn closure_self(&self, closure: usize) -> Value<P> {
        self.get(closure + 2)
    }

    /// Returns a captured value of a closure, if it is in the first cell.
    #[hot]
    pub(crate) fn captured_in_head(&self, closure: usize, number: usize) -> Option<Value<P>> {
        (number < IN_HEAD).then(|| self.get_fast(closure + 3 + number))
    }

    /// Returns a captured value of a closure, nil if its number is too high.
    pub(crate) fn captured(&self, closure: usize, number: usize) -> Value<P> {
        if number < IN_HEAD {
            return self.get(closure + 3 + number);
        }
        let mut number = number - IN_HEAD;
        let mut cell = self.link(closure);
        while number >= IN_CELL && cell != 0 {
            cell = self.link(cell);
            number -= IN_CELL;
        }
        if cell == 0 { Value::nil() } else { self.get(cell + 1 + number) }
    }

    /// Returns the number of slots that a closure has for captured values, which is at least the
    /// number of these values.
    pub(crate) fn capture_slots(&self, closure: usize) -> usize {
        let mut slots = IN_HEAD;
        let mut cell = self.link(closure);
        while cell != 0 {
            slots += IN_CELL;
            cell = self.link(cell);
        }
        slots
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arena::TestArena;
    use crate::number::Tiny;

    #[test]
    fn captures_any_number_of_values() {
        for count in 0..40 {
            let mut memory: TestArena<Tiny, 200> = Arena::full();
            memory.set(0, Value::int(9));
            for slot in 0..count {
                memory.set(1 + slot, Value::int(100 + slot as i32));
            }
            let function = Value::indexed(Tag::FUNCTION, 3);
            let with_self = count % 2 == 1;
            let from = if with_self { 0 } else { 1 };
            let closure = memory.new_closure(function, with_self, from, 1 + count).unwrap().index();
            assert!(memory.closure_function(closure).same(function));
            assert_eq!(memory.closure_self(closure).as_int(), with_self.then_some(9));
            for number in 0..count {
                assert_eq!(memory.captured(closure, number).as_int(), Some(100 + number as i32));
            }
            // A number that is too high reads nil.
            assert!(memory.captured(closure, count + 10).is_nil());
        }
    }
}
