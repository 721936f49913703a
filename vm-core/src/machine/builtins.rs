//! Built-ins that compute their result at once.

use super::Vm;
use crate::builtin::{self, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::{CallArguments, Host};
use crate::number::maths;
#[cfg(target_pointer_width = "64")]
use crate::number::memo;
use crate::number::{Profile, Rng, Rounding};
use crate::opcode::order;
use crate::part::Part;
use crate::value::{Tag, Type, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Computes a built-in of kind `Plain` from the `count` topmost values, which stay there. The
    /// result is unset if an argument is a library and the built-in needs a table in its place.
    #[one_copy]
    pub(super) fn builtin<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        count: u8,
    ) -> Result<Value<P>, Stopped> {
        let end = usize::from(self.sp);
        let first = end.wrapping_sub(usize::from(count));
        let a = self.argument(0, count);
        let b = self.argument(1, count);
        match number {
            builtin::LOG => {
                for slot in first..end {
                    if self.arena.get(slot).is(Tag::LIBRARY) {
                        return Ok(Value::unset());
                    }
                }
                let count = usize::from(count);
                host.log(CallArguments { script: self.view(), end, count });
                Ok(Value::nil())
            }
            // Without an argument `a` is unset, which is a fault below.
            builtin::SIZE if !a.is(Tag::UNSET) => {
                if !self.is_table(a)? {
                    return Ok(Value::unset());
                }
                Ok(Value::int(self.table_size(a) as i32))
            }
            builtin::RAND => Ok(Value::int(self.rng.rand())),
            builtin::UNIFORM if a.is(Tag::UNSET) => Ok(Value::int(self.rng.next_u32() as i32)),
            builtin::TO_INT
            | builtin::TO_FLOAT
            | builtin::ABS..=builtin::ROUND
            | builtin::SQRT..=builtin::EXPONENTIAL => self.compute(number, a, b),
            builtin::NEIGHBORS_GET..=builtin::NEIGHBORS_IGNORE
            | builtin::SNAPSHOT_GET..=builtin::SNAPSHOT_REDUCE
                if Self::has(Part::Neighbors) || Self::has(Part::Messages) =>
            {
                self.neighbor_builtin(host, number, count, a)
            }
            builtin::SWARM_CREATE..=builtin::SWARM_OTHERS if Self::has(Part::Swarms) => {
                self.swarm_builtin(number, count, a)
            }
            builtin::STIGMERGY_CREATE..=builtin::STIGMERGY_ONCONFLICTLOST
                if Self::has(Part::Stigmergy) =>
            {
                self.stigmergy_builtin(host, number, count, a)
            }
            // All other built-ins accept any value.
            _ if a.is(Tag::UNSET) => Err(self.fail(FaultCode::MissingArgument)),
            builtin::TYPE => Ok(Value::string(type_name(a.type_of()))),
            // These built-ins are in the order of the types. The type of user data is one that no
            // argument has.
            builtin::IS_NIL..=builtin::IS_USERDATA => {
                Ok(Value::truth(a.type_of() as u8 == number - builtin::IS_NIL))
            }
            builtin::ASSERT => {
                if !a.is_false() {
                    return Ok(Value::nil());
                }
                let detail = b.as_string().map_or(0, |number| number.wrapping_add(1));
                Err(self.fail_with(FaultCode::AssertFailed, [Type::Nil; 2], detail))
            }
            builtin::MIN | builtin::MAX => {
                if b.is(Tag::UNSET) {
                    return Err(self.fail(FaultCode::MissingArgument));
                }
                let other = if number == builtin::MAX { order::LESS } else { order::GREATER };
                // Every other value wins against nil.
                let take_other = a.is_nil() || !b.is_nil() && self.order(a, b)? == other;
                Ok(if take_other { b } else { a })
            }
            builtin::LENGTH..=builtin::STRING_TO_FLOAT if P::FULL => {
                if a.is(Tag::LIBRARY) {
                    return Ok(Value::unset());
                }
                self.string_builtin(number, count)
            }
            // The verifier refuses all other numbers.
            _ => Ok(Value::nil()),
        }
    }

    /// Returns argument `number` of the `count` topmost values, or unset if there is none.
    #[one_copy]
    pub(super) fn argument(&self, number: u8, count: u8) -> Value<P> {
        if number < count { self.top(count - number) } else { Value::unset() }
    }

    /// Computes some built-ins without [`Vm::call_builtin`], on computers: an extreme of two
    /// numbers, or a function of one float. The `count` arguments begin at slot `at`.
    pub(super) fn call_quickly(&self, number: u8, at: usize, count: usize) -> Option<Value<P>> {
        let a = self.arena.get_fast(at);
        match number {
            builtin::MIN | builtin::MAX if count == 2 => {
                let b = self.arena.get_fast(at.wrapping_add(1));
                let other = if number == builtin::MAX { order::LESS } else { order::GREATER };
                let are_numbers = a.is_number() && b.is_number();
                are_numbers.then(|| if Self::order_of_numbers(a, b) == other { b } else { a })
            }
            builtin::SQRT..builtin::ATAN
                if count == 1 && a.is(Tag::FLOAT) && Self::has(Part::Maths) =>
            {
                Some(Self::function_of(number - builtin::SQRT, a))
            }
            _ => None,
        }
    }

    /// Computes a function of the library `math` of one float. `function` is its number in
    /// [`maths::MathFunction`].
    fn function_of(function: u8, a: Value<P>) -> Value<P> {
        let compute = || {
            let y = P::unpack(a.raw());
            let mut x = y;
            maths::function::<P, C>(function, &mut x, &y);
            P::pack(&x)
        };
        #[cfg(target_pointer_width = "64")]
        if !P::FULL {
            let argument = P::raw_to_u16(a.raw());
            let result = memo::remember(function, argument, || P::raw_to_u16(compute()));
            return Value::indexed(Tag::FLOAT, result);
        }
        Value::new(Tag::FLOAT, compute())
    }

    /// Computes a built-in that takes one or two numbers.
    #[one_copy]
    fn compute(&mut self, number: u8, a: Value<P>, b: Value<P>) -> Result<Value<P>, Stopped> {
        let (mut a, mut b) = (a, b);
        match number {
            builtin::UNIFORM if b.is(Tag::UNSET) => (a, b) = (Value::int(0), a),
            builtin::GAUSSIAN => {
                if a.is(Tag::UNSET) {
                    a = Value::int(1);
                }
                if b.is(Tag::UNSET) {
                    b = Value::int(0);
                }
            }
            builtin::UNIFORM | builtin::ATAN => {}
            _ => b = a,
        }
        self.need_number(if a.is_number() { b } else { a })?;
        if a.is(Tag::INT) && b.is(Tag::INT) {
            match number {
                builtin::TO_INT | builtin::FLOOR..=builtin::ROUND => return Ok(a),
                builtin::ABS => {
                    let negative = P::int_less(a.raw(), P::ZERO);
                    return Ok(if negative { Value::new(Tag::INT, P::neg(a.raw())) } else { a });
                }
                builtin::UNIFORM => {
                    let int = self.rng.uniform_int::<P>(a.raw(), b.raw());
                    return Ok(Value::new(Tag::INT, int));
                }
                builtin::SET_SEED => {
                    self.rng = Rng::from_seed(P::int_to_i32(a.raw()) as u32);
                    return Ok(Value::nil());
                }
                _ => {}
            }
        }
        if !Self::has(Part::Floats) {
            return Err(self.wrong_type(a, b));
        }
        let mut x = a.unpack_float();
        let y = b.unpack_float();
        match number {
            builtin::SET_SEED => return Err(self.wrong_type(a, a)),
            builtin::UNIFORM => self.rng.uniform_float(&mut x, &y),
            builtin::ABS => x.abs(),
            builtin::TO_FLOAT => {}
            builtin::GAUSSIAN if Self::has(Part::Maths) => self.rng.gaussian::<P, C>(&mut x, &y),
            builtin::EXPONENTIAL if Self::has(Part::Maths) => self.rng.exponential::<P, C>(&mut x),
            // The functions are in the order of the built-ins.
            builtin::SQRT..=builtin::ATAN if Self::has(Part::Maths) => {
                maths::function::<P, C>(number - builtin::SQRT, &mut x, &y);
            }
            _ => {
                let rounding = match number {
                    builtin::FLOOR => Rounding::Floor,
                    builtin::CEIL => Rounding::Ceil,
                    builtin::ROUND => Rounding::Nearest,
                    _ => Rounding::Truncate,
                };
                return Ok(Value::new(Tag::INT, x.to_int(rounding)));
            }
        }
        Ok(Value::packed(&x))
    }

    #[one_copy]
    pub(super) fn need_number(&mut self, value: Value<P>) -> Result<(), Stopped> {
        if value.is_number() { Ok(()) } else { Err(self.wrong_type(value, value)) }
    }
}

/// Returns the number of the string that names a type.
fn type_name(of: Type) -> u16 {
    match of {
        Type::Nil | Type::Unset => string::NIL,
        Type::Int => string::INTEGER,
        Type::Float => string::FLOAT,
        Type::String => string::STRING,
        Type::Table => string::TABLE,
        Type::Closure => string::CLOSURE,
    }
}
