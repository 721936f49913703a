//! Finds operations on constants whose result exceeds the range of the robot's numbers.

use crate::ast::{BinaryOp, UnaryOp};
use crate::check::tree::{CheckedExpr, CheckedExprKind, ResolvedScript, each_expr};
use crate::check::values::word_bits;
use crate::codes::DiagnosticCode;
use crate::constant::{self, ConstantNumber};
use crate::diagnostic::Diagnostic;
use crate::profile::{self, NumberProfile};
use crate::source::Span;

/// Checks a whole script for robots of that profile.
pub fn check_overflow(program: &ResolvedScript, profile: NumberProfile) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for function in &program.functions {
        each_expr(&function.body, &mut |expr| match &expr.kind {
            CheckedExprKind::Chain { first, links } => {
                let mut left = value(first, profile);
                for link in links {
                    let right = value(&link.right, profile);
                    let Some((a, b)) = left.zip(right) else { break };
                    left = constant::arithmetic(profile, link.op, a, b);
                    let problem = left.and_then(|result| overflow(link.op, a, b, result, profile));
                    if let Some(problem) = problem {
                        diagnostics.push(problem.diagnostic(link.span, profile));
                        // One message per chain is enough, because every later result is wrong as
                        // well.
                        break;
                    }
                }
            }
            CheckedExprKind::Unary { op: UnaryOp::Negate, operand } => {
                if let Some(ConstantNumber::Int(a)) = value(operand, profile)
                    && let Some(ConstantNumber::Int(result)) =
                        constant::unary(profile, UnaryOp::Negate, ConstantNumber::Int(a))
                    && i64::from(result) != -i64::from(a)
                {
                    let problem = Overflow::Wraps { exact: -i64::from(a), result };
                    diagnostics.push(problem.diagnostic(expr.span, profile));
                }
            }
            _ => {}
        });
    }
    diagnostics
}

/// Returns the value of a constant expression; `None` for other expressions, and for literals out
/// of the profile's range.
pub fn value(expr: &CheckedExpr, profile: NumberProfile) -> Option<ConstantNumber> {
    match &expr.kind {
        CheckedExprKind::Int(value) => {
            let (low, high) = profile::int_range(profile);
            let value = i32::try_from(*value).ok()?;
            (low..=high).contains(&value).then_some(ConstantNumber::Int(value))
        }
        CheckedExprKind::Float(_) => expr.number(profile),
        CheckedExprKind::Unary { op, operand } => {
            constant::unary(profile, *op, value(operand, profile)?)
        }
        CheckedExprKind::Chain { first, links } => {
            links.iter().try_fold(value(first, profile)?, |left, link| {
                constant::arithmetic(profile, link.op, left, value(&link.right, profile)?)
            })
        }
        _ => None,
    }
}

enum Overflow {
    /// An integer loses its upper bits.
    Wraps { exact: i64, result: i32 },
    /// A float becomes infinite.
    Infinite,
}

/// Returns the overflow if the machine's result differs from the exact one.
fn overflow(
    op: BinaryOp,
    a: ConstantNumber,
    b: ConstantNumber,
    result: ConstantNumber,
    profile: NumberProfile,
) -> Option<Overflow> {
    match (a, b, result) {
        (ConstantNumber::Int(a), ConstantNumber::Int(b), ConstantNumber::Int(result)) => {
            let (a, b) = (i64::from(a), i64::from(b));
            let exact = match op {
                BinaryOp::Add => a + b,
                BinaryOp::Sub => a - b,
                BinaryOp::Mul => a * b,
                BinaryOp::Div => a.checked_div(b)?,
                // A shift into the sign bit is intended, not an overflow. The machine faults unless
                // the count is below the number of bits of its word.
                BinaryOp::ShiftLeft if a << b >> word_bits(profile) == 0 => return None,
                BinaryOp::ShiftLeft => a << b,
                _ => return None,
            };
            (exact != i64::from(result)).then_some(Overflow::Wraps { exact, result })
        }
        (a, b, ConstantNumber::Float(result)) => {
            let is_finite = |number| match number {
                ConstantNumber::Int(_) => true,
                ConstantNumber::Float(value) => value.is_finite(),
            };
            let is_zero = matches!(b, ConstantNumber::Int(0))
                || matches!(b, ConstantNumber::Float(b) if b == 0.0);
            // A division by zero is a usual way to write infinity.
            let is_meant = op == BinaryOp::Div && is_zero;
            let is_born = result.is_infinite() && is_finite(a) && is_finite(b) && !is_meant;
            is_born.then_some(Overflow::Infinite)
        }
        _ => None,
    }
}

impl Overflow {
    fn diagnostic(&self, span: Span, profile: NumberProfile) -> Diagnostic {
        let name = profile.name();
        let (low, high) = profile::int_range(profile);
        match self {
            Overflow::Wraps { exact, result } => Diagnostic::new(
                DiagnosticCode::IntegerWraps,
                span,
                format!("this is {exact}, but {result} with the integers of the `{name}` profile"),
            )
            .label("wraps")
            .help(format!(
                "integers go from {low} to {high}; use smaller units, or a float where the nearest one will do"
            )),
            Overflow::Infinite => Diagnostic::new(
                DiagnosticCode::FloatOverflows,
                span,
                format!("this is more than the floats of the `{name}` profile can hold"),
            )
            .label("becomes infinite")
            .help("use smaller units, or another order of the operations"),
        }
    }
}
