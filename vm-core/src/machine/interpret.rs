//! The interpreter loop.
//!
//! Position, frame and stack pointer are locals of one loop over one `match`. An arm does what its instruction mostly
//! does, with integers, and goes on; everything else falls through to [`super::slow`], which works on the stored
//! registers. The arms change nothing before they are sure to finish.

use super::{Flow, GLOBALS, Native, SPECIAL, Vm, record};
use crate::bytecode::ByteCode;
use crate::fault::Stopped;
use crate::host::Host;
use crate::image::USES_SELF;
use crate::number::Profile;
use crate::opcode::{self, WIDE, order};
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Runs at most `budget` instructions: `Continue` means that it is used up.
    #[inline(never)]
    pub(super) fn interpret<H: Host<P>>(
        &mut self,
        host: &mut H,
        budget: u16,
    ) -> Result<Flow, Stopped> {
        // As wide as the processor's registers.
        let mut budget = usize::from(budget);
        let Some(program) = self.program else { return Ok(Flow::Done) };
        let code = program.code;
        let mut pc;
        let mut fp;
        let mut sp;

        macro_rules! get {
            ($at:expr) => {
                self.arena.get_fast($at)
            };
        }
        macro_rules! set {
            ($at:expr, $value:expr) => {
                self.arena.set_fast($at, $value)
            };
        }
        macro_rules! push {
            ($value:expr) => {{
                let value = $value;
                set!(sp, value);
                sp = sp.wrapping_add(1);
            }};
        }
        macro_rules! jump {
            ($offset:expr) => {
                pc = pc.wrapping_add_signed($offset)
            };
        }

        loop {
            pc = usize::from(self.pc);
            fp = usize::from(self.fp);
            sp = usize::from(self.sp);
            if pc >= SPECIAL {
                if pc == Native::EXIT.position() {
                    return Ok(Flow::Done);
                }
                // Going on in a built-in counts as an instruction.
                if budget == 0 {
                    return Ok(Flow::Continue);
                }
                budget -= 1;
                if self.resume(host)? == Flow::Waiting {
                    return Ok(Flow::Waiting);
                }
                budget = self.less_work(budget);
                continue;
            }

            let mut op;
            let mut arg: isize;
            // Runs until an instruction is not done by its arm.
            let left = loop {
                if budget == 0 {
                    op = opcode::NIL;
                    arg = 0;
                    break Left::BudgetSpent;
                }
                budget -= 1;

                op = code.byte(pc);
                pc = pc.wrapping_add(1);
                arg = 0;
                if op & 0xc0 == 0x80 {
                    // Short forms, by the ranges of `opcode::SHORTS`.
                    let low = isize::from(op & 0x0f);
                    (op, arg) = match op & 0x3c {
                        0x00..=0x0c => {
                            let value = get!(
                                fp.wrapping_add_signed(low + opcode::SHORT_LOCAL_GET.low as isize)
                            );
                            if value.is(Tag::UNSET) {
                                op = opcode::LOCAL_GET;
                                break Left::Undone;
                            }
                            push!(value);
                            continue;
                        }
                        0x10..=0x1c => (opcode::INT, low + opcode::SHORT_INT.low as isize),
                        0x20..=0x2c => {
                            push!(get!(GLOBALS + low as usize));
                            continue;
                        }
                        0x30 | 0x34 => (opcode::GLOBAL_SET, low),
                        0x38 => (opcode::RETURN, low & 0x03),
                        _ => (opcode::RETURN_NIL, low & 0x03),
                    };
                } else if op & 0x40 != 0 {
                    if op & WIDE == 0 {
                        arg = isize::from(code.byte(pc) as i8);
                        pc = pc.wrapping_add(1);
                    } else {
                        arg = isize::from(code.word(pc) as i16);
                        pc = pc.wrapping_add(2);
                        op &= !WIDE;
                    }
                }
                match op {
                    opcode::LOCAL_GET => {
                        let value = get!(fp.wrapping_add_signed(arg));
                        if !value.is(Tag::UNSET) {
                            push!(value);
                            continue;
                        }
                    }
                    opcode::GLOBAL_GET => {
                        push!(get!(GLOBALS + arg as usize));
                        continue;
                    }
                    opcode::GLOBAL_SET => {
                        sp = sp.wrapping_sub(1);
                        set!(GLOBALS + arg as usize, get!(sp));
                        continue;
                    }
                    opcode::LOCAL_SET => {
                        sp = sp.wrapping_sub(1);
                        set!(fp.wrapping_add_signed(arg), get!(sp));
                        continue;
                    }
                    opcode::INT => {
                        push!(Value::int(arg as i32));
                        continue;
                    }
                    opcode::POP => {
                        sp = sp.wrapping_sub(1);
                        continue;
                    }
                    opcode::POP_N => {
                        sp = sp.wrapping_sub(arg as usize);
                        continue;
                    }
                    opcode::ADD..=opcode::MOD => {
                        let [a, b] = self.arena.pair_fast(sp.wrapping_sub(2));
                        if a.is(Tag::INT) && b.is(Tag::INT) {
                            let result = match op {
                                opcode::ADD => Some(P::add(a.raw(), b.raw())),
                                opcode::SUB => Some(P::sub(a.raw(), b.raw())),
                                opcode::MUL => Some(P::mul(a.raw(), b.raw())),
                                opcode::DIV => P::div(a.raw(), b.raw()),
                                _ => P::modulo(a.raw(), b.raw()),
                            };
                            if let Some(result) = result {
                                sp = sp.wrapping_sub(1);
                                set!(sp.wrapping_sub(1), Value::new(Tag::INT, result));
                                continue;
                            }
                        }
                    }
                    opcode::ADD_INT => {
                        let at = sp.wrapping_sub(1);
                        let a = get!(at);
                        if a.is(Tag::INT) {
                            let b = P::int_from_i32(arg as i32);
                            set!(at, Value::new(Tag::INT, P::add(a.raw(), b)));
                            continue;
                        }
                    }
                    opcode::LOCAL_ADD => {
                        let at = fp.wrapping_add_signed(arg);
                        let a = get!(at);
                        if a.is(Tag::INT) {
                            let b = P::int_from_i32(i32::from(code.byte(pc) as i8));
                            pc = pc.wrapping_add(1);
                            set!(at, Value::new(Tag::INT, P::add(a.raw(), b)));
                            continue;
                        }
                    }
                    opcode::JUMP => {
                        jump!(arg);
                        continue;
                    }
                    opcode::JUMP_FALSE | opcode::JUMP_TRUE => {
                        sp = sp.wrapping_sub(1);
                        if get!(sp).is_false() == (op == opcode::JUMP_FALSE) {
                            jump!(arg);
                        }
                        continue;
                    }
                    opcode::JUMP_LT..=opcode::JUMP_NOT_LT => {
                        let [a, b] = self.arena.pair_fast(sp.wrapping_sub(2));
                        if a.is(Tag::INT) && b.is(Tag::INT) {
                            sp = sp.wrapping_sub(2);
                            if op & order_of::<P>(a.raw(), b.raw()) != 0 {
                                jump!(arg);
                            }
                            continue;
                        }
                    }
                    opcode::JUMP_LT_INT..=opcode::JUMP_NOT_LT_INT => {
                        let a = get!(sp.wrapping_sub(1));
                        if a.is(Tag::INT) {
                            let b = P::int_from_i32(i32::from(code.byte(pc) as i8));
                            pc = pc.wrapping_add(1);
                            sp = sp.wrapping_sub(1);
                            if op & order_of::<P>(a.raw(), b) != 0 {
                                jump!(arg);
                            }
                            continue;
                        }
                    }
                    opcode::JUMP_LOCAL => {
                        let (relation, local) = opcode::relation_of_local(code.byte(pc));
                        let a = get!(fp.wrapping_add_signed(isize::from(local)));
                        if a.is(Tag::INT) {
                            let b = i32::from(code.byte(pc.wrapping_add(1)) as i8);
                            pc = pc.wrapping_add(2);
                            if relation & order_of::<P>(a.raw(), P::int_from_i32(b)) != 0 {
                                jump!(arg);
                            }
                            continue;
                        }
                    }
                    opcode::CALL_FUNCTION => {
                        let function = program.function(arg as u16);
                        let room = usize::from(code.byte(function.wrapping_add(1)));
                        if sp.wrapping_add(1).wrapping_add(room) <= usize::from(self.arena.reserved)
                        {
                            let uses_self = code.byte(function) & USES_SELF != 0;
                            set!(sp, record(sp.wrapping_sub(fp), pc));
                            fp = sp;
                            sp = sp.wrapping_add(1);
                            if uses_self {
                                push!(Value::nil());
                            }
                            pc = function.wrapping_add(2);
                            continue;
                        }
                    }
                    opcode::RETURN | opcode::RETURN_NIL => {
                        let value = if op == opcode::RETURN {
                            get!(sp.wrapping_sub(1))
                        } else {
                            Value::nil()
                        };
                        let outer = get!(fp);
                        sp = fp.wrapping_sub(arg as usize);
                        push!(value);
                        fp = fp.wrapping_sub(usize::from(outer.tag().count()));
                        pc = outer.index();
                        if pc < SPECIAL {
                            continue;
                        }
                        if pc == Native::EXIT.position() {
                            // The stack is empty: the registers start anew.
                            return Ok(Flow::Done);
                        }
                        break Left::Returned;
                    }
                    // Tables under plain keys; libraries, other keys, functions that may have to be bound and
                    // allocations that need a collection are slow.
                    opcode::FIELD_GET | opcode::FIELD_METHOD => {
                        let at = sp.wrapping_sub(1);
                        let table = get!(at);
                        if table.is(Tag::TABLE) {
                            let key = Value::string(arg as u16);
                            let value = self.arena.table_get(table.index(), key);
                            if op == opcode::FIELD_METHOD {
                                push!(value);
                                continue;
                            } else if !value.may_use_self() {
                                set!(at, value);
                                continue;
                            }
                        }
                    }
                    opcode::INDEX_GET => {
                        let table = get!(sp.wrapping_sub(2));
                        let key = get!(sp.wrapping_sub(1));
                        if table.is(Tag::TABLE) && key.is(Tag::INT) {
                            let value = self.arena.table_get(table.index(), key);
                            if !value.may_use_self() {
                                sp = sp.wrapping_sub(1);
                                set!(sp.wrapping_sub(1), value);
                                continue;
                            }
                        }
                    }
                    opcode::FIELD_SET => {
                        let table = get!(sp.wrapping_sub(2));
                        let key = Value::string(arg as u16);
                        if self.set_quickly(table, key, get!(sp.wrapping_sub(1))) {
                            sp = sp.wrapping_sub(2);
                            continue;
                        }
                    }
                    opcode::INDEX_SET => {
                        let table = get!(sp.wrapping_sub(3));
                        let key = get!(sp.wrapping_sub(2));
                        if key.is(Tag::INT)
                            && self.set_quickly(table, key, get!(sp.wrapping_sub(1)))
                        {
                            sp = sp.wrapping_sub(3);
                            continue;
                        }
                    }
                    opcode::CAPTURE_GET => {
                        let closure = get!(fp.wrapping_add(1)).index();
                        push!(self.arena.captured(closure, arg as usize));
                        continue;
                    }
                    _ => {}
                }
                break Left::Undone;
            };
            self.pc = pc as u16;
            self.fp = fp as u16;
            self.sp = sp as u16;
            match left {
                Left::BudgetSpent => return Ok(Flow::Continue),
                // The commonest of the slow ones, without a second search for the opcode.
                Left::Undone if matches!(op, opcode::CALL | opcode::CALL_METHOD) => {
                    let count = arg as usize;
                    let callee = get!(sp.wrapping_sub(count).wrapping_sub(1));
                    self.call(host, callee, count, usize::from(op - opcode::CALL) + 1)?;
                    budget = self.less_work(budget);
                }
                Left::Undone => {
                    self.slow(host, op, arg as i16)?;
                    budget = self.less_work(budget);
                }
                Left::Returned => {}
            }
        }
    }

    /// What is left of a budget after the work on text.
    #[cfg(feature = "strings")]
    fn less_work(&mut self, budget: usize) -> usize {
        budget.saturating_sub(usize::from(core::mem::take(&mut self.work)))
    }

    #[cfg(not(feature = "strings"))]
    #[inline(always)]
    fn less_work(&mut self, budget: usize) -> usize {
        budget
    }
}

/// The order of two integers, as the bit of the relations that hold.
#[inline(always)]
fn order_of<P: Profile>(a: P::Raw, b: P::Raw) -> u8 {
    if P::int_less(a, b) {
        order::LESS
    } else if a == b {
        order::EQUAL
    } else {
        order::GREATER
    }
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Stores into a table if no collection is needed for it. Tests of scarce memory want all allocations in one place.
    #[inline(always)]
    fn set_quickly(&mut self, table: Value<P>, key: Value<P>, value: Value<P>) -> bool {
        cfg!(not(feature = "torture"))
            && table.is(Tag::TABLE)
            && self.arena.table_set(table.index(), key, value).is_ok()
    }
}

/// Why the inner loop was left.
enum Left {
    /// The instruction is decoded, but not done.
    Undone,
    /// A function returned to the machine itself.
    Returned,
    BudgetSpent,
}
