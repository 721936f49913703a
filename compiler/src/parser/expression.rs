//! Conditions, comparisons and operators: everything that has a precedence.
//!
//! From tightest to loosest: `!`; `& |`; `<< >>`; `^`, to the right; `%`; `* /`; `+ -`; comparisons, which do not
//! chain; `and or`; `not`.

use super::{Parse, Parser};
use crate::ast::{BinaryOp, Expr, ExprKind, UnaryOp};
use crate::codes::Code;
use crate::diagnostic::Diagnostic;
use crate::token::{Fixed, Separation};

/// How tightly a binary operator binds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Power {
    Logic,
    Comparison,
    Sum,
    Product,
    Modulo,
    Exponent,
    Shift,
    Bits,
    /// Tighter than any binary operator.
    Operand,
}

impl Power {
    fn next(self) -> Power {
        match self {
            Power::Logic => Power::Comparison,
            Power::Comparison => Power::Sum,
            Power::Sum => Power::Product,
            Power::Product => Power::Modulo,
            Power::Modulo => Power::Exponent,
            Power::Exponent => Power::Shift,
            Power::Shift => Power::Bits,
            Power::Bits | Power::Operand => Power::Operand,
        }
    }
}

/// The binary operator that a token is.
pub(super) fn binary_operator(fixed: Fixed) -> Option<(BinaryOp, Power)> {
    Some(match fixed {
        Fixed::And => (BinaryOp::And, Power::Logic),
        Fixed::Or => (BinaryOp::Or, Power::Logic),
        Fixed::Equal => (BinaryOp::Eq, Power::Comparison),
        Fixed::NotEqual => (BinaryOp::NotEq, Power::Comparison),
        Fixed::Less => (BinaryOp::Less, Power::Comparison),
        Fixed::LessEqual => (BinaryOp::LessEq, Power::Comparison),
        Fixed::Greater => (BinaryOp::Greater, Power::Comparison),
        Fixed::GreaterEqual => (BinaryOp::GreaterEq, Power::Comparison),
        Fixed::Plus => (BinaryOp::Add, Power::Sum),
        Fixed::Minus => (BinaryOp::Sub, Power::Sum),
        Fixed::Star => (BinaryOp::Mul, Power::Product),
        Fixed::Slash => (BinaryOp::Div, Power::Product),
        Fixed::Percent => (BinaryOp::Mod, Power::Modulo),
        Fixed::Caret => (BinaryOp::Pow, Power::Exponent),
        Fixed::ShiftLeft => (BinaryOp::ShiftLeft, Power::Shift),
        Fixed::ShiftRight => (BinaryOp::ShiftRight, Power::Shift),
        Fixed::Ampersand => (BinaryOp::BitAnd, Power::Bits),
        Fixed::Pipe => (BinaryOp::BitOr, Power::Bits),
        _ => return None,
    })
}

