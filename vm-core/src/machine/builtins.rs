//! Built-ins that have their result at once.

use core::cmp::Ordering;

use super::Vm;
use super::slow::as_f32;
use crate::builtin::{self, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::{Arguments, Host};
#[cfg(feature = "maths")]
use crate::number::maths;
use crate::number::{self, Number, Profile, Rng};
use crate::value::{Tag, Type, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Computes a built-in of kind `Plain` from the `count` arguments on top, which stay there.
    #[inline(never)]
    pub(super) fn builtin<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        count: usize,
    ) -> Result<Value<P>, Stopped> {
        let first = usize::from(self.sp) - count;
        let end = usize::from(self.sp);
        if number == builtin::LOG {
            for slot in first..end {
                if self.arena.get(slot).is(Tag::LIBRARY) {
                    self.library_to_table(host, slot)?;
                }
            }
            host.log(Arguments { vm: self, end, count });
            return Ok(Value::nil());
        }
        let a = self.argument(first, end);
        let b = self.argument(first + 1, end);
        match number {
            builtin::RAND => {
                return Ok(Value::int(self.rng.rand()));
            }
            builtin::UNIFORM => return self.uniform(a, b),
            #[cfg(feature = "maths")]
            builtin::GAUSSIAN => {
                let deviation = self.float_or(a, 1.0)?;
                let mean = self.float_or(b, 0.0)?;
                return Ok(Value::float(self.rng.gaussian(deviation, mean)));
            }
            _ => {}
        }
        // All others need their first argument.
        if a.is(Tag::UNSET) {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        let is = |wanted: Type| Ok(Value::truth(a.type_of() == wanted));
        match number {
            builtin::SIZE => {
                self.library_to_table(host, first)?;
                let size = self.table_size(self.arena.get(first));
                Ok(Value::int(size as i32))
            }
            builtin::TYPE => Ok(Value::string(match a.type_of() {
                Type::Nil | Type::Unset => string::NIL,
                Type::Int => string::INTEGER,
                Type::Float => string::FLOAT,
                Type::String => string::STRING,
                Type::Table => string::TABLE,
                Type::Closure => string::CLOSURE,
            })),
            builtin::IS_NIL => is(Type::Nil),
            builtin::IS_INT => is(Type::Int),
            builtin::IS_FLOAT => is(Type::Float),
            builtin::IS_STRING => is(Type::String),
            builtin::IS_TABLE => is(Type::Table),
            builtin::IS_CLOSURE => is(Type::Closure),
            builtin::IS_USERDATA => Ok(Value::truth(false)),
            builtin::TO_INT => Ok(saturated(number::to_int(self.need_number(a)?))),
            builtin::TO_FLOAT => Ok(Value::float(self.need_float(a)?)),
            builtin::ASSERT => {
                if !a.is_false() {
                    return Ok(Value::nil());
                }
                let detail = b.as_string().map_or(0, |number| number.wrapping_add(1));
                Err(self.fail_with(FaultCode::AssertFailed, [Type::Nil; 2], detail))
            }
            builtin::MIN | builtin::MAX => self.extreme(a, b, number == builtin::MAX),
            builtin::ABS => match self.need_number(a)? {
                Number::Int(value) if value < 0 => Ok(Value::new(Tag::INT, P::neg(a.raw()))),
                Number::Float(value) => Ok(Value::float(number::abs(value))),
                Number::Int(_) => Ok(a),
            },
            builtin::FLOOR => Ok(rounded(a, self.need_number(a)?, number::floor)),
            builtin::CEIL => Ok(rounded(a, self.need_number(a)?, number::ceil)),
            builtin::ROUND => Ok(rounded(a, self.need_number(a)?, number::round)),
            builtin::SET_SEED => {
                let Number::Int(seed) = self.need_number(a)? else {
                    return Err(self.wrong_type(a, a));
                };
                self.rng = Rng::from_seed(seed as u32);
                Ok(Value::nil())
            }
            #[cfg(feature = "maths")]
            builtin::EXPONENTIAL => {
                let mean = self.need_float(a)?;
                Ok(Value::float(self.rng.exponential(mean)))
            }
            #[cfg(feature = "maths")]
            builtin::SQRT..=builtin::ATAN => {
                let x = self.need_float(a)?;
                Ok(Value::float(match number {
                    builtin::SQRT => maths::sqrt(x),
                    builtin::EXP => maths::exp(x),
                    builtin::LN => maths::log(x),
                    builtin::LOG2 => maths::log2(x),
                    builtin::LOG10 => maths::log10(x),
                    builtin::SIN => maths::sin(x),
                    builtin::COS => maths::cos(x),
                    builtin::TAN => maths::tan(x),
                    builtin::ASIN => maths::asin(x),
                    builtin::ACOS => maths::acos(x),
                    _ => maths::atan2(x, self.need_float(b)?),
                }))
            }
            #[cfg(feature = "strings")]
            builtin::LENGTH..=builtin::STRING_TO_FLOAT => {
                if a.is(Tag::LIBRARY) {
                    self.library_to_table(host, first)?;
                }
                self.string_builtin(number, first, end)
            }
            // The verifier lets no other number pass.
            _ => Ok(Value::nil()),
        }
    }

    /// The argument in that slot, unset if the call has not so many.
    pub(super) fn argument(&self, slot: usize, end: usize) -> Value<P> {
        if slot < end { self.arena.get(slot) } else { Value::unset() }
    }

    /// `math.min` and `math.max`.
    fn extreme(&mut self, a: Value<P>, b: Value<P>, max: bool) -> Result<Value<P>, Stopped> {
        if b.is(Tag::UNSET) {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        if a.is_nil() || b.is_nil() {
            return Ok(if a.is_nil() { b } else { a });
        }
        let other = if max { Ordering::Less } else { Ordering::Greater };
        Ok(if self.order(a, b)? == Some(other) { b } else { a })
    }

    fn uniform(&mut self, a: Value<P>, b: Value<P>) -> Result<Value<P>, Stopped> {
        if a.is(Tag::UNSET) {
            return Ok(Value::int(self.rng.next_u32() as i32));
        }
        let (low, high) = if b.is(Tag::UNSET) {
            (Number::Int(0), self.need_number(a)?)
        } else {
            (self.need_number(a)?, self.need_number(b)?)
        };
        Ok(match (low, high) {
            (Number::Int(low), Number::Int(high)) => Value::int(self.rng.uniform_int(low, high)),
            (low, high) => Value::float(self.rng.uniform_float::<P>(as_f32(low), as_f32(high))),
        })
    }

    fn need_number(&mut self, value: Value<P>) -> Result<Number, Stopped> {
        match value.as_number() {
            Some(number) => Ok(number),
            None => Err(self.wrong_type(value, value)),
        }
    }

    fn need_float(&mut self, value: Value<P>) -> Result<f32, Stopped> {
        self.need_number(value).map(as_f32)
    }

    #[cfg(feature = "maths")]
    fn float_or(&mut self, value: Value<P>, default: f32) -> Result<f32, Stopped> {
        if value.is(Tag::UNSET) { Ok(default) } else { self.need_float(value) }
    }
}

/// The integer, or the nearest that the profile has.
fn saturated<P: Profile>(value: i32) -> Value<P> {
    Value::int(value.clamp(P::INT_MIN, P::INT_MAX))
}

/// Integers are themselves; floats are rounded and saturate.
fn rounded<P: Profile>(value: Value<P>, number: Number, round: fn(f32) -> i32) -> Value<P> {
    match number {
        Number::Int(_) => value,
        Number::Float(float) => saturated(round(float)),
    }
}
