//! The lexer: turns the text of one file into tokens.
//!
//! The lexer never stops at an error: it reports the error, inserts the most likely token, and
//! continues.

mod literal;
mod operator;

use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::source::{FileId, Span};
use crate::steps;
use crate::token::{FixedToken, Separation, Token, TokenKind};

/// Returns the tokens of a file, the last one being [`TokenKind::FileEnd`]. Errors are added to
/// `diagnostics`. The text must have at most [`SOURCE_BYTES_MAX`](crate::include::SOURCE_BYTES_MAX)
/// bytes.
pub fn lex(file: FileId, text: &str, diagnostics: &mut Vec<Diagnostic>) -> Vec<Token> {
    let mut lexer = Lexer::new(file, text, None);
    lexer.run();
    if let Some(opening) = lexer.forgotten_quote() {
        // The missing quote is most likely that of an earlier string, which then swallowed lines of
        // code. Ending that string at its line reports the mistake at its place, and avoids errors
        // about the rest of the file.
        lexer = Lexer::new(file, text, Some(opening));
        lexer.run();
    }
    diagnostics.append(&mut lexer.diagnostics);
    lexer.tokens
}

struct Lexer<'a> {
    file: FileId,
    text: &'a str,
    position: usize,
    /// Offset of the token that is being read.
    start: usize,
    separation: Separation,
    /// The open brackets, innermost last.
    brackets: Vec<FixedToken>,
    tokens: Vec<Token>,
    diagnostics: Vec<Diagnostic>,
    /// Offset of the opening quote of a string that must end at its line.
    one_line_string: Option<usize>,
    /// Offsets of the opening quotes of strings that contain newlines.
    multi_line_strings: Vec<usize>,
    endless_string: Option<usize>,
    /// True once a `/*` without `*/` was found.
    endless_comment: bool,
    /// True once a line that ends with a lone carriage return was reported.
    has_reported_line_ends: bool,
}

impl<'a> Lexer<'a> {
    fn new(file: FileId, text: &'a str, one_line_string: Option<usize>) -> Self {
        Lexer {
            file,
            text,
            position: 0,
            start: 0,
            separation: Separation::SameLine,
            brackets: Vec::new(),
            tokens: Vec::new(),
            diagnostics: Vec::new(),
            one_line_string,
            multi_line_strings: Vec::new(),
            endless_string: None,
            endless_comment: false,
            has_reported_line_ends: false,
        }
    }

    fn run(&mut self) {
        self.eat("\u{feff}");
        loop {
            self.skip_blanks();
            self.start = self.position;
            let Some(next) = self.peek() else { break };
            match next {
                '"' | '\'' => self.string(next),
                '0'..='9' => self.number(),
                '.' if self.is_fraction() => self.number(),
                _ if is_name_start(next) => self.word(),
                _ => self.operator(next),
            }
        }
        // `FileEnd` is placed after the last text, because an empty line would show nothing in a
        // message.
        self.position = self.text.trim_end().len();
        self.start = self.position;
        self.push(TokenKind::FileEnd);
    }

