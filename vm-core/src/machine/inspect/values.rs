//! Values and their contents: entries of tables, functions with their captured values, text.

use super::super::Vm;
use crate::builtin::Library;
use crate::bytecode::ByteCode;
use crate::heap::Visit;
use crate::host::Text;
use crate::number::Profile;
use crate::value::{Tag, Value};

/// A value by its type. Tables, closures and strings made at run time are named by their cells:
/// equal numbers are the same object, until a collection frees the cell and another object takes
/// it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum ValueKind {
    /// nil
    Nil,
    /// An argument that was not passed.
    Unset,
    /// An integer.
    Int(i32),
    /// A float.
    Float(f32),
    /// A constant string, by its number.
    String(u16),
    /// A string made at run time, by its cell.
    Text(u16),
    /// A table, by its cell.
    Table(u16),
    /// A result of `neighbors.map` and its relatives, by its cell: a table that has functions.
    Snapshot(u16),
    /// A function with captured values, by its cell.
    Closure(u16),
    /// A function that was read from a table and has this table as its `self`, by its cell.
    Bound(u16),
    /// A function of the script that captures nothing, by its number.
    Function(u16),
    /// A built-in function, by its number in [`builtin`](crate::builtin).
    Builtin(u8),
    /// A robot function, by the number of its import.
    Robot(u16),
    /// A library.
    Library(Library),
    /// A swarm, by the number that the script gave it.
    Swarm(u16),
    /// A stigmergy, by the number that the script gave it.
    Stigmergy(u16),
}

/// The parts of a closure or a bound function.
#[derive(Clone, Copy, Debug)]
pub struct ClosureParts<P: Profile> {
    /// The function that a call runs. For a closure this is a function of the script; for a bound
    /// function it is the function, closure or built-in that was bound.
    pub function: Value<P>,
    /// Its `self`, or nil.
    pub self_value: Value<P>,
    /// The number of slots for captured values, at least as many as there are values. Those after
    /// the last value are nil.
    pub slots: usize,
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the type of a value, with its content or identity.
    pub fn kind(&self, value: Value<P>) -> ValueKind {
        let index = value.index() as u16;
        match value.tag() {
            Tag::INT => ValueKind::Int(value.as_int().unwrap_or(0)),
            Tag::FLOAT => ValueKind::Float(value.as_f32().unwrap_or(0.0)),
            Tag::STRING => ValueKind::String(index),
            Tag::FUNCTION => ValueKind::Function(index),
            Tag::BUILTIN => ValueKind::Builtin(index as u8),
            Tag::ROBOT => ValueKind::Robot(index),
            Tag::LIBRARY => self.library_kind(value),
            Tag::UNSET => ValueKind::Unset,
            Tag::TABLE => ValueKind::Table(index),
            Tag::CLOSURE => ValueKind::Closure(index),
            Tag::BOUND => ValueKind::Bound(index),
            Tag::TEXT => ValueKind::Text(index),
            Tag::SNAPSHOT => ValueKind::Snapshot(index),
            _ => ValueKind::Nil,
        }
    }

    fn library_kind(&self, value: Value<P>) -> ValueKind {
        let [library, _] = (value.index() as u16).to_le_bytes();
        match Library::ALL.get(usize::from(library)) {
            Some(Library::SwarmObject) => ValueKind::Swarm(self.swarm_number(value)),
            Some(Library::StigmergyObject) => ValueKind::Stigmergy(self.stigmergy_number(value)),
            Some(library) => ValueKind::Library(*library),
            None => ValueKind::Nil,
        }
    }

    /// Returns the text of a string; `None` for other values. It is empty for a constant whose text
    /// is not in the image.
    pub fn text(&self, value: Value<P>) -> Option<Text<'_, P, C, SLOTS>> {
        let is_string = matches!(value.tag(), Tag::STRING | Tag::TEXT);
        is_string.then(|| Text::new(self.view(), value))
    }

    /// Returns the entries of a table or a snapshot in the order in which scripts iterate over
    /// them. For a library these are the changes that the script has made; a member that the script
    /// removed has an unset value. Other values have no entries.
    pub fn entries(&self, table: Value<P>) -> TableEntries<'_, P, C, SLOTS> {
        let table = match table.tag() {
            Tag::TABLE | Tag::SNAPSHOT => Some(table),
            Tag::LIBRARY => Some(self.registered(table)).filter(|changes| changes.is(Tag::TABLE)),
            _ => None,
        };
        let table = table.map(|table| table.index());
        let visit = table.map_or(Visit::NONE, |table| self.arena.visit(table));
        TableEntries { vm: self, table, visit, gap: 0, is_before_gap: true }
    }

    /// Returns function and `self` of a closure or a bound function; `None` for other values.
    pub fn closure(&self, value: Value<P>) -> Option<ClosureParts<P>> {
        let cell = value.index();
        let slots = match value.tag() {
            Tag::CLOSURE => self.arena.capture_slots(cell),
            Tag::BOUND => 0,
            _ => return None,
        };
        let function = self.arena.closure_function(cell);
        Some(ClosureParts { function, self_value: self.arena.closure_self(cell), slots })
    }

    /// Returns a captured value of a closure by its number, nil if there is none, or if the value
    /// is no closure.
    pub fn captured(&self, closure: Value<P>, number: u16) -> Value<P> {
        match closure.tag() {
            Tag::CLOSURE => self.arena.captured(closure.index(), number.into()),
            _ => Value::nil(),
        }
    }
}

/// The iterator of [`Vm::entries`].
pub struct TableEntries<'a, P: Profile, C: ByteCode, const SLOTS: usize> {
    vm: &'a Vm<P, C, SLOTS>,
    /// The cell of the table; `None` after the last entry.
    table: Option<usize>,
    /// The visit to the entries as they are stored, which follow the consecutive keys.
    visit: Visit,
    /// The first of the keys 0, 1, 2, ... that is missing, as far as they were visited.
    gap: u16,
    /// True while the keys 0, 1, 2, ... are visited.
    is_before_gap: bool,
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Iterator for TableEntries<'_, P, C, SLOTS> {
    type Item = [Value<P>; 2];

    fn next(&mut self) -> Option<[Value<P>; 2]> {
        let (arena, table) = (&self.vm.arena, self.table?);
        if self.is_before_gap {
            let key = Value::indexed(Tag::INT, self.gap);
            let value = arena.table_get(table, key);
            if !value.is_nil() {
                self.gap += 1;
                return Some([key, value]);
            }
            self.is_before_gap = false;
        }
        loop {
            let Some([key, value]) = arena.next_stored(&mut self.visit) else {
                // After its end a visit must not be continued.
                self.table = None;
                return None;
            };
            let is_visited = key.as_int().is_some_and(|key| (0..self.gap.into()).contains(&key));
            if !is_visited {
                return Some([key, value]);
            }
        }
    }
}
