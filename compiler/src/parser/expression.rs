//! Parses conditions, comparisons and operators, which are the parts of expressions with a
//! precedence.
//!
//! From highest to lowest precedence: `!`; `& |`; `<< >>`; `^`, right-associative; `%`; `* /`; `+
//! -`; comparisons, which do not chain; `and or`; `not`.

use super::{Parse, Parser};
use crate::ast::{BinaryOp, Expr, ExprKind, Link, Power, UnaryOp};
use crate::codes::Code;
use crate::diagnostic::Diagnostic;
use crate::token::{Fixed, Separation, TokenKind};

/// Returns the binary operator that a token stands for.
pub(super) fn binary_operator(fixed: Fixed) -> Option<BinaryOp> {
    Some(match fixed {
        Fixed::And => BinaryOp::And,
        Fixed::Or => BinaryOp::Or,
        Fixed::Equal => BinaryOp::Eq,
        Fixed::NotEqual => BinaryOp::NotEq,
        Fixed::Less => BinaryOp::Less,
        Fixed::LessEqual => BinaryOp::LessEq,
        Fixed::Greater => BinaryOp::Greater,
        Fixed::GreaterEqual => BinaryOp::GreaterEq,
        Fixed::Plus => BinaryOp::Add,
        Fixed::Minus => BinaryOp::Sub,
        Fixed::Star => BinaryOp::Mul,
        Fixed::Slash => BinaryOp::Div,
        Fixed::Percent => BinaryOp::Mod,
        Fixed::Caret => BinaryOp::Pow,
        Fixed::ShiftLeft => BinaryOp::ShiftLeft,
        Fixed::ShiftRight => BinaryOp::ShiftRight,
        Fixed::Ampersand => BinaryOp::BitAnd,
        Fixed::Pipe => BinaryOp::BitOr,
        _ => return None,
    })
}

/// Returns the next higher precedence; `None` if only operands bind tighter.
fn tighter(power: Power) -> Option<Power> {
    Some(match power {
        Power::Logic => Power::Comparison,
        Power::Comparison => Power::Sum,
        Power::Sum => Power::Product,
        Power::Product => Power::Modulo,
        Power::Modulo => Power::Exponent,
        Power::Exponent => Power::Shift,
        Power::Shift => Power::Bits,
        Power::Bits => return None,
    })
}

impl Parser<'_> {
    /// Returns the binary operator at the current position, if there is one.
    pub(super) fn operator(&self) -> Option<(BinaryOp, Power)> {
        self.fixed().and_then(binary_operator).map(|op| (op, op.power()))
    }

    /// Parses a whole expression, as in parentheses, as an argument or on the right side of `=`.
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

    /// Parses the rest of a condition whose first operand was already parsed.
    pub(super) fn condition_rest(&mut self, value: &mut Expr) -> Parse<()> {
        self.binary_rest(value, Power::Sum)?;
        self.comparison_rest(value)?;
        self.logic_rest(value)
    }

    /// Parses `not`, whose operand is everything to its right.
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
            let (right, height) = self.right_side(|parser| {
                if parser.at(Fixed::Not) { parser.condition() } else { parser.comparison() }
            });
            self.join(op, left, right?, height)?;
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
            let (right, height) = self.right_side(Self::sum);
            self.join(op, left, right?, height)?;
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

    /// Parses a sum or a table literal, which cannot be an operand of `+` and the like.
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

    /// Parses operators whose precedence is at least `least`.
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
            let (right, height) = self.right_side(|parser| match tighter(power) {
                // `^` is right-associative: `2^3^2` is `2^(3^2)`. The level of nesting that this
                // takes is that of the operation itself.
                _ if op == BinaryOp::Pow => {
                    let right = parser.nested(|parser| parser.binary(Power::Exponent));
                    parser.height = parser.height.saturating_sub(1);
                    right
                }
                Some(tighter) => parser.binary(tighter),
                None => parser.operand(),
            });
            self.join(op, left, right?, height)?;
        }
        Ok(())
    }

    /// Parses the right side of an operator. Returns it with the height of its tree.
    fn right_side(&mut self, parse: impl FnOnce(&mut Self) -> Parse<Expr>) -> (Parse<Expr>, u32) {
        let before = std::mem::take(&mut self.height);
        let right = parse(self);
        let height = std::mem::replace(&mut self.height, before);
        (right, height)
    }

    /// Replaces `left` by the operation on `left` and `right`; `height` is that of the tree of
    /// `right`.
    fn join(&mut self, op: BinaryOp, left: &mut Expr, right: Expr, height: u32) -> Parse<()> {
        let goes_on = matches!(&left.kind, ExprKind::Chain { links, .. }
            if links.last().is_some_and(|last| last.op.power() == op.power()));
        // Another link does not increase the height of a chain.
        self.grow(if goes_on { height } else { height.max(self.height) })?;
        self.warn_grouping(op, left, &right);
        let span = left.span.to(right.span);
        let link = Link { op, right, span };
        match &mut left.kind {
            ExprKind::Chain { links, .. } if goes_on => links.push(link),
            _ => {
                let first = std::mem::replace(left, Expr { kind: ExprKind::Error, span });
                left.kind = ExprKind::Chain { first: Box::new(first), links: vec![link] };
            }
        }
        left.span = span;
        Ok(())
    }

    /// Reports and skips `++` or `--` after a value; `a ++b` and `a + +b` are sums.
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

    /// Warns if the current token begins a line, but is parsed as part of the statement above.
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
