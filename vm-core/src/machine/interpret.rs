//! The interpreter loop.
//!
//! The verifier has proved that every position which the loop reaches is an instruction and that
//! every slot which an operand names exists ([`crate::verify`]). The loop therefore checks neither
//! jumps nor the depth of the stack. Two checks are left, because no verifier can decide them: the
//! types of values, and the room for the frame of a call.
//!
//! # Fast arms and the slow path
//! An arm of the `match` handles the case that its instruction has most of the time, such as two
//! integers, and continues with the next instruction. Every other case leaves the `match`, and
//! [`Vm::slow`] executes the decoded instruction on the stored registers. An arm changes neither
//! slots nor the stack pointer before it is sure to finish, so the slow path can do all of the
//! instruction. The obvious alternative is to handle all cases in the arm. It would make the loop
//! so large that its variables no longer fit in registers, and it would spread each rare case over
//! several arms.
//!
//! # Registers
//! Position, stack pointer and frame are local variables of the loop. Everything else stays in
//! memory, since an AVR has no more registers to give away. The helpers that arms call are
//! functions of their own which take slots by number, so few values have to survive a call. The
//! local variables are stored when the inner loop ends and loaded again when the outer loop goes
//! round.
//!
//! # No recursion
//! No built-in calls the interpreter. `foreach`, `map` and the handling of messages have frames
//! whose return position is at least [`SPECIAL`]. When a script's function returns to such a
//! position, the loop resumes the built-in. A script can therefore nest them as deep as its own
//! memory allows, the processor's stack does not grow with the script, and `run` can stop between
//! any two instructions.
//!
//! # Budget
//! Each instruction takes one from the budget, and work on text takes more. After instructions that
//! may take long, the loop asks the host whether the slice is over. On a host with
//! [`Host::IS_TIMED`], such as a Kilobot, it asks before each instruction instead and counts no
//! budget.
//!
//! # Order of the arms
//! Opcodes that share an arm are listed one by one. A range would be compared separately, before or
//! after the jump table. [`super::quick`] describes the loop that is before this one on robots with more flash, [`super::decode`] explains the two decoders; `docs/instruction-set.md` has
//! all instructions, and `docs/performance.md` the cost of each.

