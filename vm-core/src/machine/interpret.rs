//! The interpreter loop.
//!
//! Position, frame and stack pointer are locals of one loop over one `match`; what most instructions do with integers
//! is done here, everything else in [`super::slow`], never inlined, with the registers stored.

use super::{Flow, GLOBALS, Native, SPECIAL, Vm, record};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::image::{PARAMETERS, USES_SELF};
use crate::number::Profile;
use crate::opcode::{self, WIDE};
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Runs at most `budget` instructions: `Continue` means that it is used up.
    #[inline(never)]
    pub(super) fn interpret<H: Host<P>>(
        &mut self,
        host: &mut H,
        mut budget: u16,
    ) -> Result<Flow, Stopped> {
        let Some(program) = self.program else { return Ok(Flow::Done) };
        let code = program.code;
        let mut pc = usize::from(self.pc);
        let mut fp = usize::from(self.fp);
        let mut sp = usize::from(self.sp);

        macro_rules! store {
            () => {
                self.pc = pc as u16;
                self.fp = fp as u16;
                self.sp = sp as u16;
            };
        }
        macro_rules! load {
            () => {
                pc = usize::from(self.pc);
                fp = usize::from(self.fp);
                sp = usize::from(self.sp);
            };
        }
        macro_rules! push {
            ($value:expr) => {{
                let value = $value;
                self.arena.set_fast(sp, value);
                sp = sp.wrapping_add(1);
            }};
        }
        macro_rules! top {
            ($below:literal) => {
                self.arena.get_fast(sp.wrapping_sub($below))
            };
        }
        // The rest of the machine works on the stored registers.
        macro_rules! slow {
            ($call:expr) => {{
                store!();
                let result = $call?;
                load!();
                result
            }};
        }
        macro_rules! jump {
            ($offset:expr) => {
                pc = pc.wrapping_add_signed($offset as isize)
            };
        }
        // Compares the two values on top, integers at once.
        macro_rules! compare {
            ($opcode:expr, $a:ident, $b:ident, $fast:expr) => {{
                let $a = top!(2);
                let $b = top!(1);
                if $a.is(Tag::INT) && $b.is(Tag::INT) {
                    let ($a, $b) = ($a.raw(), $b.raw());
                    $fast
                } else {
                    slow!(self.compare_slow($opcode, $a, $b))
                }
            }};
        }
        macro_rules! jump_if {
            ($opcode:expr, $offset:expr, $a:ident, $b:ident, $fast:expr) => {{
                let holds = compare!($opcode, $a, $b, $fast);
                sp = sp.wrapping_sub(2);
                if holds {
                    jump!($offset);
                }
            }};
        }
        macro_rules! arithmetic {
            ($opcode:expr, $operation:path) => {{
                let a = top!(2);
                let b = top!(1);
                let result = if a.is(Tag::INT) && b.is(Tag::INT) {
                    Value::new(Tag::INT, $operation(a.raw(), b.raw()))
                } else {
                    slow!(self.binary($opcode, a, b))
                };
                sp = sp.wrapping_sub(1);
                self.arena.set_fast(sp.wrapping_sub(1), result);
            }};
        }

        loop {
            if pc >= SPECIAL {
                // Going on in a built-in counts as an instruction.
                store!();
                if pc == Native::Exit.position() {
                    return Ok(Flow::Done);
                }
                if budget == 0 {
                    return Ok(Flow::Continue);
                }
                budget -= 1;
                if self.resume(host)? == Flow::Waiting {
                    return Ok(Flow::Waiting);
                }
                load!();
                continue;
            }
            if budget == 0 {
                store!();
                return Ok(Flow::Continue);
            }
            budget -= 1;

            let byte = code.byte(pc);
            pc = pc.wrapping_add(1);
            let mut op = byte;
            let mut arg: i16 = 0;
            if byte & 0x40 != 0 {
                if byte & WIDE == 0 {
                    arg = i16::from(code.byte(pc) as i8);
                    pc = pc.wrapping_add(1);
                } else {
                    arg = code.word(pc) as i16;
                    pc = pc.wrapping_add(2);
                    op = byte & !WIDE;
                }
            }
            match op {
                // Short forms, by the ranges of `opcode::SHORTS`.
                0x80..=0x8f => {
                    arg = i16::from(byte & 0x0f) + opcode::SHORT_LOCAL_GET.low;
                    let value = self.arena.get_fast(fp.wrapping_add_signed(isize::from(arg)));
                    if value.is(Tag::UNSET) {
                        store!();
                        return Err(self.fail(FaultCode::MissingArgument));
                    }
                    push!(value);
                }
                0x90..=0x9f => {
                    let number = i16::from(byte & 0x0f) + opcode::SHORT_INT.low;
                    push!(Value::int(i32::from(number)));
                }
                0xa0..=0xaf => push!(self.arena.get_fast(GLOBALS + usize::from(byte & 0x0f))),
                0xb0..=0xb7 => {
                    sp = sp.wrapping_sub(1);
                    self.arena.set_fast(GLOBALS + usize::from(byte & 0x07), self.arena.get_fast(sp));
                }
                opcode::LOCAL_GET => {
                    let value = self.arena.get_fast(fp.wrapping_add_signed(isize::from(arg)));
                    if value.is(Tag::UNSET) {
                        store!();
                        return Err(self.fail(FaultCode::MissingArgument));
                    }
                    push!(value);
                }
                opcode::LOCAL_SET => {
                    sp = sp.wrapping_sub(1);
                    self.arena.set_fast(fp.wrapping_add_signed(isize::from(arg)), self.arena.get_fast(sp));
                }
                opcode::GLOBAL_GET => push!(self.arena.get_fast(GLOBALS + arg as usize)),
                opcode::GLOBAL_SET => {
                    sp = sp.wrapping_sub(1);
                    self.arena.set_fast(GLOBALS + arg as usize, self.arena.get_fast(sp));
                }
                opcode::INT => push!(Value::int(i32::from(arg))),
                opcode::NIL => push!(Value::nil()),
                opcode::POP => sp = sp.wrapping_sub(1),
                opcode::POP_N => sp = sp.wrapping_sub(arg as usize),

                opcode::ADD => arithmetic!(op, P::add),
                opcode::SUB => arithmetic!(op, P::sub),
                opcode::MUL => arithmetic!(op, P::mul),
                opcode::ADD_INT => {
                    let a = top!(1);
                    let b = Value::int(i32::from(arg));
                    let result = if a.is(Tag::INT) {
                        Value::new(Tag::INT, P::add(a.raw(), b.raw()))
                    } else {
                        slow!(self.binary(opcode::ADD, a, b))
                    };
                    self.arena.set_fast(sp.wrapping_sub(1), result);
                }
                opcode::LOCAL_ADD => {
                    let local = fp.wrapping_add_signed(isize::from(arg));
                    let b = Value::int(i32::from(code.byte(pc) as i8));
                    pc = pc.wrapping_add(1);
                    let a = self.arena.get_fast(local);
                    let result = if a.is(Tag::INT) {
                        Value::new(Tag::INT, P::add(a.raw(), b.raw()))
                    } else {
                        slow!(self.binary(opcode::ADD, a, b))
                    };
                    self.arena.set_fast(local, result);
                }

                opcode::JUMP => jump!(arg),
                opcode::JUMP_FALSE => {
                    sp = sp.wrapping_sub(1);
                    if self.arena.get_fast(sp).is_false() {
                        jump!(arg);
                    }
                }
                opcode::JUMP_TRUE => {
                    sp = sp.wrapping_sub(1);
                    if !self.arena.get_fast(sp).is_false() {
                        jump!(arg);
                    }
                }
                opcode::JUMP_EQ => jump_if!(opcode::EQ, arg, a, b, a == b),
                opcode::JUMP_NE => jump_if!(opcode::NE, arg, a, b, a != b),
                opcode::JUMP_LT => jump_if!(opcode::LT, arg, a, b, P::int_less(a, b)),
                opcode::JUMP_LE => jump_if!(opcode::LE, arg, a, b, !P::int_less(b, a)),
                opcode::JUMP_GT => jump_if!(opcode::GT, arg, a, b, P::int_less(b, a)),
                opcode::JUMP_GE => jump_if!(opcode::GE, arg, a, b, !P::int_less(a, b)),
                opcode::JUMP_NOT_LT => jump_if!(op, arg, a, b, !P::int_less(a, b)),
                opcode::JUMP_NOT_LE => jump_if!(op, arg, a, b, P::int_less(b, a)),
                opcode::JUMP_NOT_GT => jump_if!(op, arg, a, b, !P::int_less(b, a)),
                opcode::JUMP_NOT_GE => jump_if!(op, arg, a, b, P::int_less(a, b)),

                opcode::CALL_FUNCTION => {
                    let function = program.function(arg as u16);
                    let head = code.byte(function);
                    let room = usize::from(code.byte(function.wrapping_add(1)));
                    let limit = sp + 1 + room;
                    if limit > usize::from(self.arena.reserved) {
                        store!();
                        self.ensure(limit)?;
                    }
                    self.arena.set_fast(sp, record(sp - fp, pc));
                    fp = sp;
                    sp += 1;
                    if head & USES_SELF != 0 {
                        push!(Value::nil());
                    }
                    pc = function + 2;
                }
                0xb8..=0xbb | opcode::RETURN => {
                    if op != opcode::RETURN {
                        arg = i16::from(byte & 0x03);
                    }
                    let value = top!(1);
                    let outer = self.arena.get_fast(fp);
                    sp = fp - arg as usize;
                    push!(value);
                    fp -= usize::from(outer.tag().0);
                    pc = outer.index();
                }
                0xbc..=0xbf | opcode::RETURN_NIL => {
                    if op != opcode::RETURN_NIL {
                        arg = i16::from(byte & 0x03);
                    }
                    let outer = self.arena.get_fast(fp);
                    sp = fp - arg as usize;
                    push!(Value::nil());
                    fp -= usize::from(outer.tag().0);
                    pc = outer.index();
                }
                opcode::CAPTURE_GET => {
                    let closure = self.arena.get_fast(fp.wrapping_add(1)).index();
                    push!(self.arena.captured(closure, arg as usize));
                }
                _ => slow!(self.slow(host, op, arg)),
            }
        }
    }

    /// Parameters of the function whose header is at `function`.
    pub(super) fn parameters(&self, function: usize) -> usize {
        match &self.program {
            Some(program) => usize::from(program.code.byte(function) & PARAMETERS),
            None => 0,
        }
    }
}
