//! Warnings about operators that people would group otherwise than Buzz does.
//!
//! In Buzz, bit operators and shifts have a higher precedence than arithmetic, `%` a higher one
//! than `*`, and `and` the same as `or`. The operand of `not` is everything to its right.
//! Parentheses silence all of these warnings.

use super::Parser;
use crate::ast::{BinaryOp, Expr, ExprKind, UnaryOp};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::Span;

/// Returns the precedence that C and Python programmers expect of an operator. A larger number
/// binds tighter.
fn expected_power(op: BinaryOp) -> u8 {
    match op {
        BinaryOp::Or => 1,
        BinaryOp::And => 2,
        BinaryOp::Eq
        | BinaryOp::NotEq
        | BinaryOp::Less
        | BinaryOp::LessEq
        | BinaryOp::Greater
        | BinaryOp::GreaterEq => 3,
        BinaryOp::BitOr => 4,
        BinaryOp::BitAnd => 5,
        BinaryOp::ShiftLeft | BinaryOp::ShiftRight => 6,
        BinaryOp::Add | BinaryOp::Sub => 7,
        BinaryOp::Mul | BinaryOp::Div | BinaryOp::Mod => 8,
        BinaryOp::Pow => 9,
    }
}

fn is_bit_logic(op: BinaryOp) -> bool {
    matches!(op, BinaryOp::BitAnd | BinaryOp::BitOr)
}

#[derive(Clone, Copy, PartialEq)]
enum Side {
    Left,
    Right,
}

/// Returns true if Buzz evaluates `inner` before `outer`, but people would expect the opposite.
fn surprises(outer: BinaryOp, inner: BinaryOp, side: Side) -> bool {
    let (outer_power, inner_power) = (expected_power(outer), expected_power(inner));
    // `a & b == c` has the same grouping in Buzz and Python, but another one in C.
    let is_comparison = outer_power == expected_power(BinaryOp::Eq);
    if is_comparison && is_bit_logic(inner) {
        return true;
    }
    match inner_power.cmp(&outer_power) {
        std::cmp::Ordering::Less => true,
        std::cmp::Ordering::Greater => false,
        // Operators of one precedence are read from left to right, powers from right to left.
        std::cmp::Ordering::Equal => (side == Side::Right) != (outer == BinaryOp::Pow),
    }
}

/// Returns the operator that is evaluated last in an expression without parentheses around it.
fn binary_op(expr: &Expr) -> Option<BinaryOp> {
    match &expr.kind {
        ExprKind::Chain { links, .. } => links.last().map(|link| link.op),
        _ => None,
    }
}

