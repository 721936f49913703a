//! The slow path: instructions that the loop does not finish itself, and arithmetic on operands
//! other than two integers.

use super::Vm;
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::image::{CAPTURES, PARAMETERS, USES_SELF};
use crate::number::maths::{self, MathFunction};
use crate::number::wide::IS_WIDE;
use crate::number::{Profile, compute};
use crate::opcode::{self, DROP_RESULT, Operand};
use crate::part::Part;
use crate::rom::Effect;
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Executes one instruction; `pc` is after opcode and operand.
    #[one_copy]
    pub(super) fn slow<H: Host<P>>(
        &mut self,
        host: &mut H,
        op: u8,
        arg: i16,
    ) -> Result<(), Stopped> {
        let effect = Effect::of::<P, C>(op);
        let trailer = effect.trailer();
        self.pc = self.pc.wrapping_add(trailer as u16);
        let number = arg as u16;
        match op {
            opcode::CALL_FUNCTION => {
                let count = self.head(number) & PARAMETERS;
                let callee = Value::indexed(Tag::FUNCTION, number);
                return self.call(host, callee, count, 0);
            }
            opcode::CALL_BUILTIN | opcode::CALL_ROBOT => {
                // The trailer holds the number of arguments, and the bit that drops the result.
                let trailer = self.byte_before(1);
                let count = trailer & !DROP_RESULT;
                let drop_result = trailer & DROP_RESULT != 0;
                if op == opcode::CALL_ROBOT {
                    return self.call_robot(host, number, count, drop_result);
                }
                return self.call_builtin(host, number as u8, count, drop_result);
            }
            _ => {}
        }
        // `a` is the lowest operand. `b` is the next one, or the value that the instruction itself
        // holds.
        let pops = effect.pops();
        let a = self.top(pops);
        let b = if effect.operand() == Operand::String as u8 {
            Value::string(number)
        } else if trailer != 0 {
            Value::int(i32::from(self.byte_before(1) as i8))
        } else {
            self.top(pops.wrapping_sub(1))
        };
        let value = match op {
            _ if (opcode::BAND..=opcode::MOD).contains(&op) => self.binary(op, a, b)?,
            opcode::NIL => Value::nil(),
            opcode::UNSET => Value::unset(),
            opcode::DUP => a,
            // The loop reads every local that is set.
            opcode::LOCAL_GET => return Err(self.fail(FaultCode::MissingArgument)),
            opcode::ADD_INT => self.binary(opcode::ADD, a, Value::int(i32::from(arg)))?,
            opcode::LOCAL_ADD => {
                let local = self.local_slot(arg);
                let sum = self.binary(opcode::ADD, self.arena.get(local), b)?;
                self.arena.set(local, sum);
                sum
            }
            opcode::NEG if a.is(Tag::INT) => Value::new(Tag::INT, P::neg(a.raw())),
            opcode::NEG => {
                self.need_number(a)?;
                self.binary(opcode::MUL, a, Value::int(-1))?
            }
            opcode::JUMP_LOCAL => {
                let (relation, local) = opcode::relation_of_local(self.byte_before(3));
                let b = i16::from_le_bytes([self.byte_before(2), self.byte_before(1)]);
                let a = self.arena.get(self.local_slot(local));
                if a.is(Tag::UNSET) {
                    return Err(self.fail(FaultCode::MissingArgument));
                }
                if self.compare_slow(relation, a, Value::int(b.into()))? {
                    self.pc = self.pc.wrapping_add_signed(arg);
                }
                a
            }
            // Comparisons that do not jump have the operand 0.
            opcode::LT..=opcode::GE | opcode::JUMP_LT..=opcode::JUMP_NOT_LT_INT => {
                let holds = self.compare_slow(op, a, b)?;
                if holds {
                    self.pc = self.pc.wrapping_add_signed(arg);
                }
                Value::truth(holds)
            }
            opcode::BNOT => {
                if !a.is(Tag::INT) {
                    return Err(self.wrong_type(a, a));
                }
                Value::new(Tag::INT, P::not(a.raw()))
            }
            opcode::NOT | opcode::TRUTH | opcode::AND | opcode::OR => {
                let truth = u8::from(a.is_false() == (op == opcode::NOT));
                // `AND` keeps 0, `OR` keeps 1.
                if op.wrapping_sub(opcode::AND) == truth {
                    self.pc = self.pc.wrapping_add_signed(arg);
                    self.set_top(Value::truth(truth != 0));
                    return Ok(());
                }
                Value::truth(truth != 0)
            }
            opcode::TABLE_NEW => self.new_table()?,
            opcode::INDEX_GET | opcode::FIELD_GET => self.index_get(host, a, b, true)?,
            opcode::INDEX_METHOD | opcode::FIELD_METHOD => self.index_get(host, a, b, false)?,
            opcode::INDEX_SET | opcode::INDEX_INIT | opcode::FIELD_SET | opcode::FIELD_INIT => {
                self.index_set(a, b, self.top(1))?;
                a
            }
            opcode::ROBOT_ID => Value::int(i32::from(self.robot_id)),
            opcode::FLOAT | opcode::FLOAT_HALF | opcode::INT_WORD => {
                let tag = if op == opcode::INT_WORD { Tag::INT } else { Tag::FLOAT };
                Value::new(tag, self.literal(op == opcode::FLOAT_HALF))
            }
            // Immediate values: their opcodes are in the order of the tags.
            opcode::STRING..=opcode::LIBRARY => {
                Value::indexed(Tag::of(op - opcode::STRING + Tag::STRING.byte()), number)
            }
            opcode::CLOSURE if Self::has(Part::Closures) => self.make_closure(number)?,
            // The verifier refuses every other byte.
            _ => return Ok(()),
        };
        self.sp = self.sp.wrapping_sub(pops.into()).wrapping_add(effect.pushes().into());
        if effect.pushes() != 0 {
            self.set_top(value);
        }
        Ok(())
    }

    /// Returns the byte at `count` bytes before the next instruction.
    #[one_copy]
    fn byte_before(&self, count: u16) -> u8 {
        let at = self.pc.wrapping_sub(count);
        self.program().map_or(0, |program| program.code.byte(at.into()))
    }

    /// Returns the literal at the end of the instruction. With `half` the image holds its upper
    /// half only.
    fn literal(&self, half: bool) -> P::Raw {
        let upper = [self.byte_before(2), self.byte_before(1)];
        let [c, d] = upper;
        P::literal_from_le(match P::FULL {
            true if half => [0, 0, c, d],
            true => [self.byte_before(4), self.byte_before(3), c, d],
            false => [c, d, 0, 0],
        })
    }

    /// Returns the first byte of the header of a function. For a number that no function has,
    /// returns that of a function with captured values, which no message may contain.
    #[one_copy]
    pub(super) fn head(&self, number: u16) -> u8 {
        if number >= self.header.functions() {
            return CAPTURES;
        }
        self.program().map_or(0, |program| program.code.byte(program.function(number)))
    }

    /// Makes a closure of the values on top, and pops them. The first value is self if the function
    /// uses it.
    #[one_copy]
    fn make_closure(&mut self, number: u16) -> Result<Value<P>, Stopped> {
        let function = Value::indexed(Tag::FUNCTION, number);
        let has_self = self.head(number) & USES_SELF != 0;
        let end = usize::from(self.sp);
        let first = end - usize::from(self.byte_before(1));
        let closure = self.allocate(|vm| vm.arena.new_closure(function, has_self, first, end))?;
        self.sp = first as u16;
        Ok(closure)
    }

    /// Adds, subtracts, multiplies or divides two numbers in binary32: those of the full profile, and on
    /// computers also those of the tiny profile. Floats of the tiny profile have ten bits. A result that
    /// is rounded to 24 bits and then to ten equals one that is rounded once, since 24 is at least
    /// 2 * 10 + 2 (Figueroa, "When is double rounding innocuous?", 1995). Returns `None` for another
    /// operation, for other values, and in the tiny profile for integers of more bits.
    #[hot]
    pub(super) fn compute_quickly(op: u8, a: Value<P>, b: Value<P>) -> Option<Value<P>> {
        let is_short = |value: Value<P>| {
            P::FULL || value.is(Tag::FLOAT) || P::int_to_i32(value.raw()).unsigned_abs() <= 1 << 10
        };
        let (x, y) = (a.as_f32()?, b.as_f32()?);
        if !is_short(a) || !is_short(b) {
            return None;
        }
        // The numbers of the operations are in the order of the opcodes.
        Some(Value::float(compute(op.wrapping_sub(opcode::ADD), x, y)?))
    }

    /// Computes arithmetic and bit operations on any two values. The loop itself adds, subtracts
    /// and multiplies integers, and divides them unless the divisor is zero.
    #[one_copy]
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
        if (P::FULL || IS_WIDE)
            && let Some(result) = Self::compute_quickly(op, a, b)
        {
            return Ok(result);
        }
        if !Self::has(Part::Floats) {
            return Err(self.wrong_type(a, b));
        }
        let mut x = a.unpack_float();
        let y = b.unpack_float();
        match op {
            // The numbers of the operations are in the order of the opcodes.
            opcode::ADD..=opcode::DIV => x.operate(op - opcode::ADD, &y),
            opcode::MOD => return Ok(Value::new(Tag::FLOAT, x.modulo(&y))),
            opcode::POW if Self::has(Part::Maths) => {
                maths::function::<P, C>(MathFunction::Power as u8, &mut x, &y)
            }
            _ => return Err(self.wrong_type(a, b)),
        }
        Ok(Value::packed(&x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::Tiny;

    type TinyVm = Vm<Tiny, &'static [u8], 8>;

    /// Returns the result as the chips of robots compute it.
    fn compute(op: u8, a: Value<Tiny>, b: Value<Tiny>) -> Value<Tiny> {
        let mut x = a.unpack_float();
        x.operate(op - opcode::ADD, &b.unpack_float());
        Value::packed(&x)
    }

    /// Combines each float of the tiny profile with special floats, and with one of each exponent.
    #[test]
    fn hosts_compute_short_floats_like_chips() {
        let floats = (0..=u16::MAX).map(|raw| Value::<Tiny>::new(Tag::FLOAT, raw));
        let special = [0, 0x8000, 0x0001, 0x0200, 0x8201, 0x7DFF, 0x7E00, 0xFE00, 0x7F00];
        let mut state = 7_u32;
        for a in floats {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let others = (0..64_u16).map(|exponent| (state >> 16) as u16 & 0x81FF | exponent << 9);
            let others = others.chain(special).map(|raw| Value::new(Tag::FLOAT, raw));
            let integers = [0, 1, -1, 3, 1000, -1024].map(Value::int);
            for b in others.chain(integers) {
                for op in [opcode::ADD, opcode::SUB, opcode::MUL, opcode::DIV] {
                    for (a, b) in [(a, b), (b, a)] {
                        let result = TinyVm::compute_quickly(op, a, b);
                        let same = result.is_some_and(|found| found.same(compute(op, a, b)));
                        assert!(same, "operation {op} of {a:?} and {b:?}: {result:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn long_integers_are_not_rounded_twice() {
        for op in [opcode::ADD, opcode::SUB, opcode::MUL, opcode::DIV] {
            let (float, int) = (Value::float(1.5), Value::int(1025));
            assert!(TinyVm::compute_quickly(op, float, int).is_none());
            assert!(TinyVm::compute_quickly(op, int, float).is_none());
        }
        assert!(TinyVm::compute_quickly(opcode::MOD, Value::float(1.5), Value::int(1)).is_none());
    }
}
