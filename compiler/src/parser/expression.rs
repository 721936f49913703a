//! Conditions, comparisons and operators: everything that has a precedence.
//!
//! From tightest to loosest: `!`; `& |`; `<< >>`; `^`, to the right; `%`; `* /`; `+ -`; comparisons, which do not
//! chain; `and or`; `not`.

use super::{Parse, Parser};
use crate::ast::{BinaryOp, Expr, ExprKind, UnaryOp};
use crate::codes::Code;
use crate::diagnostic::Diagnostic;
use crate::token::{Fixed, Separation, TokenKind};

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
            let mut value = parser.comparison()?;
            parser.logic_rest(&mut value)?;
            Ok(value)
        })
    }

    /// What may follow when the first operand has been read already.
    pub(super) fn condition_rest(&mut self, value: &mut Expr) -> Parse<()> {
        self.binary_rest(value, Power::Sum)?;
        self.comparison_rest(value)?;
        self.logic_rest(value)
    }

    /// `not` takes everything to its right.
    fn negation(&mut self) -> Parse<Expr> {
        let start = self.advance().span;
        let operand = Box::new(self.condition()?);
        let not = self.expr(ExprKind::Unary { op: UnaryOp::Not, operand }, start);
        self.warn_wide_not(&not);
        Ok(not)
    }

    fn logic_rest(&mut self, left: &mut Expr) -> Parse<()> {
        while let Some((op, Power::Logic)) = self.operator() {
            self.advance();
            let right = if self.at(Fixed::Not) { self.condition() } else { self.comparison() };
            self.join(op, left, right?, self.height)?;
        }
        Ok(())
    }

    fn comparison(&mut self) -> Parse<Expr> {
        let mut value = self.sum()?;
        self.comparison_rest(&mut value)?;
        Ok(value)
    }

    fn comparison_rest(&mut self, left: &mut Expr) -> Parse<()> {
        let mut compared = false;
        while let Some((op, Power::Comparison)) = self.operator() {
            if compared {
                self.complain_about_chain(left);
            }
            compared = true;
            self.advance();
            let right = self.sum()?;
            self.join(op, left, right, self.height)?;
        }
        Ok(())
    }

    fn complain_about_chain(&mut self, first: &Expr) {
        let operator = self.span();
        self.complain(
            Diagnostic::new(
                Code::ChainedComparison,
                operator,
                "comparisons cannot be put in a row",
            )
            .label("the second comparison")
            .related(first.span, "the first one ends here")
            .help("write `a < b and b < c`, or put the first one in parentheses"),
        );
    }

    /// A table literal stands alone here; it is no operand of `+` and the like.
    fn sum(&mut self) -> Parse<Expr> {
        if self.at(Fixed::OpenBrace) { self.lone_table() } else { self.binary(Power::Sum) }
    }

    fn lone_table(&mut self) -> Parse<Expr> {
        let table = self.table()?;
        let mut table = self.reject_direct_use(table)?;
        if self.operator().is_some_and(|(_, power)| power >= Power::Sum) {
            self.complain_about_table(&table);
        }
        self.binary_rest(&mut table, Power::Sum)?;
        Ok(table)
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
        let mut value = self.operand()?;
        self.binary_rest(&mut value, least)?;
        Ok(value)
    }

    fn binary_rest(&mut self, left: &mut Expr, least: Power) -> Parse<()> {
        while let Some((op, power)) = self.operator().filter(|(_, power)| *power >= least) {
            if self.increment() {
                continue;
            }
            if matches!(op, BinaryOp::Add | BinaryOp::Sub) {
                self.warn_if_running_on();
            }
            self.advance();
            let height = self.height;
            let right = match op {
                // To the right: `2^3^2` is `2^(3^2)`.
                BinaryOp::Pow => self.nested(|parser| parser.binary(Power::Exponent)),
                _ => self.binary(power.next()),
            };
            let height = if op == BinaryOp::Pow { height } else { self.height };
            self.join(op, left, right?, height)?;
        }
        Ok(())
    }

    /// Makes `left` the operation on it and `right`. The higher of the two, if it is not in a level of its own, has
    /// that height.
    fn join(&mut self, op: BinaryOp, left: &mut Expr, right: Expr, height: u32) -> Parse<()> {
        self.grow(height)?;
        let span = left.span.to(right.span);
        let first = std::mem::replace(left, Expr { kind: ExprKind::Error, span });
        left.kind = ExprKind::Binary { op, left: Box::new(first), right: Box::new(right) };
        self.warn_grouping(left);
        Ok(())
    }

    /// Reports and skips `++` or `--` behind a value; `a ++b` and `a + +b` are sums.
    pub(super) fn increment(&mut self) -> bool {
        let Some(sign @ (Fixed::Plus | Fixed::Minus)) = self.fixed() else { return false };
        let (first, second) = (self.token(), self.token_at(self.position + 1));
        let behind = self.token_at(self.position + 2);
        let touching = first.span.end == second.span.start && !first.is_separated();
        let ends_here = behind.is_separated()
            || match behind.kind {
                TokenKind::FileEnd => true,
                TokenKind::Fixed(fixed) => matches!(
                    fixed,
                    Fixed::CloseParen | Fixed::CloseBrace | Fixed::CloseBracket | Fixed::Comma
                ),
                _ => false,
            };
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