    fn rest(&self) -> &'a str {
        &self.text[self.position..]
    }

    fn peek(&self) -> Option<char> {
        steps::take(1);
        self.rest().chars().next()
    }

    fn peek_after(&self, skip: usize) -> Option<char> {
        steps::take(skip);
        self.rest().chars().nth(skip)
    }

    fn advance(&mut self) -> Option<char> {
        let next = self.peek()?;
        self.position += next.len_utf8();
        Some(next)
    }

    fn eat(&mut self, expected: &str) -> bool {
        steps::take(expected.len());
        let found = self.rest().starts_with(expected);
        if found {
            self.position += expected.len();
        }
        found
    }

    fn eat_while(&mut self, wanted: impl Fn(char) -> bool) {
        let rest = self.rest();
        let length = rest.find(|c| !wanted(c)).unwrap_or(rest.len());
        steps::take(length);
        self.position += length;
    }

    fn span_from(&self, start: usize) -> Span {
        Span { file: self.file, start: start as u32, end: self.position as u32 }
    }

    /// Returns the text from the start of this token to the current position.
    fn read(&self) -> &'a str {
        steps::take(self.position - self.start);
        &self.text[self.start..self.position]
    }

    fn push(&mut self, kind: TokenKind) {
        self.tokens.push(Token {
            kind,
            span: self.span_from(self.start),
            separation: self.separation,
        });
        self.separation = Separation::SameLine;
    }

    fn push_fixed(&mut self, fixed: FixedToken) {
        if fixed.closing().is_some() {
            self.brackets.push(fixed);
        } else if matches!(
            fixed,
            FixedToken::CloseParen | FixedToken::CloseBracket | FixedToken::CloseBrace
        ) {
            self.brackets.pop();
        }
        self.push(TokenKind::Fixed(fixed));
    }

    /// Reports the text from the start of this token to the current position.
    fn report(&mut self, code: DiagnosticCode, message: impl Into<String>, help: &str) {
        self.diagnostics
            .push(Diagnostic::new(code, self.span_from(self.start), message).help(help));
    }

    /// Adds an edit to the last diagnostic, which replaces its source with `text`.
    fn suggest_edit(&mut self, text: &str) {
        if let Some(last) = self.diagnostics.pop() {
            let span = last.span;
            self.diagnostics.push(last.edit(span, text));
        }
    }

    /// Skips blanks, separators and comments, and records the kind of separator.
    fn skip_blanks(&mut self) {
        while let Some(next) = self.peek() {
            match next {
                ' ' | '\t' => {}
                '\r' if self.peek_after(1) == Some('\n') => {}
                '\r' => self.old_line_end(),
                '\n' => self.separation = self.separation.max(Separation::Newline),
                ';' => self.separation = Separation::Semicolon,
                '#' => {
                    self.eat_while(|c| !matches!(c, '\n' | '\r'));
                    continue;
                }
                _ => break,
            }
            self.position += 1;
        }
    }

    /// Handles a carriage return without a line feed as a newline. If it counted as a blank, a
    /// comment would swallow the rest of the file.
    fn old_line_end(&mut self) {
        self.separation = self.separation.max(Separation::Newline);
        if !std::mem::replace(&mut self.has_reported_line_ends, true) {
            let start = std::mem::replace(&mut self.start, self.position);
            self.position += 1;
            self.report(
                DiagnosticCode::UnknownCharacter,
                "a line ends with a carriage return alone",
                "save the file with the line ends of Unix or Windows",
            );
            self.position -= 1;
            self.start = start;
        }
    }

    fn word(&mut self) {
        self.eat_while(is_name_part);
        let word = self.read();
        if !word.is_ascii() {
            self.report(
                DiagnosticCode::UnknownCharacter,
                format!("`{word}` cannot be a name"),
                "names consist of the letters a to z, digits and `_`",
            );
        }
        let is_field =
            self.tokens.last().is_some_and(|t| t.kind == TokenKind::Fixed(FixedToken::Dot));
        if word == "include" && !is_field && self.include() {
            return;
        }
        match FixedToken::keyword(word) {
            Some(keyword) => self.push_fixed(keyword),
            None => self.push(TokenKind::Name(word.to_owned())),
        }
    }

    /// Reads the string after the word `include`. Returns false if no string follows.
    fn include(&mut self) -> bool {
        let (start, separation) = (self.start, self.separation);
        self.skip_blanks();
        let Some(quote @ ('"' | '\'')) = self.peek() else {
            (self.position, self.separation) = (start + "include".len(), separation);
            return false;
        };
        self.start = self.position;
        let errors = self.diagnostics.len();
        self.string(quote);
        let is_broken = self.diagnostics.len() > errors;
        if let Some(token) = self.tokens.last_mut()
            && let TokenKind::Str(path) = &mut token.kind
        {
            token.kind = match is_broken {
                true => TokenKind::Error,
                false => TokenKind::Include(std::mem::take(path)),
            };
            token.span.start = start as u32;
            token.separation = separation;
        }
        true
    }
}

fn is_name_start(c: char) -> bool {
    c == '_' || c.is_alphabetic()
}

/// Returns true for letters outside ASCII, too, so that the whole word can be reported.
fn is_name_part(c: char) -> bool {
    c == '_' || c.is_alphanumeric()
}
