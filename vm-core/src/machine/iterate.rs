//! Built-ins that call script functions or wait. Each has a frame; [`Vm::resume`] goes on when the callback has
//! returned, or when the machine runs again.

use super::{Flow, Native, Vm};
use crate::builtin;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::heap::Cursor;
use crate::host::Host;
use crate::number::Profile;
use crate::value::{Tag, Value};

// Locals of an iterating frame.
const CURSOR: isize = 1;
const GAP: isize = 2;
/// The result so far: a table, or the accumulator of `reduce`.
const RESULT: isize = 3;
const KEY: isize = 4;
const ELEMENT: isize = 5;
/// How many there are.
const LOCALS: u16 = 5;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Begins a built-in of kind `Calls`, whose `count` arguments are on top.
    #[inline(never)]
    pub(super) fn begin_native<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        count: usize,
    ) -> Result<(), Stopped> {
        let (native, wanted) = match number {
            builtin::FOREACH => (Native::Foreach, 2),
            builtin::MAP => (Native::Map, 2),
            builtin::FILTER => (Native::Filter, 2),
            builtin::REDUCE => (Native::Reduce, 3),
            builtin::CLONE => (Native::Clone, 1),
            _ => (Native::Delay, 1),
        };
        if count < wanted {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        // Extra arguments are ignored.
        self.sp -= (count - wanted) as u16;
        if native == Native::Delay {
            let ms = self.top(1);
            if ms.as_number().is_none() {
                return Err(self.fail_on(FaultCode::WrongType, ms, ms));
            }
            self.enter_native(native)?;
            self.push(Value::truth(false));
            return Ok(());
        }
        let table = usize::from(self.sp) - wanted;
        if native == Native::Clone && !self.arena.get(table).is(Tag::TABLE) {
            // Everything else is shared, or is its own copy.
            if !self.arena.get(table).is(Tag::LIBRARY) {
                return Ok(());
            }
        }
        self.library_to_table(host, table)?;
        self.enter_native(native)?;
        let [cursor, gap] = Cursor::START.pack();
        self.push(cursor);
        self.push(gap);
        let result = match native {
            Native::Map | Native::Filter | Native::Clone => self.new_table()?,
            Native::Reduce => self.local(-1),
            _ => Value::nil(),
        };
        self.push(result);
        self.push(Value::nil());
        self.push(Value::nil());
        // The first entry is visited when the machine resumes this frame; that it was not a callback that
        // returned shows in the key.
        self.set_local(KEY, Value::unset());
        Ok(())
    }

    /// Goes on in the built-in at the stored position.
    #[inline(never)]
    pub(super) fn resume<H: Host<P>>(&mut self, host: &mut H) -> Result<Flow, Stopped> {
        let native = Native::at(usize::from(self.pc));
        match native {
            Native::Exit => return Ok(Flow::Done),
            Native::Robot => return self.poll_robot(host),
            Native::Delay => {
                let ms = self.local(-1).as_number().map_or(0, crate::number::to_int);
                let again = !self.local(1).is_false();
                self.set_local(1, Value::truth(true));
                if !host.delay_is_over(ms, again) {
                    return Ok(Flow::Waiting);
                }
                self.leave_native(1, Value::nil());
                return Ok(Flow::Continue);
            }
            _ => {}
        }
        let parameters = match native {
            Native::Reduce => 3,
            Native::Clone => 1,
            _ => 2,
        };
        if !self.local(KEY).is(Tag::UNSET) {
            self.take_result(native)?;
        }
        let table = self.local(-parameters).index();
        let mut cursor = Cursor::unpack(self.local(CURSOR), self.local(GAP));
        let Some((key, element)) = self.arena.table_next(table, &mut cursor) else {
            let result = self.local(RESULT);
            self.leave_native(parameters as usize, result);
            return Ok(Flow::Continue);
        };
        let [at, gap] = cursor.pack();
        self.set_local(CURSOR, at);
        self.set_local(GAP, gap);
        self.set_local(KEY, key);
        if native == Native::Clone {
            self.push(element);
            return match element.tag() {
                Tag::TABLE => self.begin_native(host, builtin::CLONE, 1).map(|()| Flow::Continue),
                _ => Ok(Flow::Continue),
            };
        }
        let element = self.bind(element, self.local(-parameters))?;
        if native == Native::Filter {
            self.set_local(ELEMENT, element);
        }
        self.push(self.local(1 - parameters));
        self.push(key);
        self.push(element);
        let mut count = 2;
        if native == Native::Reduce {
            self.push(self.local(RESULT));
            count = 3;
        }
        self.call_value(host, count, 1)?;
        Ok(Flow::Continue)
    }

    /// Uses what the callback, or the clone of an element, has left on top.
    fn take_result(&mut self, native: Native) -> Result<(), Stopped> {
        let value = self.top(1);
        let key = self.local(KEY);
        let result = self.local(RESULT);
        match native {
            Native::Map | Native::Clone => self.table_set(result, key, value)?,
            Native::Filter if !value.is_false() => {
                self.table_set(result, key, self.local(ELEMENT))?;
            }
            Native::Reduce => self.set_local(RESULT, value),
            _ => {}
        }
        self.sp = self.fp + 1 + LOCALS;
        Ok(())
    }
}