use super::decode::forms::decode_form;
use super::decode::table::{self, short};
use super::{Flow, GLOBALS, Native, SPECIAL, Vm, record};
use crate::bytecode::ByteCode;
use crate::fault::Stopped;
use crate::host::Host;
use crate::image::USES_SELF;
use crate::number::wide::IS_WIDE;
use crate::number::{Profile, TextWork};
use crate::opcode::{self, DROP_RESULT, WIDE, order};
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Runs at most `budget` instructions, or until the host ends the slice. `Continue` means that
    /// the script is not finished and runs on in the next slice.
    #[one_copy]
    #[allow(clippy::collapsible_match, reason = "guards would split the jump table")]
    #[allow(
        clippy::manual_range_patterns,
        reason = "ranges would be compared, not looked up in the jump table"
    )]
    pub(super) fn interpret<H: Host<P>>(
        &mut self,
        host: &mut H,
        budget: u16,
    ) -> Result<Flow, Stopped> {
        // A word of the processor: arithmetic on 16 bits would need extra instructions on ARM.
        let mut budget = usize::from(budget);
        let Some(program) = self.program() else { return Ok(Flow::Done) };
        let code = program.code;
        let mut pc;
        let mut sp;
        // The slot of the frame's record. Only the decoder `table` reads it; see `fp!`.
        let mut fp;

        macro_rules! get {
            ($at:expr) => {
                self.arena.get_fast($at)
            };
        }
        macro_rules! fp {
            () => {
                if Self::DIRECT { fp } else { usize::from(self.fp) }
            };
        }
        macro_rules! set_fp {
            ($to:expr) => {
                self.fp = $to;
                fp = usize::from(self.fp);
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
        // Passes over the operand. With `DIRECT` it has been read together with the opcode, but the
        // position is still in front of its last byte.
        macro_rules! operand {
            () => {
                if Self::DIRECT {
                    pc = pc.wrapping_add(1);
                }
            };
        }

        // True if the slice is over. Otherwise takes one instruction from the budget.
        macro_rules! is_over {
            () => {
                if H::IS_TIMED {
                    host.is_slice_over()
                } else if IS_WIDE {
                    // One machine instruction. The wrapped budget does no harm, because the slice
                    // ends here.
                    let is_over;
                    (budget, is_over) = budget.overflowing_sub(1);
                    is_over
                } else {
                    let is_over = budget == 0;
                    budget = budget.wrapping_sub(1);
                    is_over
                }
            };
        }

        // Takes the value of an operation that can fail. A fault during the handling of a message
        // may end that handling alone; every other fault stops the script.
        macro_rules! contained {
            ($result:expr) => {
                match $result {
                    Ok(value) => value,
                    Err(Stopped) if Self::HAS_NETWORK && self.contain(host) => continue,
                    Err(Stopped) => return Err(Stopped),
                }
            };
        }

        // The position of the running instruction, on a machine that may have to repeat it.
        let mut start = 0;
        let mut has_returned = false;
        loop {
            pc = usize::from(self.pc);
            sp = usize::from(self.sp);
            fp = usize::from(self.fp);
            // The instruction that ended the inner loop may have taken long, unless it was a
            // return.
            let mut is_over = !H::IS_TIMED && !has_returned && host.is_slice_over();
            if Self::PAUSES {
                is_over |= self.begins_collection(pc);
            }
            if is_over {
                budget = 0;
            }
            has_returned = false;
            if pc >= SPECIAL {
                if pc == Native::EXIT.position() {
                    return Ok(Flow::Done);
                }
                // A resumed built-in counts as one instruction.
                if is_over!() {
                    return Ok(Flow::Continue);
                }
                if Self::HAS_NETWORK && pc == Native::MESSAGES.position() {
                    contained!(self.next_message(host));
                    continue;
                }
                if contained!(self.resume(host)) == Flow::Waiting {
                    return Ok(Flow::Waiting);
                }
                budget = self.charge_text_work(host, budget);
                continue;
            }

            let mut op;
            let mut arg: isize;
            // Executes instructions until an arm cannot finish its instruction.
            let left = 'run: loop {
                if Self::IS_QUICK && !H::IS_TIMED {
                    self.pc = pc as u16;
                    self.sp = sp as u16;
                    budget = self.run_quickly(code, budget);
                    pc = usize::from(self.pc);
                    sp = usize::from(self.sp);
                    fp = usize::from(self.fp);
                    if pc >= SPECIAL {
                        op = opcode::NIL;
                        arg = 0;
                        break 'run LoopExit::Returned;
                    }
                }
                if is_over!() {
                    op = opcode::NIL;
                    arg = 0;
                    break 'run LoopExit::SliceOver;
                }

                if Self::PAUSES {
                    start = pc;
                }
                if Self::DIRECT {
                    (op, arg) = table::fetch(code, pc);
                    pc = pc.wrapping_add(1);
                } else {
                    decode_form!(code at pc, op arg, 'run);
                }
                'decoded: loop {
                    // Executes `op`, which is `RETURN` or `RETURN_NIL`; its operand is the number
                    // of parameters.
                    macro_rules! return_from {
                        () => {{
                            let value = if op == opcode::RETURN {
                                get!(sp.wrapping_sub(1))
                            } else {
                                Value::nil()
                            };
                            let outer = get!(fp!());
                            let caller = self.fp.wrapping_sub(u16::from(outer.tag().byte()));
                            pc = outer.index();
                            if pc == Native::EXIT.position() {
                                // The value of an entry is not used.
                                self.fp = caller;
                                return Ok(Flow::Done);
                            }
                            sp = fp!().wrapping_sub(arg as usize);
                            push!(value);
                            set_fp!(caller);
                            if pc >= SPECIAL {
                                break 'run LoopExit::Returned;
                            }
                            continue 'run;
                        }};
                    }
                    match op {
                        opcode::LOCAL_GET => {
                            operand!();
                            let value = get!(fp!().wrapping_add_signed(arg));
                            if !value.is(Tag::UNSET) {
                                push!(value);
                                continue 'run;
                            }
                        }
                        opcode::GLOBAL_GET => {
                            operand!();
                            push!(get!(GLOBALS + arg as usize));
                            continue 'run;
                        }
                        opcode::GLOBAL_SET => {
                            operand!();
                            sp = sp.wrapping_sub(1);
                            set!(GLOBALS + arg as usize, get!(sp));
                            continue 'run;
                        }
                        opcode::LOCAL_SET => {
                            operand!();
                            sp = sp.wrapping_sub(1);
                            set!(fp!().wrapping_add_signed(arg), get!(sp));
                            continue 'run;
                        }
                        opcode::INT => {
                            operand!();
                            push!(Value::int(arg as i32));
                            continue 'run;
                        }
                        opcode::POP => {
                            sp = sp.wrapping_sub(1);
                            continue 'run;
                        }
                        opcode::POP_N => {
                            operand!();
                            sp = sp.wrapping_sub(arg as usize);
                            continue 'run;
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
                                continue 'run;
                            }
                            if IS_WIDE && let Some(result) = Self::compute_quickly(op, a, b) {
                                sp = sp.wrapping_sub(1);
                                set!(sp.wrapping_sub(1), result);
                                continue 'run;
                            }
                        }
                        opcode::DIV | opcode::MOD => {
                            if self.divide_quickly(op, sp) {
                                sp = sp.wrapping_sub(1);
                                continue 'run;
                            }
                        }
                        opcode::ADD_INT => {
                            operand!();
                            let at = sp.wrapping_sub(1);
                            let a = get!(at);
                            if a.is(Tag::INT) {
                                let b = P::int_from_i32(arg as i32);
                                set!(at, Value::new(Tag::INT, P::add(a.raw(), b)));
                                continue 'run;
                            }
                        }
                        opcode::LOCAL_ADD => {
                            operand!();
                            let at = fp!().wrapping_add_signed(arg);
                            let a = get!(at);
                            if a.is(Tag::INT) {
                                let b = P::int_from_i32(i32::from(code.byte(pc) as i8));
                                pc = pc.wrapping_add(1);
                                set!(at, Value::new(Tag::INT, P::add(a.raw(), b)));
                                continue 'run;
                            }
                        }
                        opcode::JUMP => {
                            operand!();
                            jump!(arg);
                            continue 'run;
                        }
                        opcode::JUMP_FALSE | opcode::JUMP_TRUE => {
                            operand!();
                            sp = sp.wrapping_sub(1);
                            if get!(sp).is_false() == (op == opcode::JUMP_FALSE) {
                                jump!(arg);
                            }
                            continue 'run;
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
                            operand!();
                            let [a, b] = self.arena.pair_fast(sp.wrapping_sub(2));
                            if a.is(Tag::INT) && b.is(Tag::INT) {
                                sp = sp.wrapping_sub(2);
                                if op & order_of::<P>(a.raw(), b.raw()) != 0 {
                                    jump!(arg);
                                }
                                continue 'run;
                            }
                            if IS_WIDE && a.is_number() && b.is_number() {
                                let found = Self::order_of_numbers(a, b);
                                if found != order::NONE {
                                    sp = sp.wrapping_sub(2);
                                    if op & found != 0 {
                                        jump!(arg);
                                    }
                                    continue 'run;
                                }
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
                            operand!();
                            let a = get!(sp.wrapping_sub(1));
                            if a.is(Tag::INT) {
                                let b = P::int_from_i32(i32::from(code.byte(pc) as i8));
                                pc = pc.wrapping_add(1);
                                sp = sp.wrapping_sub(1);
                                if op & order_of::<P>(a.raw(), b) != 0 {
                                    jump!(arg);
                                }
                                continue 'run;
                            }
                        }
                        opcode::JUMP_LOCAL => {
                            operand!();
                            let (relation, local) = opcode::relation_of_local(code.byte(pc));
                            let a = get!(fp!().wrapping_add_signed(isize::from(local)));
                            if a.is(Tag::INT) {
                                let b = i32::from(code.word(pc.wrapping_add(1)) as i16);
                                pc = pc.wrapping_add(3);
                                if relation & order_of::<P>(a.raw(), P::int_from_i32(b)) != 0 {
                                    jump!(arg);
                                }
                                continue 'run;
                            }
                        }
                        opcode::CALL_FUNCTION => {
                            operand!();
                            let Some(program) = self.program() else { return Ok(Flow::Done) };
                            let function = program.function(arg as u16);
                            let room = usize::from(code.byte(function.wrapping_add(1)));
                            if sp.wrapping_add(1).wrapping_add(room)
                                <= usize::from(self.arena.reserved)
                            {
                                let uses_self = code.byte(function) & USES_SELF != 0;
                                set!(sp, record(sp.wrapping_sub(fp!()), pc));
                                set_fp!(sp as u16);
                                sp = sp.wrapping_add(1);
                                if uses_self {
                                    push!(Value::nil());
                                }
                                pc = function.wrapping_add(2);
                                continue 'run;
                            }
                        }
                        opcode::RETURN | opcode::RETURN_NIL => return_from!(),
                        opcode::CALL_BUILTIN if IS_WIDE => {
                            operand!();
                            let trailer = code.byte(pc);
                            let count = usize::from(trailer & !DROP_RESULT);
                            let at = sp.wrapping_sub(count);
                            if let Some(result) = self.call_quickly(arg as u8, at, count) {
                                pc = pc.wrapping_add(1);
                                set!(at, result);
                                sp = at.wrapping_add(usize::from(trailer & DROP_RESULT == 0));
                                continue 'run;
                            }
                        }
                        // The next arms handle tables with integer and string keys. The slow path
                        // handles libraries, other keys, functions that may have to be bound, and
                        // allocations that need a collection.
                        opcode::FIELD_GET => {
                            operand!();
                            let at = sp.wrapping_sub(1);
                            if self.get_quickly(at, Value::string(arg as u16), at) {
                                break 'decoded;
                            }
                        }
                        opcode::FIELD_METHOD => {
                            operand!();
                            let at = sp.wrapping_sub(1);
                            if self.get_quickly(at, Value::string(arg as u16), sp) {
                                sp = sp.wrapping_add(1);
                                break 'decoded;
                            }
                        }
                        opcode::INDEX_GET => {
                            let at = sp.wrapping_sub(2);
                            let key = get!(sp.wrapping_sub(1));
                            if key.is(Tag::INT) && self.get_quickly(at, key, at) {
                                sp = sp.wrapping_sub(1);
                                break 'decoded;
                            }
                        }
                        opcode::FIELD_SET => {
                            operand!();
                            if self.set_quickly(sp.wrapping_sub(2), Value::string(arg as u16), sp) {
                                sp = sp.wrapping_sub(2);
                                break 'decoded;
                            }
                        }
                        opcode::INDEX_SET => {
                            let key = get!(sp.wrapping_sub(2));
                            if key.is(Tag::INT) && self.set_quickly(sp.wrapping_sub(3), key, sp) {
                                sp = sp.wrapping_sub(3);
                                break 'decoded;
                            }
                        }
                        opcode::CAPTURE_GET => {
                            operand!();
                            let closure = get!(fp!().wrapping_add(1)).index();
                            push!(self.arena.captured(closure, arg as usize));
                            continue 'run;
                        }
                        // With `DIRECT`, the jump table also has the short forms of the image.
                        short!(LOCAL_GET) if Self::DIRECT => {
                            let low = table::short_local(op);
                            let value = get!(fp!().wrapping_add_signed(low));
                            if !value.is(Tag::UNSET) {
                                push!(value);
                                continue 'run;
                            }
                            op = opcode::LOCAL_GET;
                            arg = low;
                        }
                        short!(INT) if Self::DIRECT => {
                            push!(Value::int(table::short_int(op)));
                            continue 'run;
                        }
                        short!(GLOBAL_GET) if Self::DIRECT => {
                            push!(get!(GLOBALS + usize::from(op & 0x0f)));
                            continue 'run;
                        }
                        // On computers the size of the code does not matter, so these forms have
                        // arms of their own and need no second jump.
                        short!(GLOBAL_SET) if Self::DIRECT && IS_WIDE => {
                            sp = sp.wrapping_sub(1);
                            set!(GLOBALS + usize::from(op & 0x07), get!(sp));
                            continue 'run;
                        }
                        short!(RETURN) if Self::DIRECT && IS_WIDE => {
                            (op, arg) = table::short_other(op);
                            return_from!()
                        }
                        short!(GLOBAL_SET) | short!(RETURN) if Self::DIRECT => {
                            (op, arg) = table::short_other(op);
                            pc = pc.wrapping_sub(1);
                            continue 'decoded;
                        }
                        _ if Self::DIRECT && op & WIDE != 0 => {
                            (op, arg) = table::wide(code, pc, op);
                            pc = pc.wrapping_add(1);
                            continue 'decoded;
                        }
                        _ if Self::DIRECT && op & 0x40 != 0 => operand!(),
                        _ => {}
                    }
                    break 'run LoopExit::Undone;
                }
                // A search in a long table takes long.
                if !H::IS_TIMED && host.is_slice_over() {
                    break 'run LoopExit::SliceOver;
                }
            };
            self.pc = pc as u16;
            self.sp = sp as u16;
            let frame = self.fp;
            match left {
                LoopExit::SliceOver => return Ok(Flow::Continue),
                // Calls are the most frequent slow instructions. Here they need no second search
                // for the opcode.
                LoopExit::Undone if matches!(op, opcode::CALL | opcode::CALL_METHOD) => {
                    let count = arg as u8;
                    let callee = get!(sp.wrapping_sub(usize::from(count)).wrapping_sub(1));
                    let below = op.wrapping_sub(opcode::CALL - 1);
                    if Self::PAUSES {
                        self.allow_repeat(matches!(callee.tag(), Tag::FUNCTION | Tag::CLOSURE));
                    }
                    let called = self.call(host, callee, count, below);
                    if Self::PAUSES && self.repeats(start, sp, frame) {
                        return Ok(Flow::Continue);
                    }
                    contained!(called);
                    budget = self.charge_text_work(host, budget);
                }
                LoopExit::Undone => {
                    // `fetch` takes the next byte for an operand; this instruction has none.
                    if Self::DIRECT && op & 0x40 == 0 {
                        arg = 0;
                    }
                    if Self::PAUSES {
                        self.allow_repeat(Self::is_repeatable(op, arg as u8));
                    }
                    let done = self.slow(host, op, arg as i16);
                    if Self::PAUSES && self.repeats(start, sp, frame) {
                        return Ok(Flow::Continue);
                    }
                    contained!(done);
                    budget = self.charge_text_work(host, budget);
                }
                LoopExit::Returned => has_returned = true,
            }
        }
    }

    /// Returns the rest of the budget after the work on text, and reports that work to the host.
    fn charge_text_work<H: Host<P>>(&mut self, host: &mut H, budget: usize) -> usize {
        let work = self.work.take();
        host.has_worked(work);
        budget.saturating_sub(usize::from(work))
    }
}

