//! Parses operands: literals, names with calls and fields, parentheses, tables.

use super::{Parse, Parser};
use crate::ast::{Expr, ExprKind, FieldKey, Ident, Precedence, TableField, UnaryOp};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::Span;
use crate::token::{FixedToken, KEYWORDS, TokenKind};

impl Parser<'_> {
    pub(super) fn operand(&mut self) -> Parse<Expr> {
        // There is a single `?` for all cases, because each `?` takes stack space in this recursive
        // function.
        let value = match self.kind() {
            TokenKind::Name(_) if !self.next_line_assigns() => return self.reference(),
            TokenKind::Fixed(FixedToken::Bang) => return self.bit_not(),
            TokenKind::Fixed(FixedToken::Plus | FixedToken::Minus) => return self.signed(),
            TokenKind::Fixed(FixedToken::Not) => return self.misplaced_not(),
            TokenKind::Fixed(FixedToken::Function) => self.lambda(),
            TokenKind::Fixed(FixedToken::OpenParen) => self.parenthesized(),
            TokenKind::Fixed(FixedToken::OpenBrace) => {
                self.table().inspect(|table| self.complain_about_table(table))
            }
            _ => self.literal(),
        };
        self.reject_direct_use(value?)
    }

    fn literal(&mut self) -> Parse<Expr> {
        let start = self.span();
        let kind = match self.kind() {
            TokenKind::Fixed(FixedToken::Nil) => ExprKind::Nil,
            TokenKind::Int(value) => ExprKind::Int(*value),
            TokenKind::Float(value) => ExprKind::Float(*value),
            TokenKind::Str(text) => {
                self.strings.insert(text.clone());
                ExprKind::Str(text.clone())
            }
            _ => {
                let mut diagnostic = self.unexpected("a value");
                if self.at(FixedToken::OpenBracket) {
                    diagnostic = diagnostic
                        .help("a list is a table with numbers as keys: `{.0 = \"a\", .1 = \"b\"}`");
                }
                return Err(self.report(diagnostic));
            }
        };
        self.advance();
        Ok(self.expr(kind, start))
    }

    /// Parses `!x`, which has the highest precedence.
    fn bit_not(&mut self) -> Parse<Expr> {
        let start = self.advance().span;
        let operand = Box::new(self.nested(Self::operand)?);
        let not = self.expr(ExprKind::Unary { op: UnaryOp::BitNot, operand }, start);
        self.warn_bit_not_of_condition(&not);
        Ok(not)
    }

    /// Parses a sign. The sign belongs to the literal after it; otherwise it applies to a whole
    /// power: `-y^2` is `-(y^2)`.
    fn signed(&mut self) -> Parse<Expr> {
        let start = self.span();
        let is_negative = self.at(FixedToken::Minus);
        self.advance();
        let literal = match *self.kind() {
            TokenKind::Int(value) => ExprKind::Int(if is_negative { -value } else { value }),
            TokenKind::Float(value) => ExprKind::Float(if is_negative { -value } else { value }),
            _ => {
                let op = if is_negative { UnaryOp::Negate } else { UnaryOp::Plus };
                let operand = Box::new(self.nested(|parser| parser.binary(Precedence::Exponent))?);
                let signed = self.expr(ExprKind::Unary { op, operand }, start);
                self.warn_sign_grouping(&signed);
                return Ok(signed);
            }
        };
        self.advance();
        let literal = self.expr(literal, start);
        self.reject_direct_use(literal)
    }

    /// Reports a `not` after an operator, as in `1 + not a`, and parses it nevertheless. The
    /// precedence of `not` is too low for that place.
    fn misplaced_not(&mut self) -> Parse<Expr> {
        let start = self.advance().span;
        self.complain(
            Diagnostic::new(
                DiagnosticCode::UnexpectedToken,
                start,
                "`not` cannot stand after this operator",
            )
            .help("put it in parentheses with its operand: `(not x)`"),
        );
        let operand = Box::new(self.nested(Self::operand)?);
        Ok(self.expr(ExprKind::Unary { op: UnaryOp::Not, operand }, start))
    }

    fn parenthesized(&mut self) -> Parse<Expr> {
        let start = self.span();
        self.open();
        let inner = self.enclosed("an operator or `)`", Self::condition)?;
        Ok(match inner {
            Some(inner) => self.expr(ExprKind::Paren(Box::new(inner)), start),
            None => self.expr(ExprKind::Error, start),
        })
    }

    /// Reports a call or an index of an operand that does not begin with a name.
    pub(super) fn reject_direct_use(&mut self, value: Expr) -> Parse<Expr> {
        let is_used = matches!(
            self.fixed(),
            Some(FixedToken::OpenParen | FixedToken::OpenBracket | FixedToken::Dot)
        );
        if !is_used || self.token().is_separated() || self.is_table_field() {
            return Ok(value);
        }
        self.complain_about_direct_use(&value);
        self.suffixes(value)
    }

    fn complain_about_direct_use(&mut self, value: &Expr) {
        let verb = if self.at(FixedToken::OpenParen) { "called" } else { "indexed" };
        let what = match value.kind {
            ExprKind::Lambda(_) => "a lambda",
            ExprKind::Table(_) => "a table literal",
            ExprKind::Str(_) => "a string",
            ExprKind::Int(_) | ExprKind::Float(_) => "a number",
            ExprKind::Paren(_) => "a value in parentheses",
            _ => "this value",
        };
        self.complain(
            Diagnostic::new(
                DiagnosticCode::CallOfValue,
                self.span(),
                format!("{what} cannot be {verb} directly"),
            )
            .related(value.span, "this value")
            .help("store it in a variable first"),
        );
    }

    /// Returns true inside a table at `.key =`, which is a field without a comma before it.
    fn is_table_field(&self) -> bool {
        let is_in_table = self.is_enclosed()
            && self
                .open
                .last()
                .is_some_and(|open| self.fixed_at(*open) == Some(FixedToken::OpenBrace));
        is_in_table
            && self.at(FixedToken::Dot)
            && self.fixed_at(self.position + 2) == Some(FixedToken::Assign)
    }

    /// Parses a name with all calls, fields and elements that follow: `t.a[1].b(2)`.
    pub(super) fn reference(&mut self) -> Parse<Expr> {
        let start = self.span();
        let TokenKind::Name(name) = self.kind() else {
            let diagnostic = self.unexpected("a name");
            return Err(self.report(diagnostic));
        };
        self.advance();
        let name = self.expr(ExprKind::Name(name.clone()), start);
        self.suffixes(name)
    }

    fn suffixes(&mut self, mut value: Expr) -> Parse<Expr> {
        let start = value.span;
        loop {
            let height = self.height;
            let kind = match self.fixed() {
                Some(FixedToken::Dot) => self.field(value),
                Some(FixedToken::OpenBracket) => self.index(value),
                Some(FixedToken::OpenParen) => self.call(value),
                _ => return Ok(value),
            };
            value = self.expr(kind?, start);
            self.grow(height)?;
        }
    }

    /// Parses `[index]` after `object`.
    fn index(&mut self, object: Expr) -> Parse<ExprKind> {
        let object = Box::new(object);
        self.warn_if_running_on();
        self.open();
        let index = self.enclosed("an operator or `]`", Self::condition)?;
        let index = Box::new(index.unwrap_or_else(|| self.error_here()));
        Ok(ExprKind::Index { object, index })
    }

    /// Parses `(args)` after `callee`.
    fn call(&mut self, callee: Expr) -> Parse<ExprKind> {
        let callee = Box::new(callee);
        self.warn_if_running_on();
        self.open();
        let errors = self.diagnostics.len();
        let args = self.enclosed("`,` or `)`", |parser| {
            parser.list(FixedToken::CloseParen, Self::condition)
        })?;
        // The lexer may have reported the mistake in a list that was dropped.
        let is_dropped = args.is_none();
        let mut args = args.unwrap_or_default();
        let is_closed = self.previous().kind == TokenKind::Fixed(FixedToken::CloseParen);
        if is_dropped || !is_closed || self.found_error_since(errors) {
            // The list of arguments may be incomplete.
            args.push(self.error_here());
        }
        Ok(ExprKind::Call { callee, args })
    }

    pub(super) fn error_here(&self) -> Expr {
        Expr { kind: ExprKind::Error, span: self.previous().span }
    }

    /// Parses `.name` after `object`.
    pub(super) fn field(&mut self, object: Expr) -> Parse<ExprKind> {
        let dot = self.advance().span;
        let object = Box::new(object);
        let token = self.token();
        let number = match token.kind {
            TokenKind::Int(value) => ExprKind::Int(value),
            TokenKind::Float(value) => ExprKind::Float(value),
            _ => {
                let key = self.field_name()?;
                self.strings.insert(key.name.clone());
                return Ok(ExprKind::Field { object, key });
            }
        };
        self.advance();
        let written = self.sources.text(token.span);
        self.complain(
            Diagnostic::new(
                DiagnosticCode::NumberAsField,
                dot.to(token.span),
                "a number cannot stand after a dot here",
            )
            .help(format!("write `[{written}]`"))
            .edit(dot.to(token.span), format!("[{written}]")),
        );
        Ok(ExprKind::Index { object, index: Box::new(self.expr(number, token.span)) })
    }

    /// Parses the name after a dot. A keyword is reported, but used as the name.
    fn field_name(&mut self) -> Parse<Ident> {
        let token = self.token();
        match &token.kind {
            TokenKind::Name(name) => {
                self.advance();
                Ok(Ident { name: name.clone(), span: token.span })
            }
            TokenKind::Fixed(keyword) if keyword.is_keyword() && !token.is_separated() => {
                let name = keyword.text();
                let diagnostic = self.unexpected("the name of a field").help(format!(
                    "`{name}` is a keyword; as a key it can only be written `[\"{name}\"]`"
                ));
                self.complain(diagnostic);
                self.advance();
                Ok(Ident { name: name.to_owned(), span: token.span })
            }
            _ => {
                let diagnostic = self.unexpected("the name of a field");
                Err(self.report(diagnostic))
            }
        }
    }

    /// Parses items with commas between them, up to the bracket `closing`.
    pub(super) fn list<T>(
        &mut self,
        closing: FixedToken,
        item: impl Fn(&mut Self) -> Parse<T>,
    ) -> Parse<Vec<T>> {
        let mut items = Vec::new();
        if self.at(closing) {
            return Ok(items);
        }
        loop {
            items.push(item(self)?);
            // After a missing comma, the table is parsed further at the next field.
            if self.is_table_field() {
                let diagnostic =
                    self.unexpected("`,` or `}`").help("fields are separated by commas");
                self.complain(diagnostic);
            } else if !self.eat(FixedToken::Comma) {
                return Ok(items);
            } else if self.at(closing) {
                self.complain_about_comma(closing);
                return Ok(items);
            }
        }
    }

    fn complain_about_comma(&mut self, closing: FixedToken) {
        let message = format!("there is nothing between this comma and the `{}`", closing.text());
        let comma = self.previous().span;
        self.complain(
            Diagnostic::new(DiagnosticCode::TrailingComma, comma, message)
                .help("remove the comma")
                .edit(comma, ""),
        );
    }

    /// `{.x = 1, .2 = "a"}`
    pub(super) fn table(&mut self) -> Parse<Expr> {
        let start = self.span();
        self.open();
        let fields = self.enclosed("`,` or `}`", |parser| {
            parser.list(FixedToken::CloseBrace, Self::table_field)
        })?;
        Ok(match fields {
            Some(fields) => self.expr(ExprKind::Table(fields), start),
            None => self.expr(ExprKind::Error, start),
        })
    }

    fn table_field(&mut self) -> Parse<TableField> {
        let key_span = self.field_dot()?;
        let key = match *self.kind() {
            TokenKind::Int(value) => {
                self.advance();
                FieldKey::Int(value)
            }
            TokenKind::Float(value) => {
                self.advance();
                FieldKey::Float(value)
            }
            _ => {
                let name = self.field_name()?.name;
                self.strings.insert(name.clone());
                FieldKey::Name(name)
            }
        };
        self.expect(FixedToken::Assign)?;
        let value = self.condition()?;
        self.warn_condition_value(&value);
        Ok(TableField { key, key_span, value })
    }

    /// Consumes the dot of a field. Returns the place of the key after it.
    fn field_dot(&mut self) -> Parse<Span> {
        if matches!(self.kind(), TokenKind::FileEnd | TokenKind::FileStart) {
            let diagnostic = self.unexpected("a field");
            return Err(self.report(diagnostic));
        }
        let token = self.token();
        if self.at(FixedToken::Dot) {
            self.advance();
            if !self.at(FixedToken::Minus) {
                return Ok(self.span());
            }
        }
        let is_assignment = self.fixed_at(self.position + 1) == Some(FixedToken::Assign);
        let help = match &token.kind {
            TokenKind::Name(name) => format!("write `.{name} = value`"),
            TokenKind::Str(text) => {
                format!(
                    "write `.{text} = value`, or `t[\"{text}\"] = value` after the table is made"
                )
            }
            TokenKind::Fixed(FixedToken::OpenBracket | FixedToken::Dot) => {
                "a key that is no name and no plain number is stored after the table is made: \
                 `t[key] = value`"
                    .to_owned()
            }
            _ => "a list is a table with numbers as keys: `{.0 = \"a\", .1 = \"b\"}`".to_owned(),
        };
        let mut diagnostic = Diagnostic::new(
            DiagnosticCode::FieldWithoutDot,
            token.span,
            "a table field is written `.name = value`",
        )
        .help(help);
        let name = match &token.kind {
            TokenKind::Name(name) => Some(name),
            TokenKind::Str(text) if can_be_name(text) => Some(text),
            _ => None,
        };
        if let Some(name) = name {
            // `a: 1` and `"a": 1` of other languages.
            let colon = self.token_at(self.position + 1).span;
            let is_colon = self.sources.text(colon) == ":";
            if is_colon {
                diagnostic = diagnostic.edit(token.span.to(colon), format!(".{name} ="));
            } else if is_assignment {
                diagnostic = diagnostic.edit(token.span, format!(".{name}"));
            }
        }
        if matches!(token.kind, TokenKind::Name(_)) && is_assignment {
            self.complain(diagnostic);
            return Ok(token.span);
        }
        Err(self.report(diagnostic))
    }
}

/// Returns true if a field can have that name without quotes.
fn can_be_name(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && KEYWORDS.into_iter().all(|keyword| keyword.text() != text)
}
