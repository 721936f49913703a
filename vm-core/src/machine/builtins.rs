//! Built-ins that have their result at once.

use core::cmp::Ordering;

use super::Vm;
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
        let end = usize::from(self.sp);
        let first = end - count;
        let a = self.argument(first, end);
        let b = self.argument(first + 1, end);
        match number {
            builtin::LOG => {
                for slot in first..end {
                    if self.arena.get(slot).is(Tag::LIBRARY) {
                        self.library_to_table(host, slot)?;
                    }
                }
                host.log(Arguments { vm: self, end, count });
                Ok(Value::nil())
            }
            builtin::SIZE => {
                self.library_to_table(host, first)?;
                Ok(Value::int(self.table_size(self.arena.get(first)) as i32))
            }
            builtin::RAND => Ok(Value::int(self.rng.rand())),
            builtin::UNIFORM => self.uniform(a, b),
            builtin::SET_SEED => {
                let Some(seed) = a.as_int() else { return Err(self.wrong_type(a, a)) };
                self.rng = Rng::from_seed(seed as u32);
                Ok(Value::nil())
            }
            builtin::TO_INT | builtin::FLOOR..=builtin::ROUND => self.rounded(number, a),
            builtin::ABS => self.magnitude(a),
            #[cfg(feature = "maths")]
            builtin::SQRT..=builtin::ATAN | builtin::GAUSSIAN | builtin::EXPONENTIAL => {
                self.maths(number, a, b)
            }
            builtin::TO_FLOAT => {
                self.need_number(a)?;
                Ok(Value::float(float(a)))
            }
            // All others take any value.
            _ if a.is(Tag::UNSET) => Err(self.fail(FaultCode::MissingArgument)),
            builtin::TYPE => Ok(Value::string(type_name(a.type_of()))),
            // In the order of the types; that of user data is one that no argument has.
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
                let other = if number == builtin::MAX { Ordering::Less } else { Ordering::Greater };
                // Anything is more of an extreme than nil.
                let take_other = a.is_nil() || !b.is_nil() && self.order(a, b)? == Some(other);
                Ok(if take_other { b } else { a })
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
    #[inline(never)]
    pub(super) fn argument(&self, slot: usize, end: usize) -> Value<P> {
        if slot < end { self.arena.get(slot) } else { Value::unset() }
    }

    fn uniform(&mut self, a: Value<P>, b: Value<P>) -> Result<Value<P>, Stopped> {
        if a.is(Tag::UNSET) {
            return Ok(Value::int(self.rng.next_u32() as i32));
        }
        let (low, high) = if b.is(Tag::UNSET) { (Value::int(0), a) } else { (a, b) };
        self.need_number(low)?;
        self.need_number(high)?;
        Ok(match (low.as_int(), high.as_int()) {
            (Some(low), Some(high)) => Value::int(self.rng.uniform_int(low, high)),
            _ => Value::float(self.rng.uniform_float::<P>(float(low), float(high))),
        })
    }

    /// Integers are themselves; floats are rounded and saturate.
    fn rounded(&mut self, number: u8, a: Value<P>) -> Result<Value<P>, Stopped> {
        self.need_number(a)?;
        if a.is(Tag::INT) {
            return Ok(a);
        }
        let x = float(a);
        let int = match number {
            builtin::FLOOR => number::floor(x),
            builtin::CEIL => number::ceil(x),
            builtin::ROUND => number::round(x),
            _ => number::to_int(Number::Float(x)),
        };
        Ok(Value::int(int.clamp(P::INT_MIN, P::INT_MAX)))
    }

    fn magnitude(&mut self, a: Value<P>) -> Result<Value<P>, Stopped> {
        self.need_number(a)?;
        let raw = a.raw();
        let sign = P::int_less(raw, P::Raw::default());
        Ok(match a.tag() {
            // The sign of a float is in the same bit as that of an integer.
            Tag::FLOAT => Value::new(Tag::FLOAT, P::and(raw, P::int_from_i32(P::INT_MAX))),
            _ if sign => Value::new(Tag::INT, P::neg(raw)),
            _ => a,
        })
    }

    /// The functions of one or two floats.
    #[cfg(feature = "maths")]
    fn maths(&mut self, number: u8, a: Value<P>, b: Value<P>) -> Result<Value<P>, Stopped> {
        let (mut a, mut b) = (a, b);
        if number == builtin::GAUSSIAN {
            if a.is(Tag::UNSET) {
                a = Value::int(1);
            }
            if b.is(Tag::UNSET) {
                b = Value::int(0);
            }
        } else if number != builtin::ATAN {
            b = a;
        }
        self.need_number(a)?;
        self.need_number(b)?;
        let x = float(a);
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
            builtin::ATAN => maths::atan2(x, float(b)),
            builtin::GAUSSIAN => self.rng.gaussian(x, float(b)),
            _ => self.rng.exponential(x),
        }))
    }

    #[inline(never)]
    pub(super) fn need_number(&mut self, value: Value<P>) -> Result<(), Stopped> {
        if value.is_number() { Ok(()) } else { Err(self.wrong_type(value, value)) }
    }
}

/// A number as a float; integers of the full profile round to the nearest, as a float literal would.
#[inline(never)]
fn float<P: Profile>(number: Value<P>) -> f32 {
    number.as_f32().unwrap_or(0.0)
}

/// The string that names a type.
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
