//! Built-ins that call script functions or wait. Each has a frame; [`Vm::resume`] continues it when
//! the callback has returned, or when the machine runs again.
//!
//! The first argument is the source of the iteration: a table, a snapshot of neighbors, a
//! stigmergy, or `neighbors` itself.

use super::network::is_of_neighbors;
use super::{Flow, Native, Vm};
use crate::builtin;
use crate::builtin::Library;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::number::Profile;
use crate::part::Part;
use crate::value::{Tag, Type, Value};

// Locals of a built-in's frame. All are nil at first.
/// The result so far: a table, or the accumulator of `reduce`.
const RESULT: i8 = 1;
/// For `delay`: not nil once the host has started it.
const BEGUN: i8 = 1;
/// The key and the element of the running callback, for built-ins that need them after it returns.
const KEY: i8 = 2;
const ELEMENT: i8 = 3;
/// The first slot of the iteration, see [`crate::heap`]. Its last two slots lie above the locals
/// and are the first arguments of the callback.
const ITERATES: usize = 4;
/// The number of locals.
const LOCALS: usize = 5;
/// The slot of a callback's first argument, and later of its result.
const CALLBACK: usize = ITERATES + 2;

/// Returns the number of arguments of a built-in of kind `Calls` with that [`task`], including the
/// source.
fn parameters(task: u8) -> u8 {
    match task {
        builtin::CLONE | builtin::DELAY => 1,
        builtin::REDUCE => 3,
        _ => 2,
    }
}

