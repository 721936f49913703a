//! Reading and writing through `.` and `[ ]`: tables, and the libraries that behave as tables.
//!
//! A library costs no memory until a script changes it. Then the machine's own global holds a table
//! of overlays: it maps the library's value to a table of the changed fields. A field that the
//! script removed is unset in that table.

use super::{Flow, Native, OVERLAYS, Vm};
use crate::builtin::{self, Library};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::heap::{ITERATION, NoCell};
use crate::host::{Axis, Host};
use crate::image::USES_SELF;
use crate::number::Profile;
use crate::part::Part;
use crate::rom::BuiltinFlags;
use crate::value::{Tag, Value};

// Locals of the frame that copies a library to a table.
/// The built-in that is called afterwards, and the number of its arguments.
const CALL: i8 = 1;
const DROP_RESULT: i8 = 2;
/// The next row of the image's library table.
const ROW: i8 = 3;
const COPY: i8 = 4;
/// The first slot of the iteration over the script's changes. Its last two slots are on top.
const COPY_ITERATES: usize = 5;
const COPY_LOCALS: usize = 4 + ITERATION;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    pub(super) fn table_size(&self, table: Value<P>) -> usize {
        self.arena.table_size(table.index())
    }

    /// True if the interpreter's loop may allocate on its own. Tests of scarce memory need all
    /// allocations to go through [`Vm::allocate`].
    pub(super) const ALLOCATES_QUICKLY: bool = cfg!(not(feature = "torture"));

    /// Runs an allocation; if there is no cell, collects and tries once more. All values that the
    /// allocation uses must be on the stack.
    #[hot]
    pub(super) fn allocate<T>(
        &mut self,
        mut make: impl FnMut(&mut Self) -> Result<T, NoCell>,
    ) -> Result<T, Stopped> {
        #[cfg(feature = "torture")]
        if self.torture.refuses() {
            return Err(self.fail(FaultCode::OutOfMemory));
        } else if self.torture.collect_always {
            self.collect();
        }
        loop {
            if let Ok(made) = make(self) {
                self.arena.pressed = false;
                return Ok(made);
            }
            self.make_room()?;
        }
    }

    /// Collects. Fails if the allocation was already tried again after a collection.
    #[one_copy]
    fn make_room(&mut self) -> Result<(), Stopped> {
        if self.arena.pressed {
            return Err(self.fail(FaultCode::OutOfMemory));
        }
        self.want_repeat()?;
        self.collect();
        self.arena.pressed = true;
        Ok(())
    }

    #[one_copy]
    pub(super) fn new_table(&mut self) -> Result<Value<P>, Stopped> {
        self.allocate(|vm| vm.arena.new_table())
    }

    /// Stores a value in a table under a key that [`Vm::key`] returned.
    #[one_copy]
    pub(super) fn table_set(
        &mut self,
        table: Value<P>,
        key: Value<P>,
        value: Value<P>,
    ) -> Result<(), Stopped> {
        self.allocate(|vm| vm.arena.table_set(table.index(), key, value))
    }

    /// Returns the key as tables hold it: a float with an integral value becomes an integer. Fails
    /// if `table` is neither table nor library, or if the key is neither number nor string.
    #[one_copy]
    pub(super) fn key(&mut self, table: Value<P>, key: Value<P>) -> Result<Value<P>, Stopped> {
        let is_table = table.is(Tag::TABLE)
            || Self::has(Part::Libraries) && matches!(table.tag(), Tag::LIBRARY | Tag::SNAPSHOT);
        if !is_table {
            return Err(self.fail_on(FaultCode::NotATable, table, key));
        }
        match key.tag() {
            Tag::INT | Tag::STRING | Tag::TEXT => Ok(key),
            Tag::FLOAT if Self::has(Part::Floats) => Ok(match P::unpack(key.raw()).as_int() {
                Some(int) => Value::new(Tag::INT, int),
                None => key,
            }),
            _ => Err(self.fail_on(FaultCode::BadKey, key, key)),
        }
    }

    /// Evaluates `table[key]`. With `bind`, a function that uses self is bound to the table; then
    /// table and key must be on the stack. A method call reads it without.
    #[one_copy]
    pub(super) fn index_get<H: Host<P>>(
        &mut self,
        host: &mut H,
        table: Value<P>,
        key: Value<P>,
        bind: bool,
    ) -> Result<Value<P>, Stopped> {
        let key = self.key(table, key)?;
        if !Self::has(Part::Libraries) || table.is(Tag::TABLE) {
            let value = self.arena.table_get(table.index(), key);
            return if bind { self.bind(value, table) } else { Ok(value) };
        }
        let value = self.library_get(host, table, key);
        if bind { self.bind_function(value, table) } else { Ok(value) }
    }

    /// Executes `table[key] = value`. All three must be on the stack.
    #[one_copy]
    pub(super) fn index_set(
        &mut self,
        table: Value<P>,
        key: Value<P>,
        value: Value<P>,
    ) -> Result<(), Stopped> {
        let key = self.key(table, key)?;
        if !Self::has(Part::Libraries) || table.is(Tag::TABLE) {
            return self.table_set(table, key, value);
        }
        if table.is(Tag::SNAPSHOT) {
            return Err(self.fail_on(FaultCode::NotATable, table, key));
        }
        let overlay = self.make_overlay(table)?;
        self.table_set(overlay, key, if value.is_nil() { Value::unset() } else { value })
    }

    /// Returns the value as a read from a table yields it: a function that uses self gets the table
    /// as its self.
    #[hot]
    fn bind(&mut self, value: Value<P>, table: Value<P>) -> Result<Value<P>, Stopped> {
        if Self::HAS_BOUND_METHODS && value.may_use_self() {
            self.bind_function(value, table)
        } else {
            Ok(value)
        }
    }

    #[one_copy]
    pub(super) fn bind_function(
        &mut self,
        value: Value<P>,
        table: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        let mut plain = value;
        if plain.is(Tag::BOUND) {
            plain = self.arena.closure_function(plain.index());
        }
        let mut function = plain;
        if function.is(Tag::CLOSURE) {
            function = self.arena.closure_function(function.index());
        }
        let number = function.index() as u16;
        let binds = match function.tag() {
            Tag::FUNCTION => self.head(number) & USES_SELF != 0,
            // A method that was read from its object stays bound to that object.
            Tag::BUILTIN if Self::HAS_NETWORK => {
                value.is(Tag::BUILTIN) && BuiltinFlags::of::<P, C>(number as u8).is_method()
            }
            _ => false,
        };
        if !binds {
            return Ok(value);
        }
        // The value can be reached through its table, and cells do not move.
        let cell = self.new_table()?;
        Ok(self.arena.bound(cell.index(), plain, table))
    }

    /// Returns the table of changes of a library, or the function that listens to a topic; nil if
    /// there is none.
    #[one_copy]
    pub(super) fn registered(&self, key: Value<P>) -> Value<P> {
        let overlays = self.arena.get_fast(OVERLAYS);
        if overlays.is_nil() { overlays } else { self.arena.pair(overlays.index(), key) }
    }

    /// Returns the table of all overlays and listeners, and makes it if there is none.
    #[one_copy]
    pub(super) fn overlays(&mut self) -> Result<Value<P>, Stopped> {
        if self.arena.get(OVERLAYS).is_nil() {
            let overlays = self.new_table()?;
            self.arena.set(OVERLAYS, overlays);
        }
        Ok(self.arena.get(OVERLAYS))
    }

    /// Returns the overlay, and makes it if there is none.
    fn make_overlay(&mut self, library: Value<P>) -> Result<Value<P>, Stopped> {
        let found = self.registered(library);
        let is_made = if Self::PAUSES { found.is(Tag::TABLE) } else { !found.is_nil() };
        if is_made {
            return Ok(found);
        }
        // A placeholder takes the key's pair first, so that storing the new table needs no cell. An
        // allocation at that point could collect, and nothing would refer to the new table yet.
        let overlays = self.overlays()?;
        self.table_set(overlays, library, library)?;
        let made = self.new_table()?;
        let _ = self.arena.table_set(overlays.index(), library, made);
        Ok(made)
    }

    /// Pushes `count` nils, even if the frame has used all slots that its function declared.
    #[one_copy]
    pub(super) fn reserve(&mut self, count: usize) -> Result<(), Stopped> {
        let top = usize::from(self.sp);
        let end = top.wrapping_add(count);
        self.ensure(end)?;
        self.arena.fill(top, end);
        self.sp = end as u16;
        Ok(())
    }

    pub(super) fn set_top(&mut self, value: Value<P>) {
        self.arena.set(usize::from(self.sp) - 1, value);
    }

    fn library_get<H: Host<P>>(&self, host: &mut H, library: Value<P>, key: Value<P>) -> Value<P> {
        let overlay = self.registered(library);
        if !overlay.is_nil() {
            // A field that the script removed is unset.
            let changed = self.arena.table_get(overlay.index(), key);
            if changed.is(Tag::UNSET) {
                return Value::nil();
            }
            if !changed.is_nil() {
                return changed;
            }
        }
        if !key.is(Tag::STRING) {
            return Value::nil();
        }
        let Some(program) = self.program() else { return Value::nil() };
        let number = match library.tag() {
            Tag::SNAPSHOT => Library::Snapshot as u8,
            _ => library.index() as u8,
        };
        match program.library_member(number, key.index() as u16) {
            Some(member) => self.member(host, library, member),
            None => Value::nil(),
        }
    }

    /// Returns the value of a library's member.
    fn member<H: Host<P>>(&self, host: &mut H, library: Value<P>, member: u8) -> Value<P> {
        let axis = match member {
            builtin::PI => return Value::float(core::f32::consts::PI),
            builtin::RNG => return Value::indexed(Tag::LIBRARY, Library::Rng as u16),
            builtin::SWARM_OBJECT_ID | builtin::STIGMERGY_OBJECT_ID if Self::HAS_SHARED_STATE => {
                return self.object_id(library, member);
            }
            builtin::POSITION_X => Axis::X,
            builtin::POSITION_Y => Axis::Y,
            builtin::POSITION_Z => Axis::Z,
            builtin::POSITION_ORIENTATION => Axis::Orientation,
            function => return Value::indexed(Tag::BUILTIN, u16::from(function)),
        };
        host.position(axis).map_or(Value::nil(), Value::float)
    }

    /// Returns true for a table or a snapshot, which is a table internally, false for a library,
    /// and a fault for any other value.
    #[one_copy]
    pub(super) fn is_table(&mut self, value: Value<P>) -> Result<bool, Stopped> {
        match value.tag() {
            Tag::TABLE | Tag::SNAPSHOT => Ok(true),
            Tag::LIBRARY if Self::has(Part::Libraries) => Ok(false),
            _ => Err(self.fail_on(FaultCode::NotATable, value, value)),
        }
    }

    /// Begins to replace the first library among the `count` topmost values by a table with the
    /// same entries. Copying each entry takes an instruction; then the built-in `number` is called
    /// with the table.
    #[one_copy]
    pub(super) fn begin_copy(
        &mut self,
        number: u8,
        count: u8,
        drop_result: bool,
    ) -> Result<(), Stopped> {
        let drop_result = u16::from(drop_result);
        self.enter_native(Native::COPY)?;
        self.reserve(COPY_LOCALS)?;
        let call = u16::from_le_bytes([number, count]);
        self.set_local(CALL, Value::indexed(Tag::INT, call));
        self.set_local(DROP_RESULT, Value::indexed(Tag::INT, drop_result));
        self.set_local(ROW, Value::int(0));
        let table = self.new_table()?;
        self.set_local(COPY, table);
        Ok(())
    }

    /// Copies the next entry of a library. After the last entry, calls the built-in that needs the
    /// table.
    #[one_copy]
    pub(super) fn copy_on<H: Host<P>>(&mut self, host: &mut H) -> Result<Flow, Stopped> {
        let [number, count] = (self.local(CALL).index() as u16).to_le_bytes();
        let fp = usize::from(self.fp);
        let mut slot = fp.wrapping_sub(usize::from(count));
        while !self.arena.get(slot).is(Tag::LIBRARY) {
            slot = slot.wrapping_add(1);
        }
        let library = self.arena.get(slot);
        let table = self.local(COPY);
        let overlay = self.registered(library);
        let row = self.local(ROW).index() as u16;
        if row < self.header.library_rows() {
            self.set_local(ROW, Value::indexed(Tag::INT, row.wrapping_add(1)));
            let Some(program) = self.program() else { return Ok(Flow::Done) };
            let (of, string, _) = program.library_row(row);
            if of == library.index() as u8 {
                let key = Value::string(string);
                let value = self.library_get(host, library, key);
                self.table_set(table, key, value)?;
            }
        } else if !overlay.is_nil() && self.arena.table_next(overlay.index(), fp + COPY_ITERATES) {
            // A field that the script removed is unset.
            let value = self.top(1);
            if !value.is(Tag::UNSET) {
                self.table_set(table, self.top(2), value)?;
            }
        } else {
            self.arena.set(slot, table);
            let drop_result = self.local(DROP_RESULT).index() != 0;
            let (pc, outer) = self.caller(fp);
            self.sp = fp as u16;
            self.fp = outer as u16;
            self.pc = pc as u16;
            self.call_builtin(host, number, count, drop_result)?;
        }
        Ok(Flow::Continue)
    }
}
