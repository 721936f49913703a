//! Parses conditions, comparisons and operators, which are the parts of expressions with a
//! precedence.
//!
//! From highest to lowest precedence: `!`; `& |`; `<< >>`; `^`, right-associative; `%`; `* /`; `+
//! -`; comparisons, which do not chain; `and or`; `not`.

use super::{Parse, Parser};
use crate::ast::{BinaryOp, ChainLink, Expr, ExprKind, Precedence, UnaryOp};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::Span;
use crate::token::{FixedToken, Separation, TokenKind};

/// Returns the binary operator that a token stands for.
pub(super) fn binary_operator(fixed: FixedToken) -> Option<BinaryOp> {
    Some(match fixed {
        FixedToken::And => BinaryOp::And,
        FixedToken::Or => BinaryOp::Or,
        FixedToken::Equal => BinaryOp::Eq,
        FixedToken::NotEqual => BinaryOp::NotEq,
        FixedToken::Less => BinaryOp::Less,
        FixedToken::LessEqual => BinaryOp::LessEq,
        FixedToken::Greater => BinaryOp::Greater,
        FixedToken::GreaterEqual => BinaryOp::GreaterEq,
        FixedToken::Plus => BinaryOp::Add,
        FixedToken::Minus => BinaryOp::Sub,
        FixedToken::Star => BinaryOp::Mul,
        FixedToken::Slash => BinaryOp::Div,
        FixedToken::Percent => BinaryOp::Mod,
        FixedToken::Caret => BinaryOp::Pow,
        FixedToken::ShiftLeft => BinaryOp::ShiftLeft,
        FixedToken::ShiftRight => BinaryOp::ShiftRight,
        FixedToken::Ampersand => BinaryOp::BitAnd,
        FixedToken::Pipe => BinaryOp::BitOr,
        _ => return None,
    })
}

/// Returns the next higher precedence; `None` if only operands bind tighter.
fn tighter(power: Precedence) -> Option<Precedence> {
    Some(match power {
        Precedence::Logic => Precedence::Comparison,
        Precedence::Comparison => Precedence::Sum,
        Precedence::Sum => Precedence::Product,
        Precedence::Product => Precedence::Modulo,
        Precedence::Modulo => Precedence::Exponent,
        Precedence::Exponent => Precedence::Shift,
        Precedence::Shift => Precedence::Bits,
        Precedence::Bits => return None,
    })
}