impl Parser<'_> {
    /// The binary operator here, if there is one.
    pub(super) fn operator(&self) -> Option<(BinaryOp, Power)> {
        self.fixed().and_then(binary_operator)
    }

    /// A whole expression, as it stands in parentheses, as an argument or on the right side of `=`.
    pub(super) fn condition(&mut self) -> Parse<Expr> {
        self.nested(|parser| {
            if parser.at(Fixed::Not) {
                return parser.negation();
            }
            let first = parser.comparison()?;
            parser.logic_rest(first)
        })
    }

    /// What may follow when the first operand has been read already.
    pub(super) fn condition_rest(&mut self, operand: Expr) -> Parse<Expr> {
        let sum = self.binary_rest(operand, Power::Sum)?;
        let comparison = self.comparison_rest(sum)?;
        self.logic_rest(comparison)
    }

    /// `not` takes everything to its right.
    fn negation(&mut self) -> Parse<Expr> {
        let start = self.advance().span;
        let operand = Box::new(self.condition()?);
        let not = self.expr(ExprKind::Unary { op: UnaryOp::Not, operand }, start);
        self.warn_wide_not(&not);
        Ok(not)
    }

    fn logic_rest(&mut self, mut left: Expr) -> Parse<Expr> {
        while let Some((op, Power::Logic)) = self.operator() {
            self.advance();
            let right = if self.at(Fixed::Not) { self.condition()? } else { self.comparison()? };
            left = self.binary_node(op, left, right)?;
        }
        Ok(left)
    }

    fn comparison(&mut self) -> Parse<Expr> {
        let first = self.sum()?;
        self.comparison_rest(first)
    }

    fn comparison_rest(&mut self, mut left: Expr) -> Parse<Expr> {
        let mut compared = false;
        while let Some((op, Power::Comparison)) = self.operator() {
            let operator = self.advance().span;
            if compared {
                self.complain(
                    Diagnostic::new(
                        Code::ChainedComparison,
                        operator,
                        "comparisons cannot be put in a row",
                    )
                    .label("the second comparison")
                    .related(left.span, "the first one ends here")
                    .help("write `a < b and b < c`, or put the first one in parentheses"),
                );
            }
            compared = true;
            let right = self.sum()?;
            left = self.binary_node(op, left, right)?;
        }
        Ok(left)
    }

    /// A table literal stands alone here; it is no operand of `+` and the like.
    fn sum(&mut self) -> Parse<Expr> {
        if !self.at(Fixed::OpenBrace) {
            return self.binary(Power::Sum);
        }
        let table = self.table()?;
        let table = self.reject_direct_use(table)?;
        if self.operator().is_some_and(|(_, power)| power >= Power::Sum) {
            self.complain_about_table(&table);
        }
        self.binary_rest(table, Power::Sum)
    }

    pub(super) fn complain_about_table(&mut self, table: &Expr) {
        self.complain(
            Diagnostic::new(
                Code::TableInExpression,
                table.span,
                "a table literal cannot be an operand",
            )
            .label("this table")
            .help("store the table in a variable first"),
        );
    }

    /// Operators that bind at least as tightly as `least`.
    pub(super) fn binary(&mut self, least: Power) -> Parse<Expr> {
        let first = self.operand()?;
        self.binary_rest(first, least)
    }

    fn binary_rest(&mut self, mut left: Expr, least: Power) -> Parse<Expr> {
        while let Some((op, power)) = self.operator().filter(|(_, power)| *power >= least) {
            if self.increment() {
                continue;
            }
            if matches!(op, BinaryOp::Add | BinaryOp::Sub) {
                self.warn_if_running_on();
            }
            self.advance();
            let right = match op {
                // To the right: `2^3^2` is `2^(3^2)`.
                BinaryOp::Pow => self.nested(|parser| parser.binary(Power::Exponent))?,
                _ => self.binary(power.next())?,
            };
            left = self.binary_node(op, left, right)?;
        }
        Ok(left)
    }

    fn binary_node(&mut self, op: BinaryOp, left: Expr, right: Expr) -> Parse<Expr> {
        self.grow()?;
        let span = left.span.to(right.span);
        let kind = ExprKind::Binary { op, left: Box::new(left), right: Box::new(right) };
        let node = Expr { kind, span };
        self.warn_grouping(&node);
        Ok(node)
    }

    /// Reports and skips `++` or `--` behind a value; `a ++b` and `a + +b` are sums.
    pub(super) fn increment(&mut self) -> bool {
        let Some(sign @ (Fixed::Plus | Fixed::Minus)) = self.fixed() else { return false };
        let (first, second) = (self.token(), self.token_at(self.position + 1));
        let behind = self.token_at(self.position + 2);
        let touching = first.span.end == second.span.start && !first.is_separated();
        let ends_here = behind.is_separated()
            || matches!(
                self.fixed_at(self.position + 2),
                Some(Fixed::CloseParen | Fixed::CloseBrace | Fixed::CloseBracket | Fixed::Comma)
            );
        if self.fixed_at(self.position + 1) != Some(sign) || !touching || !ends_here {
            return false;
        }
        let sign = sign.text();
        self.complain(
            Diagnostic::new(
                Code::ForeignOperator,
                first.span.to(second.span),
                format!("Buzz has no operator `{sign}{sign}`"),
            )
            .help(format!("write `x = x {sign} 1`")),
        );
        self.advance();
        self.advance();
        true
    }

    /// Warns when the token here, at the beginning of a line, is taken as part of the statement above.
    pub(super) fn warn_if_running_on(&mut self) {
        let token = self.token();
        if !token.is_separated() || self.is_enclosed() {
            return;
        }
        let what = match token.separation {
            Separation::Semicolon => "the statement runs on behind the `;`",
            _ => "the statement runs on over the end of the line",
        };
        let found = token.kind.describe();
        self.warn(
            Diagnostic::new(Code::RunOnStatement, token.span, what)
                .label(format!("this {found} continues the statement above"))
                .related(self.previous().span, "which goes on behind this")
                .help(
                    "newlines and `;` do not end a statement; if it is meant to go on, put it in \
                     parentheses or the operator at the end of the line above",
                ),
        );
    }
}
