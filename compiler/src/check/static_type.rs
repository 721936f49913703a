//! The types of values, as far as they are known from the source.

use crate::ast::{BinaryOp, UnaryOp};
use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{CheckedExpr, CheckedExprKind};
use crate::source::Span;

/// The type of a value, as far as it is known from the source.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StaticType {
    /// nil
    Nil,
    /// An integer.
    Int,
    /// A float.
    Float,
    /// An integer or a float.
    Number,
    /// A string.
    String,
    /// A table.
    Table,
    /// A function.
    Function,
}

impl StaticType {
    /// Returns the name in messages.
    pub fn name(self) -> &'static str {
        match self {
            StaticType::Nil => "nil",
            StaticType::Int => "an integer",
            StaticType::Float => "a float",
            StaticType::Number => "a number",
            StaticType::String => "a string",
            StaticType::Table => "a table",
            StaticType::Function => "a function",
        }
    }

    /// Returns true for integers and floats.
    pub fn is_number(self) -> bool {
        matches!(self, StaticType::Int | StaticType::Float | StaticType::Number)
    }
}

/// Returns the type of an expression's value, if the type is certain unless the expression faults.
pub fn kind_of(expr: &CheckedExpr, meanings: &Meanings<'_>) -> Option<StaticType> {
    match &expr.kind {
        CheckedExprKind::Nil => Some(StaticType::Nil),
        CheckedExprKind::Int(_) => Some(StaticType::Int),
        CheckedExprKind::Float(_) => Some(StaticType::Float),
        CheckedExprKind::Str(_) => Some(StaticType::String),
        CheckedExprKind::Table(_) => Some(StaticType::Table),
        CheckedExprKind::Lambda(_) => Some(StaticType::Function),
        CheckedExprKind::Name(name) => match meanings.of(*name) {
            Meaning::Function(_) | Meaning::Builtin(_) | Meaning::Robot => {
                Some(StaticType::Function)
            }
            Meaning::Library(_) => Some(StaticType::Table),
            Meaning::RobotId => Some(StaticType::Int),
            Meaning::Nil | Meaning::Global => None,
        },
        CheckedExprKind::Unary { op, operand } => Some(match op {
            UnaryOp::Not | UnaryOp::BitNot => StaticType::Int,
            UnaryOp::Negate | UnaryOp::Plus => number_kind(kind_of(operand, meanings)),
        }),
        CheckedExprKind::Chain { first, links } => {
            links.iter().fold(kind_of(first, meanings), |left, link| {
                Some(result_kind(link.op, left, kind_of(&link.right, meanings)))
            })
        }
        _ => None,
    }
}

/// Returns the type of an operation's value, from those of its two sides.
pub fn result_kind(
    op: BinaryOp,
    left: Option<StaticType>,
    right: Option<StaticType>,
) -> StaticType {
    match op {
        BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div | BinaryOp::Mod => {
            match (number_kind(left), number_kind(right)) {
                (StaticType::Float, _) | (_, StaticType::Float) => StaticType::Float,
                (StaticType::Int, StaticType::Int) => StaticType::Int,
                _ => StaticType::Number,
            }
        }
        BinaryOp::Pow => StaticType::Float,
        _ => StaticType::Int,
    }
}

/// One side of an operation.
#[derive(Debug, Clone, Copy)]
pub struct OperandValue {
    /// The type of the value; `None` if it is not certain.
    pub kind: Option<StaticType>,
    /// The place in the source.
    pub span: Span,
}

fn number_kind(kind: Option<StaticType>) -> StaticType {
    kind.filter(|kind| kind.is_number()).unwrap_or(StaticType::Number)
}
