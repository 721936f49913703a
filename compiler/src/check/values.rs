//! Values that can be seen in the source: literals out of range, and operations that cannot work.

use crate::ast::{BinaryOp, UnaryOp};
use crate::check::names::{Meaning, Meanings};
use crate::check::tree::{Expr, ExprKind};
use crate::check::walk::Checker;
use crate::codegen::constant::{self, Profile};
use crate::codes::Code;
use crate::diagnostic::Diagnostic;
use crate::source::Span;

/// The type of a value, as far as the source shows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
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

impl Kind {
    /// As messages name it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Nil => "nil",
            Kind::Int => "an integer",
            Kind::Float => "a float",
            Kind::Number => "a number",
            Kind::String => "a string",
            Kind::Table => "a table",
            Kind::Function => "a function",
        }
    }

    fn is_number(self) -> bool {
        matches!(self, Kind::Int | Kind::Float | Kind::Number)
    }
}

/// The type of an expression's value, where it is certain unless the expression faults.
pub fn kind_of(expr: &Expr, meanings: &Meanings<'_>) -> Option<Kind> {
    match &expr.kind {
        ExprKind::Nil => Some(Kind::Nil),
        ExprKind::Int(_) => Some(Kind::Int),
        ExprKind::Float(_) => Some(Kind::Float),
        ExprKind::Str(_) => Some(Kind::String),
        ExprKind::Table(_) => Some(Kind::Table),
        ExprKind::Lambda(_) => Some(Kind::Function),
        ExprKind::Name(name) => match meanings.of(*name) {
            Meaning::Function(_) | Meaning::Builtin(_) | Meaning::Robot => Some(Kind::Function),
            Meaning::Library(_) => Some(Kind::Table),
            Meaning::RobotId => Some(Kind::Int),
            Meaning::Nil | Meaning::Global => None,
        },
        ExprKind::Unary { op, operand } => Some(match op {
            UnaryOp::Not | UnaryOp::BitNot => Kind::Int,
            UnaryOp::Negate | UnaryOp::Plus => number_kind(kind_of(operand, meanings)),
        }),
        ExprKind::Binary { op, left, right } => Some(match op {
            BinaryOp::Add | BinaryOp::Sub | BinaryOp::Mul | BinaryOp::Div | BinaryOp::Mod => {
                let left = number_kind(kind_of(left, meanings));
                let right = number_kind(kind_of(right, meanings));
                match (left, right) {
                    (Kind::Float, _) | (_, Kind::Float) => Kind::Float,
                    (Kind::Int, Kind::Int) => Kind::Int,
                    _ => Kind::Number,
                }
            }
            BinaryOp::Pow => Kind::Float,
            _ => Kind::Int,
        }),
        _ => None,
    }
}

fn number_kind(kind: Option<Kind>) -> Kind {
    kind.filter(|kind| kind.is_number()).unwrap_or(Kind::Number)
}