impl Parser<'_> {
    /// Warns about an operation whose operands are grouped unexpectedly.
    pub(super) fn warn_grouping(&mut self, op: BinaryOp, left: &Expr, right: &Expr) {
        let whole = left.span.to(right.span);
        for (operand, side) in [(left, Side::Left), (right, Side::Right)] {
            let Some(inner) = binary_op(operand).filter(|inner| surprises(op, *inner, side)) else {
                continue;
            };
            if op.is_logic() && inner.is_logic() {
                self.warn_reading(
                    DiagnosticCode::MixedAndOr,
                    whole,
                    operand.span,
                    "`and` binds like `or`",
                );
            } else {
                let why = "these operators group otherwise than in C or Python";
                self.warn_reading(DiagnosticCode::OperatorGrouping, whole, operand.span, why);
            }
        }
        let is_negative = match left.kind {
            ExprKind::Int(value) => value < 0,
            ExprKind::Float(value) => value.is_sign_negative(),
            _ => false,
        };
        if op == BinaryOp::Pow && is_negative {
            let why = "the minus sign belongs to the number, the power comes after it";
            self.warn_reading(DiagnosticCode::OperatorGrouping, whole, left.span, why);
        }
    }

    /// Warns about a sign whose operand is a whole operation.
    pub(super) fn warn_sign_grouping(&mut self, node: &Expr) {
        let ExprKind::Unary { operand, .. } = &node.kind else { return };
        if binary_op(operand).is_some_and(|op| op != BinaryOp::Pow) {
            let why = "the sign applies to the whole operation after it";
            self.warn_reading(DiagnosticCode::OperatorGrouping, node.span, operand.span, why);
        }
    }

    /// Warns about a `not` whose operand has an `and` or `or`.
    pub(super) fn warn_wide_not(&mut self, node: &Expr) {
        let ExprKind::Unary { operand, .. } = &node.kind else { return };
        if binary_op(operand).is_some_and(BinaryOp::is_logic) {
            let why = "`not` covers everything to its right";
            self.warn_reading(DiagnosticCode::WideNot, node.span, operand.span, why);
        }
    }

    /// Warns about a `!` of a condition, which gives -1 or -2; both are true.
    pub(super) fn warn_bit_not_of_condition(&mut self, node: &Expr) {
        let ExprKind::Unary { operand, .. } = &node.kind else { return };
        let ExprKind::Paren(inner) = &operand.kind else { return };
        if is_condition(inner) {
            let sign = Span { end: node.span.start + 1, ..node.span };
            let end = Span { start: node.span.end, ..node.span };
            self.warn(
                Diagnostic::new(
                    DiagnosticCode::BitwiseNotOfCondition,
                    node.span,
                    "`!` inverts bits: of a condition it gives -1 or -2, which are both true",
                )
                .help("the logical operator is the word `not`")
                .edit(sign, "(not ")
                .edit(end, ")"),
            );
        }
    }

    /// Warns about `and` and `or` on the right side of `=`, because they give 0 or 1 instead of one
    /// of their operands.
    pub(super) fn warn_condition_value(&mut self, value: &Expr) {
        let ExprKind::Chain { links, .. } = &value.kind else { return };
        let mut tested = links.iter().rev().take_while(|link| link.op.is_logic());
        let Some(link) = tested.find(|link| !may_be_condition(&link.right)) else {
            return;
        };
        let name = if link.op == BinaryOp::And { "and" } else { "or" };
        self.warn(
            Diagnostic::new(
                DiagnosticCode::ConditionValue,
                value.span,
                format!("the value of this `{name}` is 0 or 1"),
            )
            .related(link.right.span, "this value is only tested, never taken")
            .help("choose a value with `if`; if 0 or 1 is meant, put it in parentheses"),
        );
    }

    fn warn_reading(&mut self, code: DiagnosticCode, whole: Span, first: Span, why: &str) {
        let mut diagnostic = Diagnostic::new(code, whole, why);
        if let Some(reading) = self.with_parentheses(whole, first) {
            diagnostic = diagnostic.label(format!("this is `{reading}`"));
        }
        self.warn(diagnostic.help("write the parentheses that you mean"));
    }

    /// Returns the text of `whole` with parentheses around the part `first`, unless the text is too
    /// long to help.
    fn with_parentheses(&self, whole: Span, first: Span) -> Option<String> {
        const REPLACEMENT_BYTES_MAX: usize = 60;
        let part = |start, end| self.sources.text(Span { start, end, ..whole });
        let text = format!(
            "{}({}){}",
            part(whole.start, first.start),
            part(first.start, first.end),
            part(first.end, whole.end)
        );
        (text.len() <= REPLACEMENT_BYTES_MAX && !text.contains(['\n', '#'])).then_some(text)
    }
}

/// Returns true for expressions that give 0 or 1.
fn is_condition(expr: &Expr) -> bool {
    match &expr.kind {
        ExprKind::Chain { links, .. } => {
            links.last().is_some_and(|link| expected_power(link.op) <= expected_power(BinaryOp::Eq))
        }
        ExprKind::Unary { op, .. } => *op == UnaryOp::Not,
        ExprKind::Paren(inner) => is_condition(inner),
        _ => false,
    }
}

/// Returns true for expressions that may be meant as a condition: conditions, and calls such as
/// `isnil(x)`.
fn may_be_condition(expr: &Expr) -> bool {
    matches!(expr.kind, ExprKind::Call { .. } | ExprKind::Error) || is_condition(expr)
}
