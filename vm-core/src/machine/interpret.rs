//! The interpreter loop.
//!
//! Position and stack pointer are locals of one loop over one `match`; all else is in memory, since an AVR has no more
//! registers to give away. An arm does what its instruction mostly does, with integers, and goes on; everything else falls
//! through to [`super::slow`], which works on the stored registers. The arms change nothing before they are sure to
//! finish.
//!
//! Opcodes with an arm in common stand side by side: a range would be tested by itself, before the jump table or behind
//! it. Whatever calls a function is a function itself, on slots, so that the loop keeps no values across a call.

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
    #[allow(clippy::collapsible_match, reason = "guards would split the jump table")]
    pub(super) fn interpret<H: Host<P>>(
        &mut self,
        host: &mut H,
        budget: u16,
    ) -> Result<Flow, Stopped> {
        // As wide as the processor's registers.
        let mut budget = usize::from(budget);
        let Some(program) = &self.program else { return Ok(Flow::Done) };
        let code = program.code;
        let mut pc;
        let mut sp;

        macro_rules! get {
            ($at:expr) => {
                self.arena.get_fast($at)
            };
        }
        macro_rules! fp {
            () => {
                usize::from(self.fp)
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
                #[cfg(feature = "swarm")]
                if pc == Native::MESSAGES.position() {
                    self.next_message(host)?;
                    continue;
                }
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
                    (op, arg) = match op & 0x30 {
                        0x00 => {
                            let value =
                                get!(fp!().wrapping_add_signed(
                                    low + opcode::SHORT_LOCAL_GET.low as isize
                                ));
                            if value.is(Tag::UNSET) {
                                op = opcode::LOCAL_GET;
                                break Left::Undone;
                            }
                            push!(value);
                            continue;
                        }
                        0x10 => (opcode::INT, low + opcode::SHORT_INT.low as isize),
                        0x20 => {
                            push!(get!(GLOBALS + low as usize));
                            continue;
                        }
                        _ if op & 0x08 == 0 => (opcode::GLOBAL_SET, low),
                        _ if op & 0x04 == 0 => (opcode::RETURN, low & 0x03),
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
                        let value = get!(fp!().wrapping_add_signed(arg));
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
                        set!(fp!().wrapping_add_signed(arg), get!(sp));
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
                    opcode::ADD | opcode::SUB | opcode::MUL => {
                        let [a, b] = self.arena.pair_fast(sp.wrapping_sub(2));
                        if a.is(Tag::INT) && b.is(Tag::INT) {
                            let result = match op {
                                opcode::ADD => P::add(a.raw(), b.raw()),
                                opcode::SUB => P::sub(a.raw(), b.raw()),
                                _ => P::mul(a.raw(), b.raw()),
                            };
                            sp = sp.wrapping_sub(1);
                            set!(sp.wrapping_sub(1), Value::new(Tag::INT, result));
                            continue;
                        }
                    }
                    opcode::DIV | opcode::MOD => {
                        if self.divide_quickly(op, sp) {
                            sp = sp.wrapping_sub(1);
                            continue;
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
                        let at = fp!().wrapping_add_signed(arg);
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
                    opcode::JUMP_LT
                    | opcode::JUMP_EQ
                    | opcode::JUMP_LE
                    | opcode::JUMP_GT
                    | opcode::JUMP_NE
                    | opcode::JUMP_GE
                    | opcode::JUMP_NOT_GE
                    | opcode::JUMP_NOT_GT
                    | opcode::JUMP_NOT_LE
                    | opcode::JUMP_NOT_LT => {
                        let [a, b] = self.arena.pair_fast(sp.wrapping_sub(2));
                        if a.is(Tag::INT) && b.is(Tag::INT) {
                            sp = sp.wrapping_sub(2);
                            if op & order_of::<P>(a.raw(), b.raw()) != 0 {
                                jump!(arg);
                            }
                            continue;
                        }
                    }
                    opcode::JUMP_LT_INT
                    | opcode::JUMP_EQ_INT
                    | opcode::JUMP_LE_INT
                    | opcode::JUMP_GT_INT
                    | opcode::JUMP_NE_INT
                    | opcode::JUMP_GE_INT
                    | opcode::JUMP_NOT_GE_INT
                    | opcode::JUMP_NOT_GT_INT
                    | opcode::JUMP_NOT_LE_INT
                    | opcode::JUMP_NOT_LT_INT => {
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
                        let a = get!(fp!().wrapping_add_signed(isize::from(local)));
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
                        let Some(program) = &self.program else { return Ok(Flow::Done) };
                        let function = program.function(arg as u16);
                        let room = usize::from(code.byte(function.wrapping_add(1)));
                        if sp.wrapping_add(1).wrapping_add(room) <= usize::from(self.arena.reserved)
                        {
                            let uses_self = code.byte(function) & USES_SELF != 0;
                            set!(sp, record(sp.wrapping_sub(fp!()), pc));
                            self.fp = sp as u16;
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
                        let outer = get!(fp!());
                        let caller = self.fp.wrapping_sub(u16::from(outer.tag().byte()));
                        pc = outer.index();
                        if pc == Native::EXIT.position() {
                            // Nobody takes the value of an entry.
                            self.fp = caller;
                            return Ok(Flow::Done);
                        }
                        sp = fp!().wrapping_sub(arg as usize);
                        push!(value);
                        self.fp = caller;
                        if pc >= SPECIAL {
                            break Left::Returned;
                        }
                        continue;
                    }
                    // Tables under plain keys; libraries, other keys, functions that may have to be bound and
                    // allocations that need a collection are slow.
                    opcode::FIELD_GET => {
                        let at = sp.wrapping_sub(1);
                        if self.get_quickly(at, Value::string(arg as u16), at) {
                            continue;
                        }
                    }
                    opcode::FIELD_METHOD => {
                        let at = sp.wrapping_sub(1);
                        if self.get_quickly(at, Value::string(arg as u16), sp) {
                            sp = sp.wrapping_add(1);
                            continue;
                        }
                    }
                    opcode::INDEX_GET => {
                        let at = sp.wrapping_sub(2);
                        let key = get!(sp.wrapping_sub(1));
                        if key.is(Tag::INT) && self.get_quickly(at, key, at) {
                            sp = sp.wrapping_sub(1);
                            continue;
                        }
                    }
                    opcode::FIELD_SET => {
                        if self.set_quickly(sp.wrapping_sub(2), Value::string(arg as u16), sp) {
                            sp = sp.wrapping_sub(2);
                            continue;
                        }
                    }
                    opcode::INDEX_SET => {
                        let key = get!(sp.wrapping_sub(2));
                        if key.is(Tag::INT) && self.set_quickly(sp.wrapping_sub(3), key, sp) {
                            sp = sp.wrapping_sub(3);
                            continue;
                        }
                    }
                    opcode::CAPTURE_GET => {
                        let closure = get!(fp!().wrapping_add(1)).index();
                        push!(self.arena.captured(closure, arg as usize));
                        continue;
                    }
                    _ => {}
                }
                break Left::Undone;
            };
            self.pc = pc as u16;
            self.sp = sp as u16;
            match left {
                Left::BudgetSpent => return Ok(Flow::Continue),
                // The commonest of the slow ones, without a second search for the opcode.
                Left::Undone if matches!(op, opcode::CALL | opcode::CALL_METHOD) => {
                    let count = arg as u8;
                    let callee = get!(sp.wrapping_sub(usize::from(count)).wrapping_sub(1));
                    self.call(host, callee, count, op.wrapping_sub(opcode::CALL - 1))?;
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
    /// Divides integers, if they are the two operands below `sp`.
    #[inline(never)]
    fn divide_quickly(&mut self, op: u8, sp: usize) -> bool {
        let at = sp.wrapping_sub(2);
        let [a, b] = self.arena.pair_fast(at);
        if !(a.is(Tag::INT) && b.is(Tag::INT)) {
            return false;
        }
        let result = match op {
            opcode::DIV => P::div(a.raw(), b.raw()),
            _ => P::modulo(a.raw(), b.raw()),
        };
        let Some(result) = result else { return false };
        self.arena.set_fast(at, Value::new(Tag::INT, result));
        true
    }

    /// Puts the value under a key of the table in slot `table` into slot `to`, if it is a table. In the table's own slot it
    /// may be no function that would have to be bound.
    #[inline(never)]
    fn get_quickly(&mut self, table: usize, key: Value<P>, to: usize) -> bool {
        let object = self.arena.get_fast(table);
        if !object.is(Tag::TABLE) {
            return false;
        }
        let value = self.arena.table_get(object.index(), key);
        if to == table && value.may_use_self() {
            return false;
        }
        self.arena.set_fast(to, value);
        true
    }

    /// Stores the top value into the table in a slot if no collection is needed for it. Tests of scarce memory want all
    /// allocations in one place.
    #[inline(never)]
    fn set_quickly(&mut self, table: usize, key: Value<P>, sp: usize) -> bool {
        let table = self.arena.get_fast(table);
        let value = self.arena.get_fast(sp.wrapping_sub(1));
        cfg!(not(feature = "torture"))
            && table.is(Tag::TABLE)
            && self.arena.table_set(table.index(), key, value).is_ok()
    }
}

/// Why the inner loop was left.
enum Left {
    /// The instruction is decoded, but not done.
    Undone,
    /// A function has returned to the machine itself.
    Returned,
    BudgetSpent,
}
