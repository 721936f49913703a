//! The parser: turns tokens into the syntax tree, by recursive descent.
//!
//! A function that reported an error returns `Err(Reported)`. Brackets catch it and continue after
//! their closing bracket. The statement list catches all other errors and continues at the next
//! statement. Therefore one mistake gives one message, and one run finds many mistakes.

mod alone;
mod brackets;
mod consequences;
mod expression;
mod function;
mod grouping;
mod hidden;
mod loops;
mod operand;
mod recovery;
mod statement;
mod words;

use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

use crate::ast::{Expr, ExprKind, Script};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::include::{IncludeLoader, Loaded, load_again, load_file, load_text};
use crate::source::{SourceMap, Span};
use crate::steps;
use crate::token::{FixedToken, Token, TokenKind, hash_tokens};
pub use alone::{Alone, parse_alone};
use brackets::Brackets;
pub use hidden::Hidden;

/// The maximum depth of nested expressions, blocks and includes, and the maximum height of the
/// syntax tree, on which recursive walks of the tree rely. People do not write scripts that deep,
/// and the depth that overflows a thread's stack is far greater.
pub const NESTING_MAX: u32 = 200;

/// The result of the front end for a script.
#[derive(Debug, Clone, Default)]
pub struct Parsed {
    /// The syntax tree, as far as it could be built.
    pub script: Script,
    /// The script and everything that it includes.
    pub sources: SourceMap,
    /// The diagnostics, sorted by file and position.
    pub diagnostics: Vec<Diagnostic>,
    /// Hash of the tokens after includes, see [`hash_tokens`].
    pub token_hash: u32,
    /// All string literals and names of fields: the strings of the script, sorted by text.
    pub strings: BTreeSet<String>,
    /// Names that may be defined or used in source with syntax errors.
    pub hidden: Hidden,
}

impl Parsed {
    /// Returns true if there is an error among the diagnostics, not only warnings.
    pub fn has_errors(&self) -> bool {
        use crate::diagnostic::Severity;
        self.diagnostics.iter().any(|d| d.severity() == Severity::Error)
    }
}

/// Parses the script `text`; `main` is its path, relative to which includes are searched.
pub fn parse(main: &Path, text: String, loader: &IncludeLoader) -> Parsed {
    parse_loaded(load_text(main, text, loader))
}

/// Reads and parses the script at `main`.
pub fn parse_file(main: &Path, loader: &IncludeLoader) -> Parsed {
    parse_loaded(load_file(main, loader))
}

/// Parses a script again, with everything that it includes.
pub fn parse_again(sources: SourceMap) -> Parsed {
    parse_loaded(load_again(sources))
}

fn parse_loaded(loaded: Loaded) -> Parsed {
    let Loaded { tokens, sources, mut diagnostics } = loaded;
    let token_hash = hash_tokens(&tokens);
    let mut parser = Parser::new(&tokens, &sources);
    let script = Script { stmts: parser.statements(false) };
    let (strings, lost, gave_up) = (parser.strings, parser.lost, parser.gave_up);
    // An unterminated string has swallowed the rest of its line, including brackets.
    parser.diagnostics.retain(|found| {
        let swallowed = |string: &Diagnostic| {
            let range = string.span.start as usize..found.span.start as usize;
            string.code == DiagnosticCode::UnterminatedString
                && string.span.file == found.span.file
                && sources.file(found.span.file).text.get(range).is_some_and(|t| !t.contains('\n'))
        };
        found.code != DiagnosticCode::UnclosedBracket || !diagnostics.iter().any(swallowed)
    });
    diagnostics.append(&mut parser.diagnostics);
    diagnostics.sort_by_key(|diagnostic| (diagnostic.span.file, diagnostic.span.start));
    consequences::remove(&mut diagnostics, &tokens, &lost, &sources);
    let hidden = Hidden::find(&tokens, &lost, gave_up, &sources, &diagnostics);
    Parsed { script, sources, diagnostics, token_hash, strings, hidden }
}

/// Proof that a diagnostic was issued for text that could not be parsed.
#[derive(Debug, Clone, Copy)]
struct Reported;

type Parse<T> = Result<T, Reported>;

