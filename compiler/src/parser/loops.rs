//! Parses statements with a head in parentheses: `if`, `while`, `for`.

use super::{Parse, Parser};
use crate::ast::{Block, Branch, Expr, ExprKind, Stmt, StmtKind};
use crate::codes::DiagnosticCode;
use crate::diagnostic::{Diagnostic, Edit};
use crate::source::Span;
use crate::token::{FixedToken, Separation, TokenKind};

const FOR_HELP: &str = "a loop is written `for(i = 0, i < 5, i = i + 1) { ... }`";

/// The content of the parentheses after `for`.
struct ForHead {
    init: Box<Stmt>,
    condition: Expr,
    update: Box<Stmt>,
}

impl Parser<'_> {
    pub(super) fn if_statement(&mut self) -> Parse<StmtKind> {
        self.advance();
        let mut branches = vec![self.branch()?];
        loop {
            if !self.eat(FixedToken::Else) {
                if !self.foreign_else_if() {
                    return Ok(StmtKind::If { branches, otherwise: None });
                }
            } else if self.at(FixedToken::If) {
                self.warn_semicolon_before_body("else");
                self.advance();
            } else {
                let otherwise = Some(self.body("else")?);
                return Ok(StmtKind::If { branches, otherwise });
            }
            let (start, level) = (self.position, self.open.len());
            match self.branch() {
                Ok(branch) => branches.push(branch),
                Err(_) => {
                    self.open.truncate(level);
                    self.skip_statement(start);
                    return Ok(StmtKind::If { branches, otherwise: None });
                }
            }
        }
    }

    /// Parses the part after `if`.
    fn branch(&mut self) -> Parse<Branch> {
        let condition = self.head_condition("if")?;
        let then = self.body("if")?;
        Ok(Branch { condition, then })
    }

    pub(super) fn while_statement(&mut self) -> Parse<StmtKind> {
        self.advance();
        let condition = self.head_condition("while")?;
        let body = self.body("while")?;
        Ok(StmtKind::While { condition, body })
    }

    pub(super) fn for_statement(&mut self) -> Parse<StmtKind> {
        self.advance();
        if !self.at(FixedToken::OpenParen) {
            return self.for_without_parentheses();
        }
        self.open();
        let head = self.enclosed("`)`", Self::for_head)?;
        let body = self.body("for")?;
        Ok(match head {
            Some(ForHead { init, condition, update }) => {
                StmtKind::For { init, condition, update, body }
            }
            None => StmtKind::While { condition: self.error_here(), body },
        })
    }

    /// Reports a `for` without parentheses. The body is kept, so that it is checked.
    fn for_without_parentheses(&mut self) -> Parse<StmtKind> {
        let diagnostic = self.unexpected("`(`").help(FOR_HELP);
        let (reported, start) = (self.report(diagnostic), self.position);
        if !self.skip_to_block() {
            return Err(reported);
        }
        self.lose(start);
        Ok(StmtKind::While { condition: self.error_here(), body: self.block()? })
    }

    fn for_head(&mut self) -> Parse<ForHead> {
        let mut complained = false;
        if self.token().separation == Separation::Semicolon {
            let diagnostic = self.semicolon();
            return Err(self.report(diagnostic));
        }
        self.reject_for_in()?;
        if self.at(FixedToken::Var) {
            let var = self.advance().span;
            self.complain(
                Diagnostic::new(
                    DiagnosticCode::VarInFor,
                    var,
                    "`var` cannot stand in the head of a loop",
                )
                .help("write `var` on the line before: `var i = 0`"),
            );
        }
        let init = Box::new(self.assignment_or_call()?);
        self.for_comma(&mut complained)?;
        let condition = self.condition()?;
        self.for_comma(&mut complained)?;
        let update = Box::new(self.assignment_or_call()?);
        Ok(ForHead { init, condition, update })
    }

    fn for_comma(&mut self, complained: &mut bool) -> Parse<()> {
        if self.eat(FixedToken::Comma) {
            return Ok(());
        }
        if self.token().separation != Separation::Semicolon {
            let diagnostic = self.unexpected("`,`").help(FOR_HELP);
            return Err(self.report(diagnostic));
        }
        let semicolon = self.semicolon_before();
        if !*complained {
            let diagnostic = self.semicolon().edit(semicolon, ",");
            self.complain(diagnostic);
            *complained = true;
        } else {
            // One diagnostic has the edits for both semicolons.
            let first = self
                .diagnostics
                .iter_mut()
                .rev()
                .find(|d| d.code == DiagnosticCode::SemicolonInFor);
            let comma = Edit { span: semicolon, text: ",".to_owned(), is_certain: true };
            first.into_iter().for_each(|first| first.edits.push(comma.clone()));
        }
        Ok(())
    }

    fn semicolon(&self) -> Diagnostic {
        Diagnostic::new(
            DiagnosticCode::SemicolonInFor,
            self.semicolon_before(),
            "the parts of a `for` are separated by commas",
        )
        .help(FOR_HELP)
    }

    /// Returns the place of a `;` between the previous token and the current one.
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

    /// Reports `for(x in t)` and `for(k, v in t)` of other languages.
    fn reject_for_in(&mut self) -> Parse<()> {
        let key_end = self.position + 1;
        let following = match self.fixed_at(key_end) {
            Some(FixedToken::Comma) => key_end + 2,
            _ => key_end,
        };
        if self.name_at(self.position).is_none() || self.name_at(following) != Some("in") {
            return Ok(());
        }
        let diagnostic = Diagnostic::new(
            DiagnosticCode::ForeignWord,
            self.token_at(following).span,
            "Buzz has no `for ... in`",
        )
        .help("visit a table with `foreach(t, function(key, value) { ... })`");
        Err(self.report(diagnostic))
    }

    /// Parses the condition after `if` or `while`, in its parentheses.
    fn head_condition(&mut self, keyword: &str) -> Parse<Expr> {
        let (start, has_parentheses) = (self.span(), self.at(FixedToken::OpenParen));
        let first = self.position;
        let result = if has_parentheses {
            self.open();
            self.enclosed("an operator or `)`", Self::condition_or_assignment)
        } else {
            self.condition_or_assignment().map(Some)
        };
        match result {
            Ok(Some(condition)) if has_parentheses && self.operator().is_none() => Ok(condition),
            Ok(Some(condition)) => self.bare_condition(condition, start, keyword),
            Err(reported) if !self.skip_to_block() => Err(reported),
            Ok(None) | Err(_) => {
                self.lose(first);
                Ok(Expr { kind: ExprKind::Error, span: start })
            }
        }
    }

    /// Reports a condition such as `if (a) and (b)` or `if a < 3`, and parses it nevertheless.
    fn bare_condition(&mut self, first: Expr, start: Span, keyword: &str) -> Parse<Expr> {
        let mut condition = first;
        if self.operator().is_some() {
            condition = self.expr(ExprKind::Paren(Box::new(condition)), start);
            self.condition_rest(&mut condition)?;
        }
        let span = self.span_since(start);
        let written = self.sources.text(span);
        let help = match written.contains('\n') {
            true => format!("write `{keyword}(...)`"),
            false => format!("write `{keyword}({written})`"),
        };
        self.complain(
            Diagnostic::new(
                DiagnosticCode::ConditionWithoutParentheses,
                span,
                format!("the condition of this `{keyword}` is not in parentheses as a whole"),
            )
            .help(help)
            .edit(Span { end: span.start, ..span }, "(")
            .edit(Span { start: span.end, ..span }, ")"),
        );
        Ok(condition)
    }

    fn condition_or_assignment(&mut self) -> Parse<Expr> {
        let first = self.position;
        let condition = self.condition()?;
        if !self.at(FixedToken::Assign) {
            return Ok(condition);
        }
        let assign = self.span();
        self.complain(
            Diagnostic::new(
                DiagnosticCode::AssignmentInCondition,
                assign,
                "an assignment is no condition",
            )
            .help("to compare, write `==`")
            .guess(assign, "=="),
        );
        self.advance();
        self.condition()?;
        self.lose(first);
        Ok(Expr { kind: ExprKind::Error, span: condition.span })
    }

    /// Moves to the `{` of the body after an error in a head. Returns false if the body does not
    /// start on the same line.
    fn skip_to_block(&mut self) -> bool {
        loop {
            if self.at(FixedToken::OpenBrace) {
                return true;
            }
            if self.token().is_separated() || self.at_end() || self.at(FixedToken::CloseBrace) {
                return false;
            }
            match self.brackets.partner(self.position) {
                Some(closing) if closing > self.position => self.position = closing,
                _ => {}
            }
            self.advance();
        }
    }

    /// Parses a block, or the single statement that replaces a block.
    fn body(&mut self, owner: &str) -> Parse<Block> {
        if self.at(FixedToken::CloseBrace) || self.at_end() {
            return Ok(self.empty_body(owner));
        }
        self.warn_semicolon_before_body(owner);
        match self.kind() {
            TokenKind::Fixed(FixedToken::OpenBrace) => self.block(),
            TokenKind::FileStart => Ok(self.include_as_body(owner)),
            _ => Ok(self.single_statement()),
        }
    }

    fn single_statement(&mut self) -> Block {
        let (start, span, level) = (self.position, self.span(), self.open.len());
        self.blocks += 1;
        let stmts = match self.nested(Self::statement) {
            Ok(stmt) => vec![stmt],
            Err(_) => {
                self.open.truncate(level);
                self.skip_statement(start);
                Vec::new()
            }
        };
        self.blocks -= 1;
        Block { stmts, span: self.span_since(span) }
    }

    fn empty_body(&mut self, owner: &str) -> Block {
        self.warn(
            Diagnostic::new(
                DiagnosticCode::EmptyBody,
                self.previous().span,
                format!("this `{owner}` has no body"),
            )
            .help("write `{}` if nothing is to be done"),
        );
        Block { stmts: Vec::new(), span: self.gap() }
    }

    fn include_as_body(&mut self, owner: &str) -> Block {
        let (start, span) = (self.position, self.span());
        let message = format!("an include cannot be the body of this `{owner}`");
        let diagnostic = Diagnostic::new(DiagnosticCode::IncludeMisplaced, span, message)
            .help("put braces around it");
        self.report(diagnostic);
        self.skip_statement(start);
        Block { stmts: Vec::new(), span }
    }

    fn warn_semicolon_before_body(&mut self, owner: &str) {
        if self.token().separation != Separation::Semicolon {
            return;
        }
        self.warn(
            Diagnostic::new(
                DiagnosticCode::SemicolonBeforeBody,
                self.semicolon_before(),
                format!("this `;` does not end the `{owner}`: what follows is its body"),
            )
            .help("remove the `;`, or write `{}` if nothing is to be done"),
        );
    }
}
