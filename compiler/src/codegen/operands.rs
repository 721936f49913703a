//! Facts about operands that are known at compile time: the kind of a value, and literals that have
//! a shorter instruction.

use crate::ast::{BinaryOp, UnaryOp};
use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{CheckedExpr, CheckedExprKind};

/// Returns true if the value is certainly a number or nil, provided that no operand faults.
pub fn is_number_or_nil(expr: &CheckedExpr, meanings: &Meanings<'_>) -> bool {
    match &expr.kind {
        CheckedExprKind::Nil | CheckedExprKind::Int(_) | CheckedExprKind::Float(_) => true,
        CheckedExprKind::Name(name) => meanings.of(*name) == Meaning::RobotId,
        // Arithmetic, comparisons and logic give numbers or fault.
        CheckedExprKind::Unary { op, .. } => {
            matches!(op, UnaryOp::Negate | UnaryOp::BitNot | UnaryOp::Not | UnaryOp::Plus)
        }
        CheckedExprKind::Chain { .. } => true,
        _ => false,
    }
}

/// Returns true if the value is certainly a float, provided that no operand faults.
pub fn is_float(expr: &CheckedExpr) -> bool {
    match &expr.kind {
        CheckedExprKind::Float(_) => true,
        CheckedExprKind::Unary { op: UnaryOp::Negate, operand } => is_float(operand),
        CheckedExprKind::Chain { first, links } => {
            links.iter().fold(is_float(first), |left, link| gives_float(link.op, left, &link.right))
        }
        _ => false,
    }
}

/// Returns true if the result of an operation is certainly a float; `left` is true if its left side is one.
pub fn gives_float(op: BinaryOp, left: bool, right: &CheckedExpr) -> bool {
    match op {
        BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div | BinaryOp::Mod => {
            left || is_float(right)
        }
        BinaryOp::Pow => true,
        _ => false,
    }
}

/// Returns the integer that has the same effect as a literal, with less code. A float literal has
/// one only if the other operand is a float; a negative zero has none.
fn same_integer(literal: &CheckedExpr, other_is_float: impl FnOnce() -> bool) -> Option<i16> {
    match literal.kind {
        CheckedExprKind::Int(value) => i16::try_from(value).ok(),
        CheckedExprKind::Float(value)
            if other_is_float() && value.to_bits() != (-0.0_f64).to_bits() =>
        {
            let whole = value as i16;
            // Floats of the tiny profile do not represent all larger integers exactly.
            (f64::from(whole) == value && whole.unsigned_abs() <= 1 << 10).then_some(whole)
        }
        _ => None,
    }
}

/// Returns the integer to add if an operation adds or subtracts the literal on its right side;
/// `left_is_float` is true if its left side is certainly a float.
pub fn added_integer(op: BinaryOp, left_is_float: bool, right: &CheckedExpr) -> Option<i16> {
    let literal = || same_integer(right, || left_is_float);
    match op {
        BinaryOp::Add => literal(),
        // `x - 0` keeps the sign of a negative zero, `x + 0` does not.
        BinaryOp::Sub => literal().filter(|value| *value != 0).and_then(i16::checked_neg),
        _ => None,
    }
}

/// Returns `rest` and `immediate` of `rest + immediate`, for an addition or subtraction of a
/// literal that an integer can replace.
pub fn added_literal<'a>(
    op: BinaryOp,
    left: &'a CheckedExpr,
    right: &'a CheckedExpr,
) -> Option<(&'a CheckedExpr, i16)> {
    let in_front = || match op {
        BinaryOp::Add => same_integer(left, || is_float(right)).map(|value| (right, value)),
        _ => None,
    };
    added_integer(op, is_float(left), right).map(|value| (left, value)).or_else(in_front)
}