impl Parser<'_> {
    /// Returns the binary operator at the current position, if there is one.
    pub(super) fn operator(&self) -> Option<(BinaryOp, Precedence)> {
        self.fixed().and_then(binary_operator).map(|op| (op, op.power()))
    }

    /// Parses a whole expression, as in parentheses, as an argument or on the right side of `=`.
    pub(super) fn condition(&mut self) -> Parse<Expr> {
        self.nested(|parser| {
            if parser.at(FixedToken::Not) {
                return parser.negation();
            }
            let mut value = parser.comparison()?;
            parser.logic_rest(&mut value)?;
            Ok(value)
        })
    }

    /// Parses the rest of a condition whose first operand was already parsed.
    pub(super) fn condition_rest(&mut self, value: &mut Expr) -> Parse<()> {
        self.binary_rest(value, Precedence::Sum)?;
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
        while let Some((op, Precedence::Logic)) = self.operator() {
            self.advance();
            let (right, height) = self.right_side(|parser| {
                if parser.at(FixedToken::Not) { parser.condition() } else { parser.comparison() }
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
        while let Some((op, Precedence::Comparison)) = self.operator() {
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
        let diagnostic = Diagnostic::new(
            DiagnosticCode::ChainedComparison,
            operator,
            "comparisons cannot be put in a row",
        )
        .label("the second comparison")
        .related(first.span, "the first one ends here")
        .help("write `a < b and b < c`, or put the first one in parentheses");
        let middle = match &first.kind {
            ExprKind::Chain { links, .. } => links.last().map(|link| &link.right),
            _ => None,
        };
        // A call would be made twice.
        let is_plain = |middle: &&Expr| {
            matches!(middle.kind, ExprKind::Name(_) | ExprKind::Int(_) | ExprKind::Float(_))
        };
        self.complain(match middle.filter(is_plain) {
            Some(middle) => {
                let name = self.sources.text(middle.span);
                let end = Span { start: middle.span.end, ..middle.span };
                diagnostic.guess(end, format!(" and {name}"))
            }
            None => diagnostic,
        });
    }

    /// Parses a sum or a table literal, which cannot be an operand of `+` and the like.
    fn sum(&mut self) -> Parse<Expr> {
        if self.at(FixedToken::OpenBrace) {
            self.lone_table()
        } else {
            self.binary(Precedence::Sum)
        }
    }

    fn lone_table(&mut self) -> Parse<Expr> {
        let table = self.table()?;
        let mut table = self.reject_direct_use(table)?;
        if self.operator().is_some_and(|(_, power)| power >= Precedence::Sum) {
            self.complain_about_table(&table);
        }
        self.binary_rest(&mut table, Precedence::Sum)?;
        Ok(table)
    }

    pub(super) fn complain_about_table(&mut self, table: &Expr) {
        self.complain(
            Diagnostic::new(
                DiagnosticCode::TableInExpression,
                table.span,
                "a table literal cannot be an operand",
            )
            .label("this table")
            .help("store the table in a variable first"),
        );
    }

    /// Parses operators whose precedence is at least `least`.
    pub(super) fn binary(&mut self, least: Precedence) -> Parse<Expr> {
        let mut value = self.operand()?;
        self.binary_rest(&mut value, least)?;
        Ok(value)
    }

    fn binary_rest(&mut self, left: &mut Expr, least: Precedence) -> Parse<()> {
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
                    let right = parser.nested(|parser| parser.binary(Precedence::Exponent));
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
        let link = ChainLink { op, right, span };
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
        let Some(sign @ (FixedToken::Plus | FixedToken::Minus)) = self.fixed() else {
            return false;
        };
        let (first, second) = (self.token(), self.token_at(self.position + 1));
        let following = self.token_at(self.position + 2);
        let touching = first.span.end == second.span.start && !first.is_separated();
        let ends_here = following.is_separated()
            || match following.kind {
                TokenKind::FileEnd => true,
                TokenKind::Fixed(fixed) => matches!(
                    fixed,
                    FixedToken::CloseParen
                        | FixedToken::CloseBrace
                        | FixedToken::CloseBracket
                        | FixedToken::Comma
                ),
                _ => false,
            };
        if self.fixed_at(self.position + 1) != Some(sign) || !touching || !ends_here {
            return false;
        }
        let sign = sign.text();
        let diagnostic = Diagnostic::new(
            DiagnosticCode::ForeignOperator,
            first.span.to(second.span),
            format!("Buzz has no operator `{sign}{sign}`"),
        );
        self.complain(match self.target_before() {
            Some(target) => {
                let name = self.sources.text(target);
                let longer = format!("{name} = {name} {sign} 1");
                diagnostic
                    .help(format!("write `{longer}`"))
                    .edit(target.to(second.span), longer.clone())
            }
            None => diagnostic.help(format!("write `x = x {sign} 1`")),
        });
        self.advance();
        self.advance();
        true
    }

    /// Returns the place of the variable or field before the current token, if a statement begins with
    /// it, or it is in the head of a `for`.
    fn target_before(&self) -> Option<Span> {
        let mut first = self.position.checked_sub(1)?;
        self.name_at(first)?;
        while first >= 2 && self.fixed_at(first - 1) == Some(FixedToken::Dot) {
            first -= 2;
            self.name_at(first)?;
        }
        let before = first.checked_sub(1).and_then(|before| self.fixed_at(before));
        let is_in_for = || {
            let head = self.open.last().and_then(|open| open.checked_sub(1));
            head.and_then(|head| self.fixed_at(head)) == Some(FixedToken::For)
        };
        let begins = match before {
            Some(
                FixedToken::OpenBrace
                | FixedToken::CloseBrace
                | FixedToken::CloseParen
                | FixedToken::Else,
            ) => true,
            Some(FixedToken::Comma) => is_in_for(),
            _ => self.token_at(first).is_separated() && !self.is_enclosed(),
        };
        begins.then(|| self.token_at(first).span.to(self.previous().span))
    }

    /// Warns if the current token begins a line, but is parsed as part of the statement above.
    pub(super) fn warn_if_running_on(&mut self) {
        let token = self.token();
        if !token.is_separated() || self.is_enclosed() {
            return;
        }
        let what = match token.separation {
            Separation::Semicolon => "the statement goes on after the `;`",
            _ => "the statement runs on over the end of the line",
        };
        let found = token.kind.describe();
        self.warn(
            Diagnostic::new(DiagnosticCode::RunOnStatement, token.span, what)
                .label(format!("this {found} continues the statement above"))
                .related(self.previous().span, "which goes on after this")
                .help(
                    "newlines and `;` do not end a statement; if it is meant to go on, put it in \
                     parentheses or the operator at the end of the line above",
                ),
        );
    }
}
