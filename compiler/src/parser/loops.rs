//! Statements with a head in parentheses: `if`, `while`, `for`.

use super::{Parse, Parser};
use crate::ast::{Block, Expr, ExprKind, Stmt, StmtKind};
use crate::codes::Code;
use crate::diagnostic::Diagnostic;
use crate::source::Span;
use crate::token::{Fixed, Separation, TokenKind};

/// What stands in the parentheses behind `for`.
struct ForHead {
    init: Stmt,
    condition: Expr,
    update: Stmt,
}

impl Parser<'_> {
    pub(super) fn if_statement(&mut self) -> Parse<StmtKind> {
        self.advance();
        self.if_rest()
    }

    /// Behind `if`, and behind an `elseif` that was reported.
    fn if_rest(&mut self) -> Parse<StmtKind> {
        let condition = self.head_condition("if")?;
        let then = self.body("if")?;
        let otherwise = if self.eat(Fixed::Else) {
            Some(self.body("else")?)
        } else if self.foreign_else_if() {
            let start = self.span();
            let kind = self.nested(Self::if_rest)?;
            let span = self.span_since(start);
            Some(Block { stmts: vec![Stmt { kind, span }], span })
        } else {
            None
        };
        Ok(StmtKind::If { condition, then, otherwise })
    }

    pub(super) fn while_statement(&mut self) -> Parse<StmtKind> {
        self.advance();
        let condition = self.head_condition("while")?;
        let body = self.body("while")?;
        Ok(StmtKind::While { condition, body })
    }

    pub(super) fn for_statement(&mut self) -> Parse<StmtKind> {
        self.advance();
        if !self.at(Fixed::OpenParen) {
            let diagnostic = self
                .unexpected("`(`")
                .help("a loop is written `for(i = 0, i < 5, i = i + 1) { ... }`");
            let reported = self.report(diagnostic);
            if self.skip_to_block() {
                self.body("for")?;
            }
            return Err(reported);
        }
        self.open();
        let head = self.enclosed("`)`", Self::for_head)?;
        let body = self.body("for")?;
        let Some(ForHead { init, condition, update }) = head else {
            return Err(super::Reported);
        };
        Ok(StmtKind::For { init: Box::new(init), condition, update: Box::new(update), body })
    }

    fn for_head(&mut self) -> Parse<ForHead> {
        let mut complained = false;
        if self.token().separation == Separation::Semicolon {
            let diagnostic = self.semicolon();
            return Err(self.report(diagnostic));
        }
        self.reject_for_in()?;
        if self.at(Fixed::Var) {
            let var = self.advance().span;
            self.complain(
                Diagnostic::new(Code::VarInFor, var, "`var` cannot stand in the head of a loop")
                    .help("write `var` on the line before: `var i = 0`"),
            );
        }
        let init = self.assignment_or_call()?;
        self.for_comma(&mut complained)?;
        let condition = self.condition()?;
        self.for_comma(&mut complained)?;
        let update = self.assignment_or_call()?;
        Ok(ForHead { init, condition, update })
    }

    fn for_comma(&mut self, complained: &mut bool) -> Parse<()> {
        if self.eat(Fixed::Comma) {
            return Ok(());
        }
        if self.token().separation != Separation::Semicolon {
            let diagnostic = self
                .unexpected("`,`")
                .help("a loop is written `for(i = 0, i < 5, i = i + 1) { ... }`");
            return Err(self.report(diagnostic));
        }
        if !*complained {
            let diagnostic = self.semicolon();
            self.complain(diagnostic);
            *complained = true;
        }
        Ok(())
    }

    fn semicolon(&self) -> Diagnostic {
        Diagnostic::new(
            Code::SemicolonInFor,
            self.semicolon_before(),
            "the parts of a `for` are separated by commas",
        )
        .help("write `for(i = 0, i < 5, i = i + 1)`")
    }

    /// The place of a `;` between the previous token and this one.
    fn semicolon_before(&self) -> Span {
        let between = Span { end: self.span().start, ..self.gap() };
        match self.sources.text(between).find(';') {
            Some(offset) => {
                let start = between.start + offset as u32;
                Span { start, end: start + 1, ..between }
            }
            None => self.span(),
        }
    }

    /// `for(x in t)` and `for(k, v in t)` of other languages.
    fn reject_for_in(&mut self) -> Parse<()> {
        let key_end = self.position + 1;
        let behind = match self.fixed_at(key_end) {
            Some(Fixed::Comma) => key_end + 2,
            _ => key_end,
        };
        if self.name_at(self.position).is_none() || self.name_at(behind) != Some("in") {
            return Ok(());
        }
        let diagnostic = Diagnostic::new(
            Code::ForeignWord,
            self.token_at(behind).span,
            "Buzz has no `for ... in`",
        )
        .help("visit a table with `foreach(t, function(key, value) { ... })`");
        Err(self.report(diagnostic))
    }

    /// The condition behind `if` or `while`, in its parentheses.
    fn head_condition(&mut self, keyword: &str) -> Parse<Expr> {
        let start = self.span();
        let has_parentheses = self.at(Fixed::OpenParen);
        let result = if has_parentheses {
            self.open();
            self.enclosed("an operator or `)`", Self::condition_or_assignment)
        } else {
            self.condition_or_assignment().map(Some)
        };
        let condition = match result {
            Ok(Some(condition)) => condition,
            Ok(None) => Expr { kind: ExprKind::Error, span: self.span_since(start) },
            Err(reported) => {
                if !self.skip_to_block() {
                    return Err(reported);
                }
                return Ok(Expr { kind: ExprKind::Error, span: start });
            }
        };
        let goes_on = self.operator().is_some();
        if has_parentheses && !goes_on {
            return Ok(condition);
        }
        // `if (a) and (b)`, `if a < 3`: understood all the same.
        let span = self.span_since(start);
        let condition = match has_parentheses {
            true => {
                self.condition_rest(Expr { kind: ExprKind::Paren(Box::new(condition)), span })?
            }
            false => condition,
        };
        let span = self.span_since(start);
        let written = self.sources.text(span);
        self.complain(
            Diagnostic::new(
                Code::ConditionWithoutParentheses,
                span,
                format!("the condition of this `{keyword}` is not in parentheses as a whole"),
            )
            .help(match written.contains('\n') {
                true => format!("write `{keyword}(...)`"),
                false => format!("write `{keyword}({written})`"),
            }),
        );
        Ok(condition)
    }

    fn condition_or_assignment(&mut self) -> Parse<Expr> {
        let condition = self.condition()?;
        if !self.at(Fixed::Assign) {
            return Ok(condition);
        }
        let assign = self.span();
        self.complain(
            Diagnostic::new(Code::AssignmentInCondition, assign, "an assignment is no condition")
                .help("to compare, write `==`"),
        );
        self.advance();
        self.condition()?;
        Ok(Expr { kind: ExprKind::Error, span: condition.span })
    }

    /// After an error in a head: goes to the `{` of the body if it stands on the same line.
    fn skip_to_block(&mut self) -> bool {
        loop {
            if self.at(Fixed::OpenBrace) {
                return true;
            }
            if self.token().is_separated() || self.at_end() || self.at(Fixed::CloseBrace) {
                return false;
            }
            match self.brackets.partner(self.position) {
                Some(closing) if closing > self.position => self.position = closing,
                _ => {}
            }
            self.advance();
        }
    }

    /// A block, or the one statement that takes its place.
    fn body(&mut self, owner: &str) -> Parse<Block> {
        if self.at(Fixed::OpenBrace) {
            self.warn_semicolon_before_body(owner);
            return self.block();
        }
        if self.at(Fixed::CloseBrace) || self.at_end() {
            let gap = self.gap();
            self.warn(
                Diagnostic::new(
                    Code::EmptyBody,
                    self.previous().span,
                    format!("this `{owner}` has no body"),
                )
                .help("write `{}` if nothing is to be done"),
            );
            return Ok(Block { stmts: Vec::new(), span: gap });
        }
        self.warn_semicolon_before_body(owner);
        let (start, span, level) = (self.position, self.span(), self.open.len());
        self.blocks += 1;
        let result = match self.kind() {
            TokenKind::FileStart => {
                let diagnostic = Diagnostic::new(
                    Code::IncludeMisplaced,
                    span,
                    format!("an include cannot be the body of this `{owner}`"),
                )
                .help("put braces around it");
                Err(self.report(diagnostic))
            }
            _ => self.nested(Self::statement),
        };
        self.blocks -= 1;
        let stmts = match result {
            Ok(stmt) => vec![stmt],
            Err(_) => {
                self.open.truncate(level);
                self.skip_statement(start);
                Vec::new()
            }
        };
        Ok(Block { stmts, span: self.span_since(span) })
    }

    fn warn_semicolon_before_body(&mut self, owner: &str) {
        if self.token().separation != Separation::Semicolon {
            return;
        }
        self.warn(
            Diagnostic::new(
                Code::SemicolonBeforeBody,
                self.semicolon_before(),
                format!("this `;` does not end the `{owner}`: what follows is its body"),
            )
            .help("remove the `;`, or write `{}` if nothing is to be done"),
        );
    }
}
