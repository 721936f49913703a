//! Calls of values: the callee is known only at run time.

use super::{Flow, Native, Vm, record};
use crate::builtin::BuiltinKind;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, RobotFault, Stopped};
use crate::host::{CallArguments, Host, Reply};
use crate::image::{CAPTURES, PARAMETERS, USES_SELF};
use crate::number::Profile;
use crate::part::Part;
use crate::rom::BuiltinFlags;
use crate::value::{Tag, Type, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the operand that is `below` slots below the stack pointer: 1 is the top.
    #[one_copy]
    pub(super) fn top(&self, below: u8) -> Value<P> {
        self.arena.get_fast(usize::from(self.sp).wrapping_sub(usize::from(below)))
    }

    #[one_copy]
    pub(super) fn push(&mut self, value: Value<P>) {
        self.arena.set_fast(usize::from(self.sp), value);
        self.sp = self.sp.wrapping_add(1);
    }

    #[one_copy]
    pub(super) fn pop(&mut self) -> Value<P> {
        self.sp = self.sp.wrapping_sub(1);
        self.arena.get_fast(usize::from(self.sp))
    }

    /// Returns the slot of a local of the running function. Locals are counted from the frame's
    /// record.
    #[hot]
    pub(super) fn local_slot(&self, number: i16) -> usize {
        usize::from(self.fp.wrapping_add_signed(number))
    }

    /// Returns a local.
    #[one_copy]
    pub(super) fn local(&self, number: i8) -> Value<P> {
        self.arena.get_fast(self.local_slot(number.into()))
    }

    #[one_copy]
    pub(super) fn set_local(&mut self, number: i8, value: Value<P>) {
        self.arena.set_fast(self.local_slot(number.into()), value);
    }

    /// Calls a callback with the `count` topmost values as arguments.
    #[one_copy]
    pub(super) fn call_back<H: Host<P>>(
        &mut self,
        host: &mut H,
        callee: Value<P>,
        count: u8,
    ) -> Result<(), Stopped> {
        // The usual callback captures nothing, has as many parameters as there are arguments, and
        // its frame fits. Handled separately, this path needs few registers, which an AVR would
        // have to save.
        if callee.is(Tag::FUNCTION)
            && let Some(program) = self.program()
        {
            let position = program.function(callee.index() as u16);
            let fp = usize::from(self.sp);
            let room = usize::from(program.code.byte(position.wrapping_add(1)));
            let limit = fp.wrapping_add(1).wrapping_add(room);
            if program.code.byte(position) == count && limit <= usize::from(self.arena.reserved) {
                let caller = record(fp.wrapping_sub(usize::from(self.fp)), usize::from(self.pc));
                self.arena.set_fast(fp, caller);
                self.fp = fp as u16;
                self.sp = fp.wrapping_add(1) as u16;
                self.pc = position.wrapping_add(2) as u16;
                return Ok(());
            }
        }
        self.call(host, callee, count, 0)
    }

    /// Calls `callee` with the `count` topmost values as arguments. The `below` slots under the
    /// arguments, which hold the callee and for a method its self, are removed.
    #[one_copy]
    pub(super) fn call<H: Host<P>>(
        &mut self,
        host: &mut H,
        callee: Value<P>,
        count: u8,
        below: u8,
    ) -> Result<(), Stopped> {
        let mut function = callee;
        let mut closure = callee;
        if Self::HAS_BOUND_METHODS && function.is(Tag::BOUND) {
            function = self.arena.closure_function(function.index());
            closure = function;
        }
        if Self::has(Part::Closures) && function.is(Tag::CLOSURE) {
            function = self.arena.closure_function(function.index());
        }
        let Some(program) = self.program().filter(|_| function.is(Tag::FUNCTION)) else {
            return self.call_native(host, callee, count, below);
        };
        let position = program.function(function.index() as u16);
        let head = program.code.byte(position);
        let room = program.code.byte(position.wrapping_add(1));
        let wanted = head & PARAMETERS;
        // `start` is the slot of the first argument after the removal, `fp` that of the record
        // after the last parameter.
        let start = self.sp.wrapping_sub(u16::from(count)).wrapping_sub(u16::from(below));
        let fp = start.wrapping_add(u16::from(wanted));
        // The values that are on the stack now already have their slots.
        let limit = usize::from(fp).wrapping_add(1).wrapping_add(usize::from(room));
        if limit > usize::from(self.arena.reserved) {
            self.ensure(limit)?;
        }
        let mut self_value = Value::nil();
        let uses_self = Self::has(Part::Closures) && head & USES_SELF != 0;
        if uses_self {
            if below == 2 {
                self_value = self.arena.get(usize::from(start));
            } else if callee.is_heap() {
                self_value = self.arena.closure_self(callee.index());
            }
        }
        self.take_out(count, below);
        for _ in count..wanted {
            self.push(Value::unset());
        }
        let caller = record(usize::from(fp.wrapping_sub(self.fp)), usize::from(self.pc));
        self.fp = fp;
        self.arena.set_fast(usize::from(fp), caller);
        self.sp = fp.wrapping_add(1);
        self.pc = position.wrapping_add(2) as u16;
        if Self::has(Part::Closures) && head & CAPTURES != 0 {
            self.push(closure);
        }
        if uses_self {
            self.push(self_value);
        }
        Ok(())
    }

    /// Removes the `below` slots under the `count` topmost ones.
    #[one_copy]
    fn take_out(&mut self, count: u8, below: u8) {
        if below != 0 {
            let (count, below) = (u16::from(count), u16::from(below));
            let from = usize::from(self.sp.wrapping_sub(count));
            self.arena.shift_down(from, usize::from(count), usize::from(below));
            self.sp = self.sp.wrapping_sub(below);
        }
    }

    /// Calls a value that is not a function of the script.
    #[one_copy]
    fn call_native<H: Host<P>>(
        &mut self,
        host: &mut H,
        callee: Value<P>,
        count: u8,
        below: u8,
    ) -> Result<(), Stopped> {
        let mut function = callee;
        let mut count = count;
        if Self::has(Part::Libraries) && callee.is(Tag::BOUND) {
            function = self.arena.closure_function(callee.index());
        }
        let number = function.index() as u16;
        if function.is(Tag::ROBOT) {
            self.take_out(count, below);
            return self.call_robot(host, number, count, false);
        }
        if !function.is(Tag::BUILTIN) {
            return Err(self.fail_on(FaultCode::NotCallable, callee, callee));
        }
        if Self::has(Part::Libraries) && BuiltinFlags::of::<P, C>(number as u8).is_method() {
            let mut object = Value::nil();
            if callee.is(Tag::BOUND) {
                object = self.arena.closure_self(callee.index());
            } else if below == 2 {
                let under = usize::from(self.sp).wrapping_sub(usize::from(count));
                object = self.arena.get(under.wrapping_sub(2));
            }
            self.take_out(count, below);
            self.insert(count, object)?;
            count = count.wrapping_add(1);
        } else {
            self.take_out(count, below);
        }
        self.call_builtin(host, number as u8, count, false)
    }

    /// Inserts a value under the `count` topmost ones.
    #[one_copy]
    pub(super) fn insert(&mut self, count: u8, value: Value<P>) -> Result<(), Stopped> {
        let mut at = usize::from(self.sp);
        self.reserve(1)?;
        for _ in 0..count {
            self.arena.copy(at.wrapping_sub(1), at);
            at = at.wrapping_sub(1);
        }
        self.arena.set(at, value);
        Ok(())
    }

    /// Calls a built-in, whose arguments are on top.
    #[one_copy]
    pub(super) fn call_builtin<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        count: u8,
        drop_result: bool,
    ) -> Result<(), Stopped> {
        if BuiltinFlags::of::<P, C>(number).is(BuiltinKind::Calls) {
            return self.begin_native(number, count);
        }
        let result = self.builtin(host, number, count)?;
        if Self::has(Part::Libraries) && result.is(Tag::UNSET) {
            return self.begin_copy(number, count, drop_result);
        }
        self.sp = self.sp.wrapping_sub(u16::from(count));
        if !drop_result {
            self.push(result);
        }
        Ok(())
    }

    /// Makes a frame, above the arguments, for a built-in that continues at `native`.
    pub(super) fn enter_native(&mut self, native: Native) -> Result<(), Stopped> {
        let fp = usize::from(self.sp);
        self.ensure(fp + 1 + super::NATIVE_ROOM)?;
        self.push(record(fp - usize::from(self.fp), usize::from(self.pc)));
        self.fp = fp as u16;
        self.pc = native.position() as u16;
        Ok(())
    }

    /// Leaves the frame of a built-in with `count` parameters, and pushes its result.
    #[one_copy]
    pub(super) fn leave_frame(&mut self, count: u8, result: Value<P>) {
        let (pc, outer) = self.caller(usize::from(self.fp));
        let at = self.fp.wrapping_sub(u16::from(count));
        self.arena.set_fast(usize::from(at), result);
        self.sp = at.wrapping_add(1);
        self.fp = outer as u16;
        self.pc = pc as u16;
    }

    /// Calls a robot function, whose arguments are on top. If it does not finish at once, the
    /// machine makes a frame in which it waits.
    #[one_copy]
    pub(super) fn call_robot<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u16,
        count: u8,
        drop_result: bool,
    ) -> Result<(), Stopped> {
        let result = self.ask_robot(host, number, count, self.sp, false)?;
        if result.is(Tag::UNSET) {
            self.enter_native(Native::ROBOT)?;
            self.push(Value::indexed(Tag::ROBOT, number));
            self.push(Value::int(i32::from(count)));
            self.push(Value::truth(drop_result));
            return Ok(());
        }
        self.sp = self.sp.wrapping_sub(u16::from(count));
        if !drop_result {
            self.push(result);
        }
        Ok(())
    }

    /// Asks the host for the result of a robot function. Returns unset while the function is not
    /// finished.
    #[one_copy]
    fn ask_robot<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u16,
        count: u8,
        end: u16,
        again: bool,
    ) -> Result<Value<P>, Stopped> {
        let Some(program) = self.program() else { return Ok(Value::unset()) };
        let hash = program.import(number);
        let end = usize::from(end);
        let count = usize::from(count);
        for slot in end.wrapping_sub(count)..end {
            if self.arena.get(slot).is(Tag::UNSET) {
                return Err(self.fail(FaultCode::MissingArgument));
            }
        }
        match host.call(hash, CallArguments { script: self.view(), end, count }, again) {
            Ok(Reply::Value(result)) => Ok(result),
            Ok(Reply::Wait) => Ok(Value::unset()),
            Err(RobotFault::WrongType(found)) => {
                Err(self.fail_with(FaultCode::WrongType, [found; 2], 0))
            }
            Err(RobotFault::Refused(reason)) => {
                Err(self.fail_with(FaultCode::RobotRefused, [Type::Nil; 2], reason as u16))
            }
        }
    }

    /// Asks the robot function of the running frame whether it is finished.
    pub(super) fn poll_robot<H: Host<P>>(&mut self, host: &mut H) -> Result<Flow, Stopped> {
        let number = self.local(1).index() as u16;
        let count = self.local(2).index() as u8;
        let drop_result = self.local(3).index() != 0;
        let result = self.ask_robot(host, number, count, self.fp, true)?;
        if result.is(Tag::UNSET) {
            return Ok(Flow::Waiting);
        }
        self.leave_frame(count, result);
        if drop_result {
            self.pop();
        }
        Ok(Flow::Continue)
    }
}
