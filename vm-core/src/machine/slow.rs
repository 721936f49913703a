//! The instructions that the loop does not do itself, and arithmetic beyond two integers.

use super::Vm;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::image::{PARAMETERS, USES_SELF};
use crate::number::Profile;
#[cfg(feature = "maths")]
use crate::number::maths::{self, Function};
use crate::opcode::{self, DROP_RESULT};
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Executes one instruction; `pc` is behind opcode and operand.
    #[inline(never)]
    pub(super) fn slow<H: Host<P>>(
        &mut self,
        host: &mut H,
        op: u8,
        arg: i16,
    ) -> Result<(), Stopped> {
        let number = arg as u16;
        // What most instructions work on. What they put on the stack takes the place of the `drop` topmost operands.
        let (below, top) = (self.top(2), self.top(1));
        let mut drop = 0;
        let value = match op {
            opcode::NIL => Value::nil(),
            opcode::UNSET => Value::unset(),
            opcode::DUP => top,
            // The loop reads every other local itself.
            opcode::LOCAL_GET => return Err(self.fail(FaultCode::MissingArgument)),
            opcode::ADD_INT => {
                drop = 1;
                self.binary(opcode::ADD, top, Value::int(i32::from(arg)))?
            }
            opcode::LOCAL_ADD => {
                let b = Value::int(i32::from(self.next_byte() as i8));
                let local = isize::from(arg);
                let result = self.binary(opcode::ADD, self.local(local), b)?;
                self.set_local(local, result);
                return Ok(());
            }
            opcode::JUMP_LT..=opcode::JUMP_NOT_LT_INT => {
                let with_int = op >= opcode::JUMP_LT_INT;
                let holds = if with_int {
                    let b = Value::int(i32::from(self.next_byte() as i8));
                    self.compare_slow(op, top, b)?
                } else {
                    self.compare_slow(op, below, top)?
                };
                if holds {
                    self.pc = self.pc.wrapping_add_signed(arg);
                }
                self.sp = self.sp.wrapping_sub(2 - u16::from(with_int));
                return Ok(());
            }
            opcode::JUMP_LOCAL => {
                let (relation, local) = opcode::relation_of_local(self.next_byte());
                let b = Value::int(i32::from(self.next_byte() as i8));
                let a = self.local(isize::from(local));
                if a.is(Tag::UNSET) {
                    return Err(self.fail(FaultCode::MissingArgument));
                }
                if self.compare_slow(relation, a, b)? {
                    self.pc = self.pc.wrapping_add_signed(arg);
                }
                return Ok(());
            }
            opcode::ADD..=opcode::MOD
            | opcode::POW
            | opcode::BAND
            | opcode::BOR
            | opcode::SHL
            | opcode::SHR => {
                drop = 2;
                self.binary(op, below, top)?
            }
            opcode::NEG => {
                drop = 1;
                match top.tag() {
                    Tag::INT => Value::new(Tag::INT, P::neg(top.raw())),
                    Tag::FLOAT => {
                        let mut float = P::unpack(top.raw());
                        float.negate();
                        Value::packed(&float)
                    }
                    _ => return Err(self.wrong_type(top, top)),
                }
            }
            opcode::BNOT => {
                drop = 1;
                if !top.is(Tag::INT) {
                    return Err(self.wrong_type(top, top));
                }
                Value::new(Tag::INT, P::not(top.raw()))
            }
            opcode::NOT | opcode::TRUTH => {
                drop = 1;
                Value::truth(top.is_false() == (op == opcode::NOT))
            }
            opcode::LT..=opcode::GE => {
                drop = 2;
                Value::truth(self.compare_slow(op, below, top)?)
            }
            opcode::AND | opcode::OR => {
                if top.is_false() != (op == opcode::AND) {
                    self.sp = self.sp.wrapping_sub(1);
                    return Ok(());
                }
                drop = 1;
                self.pc = self.pc.wrapping_add_signed(arg);
                Value::truth(op == opcode::OR)
            }
            opcode::TABLE_NEW => self.new_table()?,
            opcode::INDEX_GET => {
                drop = 2;
                self.index_get(host, below, top, true)?
            }
            opcode::INDEX_METHOD => {
                drop = 1;
                self.index_get(host, below, top, false)?
            }
            opcode::FIELD_GET | opcode::FIELD_METHOD => {
                let bind = op == opcode::FIELD_GET;
                drop = u16::from(bind);
                self.index_get(host, top, Value::string(number), bind)?
            }
            opcode::INDEX_SET | opcode::INDEX_INIT => {
                self.index_set(self.top(3), below, top)?;
                self.sp -= 2 + u16::from(op == opcode::INDEX_SET);
                return Ok(());
            }
            opcode::FIELD_SET | opcode::FIELD_INIT => {
                self.index_set(below, Value::string(number), top)?;
                self.sp -= 1 + u16::from(op == opcode::FIELD_SET);
                return Ok(());
            }
            opcode::ROBOT_ID => Value::int(i32::from(self.robot_id)),
            opcode::FLOAT | opcode::FLOAT_HALF | opcode::INT_WORD => {
                let tag = if op == opcode::INT_WORD { Tag::INT } else { Tag::FLOAT };
                let stored = if op == opcode::FLOAT_HALF { 2 } else { P::WORD_BYTES };
                Value::new(tag, self.literal(stored))
            }
            // Immediate values, whose tags are in the order of these instructions.
            opcode::STRING..=opcode::LIBRARY => {
                Value::indexed(Tag::of(op - opcode::STRING + Tag::STRING.byte()), number)
            }
            opcode::CALL_FUNCTION => {
                let Some(program) = &self.program else { return Ok(()) };
                let count = program.code.byte(program.function(number)) & PARAMETERS;
                let callee = Value::indexed(Tag::FUNCTION, number);
                return self.call(host, callee, count, 0);
            }
            opcode::CALL_BUILTIN | opcode::CALL_ROBOT => {
                // The trailer: how many arguments, and whether the result is dropped.
                let trailer = self.next_byte();
                let count = trailer & !DROP_RESULT;
                let drop_result = trailer & DROP_RESULT != 0;
                if op == opcode::CALL_ROBOT {
                    return self.call_robot(host, number, count, drop_result);
                }
                return self.call_builtin(host, number as u8, count, drop_result);
            }
            opcode::CLOSURE => {
                let count = self.next_byte();
                drop = u16::from(count);
                self.make_closure(number, usize::from(count))?
            }
            // Every other byte was refused by the verifier.
            _ => return Ok(()),
        };
        self.sp = self.sp.wrapping_sub(drop);
        self.push(value);
        Ok(())
    }

    /// The byte behind the instruction, which belongs to it.
    fn next_byte(&mut self) -> u8 {
        let at = usize::from(self.pc);
        self.pc = self.pc.wrapping_add(1);
        self.program.as_ref().map_or(0, |program| program.code.byte(at))
    }

    /// A literal, of which the upper `stored` bytes are in the image.
    fn literal(&mut self, stored: usize) -> P::Raw {
        let mut bytes = [0; 4];
        for byte in bytes.iter_mut().take(P::WORD_BYTES).skip(P::WORD_BYTES - stored) {
            *byte = self.next_byte();
        }
        P::literal_from_le(bytes)
    }

    /// A closure of the `count` values on top, the first of which is self if the function uses it.
    fn make_closure(&mut self, number: u16, count: usize) -> Result<Value<P>, Stopped> {
        let Some(program) = &self.program else { return Ok(Value::nil()) };
        let uses_self = program.code.byte(program.function(number)) & USES_SELF != 0;
        let function = Value::indexed(Tag::FUNCTION, number);
        let first = usize::from(self.sp) - count;
        let (self_value, from) =
            if uses_self { (self.arena.get(first), first + 1) } else { (Value::nil(), first) };
        let captured = usize::from(self.sp) - from;
        self.allocate(|vm| vm.arena.new_closure(function, self_value, from, captured))
    }

    /// Arithmetic and bit operations on any two values; integers are added, subtracted and multiplied by the loop, and
    /// divided but by zero.
    #[inline(never)]
    pub(super) fn binary(&mut self, op: u8, a: Value<P>, b: Value<P>) -> Result<Value<P>, Stopped> {
        if a.is(Tag::INT) && b.is(Tag::INT) && op != opcode::POW {
            let (x, y) = (a.raw(), b.raw());
            let result = match op {
                opcode::BAND => Some(P::and(x, y)),
                opcode::BOR => Some(P::or(x, y)),
                opcode::SHL => P::shl(x, y),
                opcode::SHR => P::shr(x, y),
                _ => return Err(self.fail(FaultCode::DivisionByZero)),
            };
            return match result {
                Some(raw) => Ok(Value::new(Tag::INT, raw)),
                None => Err(self.fail(FaultCode::ShiftRange)),
            };
        }
        if !(a.is_number() && b.is_number()) {
            return Err(self.wrong_type(a, b));
        }
        if P::FULL {
            // As the chip or the compiler's library does it.
            if let (Some(x), Some(y)) = (a.as_f32(), b.as_f32()) {
                match op {
                    opcode::ADD => return Ok(Value::float(x + y)),
                    opcode::SUB => return Ok(Value::float(x - y)),
                    opcode::MUL => return Ok(Value::float(x * y)),
                    opcode::DIV => return Ok(Value::float(x / y)),
                    _ => {}
                }
            }
        }
        let (mut x, y) = (a.unpack_float(), b.unpack_float());
        match op {
            // Numbered alike.
            opcode::ADD..=opcode::DIV => x.operate(op - opcode::ADD, &y),
            opcode::MOD => x.modulo(&y),
            #[cfg(feature = "maths")]
            opcode::POW => maths::function::<P, C>(Function::Power as u8, &mut x, &y),
            _ => return Err(self.wrong_type(a, b)),
        }
        Ok(Value::packed(&x))
    }
}
