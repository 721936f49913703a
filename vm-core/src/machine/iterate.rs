//! Built-ins that call script functions or wait. Each has a frame; [`Vm::resume`] goes on when the callback has
//! returned, or when the machine runs again.

use super::{Flow, Native, Vm};
use crate::builtin;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::network::Network;
use crate::number::Profile;
use crate::value::{Tag, Value};

// Locals of a built-in's frame. All are nil in the beginning.
/// The result so far: a table, or the accumulator of `reduce`.
const RESULT: isize = 1;
/// Of `delay`: whether the host knows of it.
const BEGUN: isize = 1;
/// Key and element that the callback is called for, where they are needed after it.
const KEY: isize = 2;
const ELEMENT: isize = 3;
/// The first slot of the iteration, see [`crate::heap`]. Its last two slots are above the locals: the arguments of the
/// callback.
const ITERATES: usize = 4;
/// How many locals there are.
const LOCALS: usize = 5;
/// The first argument of a callback; its result then is in the same slot.
const CALLBACK: usize = ITERATES + 2;

/// How many arguments a built-in of kind `Calls` takes.
fn parameters(number: u8) -> u8 {
    match number {
        builtin::CLONE | builtin::DELAY => 1,
        builtin::REDUCE => 3,
        _ => 2,
    }
}

impl<P: Profile, C: ByteCode, const SLOTS: usize, N: Network<P>> Vm<P, C, SLOTS, N> {
    /// Begins a built-in of kind `Calls`, whose `count` arguments are on top.
    #[inline(never)]
    pub(super) fn begin_native<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        count: u8,
    ) -> Result<(), Stopped> {
        let wanted = parameters(number);
        if count < wanted {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        // Extra arguments are ignored.
        self.sp = self.sp.wrapping_sub(u16::from(count.wrapping_sub(wanted)));
        let first = usize::from(self.sp.wrapping_sub(u16::from(wanted)));
        let argument = self.arena.get(first);
        if number == builtin::DELAY {
            self.need_number(argument)?;
        } else {
            // Everything else is its own copy.
            if number == builtin::CLONE && !argument.is(Tag::TABLE) && !argument.is(Tag::LIBRARY) {
                return Ok(());
            }
            self.library_to_table(host, first)?;
        }
        self.enter_native(Native(number))?;
        self.reserve(LOCALS)?;
        let result = match number {
            builtin::MAP | builtin::FILTER | builtin::CLONE => self.new_table()?,
            builtin::REDUCE => self.local(-1),
            _ => Value::nil(),
        };
        self.set_local(RESULT, result);
        Ok(())
    }

    /// Goes on in the built-in at the stored position.
    #[inline(never)]
    pub(super) fn resume<H: Host<P>>(&mut self, host: &mut H) -> Result<Flow, Stopped> {
        let number = self.pc as u8 & 0x7f;
        if number == Native::ROBOT.0 {
            return self.poll_robot(host);
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
        let parameters = parameters(number);
        let first = usize::from(self.fp.wrapping_sub(u16::from(parameters)));
        let callback = usize::from(self.fp) + CALLBACK;
        // Nothing is there before the first entry.
        if usize::from(self.sp) > callback {
            // What the callback, or the clone of an element, has left.
            let mut value = self.top(1);
            if number == builtin::REDUCE {
                self.set_local(RESULT, value);
            } else if number != builtin::FOREACH && (number != builtin::FILTER || !value.is_false())
            {
                if number == builtin::FILTER {
                    value = self.local(ELEMENT);
                }
                self.table_set(self.local(RESULT), self.local(KEY), value)?;
            }
        }
        let table = self.arena.get(first);
        if !self.arena.table_next(table.index(), callback - 2) {
            self.leave_frame(parameters, self.local(RESULT));
            return Ok(Flow::Continue);
        }
        self.sp = callback as u16 + 2;
        let mut element = self.top(1);
        if number != builtin::CLONE && element.may_use_self() {
            element = self.bind_function(element, table)?;
            self.set_top(element);
        }
        match number {
            builtin::FOREACH => {}
            builtin::REDUCE => self.push(self.local(RESULT)),
            _ => {
                self.set_local(KEY, self.top(2));
                self.set_local(ELEMENT, element);
            }
        }
        if number != builtin::CLONE {
            let count = usize::from(self.sp).wrapping_sub(callback) as u8;
            self.call(host, self.arena.get(first + 1), count, 0)?;
        } else if element.is(Tag::TABLE) {
            // The clone takes the place of the element.
            self.begin_native(host, number, 1)?;
        }
        Ok(Flow::Continue)
    }
}
