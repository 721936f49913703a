//! Parses statements and blocks.

use super::{Parse, Parser, Reported};
use crate::ast::{Block, Branch, Expr, ExprKind, Stmt, StmtKind};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::Span;
use crate::token::{FixedToken, Separation, TokenKind};

impl Parser<'_> {
    /// Parses the statements of a file, or of a block up to its `}`.
    pub(super) fn statements(&mut self, in_block: bool) -> Vec<Stmt> {
        let mut stmts = Vec::new();
        loop {
            let start = self.position;
            match self.kind() {
                TokenKind::FileEnd => return stmts,
                TokenKind::FileStart => stmts.append(&mut self.included()),
                TokenKind::Fixed(FixedToken::CloseBrace) if in_block => return stmts,
                TokenKind::Fixed(FixedToken::CloseBrace) => {
                    self.unmatched_closing();
                    self.skip_orphaned_else();
                }
                _ if in_block && self.is_next_function() => return stmts,
                TokenKind::Fixed(FixedToken::Else) if in_block && self.lacks_brace(&stmts) => {
                    self.complain_about_missing_brace();
                    return stmts;
                }
                _ => {
                    let level = self.open.len();
                    match self.nested(Self::statement) {
                        Ok(stmt) => stmts.push(stmt),
                        Err(_) => self.recover(start, level),
                    }
                }
            }
            if self.position == start {
                self.advance();
            }
        }
    }

    /// Continues after a statement that could not be parsed.
    fn recover(&mut self, start: usize, open: usize) {
        self.open.truncate(open);
        self.skip_statement(start);
        self.skip_orphaned_else();
    }

    /// Parses and discards an `else` after an error, because its `if` may have been skipped.
    fn skip_orphaned_else(&mut self) {
        let open = self.open.len();
        while self.eat(FixedToken::Else) {
            let body = self.position;
            if self.at(FixedToken::OpenBrace) {
                let _ = self.block();
                self.lose(body);
            } else if self.nested(Self::statement).is_err() {
                self.open.truncate(open);
                self.skip_statement(body);
            }
        }
    }

    /// Parses the statements of an included file.
    fn included(&mut self) -> Vec<Stmt> {
        self.advance();
        let stmts = self.nested(|parser| Ok(parser.statements(false))).unwrap_or_default();
        if self.at_end() {
            self.advance();
        }
        stmts
    }

    /// Returns true at a named function inside a block that is never closed: the missing `}`
    /// belongs before the function.
    fn is_next_function(&self) -> bool {
        self.at(FixedToken::Function)
            && self.token().is_separated()
            && self.name_at(self.position + 1).is_some()
            && self.open.last().is_some_and(|open| self.brackets.partner(*open).is_none())
    }

    /// Returns true at an `else` in the block of an `if`: the `}` before it is missing. After an `if`
    /// without braces, the `else` may be meant for that one.
    fn lacks_brace(&self, stmts: &[Stmt]) -> bool {
        let Some(before) = self.open.last().and_then(|open| open.checked_sub(1)) else {
            return false;
        };
        let is_of_if = match self.fixed_at(before) {
            Some(FixedToken::CloseParen) => {
                let opening = self.brackets.partner(before);
                opening.and_then(|opening| self.fixed_at(opening.checked_sub(1)?))
                    == Some(FixedToken::If)
            }
            _ => false,
        };
        let has_bare_if = |stmt: &Stmt| {
            let StmtKind::If { branches, otherwise: None } = &stmt.kind else { return false };
            branches.iter().any(|branch| !self.sources.text(branch.then.span).starts_with('{'))
        };
        is_of_if && !stmts.iter().any(has_bare_if)
    }

    fn complain_about_missing_brace(&mut self) {
        let Some(open) = self.open.last().map(|open| self.token_at(*open).span) else { return };
        let diagnostic = Diagnostic::new(
            DiagnosticCode::UnclosedBracket,
            self.span(),
            "`}` is missing before this `else`",
        )
        .related(open, "this `{` is open")
        .help("write `} else`")
        .edit(Span { end: self.span().start, ..self.span() }, "} ");
        // The block that is not closed is no further mistake.
        self.report(diagnostic);
    }

    fn unmatched_closing(&mut self) {
        let found = self.kind().describe();
        let diagnostic = Diagnostic::new(
            DiagnosticCode::UnmatchedClosing,
            self.span(),
            format!("this {found} closes nothing"),
        )
        .help("remove it, or look for a bracket too many further up");
        self.report(diagnostic);
        self.advance();
        // `}}}` is reported once.
        while matches!(
            self.fixed(),
            Some(FixedToken::CloseBrace | FixedToken::CloseParen | FixedToken::CloseBracket)
        ) && !self.token().is_separated()
            && self.brackets.partner(self.position).is_none()
        {
            self.advance();
        }
    }

    /// `{ ... }`
    pub(super) fn block(&mut self) -> Parse<Block> {
        let (opening, start) = (self.position, self.span());
        self.advance();
        let stmts = self.block_of(opening);
        if !self.eat(FixedToken::CloseBrace) {
            let diagnostic = self.unclosed(opening, FixedToken::CloseBrace);
            self.report(diagnostic);
        }
        Ok(Block { stmts, span: self.span_since(start) })
    }

    /// Parses the statements up to a `}` whose `{` is missing. Returns `None` if the `}` is
    /// missing, too.
    pub(super) fn block_without_brace(&mut self) -> Option<Block> {
        if self.position == 0 || !self.brackets.lack_opening_brace(self.position) {
            return None;
        }
        let start = self.gap();
        let stmts = self.block_of(self.position - 1);
        self.eat(FixedToken::CloseBrace);
        Some(Block { stmts, span: self.span_since(start) })
    }

    /// Parses the statements of the block that the token at `opening` begins.
    fn block_of(&mut self, opening: usize) -> Vec<Stmt> {
        self.brackets.mark_block(opening);
        let level = self.open.len();
        self.open.push(opening);
        self.blocks += 1;
        let stmts = self.statements(true);
        self.blocks -= 1;
        self.open.truncate(level);
        stmts
    }

    pub(super) fn statement(&mut self) -> Parse<Stmt> {
        let start = self.span();
        // There is a single `?` for all cases, because each `?` takes stack space in this recursive
        // function.
        let kind = match self.fixed() {
            Some(FixedToken::Var) => self.var_statement(),
            Some(FixedToken::If) => self.if_statement(),
            Some(FixedToken::For) => self.for_statement(),
            Some(FixedToken::While) => self.while_statement(),
            Some(FixedToken::Return) => self.return_statement(),
            Some(FixedToken::Function) => self.function_statement(),
            Some(FixedToken::Else) => self.else_without_if(),
            Some(FixedToken::OpenBrace) => self.bare_block(),
            _ => return self.assignment_or_call(),
        };
        kind.map(|kind| Stmt { kind, span: self.span_since(start) })
    }

    fn var_statement(&mut self) -> Parse<StmtKind> {
        let start = self.position;
        self.advance();
        let name = self.name("the name of a variable")?;
        let assigns = self.at(FixedToken::Assign) || self.comparison_for_assignment();
        if assigns {
            self.advance();
            let value = self.value(start)?;
            return Ok(StmtKind::Var { name, value: Some(value) });
        }
        if !self.token().is_separated() {
            let help = match self.fixed() {
                Some(FixedToken::Comma) => "each variable has its own `var`",
                Some(FixedToken::Dot | FixedToken::OpenBracket) => {
                    "a field belongs to its table: assign it without `var`"
                }
                _ => return Ok(StmtKind::Var { name, value: None }),
            };
            let diagnostic = self.unexpected("`=` or the next statement").help(help);
            self.report(diagnostic);
            self.skip_statement(start);
        }
        Ok(StmtKind::Var { name, value: None })
    }

    /// Reports a `==` in a place where only `=` is possible.
    fn comparison_for_assignment(&mut self) -> bool {
        if !self.at(FixedToken::Equal) {
            return false;
        }
        let diagnostic = Diagnostic::new(
            DiagnosticCode::ComparisonAsStatement,
            self.span(),
            "`==` compares, it does not assign",
        )
        .help("write `=`")
        .edit(self.span(), "=");
        self.complain(diagnostic);
        true
    }

    /// Parses the right side of `=`. After an error in it the statement is kept, so that its target
    /// counts as assigned.
    fn value(&mut self, statement: usize) -> Parse<Expr> {
        let level = self.open.len();
        match self.condition() {
            Ok(value) => {
                self.warn_condition_value(&value);
                Ok(value)
            }
            Err(reported) if self.is_enclosed() => Err(reported),
            Err(_) => {
                self.open.truncate(level);
                let span = self.gap();
                self.skip_statement(statement);
                Ok(Expr { kind: ExprKind::Error, span })
            }
        }
    }

    fn return_statement(&mut self) -> Parse<StmtKind> {
        let start = self.position;
        let keyword = self.advance().span;
        if self.is_bare_return() {
            return Ok(StmtKind::Return { value: None });
        }
        let is_on_next_line = self.token().is_separated();
        let value = self.value_of_return(start)?;
        if is_on_next_line {
            self.warn(
                Diagnostic::new(
                    DiagnosticCode::ReturnFromNextLine,
                    value.span,
                    "this is the value of the `return` on a line above",
                )
                .related(keyword, "the `return`")
                .help("write `return;` to return nothing, or the value on the line of `return`")
                .guess(Span { start: keyword.end, ..keyword }, ";"),
            );
        }
        Ok(StmtKind::Return { value: Some(value) })
    }

    /// Parses a value as [`Self::value`] does, but accepts `return a or b`: a function may return 0
    /// or 1.
    fn value_of_return(&mut self, statement: usize) -> Parse<Expr> {
        let level = self.open.len();
        self.condition().or_else(|_| {
            self.open.truncate(level);
            let span = self.gap();
            self.skip_statement(statement);
            Ok(Expr { kind: ExprKind::Error, span })
        })
    }

    fn is_bare_return(&self) -> bool {
        if self.token().separation == Separation::Semicolon {
            return true;
        }
        match self.kind() {
            TokenKind::FileEnd | TokenKind::FileStart => true,
            TokenKind::Fixed(fixed) => match fixed {
                FixedToken::CloseBrace
                | FixedToken::Var
                | FixedToken::If
                | FixedToken::While
                | FixedToken::For
                | FixedToken::Return
                | FixedToken::Else => true,
                // A named function is a statement, not a value.
                FixedToken::Function => self.name_at(self.position + 1).is_some(),
                _ => false,
            },
            _ => self.next_line_assigns(),
        }
    }

    /// Reports an `else` without an `if`. The block is kept, so that it is checked.
    fn else_without_if(&mut self) -> Parse<StmtKind> {
        let diagnostic = Diagnostic::new(
            DiagnosticCode::ElseWithoutIf,
            self.span(),
            "this `else` belongs to no `if`",
        )
        .help("without braces only one statement belongs to an `if`; with more, put braces around");
        let reported = self.report(diagnostic);
        self.advance();
        if self.at(FixedToken::OpenBrace) { self.block_of_nobody() } else { Err(reported) }
    }

    /// Keeps a block whose statement could not be parsed, as that of an `if` with an unknown
    /// condition.
    fn block_of_nobody(&mut self) -> Parse<StmtKind> {
        let condition = self.error_here();
        let branches = vec![Branch { condition, then: self.block()? }];
        Ok(StmtKind::If { branches, otherwise: None })
    }

    fn bare_block(&mut self) -> Parse<StmtKind> {
        let is_table = self.fixed_at(self.position + 1) == Some(FixedToken::Dot);
        let diagnostic = if is_table {
            Diagnostic::new(DiagnosticCode::ValueAsStatement, self.span(), "this table is not used")
                .help("assign it to a variable")
        } else {
            Diagnostic::new(
                DiagnosticCode::BareBlock,
                self.span(),
                "a block can only stand after `if`, `else`, `for`, `while` and `function(...)`",
            )
            .help("remove the braces; a table literal needs a variable: `t = {.x = 1}`")
        };
        let reported = self.report(diagnostic);
        if is_table {
            self.open();
            self.skip_to_closing();
            return Err(reported);
        }
        self.block_of_nobody()
    }

    /// Parses a statement that may also be in the head of a `for`: `target = value` or a call.
    pub(super) fn assignment_or_call(&mut self) -> Parse<Stmt> {
        let (start, span) = (self.position, self.span());
        if !matches!(self.kind(), TokenKind::Name(_)) {
            return Err(self.stray());
        }
        let target = self.reference()?;
        if self.at(FixedToken::Assign) {
            let kind = self.assignment(target, start)?;
            return Ok(Stmt { kind, span: self.span_since(span) });
        }
        if self.increment() {
            let value = Expr { kind: ExprKind::Error, span: self.previous().span };
            let kind = StmtKind::Assign { target, value };
            return Ok(Stmt { kind, span: self.span_since(span) });
        }
        if self.operator().is_some() {
            return Err(self.lone_operation(target)?);
        }
        if !is_call(&target) {
            return Err(self.lone_name(&target));
        }
        self.reject_foreign_call(&target)?;
        Ok(Stmt { kind: StmtKind::Call(target), span: self.span_since(span) })
    }

    /// Parses `= value` after its target.
    fn assignment(&mut self, target: Expr, statement: usize) -> Parse<StmtKind> {
        if is_call(&target) {
            self.complain(
                Diagnostic::new(
                    DiagnosticCode::AssignToCall,
                    target.span,
                    "the result of a call cannot be assigned to",
                )
                .help("assign to a variable or to a field: `t = f()`, then `t.x = 1`"),
            );
        }
        self.advance();
        let value = self.value(statement)?;
        Ok(match is_call(&target) {
            true => StmtKind::Call(target),
            false => StmtKind::Assign { target, value },
        })
    }

    /// Reports an operation that is used as a statement, such as `x == 1` or `x + 1`.
    fn lone_operation(&mut self, mut value: Expr) -> Parse<Reported> {
        let is_comparison = self.at(FixedToken::Equal);
        let operator = self.span();
        let target = self.sources.text(value.span).to_owned();
        let warnings = self.diagnostics.len();
        let is_call = is_call(&value);
        self.condition_rest(&mut value)?;
        // Warnings about the value are removed, because the error makes them irrelevant.
        self.diagnostics.truncate(warnings);
        let diagnostic = if is_comparison && !is_call {
            Diagnostic::new(
                DiagnosticCode::ComparisonAsStatement,
                operator,
                "this compares, and nothing is done with the result",
            )
            .help(format!("to assign, write `{target} = ...`"))
            .guess(operator, "=")
        } else {
            self.unused_value(value.span)
        };
        Ok(self.report(diagnostic))
    }

    /// Returns the error about a value that is a statement, and after which the parser is. At the end of
    /// a block it is most likely meant as the result of a function.
    fn unused_value(&self, span: Span) -> Diagnostic {
        let message = "nothing is done with this value";
        let diagnostic = Diagnostic::new(DiagnosticCode::ValueAsStatement, span, message);
        match self.blocks > 0 && self.at(FixedToken::CloseBrace) {
            true => diagnostic
                .help("write `return` before it if it is the result of the function")
                .guess(Span { end: span.start, ..span }, "return "),
            false => diagnostic.help("assign it to a variable, or pass it to a function"),
        }
    }

    /// Reports a token that begins no statement.
    fn stray(&mut self) -> Reported {
        if let TokenKind::Fixed(FixedToken::CloseParen | FixedToken::CloseBracket) = self.kind() {
            self.unmatched_closing();
            return Reported;
        }
        let continues_line = self.position > 0
            && !self.token().is_separated()
            && !matches!(self.previous().kind, TokenKind::Fixed(_) | TokenKind::FileStart);
        if continues_line {
            let diagnostic = self.unexpected("an operator or the next statement");
            return self.report(diagnostic);
        }
        let begins_value = match self.kind() {
            TokenKind::Int(_) | TokenKind::Float(_) | TokenKind::Str(_) => true,
            TokenKind::Fixed(fixed) => matches!(
                fixed,
                FixedToken::OpenParen
                    | FixedToken::Plus
                    | FixedToken::Minus
                    | FixedToken::Bang
                    | FixedToken::Not
                    | FixedToken::Nil
            ),
            _ => false,
        };
        if !begins_value {
            let mut diagnostic = self.unexpected("a statement");
            if self.at(FixedToken::Assign) {
                diagnostic = diagnostic.help(
                    "a statement may go on over the end of a line: is the line above complete?",
                );
            }
            return self.report(diagnostic);
        }
        if let Some(reported) = self.foreign_prefix() {
            return reported;
        }
        let (start, diagnostics) = (self.span(), self.diagnostics.len());
        match self.condition() {
            Ok(value) => {
                self.diagnostics.truncate(diagnostics);
                let diagnostic = self.unused_value(start.to(value.span));
                self.complain(diagnostic);
                Reported
            }
            Err(reported) => reported,
        }
    }

    /// Reports `++i` and `-- comment` of other languages.
    fn foreign_prefix(&mut self) -> Option<Reported> {
        let sign @ (FixedToken::Plus | FixedToken::Minus) = self.fixed()? else { return None };
        if self.fixed_at(self.position + 1) != Some(sign) {
            return None;
        }
        let sign = sign.text();
        let help = match sign {
            "-" => "write `x = x - 1`; a comment starts with `#`",
            _ => "write `x = x + 1`",
        };
        let span = self.span().to(self.token_at(self.position + 1).span);
        let message = format!("Buzz has no operator `{sign}{sign}`");
        Some(
            self.report(Diagnostic::new(DiagnosticCode::ForeignOperator, span, message).help(help)),
        )
    }
}

fn is_call(expr: &Expr) -> bool {
    matches!(expr.kind, ExprKind::Call { .. })
}