impl Checker<'_> {
    /// Whether an integer literal fits the profile.
    pub fn check_int(&mut self, value: i64, span: Span) {
        let (low, high) = constant::int_range(self.profile);
        if value < i64::from(low) || value > i64::from(high) {
            let name = self.profile.name();
            self.report(
                Diagnostic::new(
                    Code::IntegerRange,
                    span,
                    format!("the integer {value} does not fit the `{name}` profile"),
                )
                .label(format!("integers go from {low} to {high}"))
                .help(match self.profile {
                    Profile::Tiny => {
                        "write it as a float, such as 1.0, or build with `--profile full`"
                    }
                    Profile::Full => "write it as a float, such as 1.0",
                }),
            );
        }
    }

    /// Whether a float literal fits the profile.
    pub fn check_float(&mut self, value: f64, span: Span) {
        let nearest = constant::from_bits(self.profile, constant::float_bits(self.profile, value));
        let problem = if value.is_infinite() {
            // No profile can hold it: the lexer said so.
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
            Profile::Tiny => {
                "magnitudes go from 2^-30 (about 9.3e-10) to just below 2^32 (about 4.29e9)"
            }
            Profile::Full => "magnitudes go from about 1.4e-45 to about 3.4e38",
        };
        self.report(
            Diagnostic::new(
                Code::FloatRange,
                span,
                format!("this float is {problem} for the `{name}` profile"),
            )
            .label(format!("it would become {}", if nearest == 0.0 { "0.0" } else { "infinity" }))
            .help(range),
        );
    }

    /// An operation on one value.
    pub fn check_unary(&mut self, op: UnaryOp, operand: &Expr, span: Span) {
        let Some(kind) = kind_of(operand, self.meanings) else { return };
        let works = match op {
            UnaryOp::Negate | UnaryOp::Plus => kind.is_number(),
            UnaryOp::BitNot => matches!(kind, Kind::Int | Kind::Number),
            UnaryOp::Not => true,
        };
        if !works {
            let wanted = if op == UnaryOp::BitNot { "integers" } else { "numbers" };
            self.impossible(span, operand.span, kind, wanted);
        }
    }

    /// An operation on two values.
    pub fn check_binary(&mut self, op: BinaryOp, left: &Expr, right: &Expr, span: Span) {
        let kinds = (kind_of(left, self.meanings), kind_of(right, self.meanings));
        match op {
            BinaryOp::And | BinaryOp::Or => {}
            BinaryOp::Eq | BinaryOp::NotEq => self.check_equality(op, kinds, span),
            BinaryOp::Less | BinaryOp::LessEq | BinaryOp::Greater | BinaryOp::GreaterEq => {
                self.check_order(kinds, span);
            }
            _ => self.check_arithmetic(op, (left, kinds.0), (right, kinds.1), span),
        }
    }

    fn check_equality(&mut self, op: BinaryOp, kinds: (Option<Kind>, Option<Kind>), span: Span) {
        let (Some(left), Some(right)) = kinds else { return };
        if left == right || (left.is_number() && right.is_number()) {
            return;
        }
        let result = if op == BinaryOp::Eq { "false" } else { "true" };
        self.report(
            Diagnostic::new(
                Code::NeverEqual,
                span,
                format!("{} never equals {}", left.name(), right.name()),
            )
            .label(format!("always {result}"))
            .help("values of different types are unequal; no text is converted to a number"),
        );
    }

    fn check_order(&mut self, kinds: (Option<Kind>, Option<Kind>), span: Span) {
        let (Some(left), Some(right)) = kinds else { return };
        // nil is below everything.
        let is_ordered = left == Kind::Nil
            || right == Kind::Nil
            || (left.is_number() && right.is_number())
            || (left == Kind::String && right == Kind::String);
        if !is_ordered {
            self.report(
                Diagnostic::new(
                    Code::Incomparable,
                    span,
                    format!("{} and {} have no order", left.name(), right.name()),
                )
                .label("cannot be compared")
                .help("`<`, `<=`, `>` and `>=` compare two numbers, two strings, or anything with nil"),
            );
        }
    }

    fn check_arithmetic(
        &mut self,
        op: BinaryOp,
        left: (&Expr, Option<Kind>),
        right: (&Expr, Option<Kind>),
        span: Span,
    ) {
        let needs_ints = matches!(
            op,
            BinaryOp::BitAnd | BinaryOp::BitOr | BinaryOp::ShiftLeft | BinaryOp::ShiftRight
        );
        for (operand, kind) in [left, right] {
            let Some(kind) = kind else { continue };
            if !kind.is_number() || (needs_ints && kind == Kind::Float) {
                let wanted = if needs_ints { "integers" } else { "numbers" };
                return self.impossible(span, operand.span, kind, wanted);
            }
        }
        let ExprKind::Int(value) = right.0.kind else { return };
        match op {
            BinaryOp::Div | BinaryOp::Mod if value == 0 && left.1 != Some(Kind::Float) => {
                self.report(
                    Diagnostic::new(Code::DivisionByZero, span, "division by zero")
                        .label("stops the script if the left side is an integer"),
                );
            }
            BinaryOp::ShiftLeft | BinaryOp::ShiftRight => {
                let bits = word_bits(self.profile);
                if !(0..bits).contains(&value) {
                    let message = format!("integers cannot be shifted by {value}");
                    self.report(
                        Diagnostic::new(Code::ShiftCount, span, message)
                            .label("stops the script")
                            .help(format!("the count goes from 0 to {}", bits - 1)),
                    );
                }
            }
            _ => {}
        }
    }

    fn impossible(&mut self, span: Span, operand: Span, kind: Kind, wanted: &str) {
        self.report(
            Diagnostic::new(
                Code::ImpossibleOperation,
                span,
                format!("this works on {wanted} only, not on {}", kind.name()),
            )
            .label("stops the script")
            .related(operand, format!("this is {}", kind.name())),
        );
    }

    /// A key between brackets.
    pub fn check_key(&mut self, key: &Expr) {
        let Some(kind @ (Kind::Nil | Kind::Table | Kind::Function)) = kind_of(key, self.meanings)
        else {
            return;
        };
        self.report(
            Diagnostic::new(
                Code::BadKey,
                key.span,
                format!("{} cannot be the key of a table", kind.name()),
            )
            .label("stops the script")
            .help("keys are numbers and strings"),
        );
    }
}

fn word_bits(profile: Profile) -> i64 {
    8 * constant::word_bytes(profile) as i64
}
