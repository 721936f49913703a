//! Kinds of values that are known without running the script, and operands that have a shorter instruction.

use crate::ast::{BinaryOp, UnaryOp};
use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{Expr, ExprKind};

/// Whether the value is a number or nil for certain, wherever its operands do not fault.
pub fn is_number_or_nil(expr: &Expr, meanings: &Meanings<'_>) -> bool {
    match &expr.kind {
        ExprKind::Nil | ExprKind::Int(_) | ExprKind::Float(_) => true,
        ExprKind::Name(name) => meanings.of(*name) == Meaning::RobotId,
        // Arithmetic, comparisons and logic give numbers or fault.
        ExprKind::Unary { op, .. } => {
            matches!(op, UnaryOp::Negate | UnaryOp::BitNot | UnaryOp::Not | UnaryOp::Plus)
        }
        ExprKind::Binary { .. } => true,
        _ => false,
    }
}

/// Whether the value is a float for certain, wherever its operands do not fault.
fn is_float(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Float(_) => true,
        ExprKind::Unary { op: UnaryOp::Negate, operand } => is_float(operand),
        ExprKind::Binary { op, left, right } => match op {
            BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div | BinaryOp::Mod => {
                is_float(left) || is_float(right)
            }
            BinaryOp::Pow => true,
            _ => false,
        },
        _ => false,
    }
}

/// The integer that does the same as a float literal next to a float, in less code. A negative zero has none.
fn same_integer(literal: &Expr, other: &Expr) -> Option<i16> {
    match literal.kind {
        ExprKind::Int(value) => i16::try_from(value).ok(),
        ExprKind::Float(value) if is_float(other) && value.to_bits() != (-0.0_f64).to_bits() => {
            let whole = value as i16;
            // A float of the tiny profile may be less exact than the integer.
            (f64::from(whole) == value && whole.unsigned_abs() <= 1 << 10).then_some(whole)
        }
        _ => None,
    }
}

/// `rest + immediate`, for an addition or subtraction of a literal that an integer can stand for.
pub fn added_literal<'a>(op: BinaryOp, left: &'a Expr, right: &'a Expr) -> Option<(&'a Expr, i16)> {
    match op {
        BinaryOp::Add => same_integer(right, left)
            .map(|value| (left, value))
            .or_else(|| same_integer(left, right).map(|value| (right, value))),
        // `x - 0` keeps the sign of a negative zero, `x + 0` does not.
        BinaryOp::Sub => same_integer(right, left)
            .filter(|value| *value != 0)
            .and_then(i16::checked_neg)
            .map(|value| (left, value)),
        _ => None,
    }
}
