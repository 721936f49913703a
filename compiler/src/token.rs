//! Tokens: the output of the lexer and the input of the parser.

use bittybuzz_vm_core::hash::{fnv_1a, fnv_1a_from};

use crate::source::Span;

/// The separation between a token and the one before it, apart from blanks and comments.
///
/// To the grammar a newline and a `;` mean nothing; they matter only to warnings and to a bare
/// `return`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Separation {
    /// Both tokens are on one line.
    SameLine,
    /// At least one newline.
    Newline,
    /// At least one `;`, perhaps newlines too.
    Semicolon,
}

/// One token with its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Token {
    pub kind: TokenKind,
    /// The place in the source.
    pub span: Span,
    /// The separation from the token before it.
    pub separation: Separation,
}

impl Token {
    /// Returns true if a newline or a `;` stands before this token.
    pub fn is_separated(&self) -> bool {
        self.separation != Separation::SameLine
    }
}

/// The kinds of tokens, with the value of those that have one.
#[derive(Debug, Clone, PartialEq)]
pub enum TokenKind {
    /// An identifier.
    Name(String),
    /// An integer literal, without sign.
    Int(i64),
    /// A float literal, without sign.
    Float(f64),
    /// A string literal with its escapes resolved.
    Str(String),
    /// A keyword, an operator or a bracket.
    Fixed(FixedToken),
    /// `include "path"`. The loader replaces it by [`TokenKind::FileStart`] ...
    /// [`TokenKind::FileEnd`].
    Include(String),
    /// The start of an included file. Its tokens follow, up to its [`TokenKind::FileEnd`].
    FileStart,
    /// The end of a file: an included one, or the script.
    FileEnd,
    /// A placeholder for source in which the lexer reported an error and found no usable token.
    Error,
}

macro_rules! fixed_tokens {
    ($($variant:ident = $text:literal,)*) => {
        /// The tokens that are always spelled the same.
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum FixedToken { $(#[doc = concat!("`", $text, "`")] $variant,)* }

        impl FixedToken {
            /// Returns the form in a script.
            pub fn text(self) -> &'static str {
                match self { $(FixedToken::$variant => $text,)* }
            }
        }
    };
}

fixed_tokens! {
    Var = "var",
    If = "if",
    Else = "else",
    Function = "function",
    Return = "return",
    For = "for",
    While = "while",
    And = "and",
    Or = "or",
    Not = "not",
    Nil = "nil",
    Plus = "+",
    Minus = "-",
    Star = "*",
    Slash = "/",
    Percent = "%",
    Caret = "^",
    Ampersand = "&",
    Pipe = "|",
    Bang = "!",
    ShiftLeft = "<<",
    ShiftRight = ">>",
    Equal = "==",
    NotEqual = "!=",
    Less = "<",
    LessEqual = "<=",
    Greater = ">",
    GreaterEqual = ">=",
    Assign = "=",
    Dot = ".",
    Comma = ",",
    OpenParen = "(",
    CloseParen = ")",
    OpenBracket = "[",
    CloseBracket = "]",
    OpenBrace = "{",
    CloseBrace = "}",
}

/// Every keyword; `include` is not one, it is special only before a string.
pub const KEYWORDS: [FixedToken; 11] = [
    FixedToken::Var,
    FixedToken::If,
    FixedToken::Else,
    FixedToken::Function,
    FixedToken::Return,
    FixedToken::For,
    FixedToken::While,
    FixedToken::And,
    FixedToken::Or,
    FixedToken::Not,
    FixedToken::Nil,
];

impl FixedToken {
    /// Returns the keyword that `word` spells.
    pub fn keyword(word: &str) -> Option<FixedToken> {
        KEYWORDS.into_iter().find(|keyword| keyword.text() == word)
    }

    /// Returns true for `var`, `if`, `and` and all other keywords.
    pub fn is_keyword(self) -> bool {
        KEYWORDS.contains(&self)
    }

    /// Returns the bracket that closes this one.
    pub fn closing(self) -> Option<FixedToken> {
        match self {
            FixedToken::OpenParen => Some(FixedToken::CloseParen),
            FixedToken::OpenBracket => Some(FixedToken::CloseBracket),
            FixedToken::OpenBrace => Some(FixedToken::CloseBrace),
            _ => None,
        }
    }
}

impl TokenKind {
    /// Returns true for a token that ends an expression, so that a `.` after it selects a field.
    pub fn ends_value(&self) -> bool {
        match self {
            TokenKind::Name(_) | TokenKind::Int(_) | TokenKind::Float(_) | TokenKind::Str(_) => {
                true
            }
            TokenKind::Fixed(fixed) => matches!(
                fixed,
                FixedToken::CloseParen
                    | FixedToken::CloseBracket
                    | FixedToken::CloseBrace
                    | FixedToken::Nil
            ),
            _ => false,
        }
    }

    /// Returns the name of this token in messages.
    pub fn describe(&self) -> String {
        match self {
            TokenKind::Name(name) => format!("`{name}`"),
            TokenKind::Int(value) => format!("the number `{value}`"),
            TokenKind::Float(value) => format!("the number `{value:?}`"),
            TokenKind::Str(_) => "a string".to_owned(),
            TokenKind::Fixed(fixed) if fixed.is_keyword() => {
                format!("the keyword `{}`", fixed.text())
            }
            TokenKind::Fixed(fixed) => format!("`{}`", fixed.text()),
            TokenKind::Include(_) | TokenKind::FileStart => "an `include`".to_owned(),
            TokenKind::FileEnd => "the end of the file".to_owned(),
            TokenKind::Error => "something unreadable".to_owned(),
        }
    }
}

/// Returns the FNV-1a hash of the tokens' kinds and values. Scripts have equal hashes if they
/// differ only in layout, comments, file names or their division into included files.
///
/// The hash includes a `;` after `return`, the only separator that changes the meaning of a script.
pub fn hash_tokens(tokens: &[Token]) -> u32 {
    let mut hash = fnv_1a(&[]);
    let mut after_return = false;
    for token in tokens {
        if after_return && token.separation == Separation::Semicolon {
            hash = fnv_1a_from(hash, b";");
        }
        after_return = token.kind == TokenKind::Fixed(FixedToken::Return);
        hash = match &token.kind {
            TokenKind::Name(name) => tagged(hash, 1, name.as_bytes()),
            TokenKind::Int(value) => tagged(hash, 2, &value.to_le_bytes()),
            TokenKind::Float(value) => tagged(hash, 3, &value.to_bits().to_le_bytes()),
            TokenKind::Str(text) => tagged(hash, 4, text.as_bytes()),
            TokenKind::Fixed(fixed) => tagged(hash, 5, fixed.text().as_bytes()),
            TokenKind::Include(_)
            | TokenKind::FileStart
            | TokenKind::FileEnd
            | TokenKind::Error => hash,
        };
    }
    hash
}

/// Continues a hash with a value. The length separates neighboring values: `"ab" "c"` is not `"a"
/// "bc"`.
fn tagged(hash: u32, tag: u8, bytes: &[u8]) -> u32 {
    let hash = fnv_1a_from(hash, &[tag]);
    let hash = fnv_1a_from(hash, &(bytes.len() as u32).to_le_bytes());
    fnv_1a_from(hash, bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keywords_are_those_of_the_language() {
        let words = "var if else function return for while and or not nil";
        assert_eq!(KEYWORDS.map(FixedToken::text).join(" "), words);
        for word in words.split(' ') {
            assert_eq!(FixedToken::keyword(word).map(FixedToken::text), Some(word));
        }
        assert_eq!(FixedToken::keyword("include"), None);
    }
}