/// Returns the built-in that does the same with tables, or the number itself if there is none.
#[one_copy]
fn task(number: u8) -> u8 {
    match number {
        // These built-ins have the same order as those of tables.
        builtin::NEIGHBORS_FOREACH..=builtin::NEIGHBORS_REDUCE => {
            number - builtin::NEIGHBORS_FOREACH + builtin::FOREACH
        }
        builtin::SNAPSHOT_FOREACH..=builtin::SNAPSHOT_REDUCE => {
            number - builtin::SNAPSHOT_FOREACH + builtin::FOREACH
        }
        // Both make a snapshot of some of the elements without changing them.
        builtin::NEIGHBORS_KIN | builtin::NEIGHBORS_NONKIN => builtin::CLONE,
        builtin::STIGMERGY_FOREACH => builtin::FOREACH,
        builtin::STIGMERGY_MAP => builtin::MAP,
        builtin::STIGMERGY_REDUCE => builtin::REDUCE,
        _ => number,
    }
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Begins a built-in of kind `Calls`, whose `count` arguments are on top.
    #[one_copy]
    pub(super) fn begin_native(&mut self, number: u8, mut count: u8) -> Result<(), Stopped> {
        if Self::ITERATES_NEIGHBORS && is_of_neighbors(number) {
            self.insert(count, Value::indexed(Tag::LIBRARY, Library::Neighbors as u16))?;
            count = count.wrapping_add(1);
        }
        let task = task(number);
        let wanted = parameters(task);
        if count < wanted {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        // Extra arguments are ignored.
        self.sp = self.sp.wrapping_sub(u16::from(count.wrapping_sub(wanted)));
        let first = usize::from(self.sp.wrapping_sub(u16::from(wanted)));
        let argument = self.arena.get(first);
        // The function is checked even if there is no element to call it with: otherwise a mistake
        // would only show where neighbors are.
        if wanted > 1 {
            let found = self.arena.get(first + 1).type_of();
            if found == Type::Unset {
                return Err(self.fail(FaultCode::MissingArgument));
            }
            if found != Type::Closure {
                return Err(self.fail_with(FaultCode::NotCallable, [found; 2], number.into()));
            }
        }
        if number == builtin::DELAY {
            self.need_number(argument)?;
        } else if Self::has(Part::Iteration) && number < builtin::NEIGHBORS_GET {
            // A value of any other type is its own copy.
            if number == builtin::CLONE
                && !matches!(argument.tag(), Tag::TABLE | Tag::LIBRARY | Tag::SNAPSHOT)
            {
                return Ok(());
            }
            if !self.is_table(argument)? {
                return self.begin_copy(number, wanted, false);
            }
        } else if Self::HAS_NETWORK {
            self.need_source(number, argument)?;
        }
        self.enter_native(Native(number))?;
        self.reserve(LOCALS)?;
        if !Self::has(Part::Iteration) {
            return Ok(());
        }
        let result = match task {
            builtin::MAP | builtin::FILTER | builtin::CLONE => self.new_table()?,
            builtin::REDUCE => self.local(-1),
            _ => Value::nil(),
        };
        self.set_local(RESULT, result);
        Ok(())
    }

    /// Continues the built-in at the stored position.
    #[one_copy]
    pub(super) fn resume<H: Host<P>>(&mut self, host: &mut H) -> Result<Flow, Stopped> {
        let number = self.pc as u8 & 0x7f;
        if number == Native::ROBOT.0 {
            return self.poll_robot(host);
        }
        if Self::has(Part::Libraries) && number == Native::COPY.0 {
            return self.copy_on(host);
        }
        if number == Native::START.0 {
            self.pc = Native::EXIT.position() as u16;
            self.call(host, self.top(1), 0, 1)?;
            return Ok(Flow::Continue);
        }
        if number == builtin::DELAY {
            let ms = self.local(-1).unpack().to_i32();
            let again = !self.local(BEGUN).is_nil();
            self.set_local(BEGUN, Value::truth(true));
            if !host.delay_is_over(ms, again) {
                return Ok(Flow::Waiting);
            }
            self.leave_frame(1, Value::nil());
            return Ok(Flow::Continue);
        }
        let task = task(number);
        let parameters = parameters(task);
        let first = usize::from(self.fp.wrapping_sub(u16::from(parameters)));
        let callback = usize::from(self.fp) + CALLBACK;
        let source = self.arena.get(first);
        let function = self.arena.get(first + 1);
        // Before the first element the stack ends at `callback`.
        let returned = usize::from(self.sp) > callback;
        if Self::has(Part::Swarms) && number == builtin::SWARM_EXEC {
            if returned {
                self.leave_frame(parameters, self.top(1));
            } else if self.is_in_swarm(source) {
                self.call_back(host, function, 0)?;
            } else {
                self.leave_frame(parameters, Value::nil());
            }
            return Ok(Flow::Continue);
        }
        if !Self::has(Part::Iteration) {
            return Ok(Flow::Continue);
        }
        if returned {
            // The result of the callback, or of the clone of an element.
            let mut value = self.top(1);
            if task == builtin::REDUCE {
                self.set_local(RESULT, value);
            } else if task != builtin::FOREACH && (task != builtin::FILTER || !value.is_false()) {
                if task == builtin::FILTER {
                    value = self.local(ELEMENT);
                }
                self.table_set(self.local(RESULT), self.local(KEY), value)?;
            }
        }
        self.sp = callback as u16;
        if !self.next_element(source, callback)? {
            let mut result = self.local(RESULT);
            let is_snapshot = matches!(
                number,
                builtin::NEIGHBORS_MAP
                    | builtin::NEIGHBORS_FILTER
                    | builtin::NEIGHBORS_KIN
                    | builtin::NEIGHBORS_NONKIN
                    | builtin::SNAPSHOT_MAP
                    | builtin::SNAPSHOT_FILTER
            );
            if is_snapshot {
                result = Value::indexed(Tag::SNAPSHOT, result.index() as u16);
            }
            self.leave_frame(parameters, result);
            return Ok(Flow::Continue);
        }
        let mut element = self.arena.get(callback + 1);
        if number != builtin::CLONE && element.may_use_self() && source.is(Tag::TABLE) {
            element = self.bind_function(element, source)?;
            self.arena.set(callback + 1, element);
        }
        match task {
            builtin::FOREACH => {}
            builtin::REDUCE => self.push(self.local(RESULT)),
            _ => {
                self.set_local(KEY, self.arena.get(callback));
                self.set_local(ELEMENT, element);
            }
        }
        if task != builtin::CLONE {
            let count = usize::from(self.sp).wrapping_sub(callback) as u8;
            self.call_back(host, function, count)?;
        } else if number != builtin::CLONE {
            if Self::has(Part::Neighbors) && Self::has(Part::Swarms) && !self.is_chosen(number) {
                self.sp = callback as u16;
            }
        } else if element.is(Tag::TABLE) {
            // The clone takes the place of the element.
            self.begin_native(number, 1)?;
        }
        Ok(Flow::Continue)
    }

    /// Pushes the key and the value of the next element, and for a stigmergy also its robot; the
    /// stack ends at `callback` before. Returns false if there is no next element.
    fn next_element(&mut self, source: Value<P>, callback: usize) -> Result<bool, Stopped> {
        if (Self::has(Part::Neighbors) || Self::has(Part::Stigmergy)) && source.is(Tag::LIBRARY) {
            return self.next_known(source, callback - 2);
        }
        self.sp = callback as u16 + 2;
        Ok(self.arena.table_next(source.index(), callback - 2))
    }
}
