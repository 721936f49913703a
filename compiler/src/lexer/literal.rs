//! Reads numbers and strings.

use super::{Lexer, is_name_part};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::token::{FixedToken, TokenKind};

impl Lexer<'_> {
    /// Returns true if the `.` here begins a number such as `.5`. Otherwise it is the dot of a
    /// field, as in `{.5 = "half"}`.
    pub(super) fn is_fraction(&self) -> bool {
        if !self.peek_after(1).is_some_and(|c| c.is_ascii_digit()) {
            return false;
        }
        match self.tokens.last().map(|token| &token.kind) {
            Some(TokenKind::Fixed(FixedToken::OpenBrace)) => false,
            Some(TokenKind::Fixed(FixedToken::Comma)) => {
                self.brackets.last() != Some(&FixedToken::OpenBrace)
            }
            Some(kind) => !kind.ends_value(),
            None => true,
        }
    }

    pub(super) fn number(&mut self) {
        if self.rest().starts_with("0x") || self.rest().starts_with("0X") {
            return self.hexadecimal();
        }
        self.eat_while(|c| c.is_ascii_digit() || c == '.');
        let has_exponent = self.exponent();
        // `1e3.5` and `1_000` can only be malformed numbers.
        let digits_end = self.position;
        if has_exponent {
            self.eat_while(|c| c.is_ascii_digit() || c == '.');
        }
        if self.peek() == Some('_') {
            self.eat_while(is_name_part);
            return self.malformed("Buzz has no digit separators: write the digits in one piece");
        }
        if self.read() == "0" && matches!(self.peek(), Some('b' | 'B')) {
            self.eat_while(is_name_part);
            return self.malformed("Buzz has no binary numbers: write `0x1F` or `31`");
        }
        let text = self.read();
        if self.position > digits_end {
            return self.malformed("an exponent is an integer, as in `1e3` or `2.5e-4`");
        }
        let text = match text.strip_suffix('.').filter(|text| text.matches('.').count() == 1) {
            Some(text) if !text.ends_with('.') && !self.peek().is_some_and(is_name_part) => {
                self.second_point(text);
                text
            }
            _ => text,
        };
        if text.matches('.').count() > 1 {
            return self.malformed("a number has at most one decimal point");
        }
        if has_exponent || text.contains('.') {
            let value: f64 = text.parse().expect("digits, one point and an exponent are a number");
            let mantissa = text.split(['e', 'E']).next().unwrap_or(text);
            let underflows = value == 0.0 && mantissa.contains(|c| matches!(c, '1'..='9'));
            if value.is_infinite() {
                self.out_of_range("too large");
            } else if underflows {
                self.out_of_range("too small");
            }
            self.push(TokenKind::Float(value));
        } else {
            self.integer(text, 10);
        }
    }

    fn hexadecimal(&mut self) {
        self.eat_while(|c| is_name_part(c) || c == '.');
        let digits = &self.read()["0x".len()..];
        if digits.is_empty() || !digits.chars().all(|c| c.is_ascii_hexdigit()) {
            return self.malformed("after `0x` stand hexadecimal digits only, as in `0x1F`");
        }
        self.integer(digits, 16);
    }

    fn integer(&mut self, digits: &str, radix: u32) {
        let value = i64::from_str_radix(digits, radix).unwrap_or_else(|_| {
            self.out_of_range("too large");
            0
        });
        self.push(TokenKind::Int(value));
    }

    /// Reads an exponent such as `e3`, `E+3` or `e-3`. An `e` without digits begins a word, as in
    /// `x = 1else`.
    fn exponent(&mut self) -> bool {
        let start = self.position;
        if self.eat("e") || self.eat("E") {
            if !self.eat("+") {
                self.eat("-");
            }
            if self.peek().is_some_and(|c| c.is_ascii_digit()) {
                self.eat_while(|c| c.is_ascii_digit());
                return true;
            }
        }
        self.position = start;
        false
    }

    fn malformed(&mut self, help: &str) {
        let text = self.read();
        self.report(DiagnosticCode::MalformedNumber, format!("`{text}` is not a number"), help);
        self.push(TokenKind::Int(0));
    }

    /// Reports a number such as `0.0.`, which Buzz reads as `0.0`.
    fn second_point(&mut self, number: &str) {
        let help = format!("write `{number}`");
        let message = format!("the second point of `{number}.` means nothing");
        self.report(DiagnosticCode::SecondPoint, message, &help);
        self.suggest_edit(number);
    }

    fn out_of_range(&mut self, how: &str) {
        let text = self.read();
        self.report(
            DiagnosticCode::NumberOutOfRange,
            format!("the number `{text}` is {how}"),
            "integers have 16 bits in the profile `tiny` and 32 bits in the profile `full`; \
             floats reach about 4e9 in `tiny` and 3e38 in `full`",
        );
    }

    /// Reads a string from its opening quote.
    pub(super) fn string(&mut self, quote: char) {
        let opening = self.position;
        // Once the quotes are known to be unbalanced, every string ends at its line, which avoids
        // further errors.
        let one_line = self.one_line_string == Some(opening) || self.endless_string.is_some();
        self.advance();
        let mut value = String::new();
        let mut holds_newline = false;
        loop {
            let piece_start = self.position;
            match self.advance() {
                Some(c) if c == quote => break,
                Some('\n') if one_line => {
                    self.position = piece_start;
                    self.unterminated(opening, quote);
                    break;
                }
                // The carriage return is dropped, so that a script has the same meaning with the
                // line ends of any editor.
                Some('\r') if self.peek() == Some('\n') => {}
                Some('\\') => value.push(self.escape(piece_start)),
                Some(c) => {
                    holds_newline |= c == '\n';
                    value.push(c);
                }
                None => {
                    // The lexer continues after the line of the opening quote.
                    self.position = opening;
                    self.eat_while(|c| c != '\n');
                    self.diagnostics.retain(|d| (d.span.start as usize) < opening);
                    self.unterminated(opening, quote);
                    self.endless_string = Some(opening);
                    value.clear();
                    holds_newline = false;
                    break;
                }
            }
        }
        if holds_newline && !self.follows_parameters() {
            self.multi_line_strings.push(opening);
        }
        self.push(TokenKind::Str(value));
    }

    /// Returns true after `function name(parameters)`, where a docstring may stand.
    fn follows_parameters(&self) -> bool {
        let mut before = self.tokens.iter().rev().map(|token| &token.kind);
        if before.next() != Some(&TokenKind::Fixed(FixedToken::CloseParen)) {
            return false;
        }
        let is_parameter = |kind: &&TokenKind| {
            matches!(kind, TokenKind::Name(_) | TokenKind::Fixed(FixedToken::Comma))
        };
        let mut before = before.skip_while(is_parameter);
        before.next() == Some(&TokenKind::Fixed(FixedToken::OpenParen))
            && matches!(before.next(), Some(TokenKind::Name(_)))
            && before.next() == Some(&TokenKind::Fixed(FixedToken::Function))
    }

    /// Returns the character that a backslash and the character after it stand for.
    fn escape(&mut self, backslash: usize) -> char {
        match self.peek() {
            Some(c @ ('\\' | '"' | '\'')) => {
                self.advance();
                c
            }
            Some('n') => {
                self.advance();
                '\n'
            }
            Some('t') => {
                self.advance();
                '\t'
            }
            Some(c) => {
                self.advance();
                let shown = if c.is_control() { c.escape_default().to_string() } else { c.into() };
                let span = self.span_from(backslash);
                self.diagnostics.push(
                    Diagnostic::new(
                        DiagnosticCode::UnknownEscape,
                        span,
                        format!("`\\{shown}` is no escape of Buzz"),
                    )
                    .help("the escapes are `\\n`, `\\t`, `\\\\`, `\\\"` and `\\'`; a backslash itself is `\\\\`"),
                );
                c
            }
            None => '\\',
        }
    }

    fn unterminated(&mut self, opening: usize, quote: char) {
        let mut span = self.span_from(opening);
        span.end = span.start + 1;
        self.diagnostics.push(
            Diagnostic::new(DiagnosticCode::UnterminatedString, span, "this string never ends")
                .label("opened here")
                .help(format!("close it with `{quote}`")),
        );
    }

    /// Returns the opening quote of the string whose missing end is the likely reason why the last
    /// string of the file does not end.
    pub(super) fn forgotten_quote(&self) -> Option<usize> {
        let endless = self.endless_string?;
        self.multi_line_strings.first().copied().filter(|opening| *opening < endless)
    }
}