struct Parser<'a> {
    /// The tokens to parse. There is at least one; the last one is [`TokenKind::FileEnd`] and is
    /// never consumed.
    tokens: &'a [Token],
    sources: &'a SourceMap,
    brackets: Brackets,
    position: usize,
    diagnostics: Vec<Diagnostic>,
    /// Position of the token at the last error. A second error at one token is a consequence of the
    /// first.
    last_error: Option<usize>,
    /// Set by an error after which no other message would help.
    gave_up: bool,
    /// The number of open levels.
    depth: u32,
    /// The height of the tree built so far inside the innermost level.
    height: u32,
    /// Token positions of the open brackets, including those of statement blocks.
    open: Vec<usize>,
    /// The number of open statement blocks.
    blocks: u32,
    strings: BTreeSet<String>,
    /// Ranges of tokens that could not be parsed.
    lost: Vec<Range<usize>>,
}

impl<'a> Parser<'a> {
    fn new(tokens: &'a [Token], sources: &'a SourceMap) -> Self {
        Parser {
            tokens,
            sources,
            brackets: Brackets::new(tokens),
            position: 0,
            diagnostics: Vec::new(),
            last_error: None,
            gave_up: false,
            depth: 0,
            height: 0,
            open: Vec::new(),
            blocks: 0,
            strings: BTreeSet::new(),
            lost: Vec::new(),
        }
    }

    fn token(&self) -> &'a Token {
        self.token_at(self.position)
    }

    /// Returns the token at `position`, or the final one for every position after it.
    fn token_at(&self, position: usize) -> &'a Token {
        steps::take(1);
        let token = self.tokens.get(position).or(self.tokens.last());
        token.expect("the lexer ends every file with `FileEnd`")
    }

    fn kind(&self) -> &'a TokenKind {
        &self.token().kind
    }

    /// Returns the keyword, operator or bracket at the current position, if there is one.
    fn fixed(&self) -> Option<FixedToken> {
        self.fixed_at(self.position)
    }

    fn fixed_at(&self, position: usize) -> Option<FixedToken> {
        match self.token_at(position).kind {
            TokenKind::Fixed(fixed) => Some(fixed),
            _ => None,
        }
    }

    fn name_at(&self, position: usize) -> Option<&'a str> {
        match &self.token_at(position).kind {
            TokenKind::Name(name) => Some(name),
            _ => None,
        }
    }

    fn at(&self, fixed: FixedToken) -> bool {
        self.fixed() == Some(fixed)
    }

    fn at_end(&self) -> bool {
        *self.kind() == TokenKind::FileEnd
    }

    /// Returns the current token and moves past it.
    fn advance(&mut self) -> &'a Token {
        let token = self.token();
        if self.position + 1 < self.tokens.len() {
            self.position += 1;
        }
        token
    }

    fn eat(&mut self, fixed: FixedToken) -> bool {
        let found = self.at(fixed);
        if found {
            self.advance();
        }
        found
    }

    fn span(&self) -> Span {
        self.token().span
    }

    /// Returns the token before the current one, or the current one if it is the first.
    fn previous(&self) -> &'a Token {
        self.token_at(self.position.saturating_sub(1))
    }

    /// Returns the span from `start` to the last token that was consumed.
    fn span_since(&self, start: Span) -> Span {
        start.to(self.previous().span)
    }

    /// Returns true inside the parentheses, brackets or braces of an expression, where no statement
    /// can begin.
    fn is_enclosed(&self) -> bool {
        self.open.last().is_some_and(|open| !self.brackets.is_block(*open))
    }

    /// Parses one level deeper.
    fn nested<T>(&mut self, parse: impl FnOnce(&mut Self) -> Parse<T>) -> Parse<T> {
        if self.depth >= NESTING_MAX {
            return Err(self.too_deep());
        }
        self.depth += 1;
        let outside = std::mem::take(&mut self.height);
        let result = parse(self);
        self.height = outside.max(self.height + 1);
        self.depth -= 1;
        result
    }

    /// Accounts for a node on top of a tree of that height. `a + b + c` needs no recursion to
    /// parse, but makes a tree that grows with every operator.
    fn grow(&mut self, height: u32) -> Parse<()> {
        self.height = self.height.max(height + 1);
        if self.height + self.depth > NESTING_MAX { Err(self.too_deep()) } else { Ok(()) }
    }

    fn too_deep(&mut self) -> Reported {
        let message = format!("this is nested more than {NESTING_MAX} levels deep");
        let diagnostic = Diagnostic::new(DiagnosticCode::NestingTooDeep, self.span(), message)
            .help("give a part of it a name: store it in a variable, or make a function of it");
        let reported = self.report(diagnostic);
        // Such a script is most likely generated, so errors about the rest would not help.
        self.gave_up = true;
        self.position = self.tokens.len().saturating_sub(1);
        reported
    }

    fn expr(&self, kind: ExprKind, start: Span) -> Expr {
        Expr { kind, span: self.span_since(start) }
    }
}
