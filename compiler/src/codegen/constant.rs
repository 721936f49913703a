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
    /// A float that the profile can represent; `f32` holds all floats of both profiles.
    Float(f32),
}

impl Number {
    /// Returns the value of a number literal, written or folded; `None` for any other expression.
    pub fn of(profile: Profile, expr: &Expr) -> Option<Number> {
        match expr.kind {
            ExprKind::Int(value) => i32::try_from(value).ok().map(Number::Int),
            ExprKind::Float(value) => {
                Some(Number::Float(from_bits(profile, float_bits(profile, value))))
            }
            _ => None,
        }
    }

    /// Returns the number as a literal.
    pub fn to_expr(self) -> ExprKind {
        match self {
            Number::Int(value) => ExprKind::Int(i64::from(value)),
            Number::Float(value) => ExprKind::Float(f64::from(value)),
        }
    }

    /// Returns the nearest binary32 value.
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

/// Returns the smallest and the largest integer of a profile.
pub fn int_range(profile: Profile) -> (i32, i32) {
    match profile {
        Profile::Tiny => (Tiny::INT_MIN, Tiny::INT_MAX),
        Profile::Full => (Full::INT_MIN, Full::INT_MAX),
    }
}

/// Returns the size of a literal in bytes.
pub fn word_bytes(profile: Profile) -> usize {
    match profile {
        Profile::Tiny => Tiny::WORD_BYTES,
        Profile::Full => Full::WORD_BYTES,
    }
}

/// Returns the payload of the float nearest to a literal.
pub fn float_bits(profile: Profile, value: f64) -> u32 {
    match profile {
        Profile::Tiny => u32::from(Tiny::float_from_f32(to_odd(value))),
        Profile::Full => Full::float_from_f32(value as f32),
    }
}

/// Returns the value of a float's payload.
pub fn from_bits(profile: Profile, bits: u32) -> f32 {
    match profile {
        Profile::Tiny => Tiny::float_to_f32(bits as u16),
        Profile::Full => Full::float_to_f32(bits),
    }
}

/// Converts to binary32 by rounding to odd: the value is truncated, and the last bit is set if bits
/// were cut off. Rounding the result once more to fewer bits gives the same value as rounding the
/// binary64 directly.
fn to_odd(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) == value || !nearest.is_finite() || nearest == 0.0 {
        return nearest;
    }
    let away = f64::from(nearest).abs() > value.abs();
    let truncated = if away { nearest.to_bits() - 1 } else { nearest.to_bits() };
    f32::from_bits(truncated | 1)
}

/// Returns the result of an operation on one number; `None` if the machine has to compute it.
pub fn unary(profile: Profile, op: UnaryOp, operand: Number) -> Option<Number> {
    match (op, operand) {
        (UnaryOp::Negate, Number::Int(value)) => Some(int(profile, value.wrapping_neg())),
        (UnaryOp::Negate, Number::Float(value)) => Some(Number::Float(-value)),
        (UnaryOp::BitNot, Number::Int(value)) => Some(int(profile, !value)),
        _ => None,
    }
}

/// Returns the result of arithmetic on two numbers; `None` if the operation faults or the machine
/// has to compute it.
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

/// Computes the IEEE binary32 operations of the full profile, which the machine leaves to the
/// processor. [`float`] keeps more bits of a product for the mathematical functions, so it would
/// round some products twice.
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

/// Returns the result of a comparison of two numbers; `None` if the machine has to compute it.
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
