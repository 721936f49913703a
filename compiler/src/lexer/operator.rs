//! Reads operators and brackets, including operators of other languages.

use super::Lexer;
use crate::codes::DiagnosticCode;
use crate::steps;
use crate::token::{FixedToken, TokenKind};

/// The operators. A longer operator precedes those that it starts with.
const OPERATORS: [FixedToken; 26] = [
    FixedToken::ShiftLeft,
    FixedToken::ShiftRight,
    FixedToken::Equal,
    FixedToken::NotEqual,
    FixedToken::LessEqual,
    FixedToken::GreaterEqual,
    FixedToken::Less,
    FixedToken::Greater,
    FixedToken::Plus,
    FixedToken::Minus,
    FixedToken::Star,
    FixedToken::Slash,
    FixedToken::Percent,
    FixedToken::Caret,
    FixedToken::Ampersand,
    FixedToken::Pipe,
    FixedToken::Bang,
    FixedToken::Assign,
    FixedToken::Dot,
    FixedToken::Comma,
    FixedToken::OpenParen,
    FixedToken::CloseParen,
    FixedToken::OpenBracket,
    FixedToken::CloseBracket,
    FixedToken::OpenBrace,
    FixedToken::CloseBrace,
];

/// Operators of other languages, with their likely meaning and help. None of these sequences can
/// occur in a correct script. A longer sequence precedes those that it starts with.
const FOREIGN: [(&str, FixedToken, &str); 22] = [
    ("===", FixedToken::Equal, "equality is `==`"),
    ("!==", FixedToken::NotEqual, "inequality is `!=`"),
    ("<<=", FixedToken::Assign, "write `x = x << ...`"),
    (">>=", FixedToken::Assign, "write `x = x >> ...`"),
    ("&&", FixedToken::And, "the logical operator is the word `and`"),
    ("||", FixedToken::Or, "the logical operator is the word `or`"),
    ("**", FixedToken::Caret, "the power operator is `^`"),
    ("~=", FixedToken::NotEqual, "inequality is `!=`"),
    ("<>", FixedToken::NotEqual, "inequality is `!=`"),
    ("=<", FixedToken::LessEqual, "less or equal is `<=`"),
    (
        "=>",
        FixedToken::GreaterEqual,
        "a lambda is written `function(x) { return ... }`; greater or equal is `>=`",
    ),
    (":=", FixedToken::Assign, "assignment is `=`"),
    ("+=", FixedToken::Assign, "write `x = x + ...`"),
    ("-=", FixedToken::Assign, "write `x = x - ...`"),
    ("*=", FixedToken::Assign, "write `x = x * ...`"),
    ("/=", FixedToken::Assign, "write `x = x / ...`"),
    ("%=", FixedToken::Assign, "write `x = x % ...`"),
    ("^=", FixedToken::Assign, "write `x = x ^ ...`"),
    ("&=", FixedToken::Assign, "write `x = x & ...`"),
    ("|=", FixedToken::Assign, "write `x = x | ...`"),
    (
        "..",
        FixedToken::Plus,
        "`log` joins its arguments; in the profile `full`, `string.concat(a, b)` joins strings",
    ),
    ("~", FixedToken::Bang, "the bitwise not is `!`"),
];

/// Signs of typography and mathematics, with the operators that they look like.
const LOOKALIKES: [(char, FixedToken); 9] = [
    ('−', FixedToken::Minus),
    ('–', FixedToken::Minus),
    ('—', FixedToken::Minus),
    ('×', FixedToken::Star),
    ('·', FixedToken::Star),
    ('÷', FixedToken::Slash),
    ('≤', FixedToken::LessEqual),
    ('≥', FixedToken::GreaterEqual),
    ('≠', FixedToken::NotEqual),
];

/// Quotes by which word processors replace `"` and `'`.
const TYPOGRAPHIC_QUOTES: [char; 8] = ['“', '”', '„', '‘', '’', '‚', '«', '»'];

