//! The quick loop: the frequent instructions of the full profile, on local registers alone.
//!
//! [`Vm::interpret`] calls it before each of its own instructions, and executes those that the quick loop
//! leaves. There every arm has a way to the slow path, and the host, which may be any robot, is at hand.
//! Here is neither, so position, stack pointer, frame and budget stay in registers of the processor.
//!
//! # Rules
//! 1. An arm changes nothing before it is sure to finish its instruction. Otherwise it leaves the loop, and the
//!    other loop executes all of the instruction.
//! 2. An instruction takes one from the budget, and not longer than a search in [`PAIR_CELLS`] or
//!    [`ARRAY_CELLS`] cells, so that the host need not be asked about the end of the slice.
//! 3. Nothing here allocates, fails or calls the host.
//!
//! # Fetch
//! One load brings opcode, operand and the first bytes of the trailer. It needs a processor that loads four bytes
//! from any address, so a Cortex-M0 has no quick loop.

use super::decode::table::short;
use super::interpret::order_of;
use super::{GLOBALS, Native, SPECIAL, Vm, record};
use crate::bytecode::ByteCode;
use crate::image::{CAPTURES, PARAMETERS, USES_SELF};
use crate::number::{Profile, compute, operation};
use crate::opcode::{self, SHORT_INT, SHORT_LOCAL_GET, WIDE, order};
use crate::value::{Tag, Value};

/// The largest number of a table's cells that are searched for a pair, after its head.
const PAIR_CELLS: u8 = 4;

/// The largest number of cells before that of an array element.
const ARRAY_CELLS: usize = 16;

/// The opcodes of wide forms that have an arm.
const INT_WIDE: u8 = opcode::INT | WIDE;
const JUMP_WIDE: u8 = opcode::JUMP | WIDE;

/// The bytes of all other instructions, as a pattern. With `_` in its place, the compiler would compare each
/// opcode with the ends of the jump table.
#[rustfmt::skip]
macro_rules! others {
    () => {
        0x00 | 0x01 | 0x02 | 0x03 | 0x04 | 0x05 | 0x06 | 0x07 | 0x08 | 0x09 | 0x0a | 0x0b | 0x0c | 0x0d | 0x0e | 0x0f |
        0x10 | 0x11 | 0x12 | 0x13 | 0x14 | 0x15 | 0x16 | 0x17 | 0x18 | 0x19 | 0x1a | 0x1b | 0x1c | 0x1d | 0x1e | 0x20 |
        0x21 | 0x22 | 0x23 | 0x24 | 0x25 | 0x26 | 0x27 | 0x28 | 0x29 | 0x2d | 0x2e | 0x2f | 0x30 | 0x31 | 0x32 | 0x33 |
        0x34 | 0x35 | 0x36 | 0x37 | 0x41 | 0x42 | 0x43 | 0x44 | 0x45 | 0x4d | 0x52 | 0x53 | 0x54 | 0x55 | 0x56 | 0x5d |
        0x5e | 0x60 | 0x67 | 0x68 | 0x6a | 0x6d | 0x6f | 0x70 | 0x77 | 0x78 | 0x7a | 0x7d | 0x7f | 0xc1 | 0xc2 | 0xc3 |
        0xc4 | 0xc5 | 0xc6 | 0xc7 | 0xc8 | 0xc9 | 0xca | 0xcb | 0xcc | 0xcd | 0xce | 0xcf | 0xd0 | 0xd1 | 0xd2 | 0xd3 |
        0xd4 | 0xd5 | 0xd6 | 0xd7 | 0xd8 | 0xd9 | 0xdb | 0xdc | 0xdd | 0xde | 0xdf | 0xe0 | 0xe1 | 0xe2 | 0xe3 | 0xe4 |
        0xe5 | 0xe6 | 0xe7 | 0xe8 | 0xe9 | 0xea | 0xeb | 0xec | 0xed | 0xee | 0xef | 0xf0 | 0xf1 | 0xf2 | 0xf3 | 0xf4 |
        0xf5 | 0xf6 | 0xf7 | 0xf8 | 0xf9 | 0xfa | 0xfb | 0xfc | 0xfd | 0xfe | 0xff
    };
}

