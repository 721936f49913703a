//! Arithmetic on constants, exactly as the virtual machine does it in the profile of the image.

use bittybuzz_vm_core::number::maths::{MathFunction, function};
use bittybuzz_vm_core::number::{self, Full, Profile as _, Tiny};

use crate::ast::{BinaryOp, UnaryOp};
use crate::profile::NumberProfile;

/// A number that is known when the script is compiled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ConstantNumber {
    /// An integer in the range of the profile.
    Int(i32),
    /// A float that the profile can represent; `f32` holds all floats of both profiles.
    Float(f32),
}

impl ConstantNumber {
    /// Returns the nearest binary32 value.
    fn to_f32(self) -> f32 {
        match self {
            ConstantNumber::Int(value) => value as f32,
            ConstantNumber::Float(value) => value,
        }
    }

    fn to_machine(self) -> number::Number {
        match self {
            ConstantNumber::Int(value) => number::Number::Int(value),
            ConstantNumber::Float(value) => number::Number::Float(value),
        }
    }
}

/// Returns the result of an operation on one number; `None` if the machine has to compute it.
pub fn unary(
    profile: NumberProfile,
    op: UnaryOp,
    operand: ConstantNumber,
) -> Option<ConstantNumber> {
    match (op, operand) {
        (UnaryOp::Negate, ConstantNumber::Int(value)) => Some(int(profile, value.wrapping_neg())),
        (UnaryOp::Negate, ConstantNumber::Float(value)) => Some(ConstantNumber::Float(-value)),
        (UnaryOp::BitNot, ConstantNumber::Int(value)) => Some(int(profile, !value)),
        _ => None,
    }
}

/// Returns the result of arithmetic on two numbers; `None` if the operation faults or the machine
/// has to compute it.
pub fn arithmetic(
    profile: NumberProfile,
    op: BinaryOp,
    left: ConstantNumber,
    right: ConstantNumber,
) -> Option<ConstantNumber> {
    match (left, right) {
        (ConstantNumber::Int(a), ConstantNumber::Int(b)) if op != BinaryOp::Pow => match profile {
            NumberProfile::Tiny => integer::<Tiny>(op, a, b),
            NumberProfile::Full => integer::<Full>(op, a, b),
        },
        _ => {
            let result = match profile {
                NumberProfile::Tiny => float::<Tiny>(op, left, right)?,
                NumberProfile::Full => match binary32(op, left, right) {
                    Some(result) => result,
                    None => float::<Full>(op, left, right)?,
                },
            };
            (!result.is_nan()).then_some(ConstantNumber::Float(result))
        }
    }
}

/// Computes the IEEE binary32 operations of the full profile, which the machine leaves to the
/// processor. [`float`] keeps more bits of a product for the mathematical functions, so it would
/// round some products twice.
fn binary32(op: BinaryOp, left: ConstantNumber, right: ConstantNumber) -> Option<f32> {
    let (a, b) = (left.to_f32(), right.to_f32());
    match op {
        BinaryOp::Add => Some(a + b),
        BinaryOp::Sub => Some(a - b),
        BinaryOp::Mul => Some(a * b),
        BinaryOp::Div => Some(a / b),
        _ => None,
    }
}

fn float<P: number::Profile>(
    op: BinaryOp,
    left: ConstantNumber,
    right: ConstantNumber,
) -> Option<f32> {
    let (mut a, b) =
        (left.to_machine().unpack_float::<P>(), right.to_machine().unpack_float::<P>());
    match op {
        BinaryOp::Add => a.add(&b),
        BinaryOp::Sub => a.sub(&b),
        BinaryOp::Mul => a.mul(&b),
        BinaryOp::Div => a.div(&b),
        BinaryOp::Mod => return Some(P::float_to_f32(a.modulo(&b))),
        BinaryOp::Pow => function::<P, &[u8]>(MathFunction::Power as u8, &mut a, &b),
        _ => return None,
    }
    Some(P::float_to_f32(P::pack(&a)))
}

fn integer<P: number::Profile>(op: BinaryOp, a: i32, b: i32) -> Option<ConstantNumber> {
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
    Some(ConstantNumber::Int(P::int_to_i32(result)))
}

fn int(profile: NumberProfile, value: i32) -> ConstantNumber {
    match profile {
        NumberProfile::Tiny => ConstantNumber::Int(Tiny::int_to_i32(Tiny::int_from_i32(value))),
        NumberProfile::Full => ConstantNumber::Int(value),
    }
}

/// Returns the result of a comparison of two numbers; `None` if the machine has to compute it.
pub fn compare(op: BinaryOp, left: ConstantNumber, right: ConstantNumber) -> Option<bool> {
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
