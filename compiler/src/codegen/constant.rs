//! Arithmetic on constants, exactly as the virtual machine does it in the profile of the image.

use bittybuzz_vm_core::number::maths::{Function, function};
use bittybuzz_vm_core::number::{self, Full, Profile as _, Tiny};

use crate::ast::{BinaryOp, UnaryOp};
use crate::check::tree::{Expr, ExprKind};

pub use bittybuzz_robot_spec::Profile;

/// A number that is known when the script is compiled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    /// An integer in the range of the profile.
    Int(i32),
    /// A value that the profile can hold; `f32` holds all of both profiles.
    Float(f32),
}

impl Number {
    /// The number that an expression is, literal or folded.
    pub fn of(profile: Profile, expr: &Expr) -> Option<Number> {
        match expr.kind {
            ExprKind::Int(value) => i32::try_from(value).ok().map(Number::Int),
            ExprKind::Float(value) => {
                Some(Number::Float(from_bits(profile, float_bits(profile, value))))
            }
            _ => None,
        }
    }

    /// The expression that it is.
    pub fn to_expr(self) -> ExprKind {
        match self {
            Number::Int(value) => ExprKind::Int(i64::from(value)),
            Number::Float(value) => ExprKind::Float(f64::from(value)),
        }
    }

    /// The nearest binary32.
    fn to_f32(self) -> f32 {
        match self {
            Number::Int(value) => value as f32,
            Number::Float(value) => value,
        }
    }

    fn to_machine(self) -> number::Number {
        match self {
            Number::Int(value) => number::Number::Int(value),
            Number::Float(value) => number::Number::Float(value),
        }
    }
}

/// Smallest and largest integer of a profile.
pub fn int_range(profile: Profile) -> (i32, i32) {
    match profile {
        Profile::Tiny => (Tiny::INT_MIN, Tiny::INT_MAX),
        Profile::Full => (Full::INT_MIN, Full::INT_MAX),
    }
}

/// Bytes of a literal.
pub fn word_bytes(profile: Profile) -> usize {
    match profile {
        Profile::Tiny => Tiny::WORD_BYTES,
        Profile::Full => Full::WORD_BYTES,
    }
}

/// The payload of the float nearest to a literal.
pub fn float_bits(profile: Profile, value: f64) -> u32 {
    match profile {
        Profile::Tiny => u32::from(Tiny::float_from_f32(to_odd(value))),
        Profile::Full => Full::float_from_f32(value as f32),
    }
}

/// The value of a float's payload.
pub fn from_bits(profile: Profile, bits: u32) -> f32 {
    match profile {
        Profile::Tiny => Tiny::float_to_f32(bits as u16),
        Profile::Full => Full::float_to_f32(bits),
    }
}

/// To binary32, truncated but with the last bit set where something was cut off. Rounding that once more to fewer
/// bits gives what rounding the binary64 at once would have given.
fn to_odd(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) == value || !nearest.is_finite() || nearest == 0.0 {
        return nearest;
    }
    let away = f64::from(nearest).abs() > value.abs();
    let truncated = if away { nearest.to_bits() - 1 } else { nearest.to_bits() };
    f32::from_bits(truncated | 1)
}

/// The result of an operation on one number; `None` if the machine has to do it.
pub fn unary(profile: Profile, op: UnaryOp, operand: Number) -> Option<Number> {
    match (op, operand) {
        (UnaryOp::Negate, Number::Int(value)) => Some(int(profile, value.wrapping_neg())),
        (UnaryOp::Negate, Number::Float(value)) => Some(Number::Float(-value)),
        (UnaryOp::BitNot, Number::Int(value)) => Some(int(profile, !value)),
        _ => None,
    }
}

/// The result of arithmetic on two numbers; `None` if it is a fault, or the machine has to do it.
pub fn arithmetic(profile: Profile, op: BinaryOp, left: Number, right: Number) -> Option<Number> {
    match (left, right) {
        (Number::Int(a), Number::Int(b)) if op != BinaryOp::Pow => match profile {
            Profile::Tiny => integer::<Tiny>(op, a, b),
            Profile::Full => integer::<Full>(op, a, b),
        },
        _ => {
            let result = match profile {
                Profile::Tiny => float::<Tiny>(op, left, right)?,
                Profile::Full => match binary32(op, left, right) {
                    Some(result) => result,
                    None => float::<Full>(op, left, right)?,
                },
            };
            (!result.is_nan()).then_some(Number::Float(result))
        }
    }
}

/// The IEEE binary32 operations of the full profile, which the machine leaves to the processor. [`float`] keeps more
/// bits of a product for the mathematical functions, so it would round some products twice.
fn binary32(op: BinaryOp, left: Number, right: Number) -> Option<f32> {
    let (a, b) = (left.to_f32(), right.to_f32());
    match op {
        BinaryOp::Add => Some(a + b),
        BinaryOp::Sub => Some(a - b),
        BinaryOp::Mul => Some(a * b),
        BinaryOp::Div => Some(a / b),
        _ => None,
    }
}

fn float<P: number::Profile>(op: BinaryOp, left: Number, right: Number) -> Option<f32> {
    let (mut a, b) =
        (left.to_machine().unpack_float::<P>(), right.to_machine().unpack_float::<P>());
    match op {
        BinaryOp::Add => a.add(&b),
        BinaryOp::Sub => a.sub(&b),
        BinaryOp::Mul => a.mul(&b),
        BinaryOp::Div => a.div(&b),
        BinaryOp::Mod => return Some(P::float_to_f32(a.modulo(&b))),
        BinaryOp::Pow => function::<P, &[u8]>(Function::Power as u8, &mut a, &b),
        _ => return None,
    }
    Some(P::float_to_f32(P::pack(&a)))
}

fn integer<P: number::Profile>(op: BinaryOp, a: i32, b: i32) -> Option<Number> {
    let (a, b) = (P::int_from_i32(a), P::int_from_i32(b));
    let result = match op {
        BinaryOp::Add => P::add(a, b),
        BinaryOp::Sub => P::sub(a, b),
        BinaryOp::Mul => P::mul(a, b),
        BinaryOp::Div => P::div(a, b)?,
        BinaryOp::Mod => P::modulo(a, b)?,
        BinaryOp::BitAnd => P::and(a, b),
        BinaryOp::BitOr => P::or(a, b),
        BinaryOp::ShiftLeft => P::shl(a, b)?,
        BinaryOp::ShiftRight => P::shr(a, b)?,
        _ => return None,
    };
    Some(Number::Int(P::int_to_i32(result)))
}

fn int(profile: Profile, value: i32) -> Number {
    match profile {
        Profile::Tiny => Number::Int(Tiny::int_to_i32(Tiny::int_from_i32(value))),
        Profile::Full => Number::Int(value),
    }
}

/// The result of a comparison of two numbers.
pub fn compare(op: BinaryOp, left: Number, right: Number) -> Option<bool> {
    let order = left.to_machine().unpack().compare(&right.to_machine().unpack())?;
    Some(match op {
        BinaryOp::Eq => order.is_eq(),
        BinaryOp::NotEq => order.is_ne(),
        BinaryOp::Less => order.is_lt(),
        BinaryOp::LessEq => order.is_le(),
        BinaryOp::Greater => order.is_gt(),
        BinaryOp::GreaterEq => order.is_ge(),
        _ => return None,
    })
}
