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

/// `rest + immediate`, for an addition or subtraction of an integer literal.
pub fn added_literal<'a>(op: BinaryOp, left: &'a Expr, right: &'a Expr) -> Option<(&'a Expr, i16)> {
    match (op, &left.kind, &right.kind) {
        (BinaryOp::Add, _, ExprKind::Int(value)) => Some((left, i16::try_from(*value).ok()?)),
        (BinaryOp::Add, ExprKind::Int(value), _) => Some((right, i16::try_from(*value).ok()?)),
        // `x - 0` keeps the sign of a negative zero, `x + 0` does not.
        (BinaryOp::Sub, _, ExprKind::Int(value)) if *value != 0 => {
            Some((left, i16::try_from(value.checked_neg()?).ok()?))
        }
        _ => None,
    }
}
