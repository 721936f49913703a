//! The instructions that the loop does not do itself, and arithmetic beyond two integers.

use super::Vm;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::image::{PARAMETERS, USES_SELF};
use crate::number::{self, Number, Profile};
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
        match op {
            opcode::NIL => self.push(Value::nil()),
            // The loop reads every other local itself.
            opcode::LOCAL_GET => return Err(self.fail(FaultCode::MissingArgument)),
            opcode::ADD_INT => {
                let result = self.binary(opcode::ADD, self.top(1), Value::int(i32::from(arg)))?;
                self.replace(1, result);
            }
            opcode::LOCAL_ADD => {
                let b = Value::int(i32::from(self.next_byte() as i8));
                let local = isize::from(arg);
                let result = self.binary(opcode::ADD, self.local(local), b)?;
                self.set_local(local, result);
            }
            opcode::JUMP_EQ..=opcode::JUMP_NOT_GE => {
                if self.compare_slow(op, self.top(2), self.top(1))? {
                    self.pc = self.pc.wrapping_add_signed(arg);
                }
                self.sp = self.sp.wrapping_sub(2);
            }
            opcode::JUMP_EQ_INT..=opcode::JUMP_NOT_GE_INT => {
                let b = Value::int(i32::from(self.next_byte() as i8));
                if self.compare_slow(op - opcode::WITH_INT, self.top(1), b)? {
                    self.pc = self.pc.wrapping_add_signed(arg);
                }
                self.sp = self.sp.wrapping_sub(1);
            }
            opcode::CALL_FUNCTION => {
                let Some(program) = &self.program else { return Ok(()) };
                let count = program.code.byte(program.function(number)) & PARAMETERS;
                return self.enter(number, usize::from(count), 0, [Value::nil(); 2]);
            }
            opcode::UNSET => self.push(Value::unset()),
            opcode::DUP => self.push(self.top(1)),
            opcode::ADD..=opcode::MOD
            | opcode::POW
            | opcode::BAND
            | opcode::BOR
            | opcode::SHL
            | opcode::SHR => {
                let result = self.binary(op, self.top(2), self.top(1))?;
                self.replace(2, result);
            }
            opcode::NEG => {
                let a = self.top(1);
                let result = match a.tag() {
                    Tag::INT => Value::new(Tag::INT, P::neg(a.raw())),
                    Tag::FLOAT => Value::float(-P::float_to_f32(a.raw())),
                    _ => return Err(self.wrong_type(a, a)),
                };
                self.replace(1, result);
            }
            opcode::BNOT => {
                let a = self.top(1);
                if !a.is(Tag::INT) {
                    return Err(self.wrong_type(a, a));
                }
                self.replace(1, Value::new(Tag::INT, P::not(a.raw())));
            }
            opcode::NOT => self.replace(1, Value::truth(self.top(1).is_false())),
            opcode::TRUTH => self.replace(1, Value::truth(!self.top(1).is_false())),
            opcode::EQ..=opcode::GE => {
                let holds = self.compare_slow(op, self.top(2), self.top(1))?;
                self.replace(2, Value::truth(holds));
            }
            opcode::AND | opcode::OR => {
                let a = self.pop();
                if a.is_false() == (op == opcode::AND) {
                    self.push(Value::truth(op == opcode::OR));
                    self.pc = self.pc.wrapping_add_signed(arg);
                }
            }
            opcode::TABLE_NEW => {
                let table = self.new_table()?;
                self.push(table);
            }
            opcode::INDEX_GET => {
                let value = self.index_get(host, self.top(2), self.top(1), true)?;
                self.replace(2, value);
            }
            opcode::INDEX_METHOD => {
                let value = self.index_get(host, self.top(2), self.top(1), false)?;
                self.replace(1, value);
            }
            opcode::FIELD_GET => {
                let value = self.index_get(host, self.top(1), Value::string(number), true)?;
                self.replace(1, value);
            }
            opcode::FIELD_METHOD => {
                let value = self.index_get(host, self.top(1), Value::string(number), false)?;
                self.push(value);
            }
            opcode::INDEX_SET | opcode::INDEX_INIT => {
                self.index_set(self.top(3), self.top(2), self.top(1))?;
                self.sp -= if op == opcode::INDEX_SET { 3 } else { 2 };
            }
            opcode::FIELD_SET | opcode::FIELD_INIT => {
                self.index_set(self.top(2), Value::string(number), self.top(1))?;
                self.sp -= if op == opcode::FIELD_SET { 2 } else { 1 };
            }
            opcode::ROBOT_ID => self.push(Value::int(i32::from(self.robot_id))),
            opcode::FLOAT | opcode::INT_WORD => {
                let tag = if op == opcode::FLOAT { Tag::FLOAT } else { Tag::INT };
                let literal = self.literal();
                self.push(Value::new(tag, literal));
            }
            opcode::STRING => self.push(Value::string(number)),
            opcode::FUNCTION => self.push(Value::indexed(Tag::FUNCTION, number)),
            opcode::BUILTIN => self.push(Value::indexed(Tag::BUILTIN, number)),
            opcode::ROBOT => self.push(Value::indexed(Tag::ROBOT, number)),
            opcode::LIBRARY => self.push(Value::indexed(Tag::LIBRARY, number)),
            opcode::CALL => return self.call_value(host, usize::from(number), 1),
            opcode::CALL_METHOD => return self.call_value(host, usize::from(number), 2),
            opcode::CALL_BUILTIN => {
                let (count, drop_result) = self.arguments();
                return self.call_builtin(host, number as u8, count, drop_result);
            }
            opcode::CALL_ROBOT => {
                let (arguments, drop_result) = self.arguments();
                return self.call_robot(host, number, arguments, drop_result);
            }
            opcode::CLOSURE => {
                let count = usize::from(self.next_byte());
                return self.make_closure(number, count);
            }
            // Every other byte was refused by the verifier.
            _ => {}
        }
        Ok(())
    }

    /// Pops `count` values and pushes one.
    #[inline(always)]
    fn replace(&mut self, count: u16, value: Value<P>) {
        self.sp = self.sp.wrapping_sub(count);
        self.push(value);
    }

    /// The byte behind the instruction, which belongs to it.
    fn next_byte(&mut self) -> u8 {
        let at = usize::from(self.pc);
        self.pc = self.pc.wrapping_add(1);
        self.program.as_ref().map_or(0, |program| program.code.byte(at))
    }

    /// The trailer of a call: how many arguments, and whether the result is dropped.
    fn arguments(&mut self) -> (usize, bool) {
        let byte = self.next_byte();
        (usize::from(byte & !DROP_RESULT), byte & DROP_RESULT != 0)
    }

    fn literal(&mut self) -> P::Raw {
        let mut bytes = [0; 4];
        for byte in bytes.iter_mut().take(P::WORD_BYTES) {
            *byte = self.next_byte();
        }
        P::literal_from_le(bytes)
    }

    /// Makes a closure of the `count` values on top, the first of which is self if the function uses it.
    fn make_closure(&mut self, number: u16, count: usize) -> Result<(), Stopped> {
        let Some(program) = &self.program else { return Ok(()) };
        let uses_self = program.code.byte(program.function(number)) & USES_SELF != 0;
        let first = usize::from(self.sp) - count;
        let (self_value, from) =
            if uses_self { (self.arena.get(first), first + 1) } else { (Value::nil(), first) };
        let function = Value::indexed(Tag::FUNCTION, number);
        let captured = count - usize::from(uses_self);
        let closure =
            self.allocate(|vm| vm.arena.new_closure(function, self_value, from, captured))?;
        self.sp -= count as u16;
        self.push(closure);
        Ok(())
    }

    /// Arithmetic and bit operations on any two values.
    #[inline(never)]
    pub(super) fn binary(&mut self, op: u8, a: Value<P>, b: Value<P>) -> Result<Value<P>, Stopped> {
        if a.is(Tag::INT) && b.is(Tag::INT) && op != opcode::POW {
            let (x, y) = (a.raw(), b.raw());
            let result = match op {
                opcode::ADD => P::add(x, y),
                opcode::SUB => P::sub(x, y),
                opcode::MUL => P::mul(x, y),
                opcode::DIV => return self.checked(P::div(x, y), FaultCode::DivisionByZero),
                opcode::MOD => return self.checked(P::modulo(x, y), FaultCode::DivisionByZero),
                opcode::BAND => P::and(x, y),
                opcode::BOR => P::or(x, y),
                opcode::SHL => return self.checked(P::shl(x, y), FaultCode::ShiftRange),
                _ => return self.checked(P::shr(x, y), FaultCode::ShiftRange),
            };
            return Ok(Value::new(Tag::INT, result));
        }
        let (Some(x), Some(y)) = (a.as_number(), b.as_number()) else {
            return Err(self.wrong_type(a, b));
        };
        let (f, g) = (as_f32(x), as_f32(y));
        let result = match op {
            opcode::ADD => f + g,
            opcode::SUB => f - g,
            opcode::MUL => f * g,
            opcode::DIV => f / g,
            opcode::MOD => number::float_modulo::<P>(f, g),
            #[cfg(feature = "maths")]
            opcode::POW => number::power(f, g),
            _ => return Err(self.wrong_type(a, b)),
        };
        Ok(Value::float(result))
    }

    /// The result of an integer operation that has none for some operands.
    fn checked(&mut self, result: Option<P::Raw>, code: FaultCode) -> Result<Value<P>, Stopped> {
        match result {
            Some(raw) => Ok(Value::new(Tag::INT, raw)),
            None => Err(self.fail(code)),
        }
    }
}

/// Integers of the full profile round to the nearest float, as a float literal would.
pub(super) fn as_f32(number: Number) -> f32 {
    match number {
        Number::Int(value) => value as f32,
        Number::Float(value) => value,
    }
}
