//! Reports errors and continues parsing after them.

use super::{Parse, Parser, Reported};
use crate::codes::DiagnosticCode;
use crate::diagnostic::{Diagnostic, Severity};
use crate::source::Span;
use crate::token::{FixedToken, Separation, TokenKind};

impl Parser<'_> {
    /// Reports an error at the current token, unless the error follows from an earlier one.
    pub(super) fn report(&mut self, diagnostic: Diagnostic) -> Reported {
        let is_consequence =
            self.last_error == Some(self.position) || *self.kind() == TokenKind::Error;
        if !is_consequence && !self.gave_up {
            self.diagnostics.push(diagnostic);
        }
        self.last_error = Some(self.position);
        Reported
    }

    /// Returns true if there is an error among the diagnostics after the first `count`.
    pub(super) fn found_error_since(&self, count: usize) -> bool {
        self.diagnostics[count..].iter().any(|diagnostic| diagnostic.severity() == Severity::Error)
    }

    /// Reports an error about source that was parsed nevertheless, so that nothing has to be
    /// skipped.
    pub(super) fn complain(&mut self, diagnostic: Diagnostic) {
        if !self.gave_up {
            self.diagnostics.push(diagnostic);
        }
    }

    /// Reports a warning, unless there is one with the same code about a part of the same place.
    pub(super) fn warn(&mut self, diagnostic: Diagnostic) {
        let span = diagnostic.span;
        let is_repetition = self.diagnostics.iter().rev().take(4).any(|d| {
            d.code == diagnostic.code
                && d.span.file == span.file
                && d.span.start >= span.start
                && d.span.end <= span.end
        });
        if !is_repetition {
            self.complain(diagnostic);
        }
    }

    /// Returns the place right after the previous token, where something is missing.
    pub(super) fn gap(&self) -> Span {
        let Some(before) = self.position.checked_sub(1) else {
            return Span { end: self.span().start, ..self.span() };
        };
        // After an included file, the place is that of the include.
        let before = match self.token_at(before).kind {
            TokenKind::FileEnd => self.brackets.partner(before).unwrap_or(before),
            _ => before,
        };
        let previous = self.token_at(before);
        match previous.kind {
            // At the beginning of an included file, the place is that beginning.
            TokenKind::FileStart if before + 1 == self.position => {
                Span { end: self.span().start, ..self.span() }
            }
            _ => Span { start: previous.span.end, ..previous.span },
        }
    }

    /// Returns the diagnostic "expected X, found Y". If the found token is on another line, the
    /// place is the end of the current line.
    pub(super) fn unexpected(&mut self, expected: &str) -> Diagnostic {
        let token = self.token();
        if token.kind == TokenKind::FileStart && !token.is_separated() {
            return Diagnostic::new(
                DiagnosticCode::IncludeMisplaced,
                token.span,
                "an include cannot stand inside a statement",
            )
            .label(format!("expected {expected}"))
            .help("put it on a line of its own, where a statement may stand");
        }
        if self.at_end()
            && self.is_enclosed()
            && let Some(opening) = self.open.last().copied()
            && let Some(closing) = self.fixed_at(opening).and_then(FixedToken::closing)
        {
            return self.unclosed(opening, closing);
        }
        let is_elsewhere = token.is_separated() || self.at_end();
        let span = if is_elsewhere { self.gap() } else { token.span };
        let message = format!("expected {expected}, found {}", token.kind.describe());
        Diagnostic::new(DiagnosticCode::UnexpectedToken, span, message)
            .label(format!("expected {expected}"))
    }

    /// Consumes `fixed`, or reports that it is missing.
    pub(super) fn expect(&mut self, fixed: FixedToken) -> Parse<()> {
        if self.eat(fixed) {
            return Ok(());
        }
        let diagnostic = self.unexpected(&format!("`{}`", fixed.text()));
        Err(self.report(diagnostic))
    }

    /// Consumes an opening bracket and remembers it until [`Self::close`].
    pub(super) fn open(&mut self) {
        self.open.push(self.position);
        self.advance();
    }

    /// Consumes the bracket that closes the innermost open one. Any other token is reported;
    /// parsing then continues after the closing bracket, or at the current token if there is no
    /// closing bracket.
    pub(super) fn close(&mut self, expected: &str) -> Parse<()> {
        let opening = *self.open.last().expect("`open` comes before `close`");
        let closing = self.fixed_at(opening).and_then(FixedToken::closing);
        let closing = closing.expect("`open` takes only brackets");
        if self.eat(closing) {
            self.open.pop();
            return Ok(());
        }
        // In `f(function(a { ... })` the `)` at the end belongs to the call.
        let begins_body = self.at(FixedToken::OpenBrace)
            && self.fixed_at(self.position + 1) != Some(FixedToken::Dot)
            && closing != FixedToken::CloseBrace;
        if self.partner_ahead(opening).is_some() && !begins_body {
            let diagnostic = match self.operator_word() {
                Some(diagnostic) => diagnostic,
                None => self.unexpected_in_brackets(expected, closing),
            };
            self.report(diagnostic);
            self.skip_to_closing();
            return Ok(());
        }
        let diagnostic = self.unclosed(opening, closing);
        let reported = self.report(diagnostic);
        self.open.pop();
        // Text on the next line, or at the beginning of a block, does not belong to the unclosed
        // bracket.
        let goes_on = self.token().is_separated()
            || matches!(self.fixed(), Some(FixedToken::OpenBrace | FixedToken::CloseBrace))
            || self.at_end();
        if goes_on { Ok(()) } else { Err(reported) }
    }

    /// Returns the diagnostic about a token in brackets that can neither go on nor end there.
    fn unexpected_in_brackets(&mut self, expected: &str, closing: FixedToken) -> Diagnostic {
        let diagnostic = self.unexpected(expected);
        if self.at(FixedToken::Assign) {
            return match closing {
                FixedToken::CloseBrace => diagnostic.help("is a comma missing before this field?"),
                _ => diagnostic
                    .help("an assignment is a statement and has no value; to compare, write `==`")
                    .guess(self.span(), "=="),
            };
        }
        let (token, before) = (self.token(), self.previous());
        if matches!(token.kind, TokenKind::Str(_))
            && matches!(before.kind, TokenKind::Name(_))
            && before.span.end == token.span.start
        {
            return diagnostic.help(
                "a letter before a string has no meaning; `log` joins its arguments: `log(\"robot \", id)`",
            );
        }
        let begins_value = matches!(
            token.kind,
            TokenKind::Name(_)
                | TokenKind::Int(_)
                | TokenKind::Float(_)
                | TokenKind::Str(_)
                | TokenKind::Fixed(FixedToken::Function | FixedToken::Nil)
        );
        if begins_value && expected.starts_with("`,`") && before.kind.ends_value() {
            let gap = self.gap();
            return diagnostic.help("write `,` between two values").guess(gap, ",");
        }
        diagnostic
    }

    pub(super) fn unclosed(&self, opening: usize, closing: FixedToken) -> Diagnostic {
        let open = self.token_at(opening);
        let (text, kind) = (closing.text(), open.kind.describe());
        let gap = self.gap();
        let diagnostic = Diagnostic::new(
            DiagnosticCode::UnclosedBracket,
            gap,
            format!("{kind} is never closed"),
        )
        .label(format!("`{text}` is missing"))
        .related(open.span, format!("this {kind} is open"));
        if closing == FixedToken::CloseBrace {
            return diagnostic;
        }
        if self.is_before_comment(gap, text) {
            return diagnostic.help(format!(
                "`#` begins a comment, which hides the `{text}`; the number of entries of a table is `size(t)`"
            ));
        }
        match self.at(FixedToken::OpenBrace) && !self.token().is_separated() {
            true => diagnostic.help(format!("write `{text}` before the `{{`")).guess(gap, text),
            false => diagnostic,
        }
    }

    /// Returns true if only a comment with that text follows on the line.
    fn is_before_comment(&self, gap: Span, text: &str) -> bool {
        let rest = self.sources.file(gap.file).text.get(gap.end as usize..).unwrap_or_default();
        let line = rest.lines().next().unwrap_or_default().trim_start();
        let line = line.strip_prefix(',').unwrap_or(line).trim_start();
        line.starts_with('#') && line.contains(text)
    }

    /// Returns the closing bracket of `opening`, if the parser has not passed it.
    fn partner_ahead(&self, opening: usize) -> Option<usize> {
        self.brackets.partner(opening).filter(|closing| *closing >= self.position)
    }

    /// Moves past the bracket that closes the innermost open one, after an error inside; returns
    /// false if there is none.
    pub(super) fn skip_to_closing(&mut self) -> bool {
        let Some(opening) = self.open.pop() else { return false };
        let Some(closing) = self.partner_ahead(opening) else { return false };
        self.position = closing;
        self.advance();
        self.lose(opening);
        true
    }

    /// Records that the tokens from `start` up to the current one could not be parsed.
    pub(super) fn lose(&mut self, start: usize) {
        self.lost.push(start..self.position);
    }

    /// Parses the content of a bracket that was opened with [`Self::open`]. After an error inside,
    /// parsing continues after the bracket, and the content is `None`.
    pub(super) fn enclosed<T>(
        &mut self,
        expected: &str,
        parse: impl FnOnce(&mut Self) -> Parse<T>,
    ) -> Parse<Option<T>> {
        let level = self.open.len();
        match parse(self) {
            Ok(content) => {
                self.close(expected)?;
                Ok(Some(content))
            }
            Err(reported) => {
                self.open.truncate(level);
                if self.skip_to_closing() { Ok(None) } else { Err(reported) }
            }
        }
    }

    /// Skips to the likely beginning of the next statement, or to the end of the block. `start` is
    /// the first token of the statement with an error.
    pub(super) fn skip_statement(&mut self, start: usize) {
        self.skip_to_statement(start);
        self.lose(start);
    }

    fn skip_to_statement(&mut self, start: usize) {
        // A keyword in place of a value, as in `x = if`, begins no statement.
        if self.last_error == Some(self.position)
            && matches!(self.fixed(), Some(fixed) if fixed.is_keyword())
            && !self.token().is_separated()
        {
            self.advance();
        }
        loop {
            let moved = self.position > start;
            match self.kind() {
                TokenKind::FileEnd | TokenKind::Fixed(FixedToken::CloseBrace) => return,
                TokenKind::FileStart | TokenKind::Fixed(FixedToken::OpenBrace)
                    if moved && self.token().is_separated() =>
                {
                    return;
                }
                kind if moved && self.starts_statement(kind) => return,
                _ => {}
            }
            match self.brackets.partner(self.position) {
                Some(closing) if closing > self.position => self.position = closing,
                _ => {}
            }
            self.advance();
        }
    }

    /// Guesses if a token begins a statement, for recovery only.
    fn starts_statement(&self, kind: &TokenKind) -> bool {
        match kind {
            TokenKind::Fixed(
                FixedToken::Var
                | FixedToken::If
                | FixedToken::For
                | FixedToken::While
                | FixedToken::Return,
            ) => true,
            TokenKind::Name(_) | TokenKind::Fixed(FixedToken::Function) => {
                self.token().is_separated()
            }
            _ => false,
        }
    }

    /// Returns true if the tokens from `position` on are a target and `=`.
    pub(super) fn starts_assignment(&self, position: usize) -> bool {
        let mut next = position + 1;
        if self.name_at(position).is_none() {
            return false;
        }
        loop {
            match self.fixed_at(next) {
                Some(FixedToken::Assign) => return true,
                Some(FixedToken::Dot) if self.name_at(next + 1).is_some() => next += 2,
                Some(FixedToken::OpenParen | FixedToken::OpenBracket) => {
                    match self.brackets.partner(next) {
                        Some(closing) => next = closing + 1,
                        None => return false,
                    }
                }
                _ => return false,
            }
        }
    }

    /// Returns true if the current token begins a line and an assignment, so that it cannot belong
    /// to the line before.
    pub(super) fn next_line_assigns(&self) -> bool {
        self.token().separation >= Separation::Newline && self.starts_assignment(self.position)
    }
}