/// Returns the order of two integers as one bit of [`order`]. The opcode of a conditional jump has
/// the bits of all orders for which it jumps.
#[hot]
pub(super) fn order_of<P: Profile>(a: P::Raw, b: P::Raw) -> u8 {
    if P::int_less(a, b) {
        order::LESS
    } else if a == b {
        order::EQUAL
    } else {
        order::GREATER
    }
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Executes `DIV` or `MOD` on the two operands below `sp`, and puts the result in place of the
    /// lower one. Returns false and changes nothing where the slow path has to do it, as for a
    /// division by zero.
    #[one_copy]
    fn divide_quickly(&mut self, op: u8, sp: usize) -> bool {
        let at = sp.wrapping_sub(2);
        let [a, b] = self.arena.pair_fast(at);
        if !(a.is(Tag::INT) && b.is(Tag::INT)) {
            if IS_WIDE && let Some(result) = Self::compute_quickly(op, a, b) {
                self.arena.set_fast(at, result);
                return true;
            }
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

    /// Reads the value under a key of the table in slot `table`, and puts it into slot `to`.
    /// Returns false and changes nothing if slot `table` holds no table, or if the value replaces
    /// the table and is a function that would have to be bound to it.
    #[one_copy]
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

    /// Stores the value on top of the stack under a key of the table in slot `table`. Returns false
    /// and changes nothing if there is no table, or if a collection has to come first.
    #[one_copy]
    fn set_quickly(&mut self, table: usize, key: Value<P>, sp: usize) -> bool {
        let table = self.arena.get_fast(table);
        let value = self.arena.get_fast(sp.wrapping_sub(1));
        Self::ALLOCATES_QUICKLY
            && !(Self::PAUSES && self.wants_collection(false))
            && table.is(Tag::TABLE)
            && self.arena.table_set(table.index(), key, value).is_ok()
    }
}

/// The reason why the inner loop ended.
enum LoopExit {
    /// The instruction is decoded, but its arm could not finish it.
    Undone,
    /// A function has returned to a position of the machine itself, at least [`SPECIAL`].
    Returned,
    /// The host ended the slice, or the budget is used up.
    SliceOver,
}
