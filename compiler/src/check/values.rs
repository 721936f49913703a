//! Checks values that are known from the source: literals out of range, and operations that cannot
//! succeed.

use crate::ast::{BinaryOp, UnaryOp};
use crate::check::checker::Checker;
use crate::check::names::Meaning;
use crate::check::static_type::{OperandValue, StaticType, kind_of};
use crate::check::tree::{CheckedExpr, CheckedExprKind, CheckedLink};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::profile::{self, NumberProfile};
use crate::source::Span;

impl Checker<'_> {
    /// Checks that an integer literal fits the profile.
    pub fn check_int(&mut self, value: i64, span: Span) {
        let (low, high) = profile::int_range(self.profile);
        if value < i64::from(low) || value > i64::from(high) {
            let name = self.profile.name();
            self.report(
                Diagnostic::new(
                    DiagnosticCode::IntegerRange,
                    span,
                    format!("the integer {value} does not fit the `{name}` profile"),
                )
                .label(format!("integers go from {low} to {high}"))
                .help(match self.profile {
                    _ if value == -i64::from(low) => {
                        format!("the least integer is one number with its sign: `{low}`")
                    }
                    NumberProfile::Tiny => {
                        "write it as a float, such as 1.0, or build with `--profile full`".into()
                    }
                    NumberProfile::Full => "write it as a float, such as 1.0".into(),
                }),
            );
        }
    }

    /// Checks that a float literal fits the profile.
    pub fn check_float(&mut self, value: f64, span: Span) {
        let nearest = profile::from_bits(self.profile, profile::float_bits(self.profile, value));
        let problem = if value.is_infinite() {
            // The lexer reported it: no profile can represent the value.
            return;
        } else if nearest.is_infinite() {
            "too large"
        } else if nearest == 0.0 && value != 0.0 {
            "too small"
        } else {
            return;
        };
        let name = self.profile.name();
        let range = match self.profile {
            NumberProfile::Tiny => {
                "magnitudes go from 2^-30 (about 9.3e-10) to just below 2^32 (about 4.29e9)"
            }
            NumberProfile::Full => "magnitudes go from about 1.4e-45 to about 3.4e38",
        };
        self.report(
            Diagnostic::new(
                DiagnosticCode::FloatRange,
                span,
                format!("this float is {problem} for the `{name}` profile"),
            )
            .label(format!("it would become {}", if nearest == 0.0 { "0.0" } else { "infinity" }))
            .help(range),
        );
    }

    /// Checks an operation on one value.
    pub fn check_unary(&mut self, op: UnaryOp, operand: &CheckedExpr, span: Span) {
        let Some(kind) = kind_of(operand, self.meanings) else { return };
        let works = match op {
            UnaryOp::Negate | UnaryOp::Plus => kind.is_number(),
            UnaryOp::BitNot => matches!(kind, StaticType::Int | StaticType::Number),
            UnaryOp::Not => true,
        };
        if !works {
            let wanted = if op == UnaryOp::BitNot { "integers" } else { "numbers" };
            self.report(impossible(span, operand.span, kind, wanted));
        }
    }

    /// Checks an operation on two values; `written` is the source of the right one.
    pub fn check_binary(
        &mut self,
        op: BinaryOp,
        left: OperandValue,
        right: OperandValue,
        written: &CheckedExpr,
        span: Span,
        in_log: Option<(&CheckedExpr, &[CheckedLink])>,
    ) {
        let kinds = (left.kind, right.kind);
        match op {
            BinaryOp::And | BinaryOp::Or => {}
            BinaryOp::Eq | BinaryOp::NotEq => self.check_equality(op, kinds, span),
            BinaryOp::Less | BinaryOp::LessEq | BinaryOp::Greater | BinaryOp::GreaterEq => {
                self.check_order(kinds, span);
            }
            _ => {
                if self.check_arithmetic(op, left, right, span, in_log) {
                    self.check_right_side(op, left, written, span);
                }
            }
        }
    }

    fn check_equality(
        &mut self,
        op: BinaryOp,
        kinds: (Option<StaticType>, Option<StaticType>),
        span: Span,
    ) {
        let (Some(left), Some(right)) = kinds else { return };
        if left == right || (left.is_number() && right.is_number()) {
            return;
        }
        let result = if op == BinaryOp::Eq { "false" } else { "true" };
        self.report(
            Diagnostic::new(
                DiagnosticCode::NeverEqual,
                span,
                format!("{} never equals {}", left.name(), right.name()),
            )
            .label(format!("always {result}"))
            .help("values of different types are unequal; no text is converted to a number"),
        );
    }

    fn check_order(&mut self, kinds: (Option<StaticType>, Option<StaticType>), span: Span) {
        let (Some(left), Some(right)) = kinds else { return };
        // Nil is less than all other values.
        let is_ordered = left == StaticType::Nil
            || right == StaticType::Nil
            || (left.is_number() && right.is_number())
            || (left == StaticType::String && right == StaticType::String);
        if !is_ordered {
            self.report(
                Diagnostic::new(
                    DiagnosticCode::Incomparable,
                    span,
                    format!("{} and {} have no order", left.name(), right.name()),
                )
                .label("cannot be compared")
                .help("`<`, `<=`, `>` and `>=` compare two numbers, two strings, or anything with nil"),
            );
        }
    }

    /// Returns true if the sides may have types that the operation works on.
    fn check_arithmetic(
        &mut self,
        op: BinaryOp,
        left: OperandValue,
        right: OperandValue,
        span: Span,
        in_log: Option<(&CheckedExpr, &[CheckedLink])>,
    ) -> bool {
        for operand in [left, right] {
            let Some(kind) = operand.kind else { continue };
            if !kind.is_number() || (op.is_bitwise() && kind == StaticType::Float) {
                let wanted = if op.is_bitwise() { "integers" } else { "numbers" };
                let diagnostic = impossible(span, operand.span, kind, wanted);
                self.report(match (op, kind) {
                    (BinaryOp::Add, StaticType::String) => self.joined(diagnostic, in_log),
                    (_, StaticType::Function) => diagnostic
                        .help("call the function to compute with its result")
                        .guess(Span { start: operand.span.end, ..operand.span }, "()"),
                    _ => diagnostic,
                });
                return false;
            }
        }
        true
    }

    /// Adds help about a sum with a text. In `log` all sums of the argument become commas.
    fn joined(
        &self,
        diagnostic: Diagnostic,
        in_log: Option<(&CheckedExpr, &[CheckedLink])>,
    ) -> Diagnostic {
        let Some((first, links)) = in_log else {
            return diagnostic.help(match self.profile {
                NumberProfile::Full => {
                    "`log(a, b)` joins its arguments; `string.concat(a, string.tostring(b))` makes a string"
                }
                NumberProfile::Tiny => {
                    "`log(a, b)` joins its arguments; no strings are made at run time in this profile"
                }
            });
        };
        let diagnostic = diagnostic.help("`log` joins its arguments: separate them by commas");
        if links.iter().any(|link| link.op != BinaryOp::Add) {
            return diagnostic;
        }
        let mut end = first.span.end;
        links.iter().fold(diagnostic, |diagnostic, link| {
            let gap = Span { start: end, end: link.right.span.start, ..first.span };
            end = link.right.span.end;
            diagnostic.guess(gap, ", ")
        })
    }

    /// Checks the object of a field or an element, which must be a table.
    pub fn check_table(&mut self, object: &CheckedExpr, span: Span) {
        let Some(kind) = self.kind(object) else { return };
        // If no robot is named, the function of one may be a table of another.
        let robots = self.meanings.robots();
        let is_open = matches!(object.kind, CheckedExprKind::Name(name)
            if self.meanings.of(name) == Meaning::Robot && robots.target.is_none());
        if is_open || matches!(kind, StaticType::Table | StaticType::Nil) {
            return;
        }
        let diagnostic = impossible(span, object.span, kind, "tables");
        self.report(match kind {
            StaticType::String if self.profile == NumberProfile::Full => {
                diagnostic.help("a part of a string is `string.sub(s, from, to)`")
            }
            _ => diagnostic,
        });
    }

    /// Checks a comparison of an integer with a fraction.
    pub fn check_fraction(
        &mut self,
        op: BinaryOp,
        left: Option<StaticType>,
        right: &CheckedExpr,
        span: Span,
    ) {
        let CheckedExprKind::Float(fraction) = right.kind else { return };
        if !matches!(op, BinaryOp::Eq | BinaryOp::NotEq)
            || left != Some(StaticType::Int)
            || fraction.fract() == 0.0
        {
            return;
        }
        let result = if op == BinaryOp::Eq { "false" } else { "true" };
        self.report(
            Diagnostic::new(
                DiagnosticCode::NeverEqual,
                span,
                format!("an integer never equals {fraction}"),
            )
            .label(format!("always {result}"))
            .help("a division of integers gives an integer: write one of them as a float, such as `10.0 / 4`"),
        );
    }

    /// Checks for a literal that is no valid divisor or shift count.
    fn check_right_side(
        &mut self,
        op: BinaryOp,
        left: OperandValue,
        right: &CheckedExpr,
        span: Span,
    ) {
        let CheckedExprKind::Int(value) = right.kind else { return };
        match op {
            BinaryOp::Div | BinaryOp::Mod if value == 0 && left.kind != Some(StaticType::Float) => {
                self.report(
                    Diagnostic::new(DiagnosticCode::DivisionByZero, span, "division by zero")
                        .label("stops the script if the left side is an integer"),
                );
            }
            BinaryOp::ShiftLeft | BinaryOp::ShiftRight => {
                let bits = word_bits(self.profile);
                if !(0..bits).contains(&value) {
                    let message = format!("integers cannot be shifted by {value}");
                    self.report(
                        Diagnostic::new(DiagnosticCode::ShiftCount, span, message)
                            .label("stops the script")
                            .help(format!("the count goes from 0 to {}", bits - 1)),
                    );
                }
            }
            _ => {}
        }
    }

    /// Checks a key between brackets.
    pub fn check_key(&mut self, key: &CheckedExpr) {
        let Some(kind @ (StaticType::Nil | StaticType::Table | StaticType::Function)) =
            kind_of(key, self.meanings)
        else {
            return;
        };
        self.report(
            Diagnostic::new(
                DiagnosticCode::BadKey,
                key.span,
                format!("{} cannot be the key of a table", kind.name()),
            )
            .label("stops the script")
            .help("keys are numbers and strings"),
        );
    }
}

fn impossible(span: Span, operand: Span, kind: StaticType, wanted: &str) -> Diagnostic {
    Diagnostic::new(
        DiagnosticCode::ImpossibleOperation,
        span,
        format!("this works on {wanted} only, not on {}", kind.name()),
    )
    .label("stops the script")
    .related(operand, format!("this is {}", kind.name()))
}

/// Returns the number of bits of an integer.
pub fn word_bits(profile: NumberProfile) -> i64 {
    8 * profile::word_bytes(profile) as i64
}