impl Lexer<'_> {
    pub(super) fn operator(&mut self, next: char) {
        if self.foreign_comment() || self.foreign_operator() {
            return;
        }
        if TYPOGRAPHIC_QUOTES.contains(&next) {
            return self.typographic_string();
        }
        if next == ':' && self.is_method_colon() {
            self.advance();
            self.report(
                DiagnosticCode::UnknownCharacter,
                "the character `:` means nothing in Buzz",
                "a function in a table is called with a dot: `t.f(1)`",
            );
            self.suggest_edit(".");
            return self.push_fixed(FixedToken::Dot);
        }
        if let Some((_, meant)) = LOOKALIKES.into_iter().find(|(sign, _)| *sign == next) {
            self.advance();
            let help = format!("write `{}`", meant.text());
            let message = format!("the character `{next}` means nothing in Buzz");
            self.report(DiagnosticCode::UnknownCharacter, message, &help);
            self.suggest_edit(meant.text());
            return self.push_fixed(meant);
        }
        match OPERATORS.into_iter().find(|operator| self.eat(operator.text())) {
            Some(operator) => self.push_fixed(operator),
            None => self.unknown(),
        }
    }

    /// Returns true at the colon of `t:f(1)`, a call of a method in Lua.
    fn is_method_colon(&self) -> bool {
        let before = self.text[..self.position].chars().next_back();
        let after = self.rest().get(1..).unwrap_or_default();
        let name = after.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(0);
        steps::take(name);
        before.is_some_and(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | ')' | ']'))
            && after.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && after.get(name..).is_some_and(|rest| rest.starts_with('('))
    }

    fn foreign_comment(&mut self) -> bool {
        let is_line = self.eat("//");
        if !is_line && !self.eat("/*") {
            return false;
        }
        let end = if is_line || self.endless_comment {
            None
        } else {
            let end = self.rest().find("*/");
            steps::take(end.unwrap_or(self.rest().len()));
            end
        };
        match end {
            Some(end) => self.position += end + 2,
            None => self.eat_while(|c| c != '\n'),
        }
        // The search for `*/` is not repeated after it failed once, because repeated searches would
        // take quadratic time.
        self.endless_comment |= !is_line && end.is_none();
        // The first two characters are marked, because a comment of many lines would hide the
        // message.
        let end = self.position;
        self.position = self.start + 2;
        self.report(
            DiagnosticCode::ForeignComment,
            format!("`{}` does not start a comment", self.read()),
            "a comment starts with `#` and goes to the end of the line; \
             a division of integers is `/`",
        );
        if is_line {
            self.suggest_edit("#");
        }
        self.position = end;
        true
    }

    fn foreign_operator(&mut self) -> bool {
        let Some((text, meant, help)) = FOREIGN.into_iter().find(|(text, ..)| self.eat(text))
        else {
            return false;
        };
        self.report(
            DiagnosticCode::ForeignOperator,
            format!("Buzz has no operator `{text}`"),
            help,
        );
        // `a .. b` and `x => x` need more than another operator, so there is no edit.
        let is_one_sign = meant != FixedToken::Assign && meant != FixedToken::Plus && text != "=>";
        if is_one_sign || text == ":=" {
            self.suggest_edit(meant.text());
        } else if meant == FixedToken::Assign
            && let Some(operator) = text.strip_suffix('=')
            && let Some(target) = self.target_of_compound(operator)
        {
            self.suggest_edit(&format!("= {target} {operator}"));
        }
        self.push_fixed(meant);
        true
    }

    /// Returns the variable or field of `x += 1`, if it is the whole beginning of the line and if `x = x + 1`
    /// means the same: of `x -= a + b` it would not.
    fn target_of_compound(&self, operator: &str) -> Option<String> {
        let before = self.text[..self.start].rsplit('\n').next()?.trim();
        let after = self.rest().split(['\n', '#', ';', '}']).next()?.trim();
        steps::take(before.len() + after.len());
        let is_simple = |text: &str, more: &[char]| {
            let fits = |c: char| c.is_ascii_alphanumeric() || c == '_' || more.contains(&c);
            !text.is_empty() && text.chars().all(fits)
        };
        let is_sum = operator == "+" && !after.contains([',', '?', ':', '<', '>', '=', '&', '|']);
        (is_simple(before, &['.']) && (is_sum || is_simple(after, &['.'])))
            .then(|| before.to_owned())
    }

    /// Reads everything up to the next quote on the line as a string.
    fn typographic_string(&mut self) {
        let opening = self.advance().expect("a quote was found here");
        let content_start = self.position;
        let is_quote = |c| TYPOGRAPHIC_QUOTES.contains(&c) || matches!(c, '"' | '\'');
        self.eat_while(|c| c != '\n' && !is_quote(c));
        let content = &self.text[content_start..self.position];
        let closed = self.peek().is_some_and(is_quote);
        if closed {
            self.advance();
        } else {
            self.position = content_start;
        }
        self.report(
            DiagnosticCode::TypographicQuote,
            format!("`{opening}` does not begin a string"),
            "strings stand in straight quotes, `\"` or `'`",
        );
        if closed {
            self.suggest_edit(&format!("\"{content}\""));
        }
        self.push(if closed { TokenKind::Str(content.to_owned()) } else { TokenKind::Error });
    }

    /// Reports consecutive unknown characters as one error.
    fn unknown(&mut self) {
        let first = self.advance().expect("an unknown character was found here");
        self.eat_while(is_unknown);
        let text = self.read();
        let several = text.chars().nth(1).is_some();
        let message = if first.is_control() || first.is_whitespace() || is_invisible(first) {
            format!("the character U+{:04X} cannot stand here", u32::from(first))
        } else if several {
            format!("the characters `{}` mean nothing in Buzz", shorten(text))
        } else {
            format!("the character `{first}` means nothing in Buzz")
        };
        let help = match first {
            '?' => "Buzz has no `? :`; use `if(condition) ... else ...`",
            ':' => "a table is written `{.name = value}`, and blocks stand in braces",
            '`' => "strings stand in straight quotes, `\"` or `'`",
            '@' | '$' => "names consist of the letters a to z, digits and `_`",
            '\\' => "a statement may go on over the end of a line without a sign for it",
            c if c.is_whitespace() || is_invisible(c) => "use ordinary spaces",
            _ => "remove it, or put it in quotes if it belongs to a text",
        };
        self.report(DiagnosticCode::UnknownCharacter, message, help);
        // Unusual blanks separate tokens like spaces, without an error token.
        if !text.chars().all(|c| c.is_whitespace() || is_invisible(c)) {
            self.push(TokenKind::Error);
        }
    }
}

/// Returns true for characters that neither begin nor separate tokens.
fn is_unknown(c: char) -> bool {
    match c {
        ' ' | '\t' | '\r' | '\n' | ';' | '#' | '"' | '\'' | '_' | '~' => false,
        _ if c.is_alphabetic() || c.is_ascii_digit() => false,
        _ if TYPOGRAPHIC_QUOTES.contains(&c) => false,
        _ if LOOKALIKES.iter().any(|(sign, _)| *sign == c) => false,
        _ => !OPERATORS.into_iter().any(|operator| operator.text().starts_with(c)),
    }
}

/// Returns true for zero-width characters and the like, which often occur in text that is copied
/// from a web page.
fn is_invisible(c: char) -> bool {
    matches!(c, '\u{200b}'..='\u{200f}' | '\u{2060}' | '\u{feff}' | '\u{ad}')
}

/// Returns the first characters of a long text.
fn shorten(text: &str) -> String {
    const SHOWN: usize = 12;
    let mut shown: String =
        text.chars().take(SHOWN).map(|c| if c.is_control() { '?' } else { c }).collect();
    if text.chars().nth(SHOWN).is_some() {
        shown.push('…');
    }
    shown
}