/// The quick loop of a machine, see [`Vm::quick_loop`]. Only the machine calls it.
pub struct QuickLoop<P: Profile, C: ByteCode, const SLOTS: usize> {
    #[expect(dead_code, reason = "the compiler makes the code to which this refers")]
    run: fn(&mut Vm<P, C, SLOTS>, C, usize) -> usize,
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the loop for the frequent instructions of the full profile. A crate that refers to it contains its
    /// code, at that crate's level of optimization.
    pub fn quick_loop() -> QuickLoop<P, C, SLOTS> {
        QuickLoop { run: Self::run_quickly }
    }

    /// True if the machine has the quick loop: in the full profile, which only robots with much flash have, on
    /// processors with loads of four bytes at any address. They have atomic instructions, a Cortex-M0 has none.
    pub(super) const IS_QUICK: bool = P::FULL && cfg!(target_has_atomic = "ptr");

    /// Executes at most `budget` instructions, until one that has no arm, is a rare case of its arm or ends the
    /// entry, or until a function has returned to a position of the machine itself. Returns the rest of the
    /// budget.
    #[inline(never)]
    #[allow(
        clippy::manual_range_patterns,
        reason = "ranges would be compared, not looked up in the jump table"
    )]
    pub(super) fn run_quickly(&mut self, code: C, budget: usize) -> usize {
        let mut pc = usize::from(self.pc);
        let mut sp = usize::from(self.sp);
        let mut fp = usize::from(self.fp);
        let mut budget = budget as isize;

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
        // Passes over an instruction of `$length` bytes.
        macro_rules! pass {
            ($length:expr) => {
                pc = pc.wrapping_add($length)
            };
        }

        loop {
            budget = budget.wrapping_sub(1);
            if budget < 0 {
                break;
            }
            let word = code.quad(pc);
            let op = word as u8;

            // The operand, and the byte after it.
            macro_rules! narrow {
                () => {
                    ((word as i32) << 16 >> 24) as isize
                };
            }
            macro_rules! count {
                () => {
                    (word >> 8 & 0xff) as usize
                };
            }
            macro_rules! wide {
                () => {
                    ((word as i32) << 8 >> 16) as isize
                };
            }
            macro_rules! immediate {
                () => {
                    (word as i32) << 8 >> 24
                };
            }
            macro_rules! short_operand {
                () => {
                    word as usize & 0x0f
                };
            }

            macro_rules! compute {
                ($int:ident, $operation:ident) => {{
                    let at = sp.wrapping_sub(2);
                    let [a, b] = self.arena.pair_fast(at);
                    let result = if a.is(Tag::INT) && b.is(Tag::INT) {
                        Value::new(Tag::INT, P::$int(a.raw(), b.raw()))
                    } else {
                        let (Some(x), Some(y)) = (a.as_f32(), b.as_f32()) else { break };
                        let Some(result) = compute(operation::$operation, x, y) else { break };
                        Value::float(result)
                    };
                    set!(at, result);
                    sp = sp.wrapping_sub(1);
                    pass!(1);
                }};
            }
            macro_rules! enter {
                ($frame:expr, $length:expr, $function:expr) => {
                    let to = $frame;
                    set!(to, record(to.wrapping_sub(fp), pc.wrapping_add($length)));
                    fp = to;
                    sp = to.wrapping_add(1);
                    pc = $function.wrapping_add(2);
                };
            }
            macro_rules! leave {
                ($value:expr) => {{
                    let outer = get!(fp);
                    let back = outer.index();
                    if back == Native::EXIT.position() {
                        break;
                    }
                    let at = fp.wrapping_sub(word as usize & 0x03);
                    set!(at, $value);
                    sp = at.wrapping_add(1);
                    fp = fp.wrapping_sub(usize::from(outer.tag().byte()));
                    pc = back;
                    if back >= SPECIAL {
                        // In contrast to every other end of the loop, this instruction was executed.
                        budget = budget.wrapping_sub(1);
                        break;
                    }
                }};
            }
            // Passes over an instruction of `$length` bytes, and jumps from there if the relation holds. Without an
            // order the other loop has to do it.
            macro_rules! jump_if {
                ($relation:expr, $found:expr, $length:expr, $pops:expr) => {{
                    let found = $found;
                    if found == order::NONE {
                        break;
                    }
                    sp = sp.wrapping_sub($pops);
                    pass!($length);
                    if $relation & found != 0 {
                        pc = pc.wrapping_add_signed(narrow!());
                    }
                }};
            }

            match op {
                short!(LOCAL_GET) => {
                    let number = short_operand!() as isize + SHORT_LOCAL_GET.low as isize;
                    let value = get!(fp.wrapping_add_signed(number));
                    if value.is(Tag::UNSET) {
                        break;
                    }
                    push!(value);
                    pass!(1);
                }
                opcode::LOCAL_GET => {
                    let value = get!(fp.wrapping_add_signed(narrow!()));
                    if value.is(Tag::UNSET) {
                        break;
                    }
                    push!(value);
                    pass!(2);
                }
                opcode::LOCAL_SET => {
                    sp = sp.wrapping_sub(1);
                    set!(fp.wrapping_add_signed(narrow!()), get!(sp));
                    pass!(2);
                }
                short!(INT) => {
                    push!(Value::int(short_operand!() as i32 + i32::from(SHORT_INT.low)));
                    pass!(1);
                }
                opcode::INT => {
                    push!(Value::int(narrow!() as i32));
                    pass!(2);
                }
                INT_WIDE => {
                    push!(Value::int(wide!() as i32));
                    pass!(3);
                }
                opcode::FLOAT_HALF => {
                    let half = (word >> 8).to_le_bytes();
                    push!(Value::new(Tag::FLOAT, P::literal_from_le([0, 0, half[0], half[1]])));
                    pass!(3);
                }
                opcode::FLOAT => {
                    let literal = code.quad(pc.wrapping_add(1)).to_le_bytes();
                    push!(Value::new(Tag::FLOAT, P::literal_from_le(literal)));
                    pass!(5);
                }
                opcode::INT_WORD => {
                    let literal = code.quad(pc.wrapping_add(1)).to_le_bytes();
                    push!(Value::new(Tag::INT, P::literal_from_le(literal)));
                    pass!(5);
                }
                opcode::NIL => {
                    push!(Value::nil());
                    pass!(1);
                }
                short!(GLOBAL_GET) => {
                    push!(get!(GLOBALS + short_operand!()));
                    pass!(1);
                }
                opcode::GLOBAL_GET => {
                    push!(get!(GLOBALS + count!()));
                    pass!(2);
                }
                short!(GLOBAL_SET) => {
                    sp = sp.wrapping_sub(1);
                    set!(GLOBALS + (word as usize & 0x07), get!(sp));
                    pass!(1);
                }
                opcode::GLOBAL_SET => {
                    sp = sp.wrapping_sub(1);
                    set!(GLOBALS + count!(), get!(sp));
                    pass!(2);
                }
                opcode::POP => {
                    sp = sp.wrapping_sub(1);
                    pass!(1);
                }
                opcode::POP_N => {
                    sp = sp.wrapping_sub(count!());
                    pass!(2);
                }
                opcode::ADD => compute!(add, ADD),
                opcode::SUB => compute!(sub, SUB),
                opcode::MUL => compute!(mul, MUL),
                opcode::DIV | opcode::MOD => {
                    let at = sp.wrapping_sub(2);
                    let [a, b] = self.arena.pair_fast(at);
                    let result = if a.is(Tag::INT) && b.is(Tag::INT) {
                        let (a, b) = (a.raw(), b.raw());
                        let result = if op == opcode::DIV { P::div(a, b) } else { P::modulo(a, b) };
                        let Some(result) = result else { break };
                        Value::new(Tag::INT, result)
                    } else {
                        let (Some(x), Some(y)) = (a.as_f32(), b.as_f32()) else { break };
                        let number = op.wrapping_sub(opcode::ADD);
                        let Some(result) = compute(number, x, y) else { break };
                        Value::float(result)
                    };
                    set!(at, result);
                    sp = sp.wrapping_sub(1);
                    pass!(1);
                }
                opcode::ADD_INT => {
                    let at = sp.wrapping_sub(1);
                    let Some(sum) = Self::sum_quickly(get!(at), narrow!() as i32) else { break };
                    set!(at, sum);
                    pass!(2);
                }
                opcode::LOCAL_ADD => {
                    let at = fp.wrapping_add_signed(narrow!());
                    let Some(sum) = Self::sum_quickly(get!(at), immediate!()) else { break };
                    set!(at, sum);
                    pass!(3);
                }
                opcode::JUMP => {
                    pass!(2);
                    pc = pc.wrapping_add_signed(narrow!());
                }
                JUMP_WIDE => {
                    pass!(3);
                    pc = pc.wrapping_add_signed(wide!());
                }
                opcode::JUMP_FALSE | opcode::JUMP_TRUE => {
                    sp = sp.wrapping_sub(1);
                    pass!(2);
                    if get!(sp).is_false() == (op == opcode::JUMP_FALSE) {
                        pc = pc.wrapping_add_signed(narrow!());
                    }
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
                    let found = if a.is(Tag::INT) && b.is(Tag::INT) {
                        order_of::<P>(a.raw(), b.raw())
                    } else if a.is(Tag::FLOAT) && b.is(Tag::FLOAT) {
                        Self::order_of_floats(a, P::float_to_f32(b.raw()))
                    } else {
                        break;
                    };
                    jump_if!(op, found, 2, 2);
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
                    let found = Self::order_quickly(get!(sp.wrapping_sub(1)), immediate!());
                    jump_if!(op, found, 3, 1);
                }
                opcode::JUMP_LOCAL => {
                    let (relation, local) = opcode::relation_of_local((word >> 16) as u8);
                    let a = get!(fp.wrapping_add_signed(isize::from(local)));
                    let b = i32::from(code.word(pc.wrapping_add(3)) as i16);
                    jump_if!(relation, Self::order_quickly(a, b), 5, 0);
                }
                opcode::CALL_FUNCTION => {
                    let function = self.function_quickly(code, count!());
                    let head = code.quad(function);
                    let room = (head >> 8 & 0xff) as usize;
                    if sp.wrapping_add(1).wrapping_add(room) > usize::from(self.arena.reserved) {
                        break;
                    }
                    enter!(sp, 2, function);
                    if head as u8 & USES_SELF != 0 {
                        push!(Value::nil());
                    }
                }
                opcode::CALL | opcode::CALL_METHOD => {
                    let count = count!();
                    // The callee, and for a method its self.
                    let below = usize::from(op.wrapping_sub(opcode::CALL - 1));
                    let first = sp.wrapping_sub(count);
                    let start = first.wrapping_sub(below);
                    let callee = get!(first.wrapping_sub(1));
                    let function = if callee.is(Tag::FUNCTION) {
                        callee
                    } else if callee.is(Tag::CLOSURE) {
                        self.arena.closure_function(callee.index())
                    } else {
                        break;
                    };
                    let function = self.function_quickly(code, function.index());
                    let head = code.quad(function);
                    let to = start.wrapping_add(count);
                    let limit = to.wrapping_add(1).wrapping_add((head >> 8 & 0xff) as usize);
                    if usize::from(head as u8 & PARAMETERS) != count
                        || limit > usize::from(self.arena.reserved)
                    {
                        break;
                    }
                    let mut own = Value::nil();
                    if head as u8 & USES_SELF != 0 {
                        if below == 2 {
                            own = get!(start);
                        } else if callee.is(Tag::CLOSURE) {
                            own = self.arena.closure_self(callee.index());
                        }
                    }
                    for at in start..to {
                        set!(at, get!(at.wrapping_add(below)));
                    }
                    enter!(to, 2, function);
                    if head as u8 & CAPTURES != 0 {
                        push!(callee);
                    }
                    if head as u8 & USES_SELF != 0 {
                        push!(own);
                    }
                }
                // The short forms of `RETURN` and `RETURN_NIL`.
                0xb8 | 0xb9 | 0xba | 0xbb => leave!(get!(sp.wrapping_sub(1))),
                0xbc | 0xbd | 0xbe | 0xbf => leave!(Value::nil()),
                opcode::CAPTURE_GET => {
                    let closure = get!(fp.wrapping_add(1)).index();
                    let Some(value) = self.arena.captured_in_head(closure, count!()) else { break };
                    push!(value);
                    pass!(2);
                }
                opcode::FIELD_GET => {
                    let at = sp.wrapping_sub(1);
                    let slot = self.field_quickly(get!(at), count!());
                    let value = get!(slot);
                    if slot == 0 || value.may_use_self() {
                        break;
                    }
                    set!(at, value);
                    pass!(2);
                }
                opcode::FIELD_METHOD => {
                    let slot = self.field_quickly(get!(sp.wrapping_sub(1)), count!());
                    if slot == 0 {
                        break;
                    }
                    push!(get!(slot));
                    pass!(2);
                }
                opcode::FIELD_SET => {
                    let [object, value] = self.arena.pair_fast(sp.wrapping_sub(2));
                    let slot = self.field_quickly(object, count!());
                    if slot == 0 || value.is_nil() {
                        break;
                    }
                    set!(slot, value);
                    sp = sp.wrapping_sub(2);
                    pass!(2);
                }
                opcode::INDEX_GET => {
                    let at = sp.wrapping_sub(2);
                    let [object, key] = self.arena.pair_fast(at);
                    let slot = self.element_quickly(object, key);
                    let value = get!(slot);
                    if slot == 0 || value.may_use_self() {
                        break;
                    }
                    set!(at, value);
                    sp = sp.wrapping_sub(1);
                    pass!(1);
                }
                opcode::INDEX_SET => {
                    let at = sp.wrapping_sub(3);
                    let [object, key] = self.arena.pair_fast(at);
                    let value = get!(sp.wrapping_sub(1));
                    let slot = self.element_quickly(object, key);
                    if value.is_nil() || slot == 0 && !self.append_quickly(object, key, value) {
                        break;
                    }
                    if slot != 0 {
                        set!(slot, value);
                    }
                    sp = at;
                    pass!(1);
                }
                others!() => break,
            }
        }
        self.pc = pc as u16;
        self.sp = sp as u16;
        self.fp = fp as u16;
        // The last instruction was not executed.
        budget.wrapping_add(1) as usize
    }

    /// Returns the position of the header of a function.
    #[hot]
    fn function_quickly(&self, code: C, number: usize) -> usize {
        let row = usize::from(self.header.functions_at()) + 2 * number;
        usize::from(code.word(row)) + usize::from(self.header.code_at())
    }

    /// Returns the sum of a number and an integer of at most 16 bits; `None` for other values.
    #[hot]
    fn sum_quickly(value: Value<P>, integer: i32) -> Option<Value<P>> {
        if value.is(Tag::INT) {
            Some(Value::new(Tag::INT, P::add(value.raw(), P::int_from_i32(integer))))
        } else if value.is(Tag::FLOAT) {
            let sum = compute(operation::ADD, P::float_to_f32(value.raw()), integer as f32)?;
            Some(Value::float(sum))
        } else {
            None
        }
    }

    /// Returns the order of a number and an integer of at most 16 bits as one bit of [`order`]; `NONE` for other
    /// values.
    #[hot]
    fn order_quickly(value: Value<P>, integer: i32) -> u8 {
        if value.is(Tag::INT) {
            order_of::<P>(value.raw(), P::int_from_i32(integer))
        } else if value.is(Tag::FLOAT) {
            Self::order_of_floats(value, integer as f32)
        } else {
            order::NONE
        }
    }

    /// Returns the order of a float and another one as one bit of [`order`].
    #[hot]
    fn order_of_floats(value: Value<P>, other: f32) -> u8 {
        let value = P::float_to_f32(value.raw());
        if value < other {
            order::LESS
        } else if value > other {
            order::GREATER
        } else if value == other {
            order::EQUAL
        } else {
            order::NONE
        }
    }

    /// Returns the slot of the value under a constant string in the first cells of a table; 0 if it is not
    /// there.
    #[hot]
    fn field_quickly(&self, object: Value<P>, key: usize) -> usize {
        if !object.is(Tag::TABLE) {
            return 0;
        }
        self.arena.field_in_cells(object.index(), Value::string(key as u16), PAIR_CELLS)
    }

    /// Appends a value that is not nil to the array of a table, where that is simple. Returns false and changes nothing
    /// otherwise.
    #[hot]
    fn append_quickly(&mut self, object: Value<P>, key: Value<P>, value: Value<P>) -> bool {
        object.is(Tag::TABLE)
            && key.is(Tag::INT)
            && self.arena.append_in_cell(
                object.index(),
                P::int_to_i32(key.raw()),
                value,
                ARRAY_CELLS,
            )
    }

    /// Returns the slot of an element in the first cells of a table's array; 0 if it is not there.
    #[hot]
    fn element_quickly(&self, object: Value<P>, key: Value<P>) -> usize {
        if !object.is(Tag::TABLE) || !key.is(Tag::INT) {
            return 0;
        }
        self.arena.element_in_cells(object.index(), P::int_to_i32(key.raw()), ARRAY_CELLS)
    }
}
