//! Finds words that are keywords in other languages, and misspelt keywords.
//!
//! In Buzz these words are ordinary names, so the parser tests for them only in statements that are
//! errors anyway.

use super::{Parse, Parser, Reported};
use crate::ast::{Expr, ExprKind};
use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::token::{FixedToken, KEYWORDS, TokenKind};

/// Help about words that stand for one keyword, and that keyword.
const DECLARES: (&str, &str) = ("a variable is declared with `var`", "var");
const DEFINES: (&str, &str) =
    ("a function is defined with `function name(...) { ... }`", "function");
const INCLUDES: (&str, &str) = ("write `include \"file.bzz\"`", "include");

/// Returns Buzz's counterpart of a word from another language.
fn instead_of(word: &str) -> Option<&'static str> {
    Some(match word {
        "elseif" | "elif" | "elsif" => "write `else if(...)`",
        "break" | "continue" => {
            "leave a loop by its condition, or put it into a function and `return`"
        }
        "do" => "a loop is written `while(condition) { ... }`, and blocks stand in braces",
        "then" | "end" | "begin" | "endif" | "done" => "blocks stand in braces: `{ ... }`",
        "local" | "let" | "const" | "int" | "float" | "double" | "char" | "bool" | "auto"
        | "uint8_t" | "int16_t" | "string" => DECLARES.0,
        "def" | "func" | "fn" | "fun" | "void" | "proc" | "sub" => DEFINES.0,
        "pass" => "write `{}` for a block that does nothing",
        "switch" | "case" | "default" | "match" | "unless" => "use `if` and `else if`",
        "foreach" => "`foreach` is a function: `foreach(t, function(key, value) { ... })`",
        "repeat" | "until" | "loop" => "the loops of Buzz are `while` and `for`",
        "import" | "require" | "using" | "use" => INCLUDES.0,
        "class" | "struct" | "enum" => "use a table: `t = {.x = 1}`",
        "try" | "catch" | "throw" | "raise" => {
            "a script cannot catch errors; check values before you use them"
        }
        "global" | "nonlocal" | "static" | "public" | "private" => {
            "a variable without `var` is global"
        }
        _ => return None,
    })
}

/// Returns the keyword that `word` most likely stands for.
fn misspelt_keyword(word: &str) -> Option<&'static str> {
    let words = KEYWORDS.into_iter().map(FixedToken::text).chain(["include"]);
    let lower = word.to_ascii_lowercase();
    words
        .map(|keyword| (strsim::osa_distance(&lower, keyword), keyword))
        .min()
        .filter(|(distance, keyword)| {
            *distance == 0 || (*distance <= 2 && *distance * 3 < keyword.len() + 1)
        })
        .map(|(_, keyword)| keyword)
}

impl Parser<'_> {
    /// Reports `elseif` after the block of an `if`, and skips it.
    pub(super) fn foreign_else_if(&mut self) -> bool {
        let Some(word @ ("elseif" | "elif" | "elsif")) = self.name_at(self.position) else {
            return false;
        };
        if self.fixed_at(self.position + 1) != Some(FixedToken::OpenParen) {
            return false;
        }
        let diagnostic = Diagnostic::new(
            DiagnosticCode::ForeignWord,
            self.span(),
            format!("Buzz has no `{word}`"),
        )
        .help("write `else if(...)`")
        .edit(self.span(), "else if");
        self.complain(diagnostic);
        self.advance();
        true
    }

    /// Reports a call that was meant as a statement of another language: `switch(x) { ... }`,
    /// `include("file.bzz")`.
    pub(super) fn reject_foreign_call(&mut self, call: &Expr) -> Parse<()> {
        let ExprKind::Call { callee, args } = &call.kind else { return Ok(()) };
        let ExprKind::Name(name) = &callee.kind else { return Ok(()) };
        if let ("include", [Expr { kind: ExprKind::Str(path), .. }]) = (&**name, args.as_slice()) {
            let diagnostic = Diagnostic::new(
                DiagnosticCode::IncludeWithoutString,
                call.span,
                "the file name of an include stands without parentheses",
            )
            .help(format!("write `include \"{path}\"`"))
            .edit(call.span, format!("include \"{path}\""));
            self.complain(diagnostic);
            return Ok(());
        }
        if !self.at(FixedToken::OpenBrace) || self.token().is_separated() {
            return Ok(());
        }
        let message = format!("`{name}` begins no statement in Buzz");
        let diagnostic = Diagnostic::new(DiagnosticCode::ForeignWord, callee.span, message);
        let Some(diagnostic) = explained(diagnostic, name, true) else { return Ok(()) };
        let reported = self.report(diagnostic);
        let opening = self.position;
        if matches!(&**name, "switch" | "match") {
            // Nothing in it is a statement of Buzz.
            self.open();
            self.skip_to_closing();
            self.lose(opening);
        } else {
            // The block is parsed to find more errors in it.
            let _ = self.block();
        }
        Err(reported)
    }

    /// Skips what follows a word of another language that was reported: the block and the condition of
    /// `do { ... } while(...)`.
    fn skip_foreign_loop(&mut self) {
        if !self.at(FixedToken::OpenBrace) || self.block().is_err() {
            return;
        }
        if self.eat(FixedToken::While) && self.at(FixedToken::OpenParen) {
            self.open();
            self.skip_to_closing();
        }
    }

    /// Returns the operator of Buzz for a word between two values, such as `mod`.
    pub(super) fn operator_word(&self) -> Option<Diagnostic> {
        self.operator_word_at(self.position)
    }

    fn operator_word_at(&self, position: usize) -> Option<Diagnostic> {
        let word = self.name_at(position)?;
        let (operator, help) = match word {
            "mod" => ("%", "the remainder of a division is `%`"),
            "div" => ("/", "a division of integers is `/`"),
            "is" | "equals" => ("==", "equality is `==`"),
            _ => return None,
        };
        let (before, word_at) = (self.token_at(position.checked_sub(1)?), self.token_at(position));
        let is_between = before.kind.ends_value()
            && !word_at.is_separated()
            && !self.token_at(position + 1).is_separated();
        let message = format!("Buzz has no operator `{word}`");
        let span = word_at.span;
        let diagnostic = Diagnostic::new(DiagnosticCode::ForeignOperator, span, message);
        is_between.then(|| diagnostic.help(help).edit(span, operator))
    }

    /// Reports a name, or a field of a table, that is neither called nor assigned.
    pub(super) fn lone_name(&mut self, value: &Expr) -> Reported {
        let written = self.sources.text(value.span).to_owned();
        let next = self.token();
        let same_line = !next.is_separated();
        if self.at(FixedToken::Comma) && !self.is_enclosed() {
            let diagnostic = self
                .unexpected("`=` or a call")
                .help("only one variable can be assigned at a time: `a = 1` and then `b = 2`");
            return self.report(diagnostic);
        }
        if let ExprKind::Name(name) = &value.kind {
            if name == "include" {
                let diagnostic = Diagnostic::new(
                    DiagnosticCode::IncludeWithoutString,
                    value.span,
                    "expected the name of a file in quotes after `include`",
                )
                .help("write `include \"file.bzz\"`");
                return self.report(diagnostic);
            }
            let goes_on = matches!(
                next.kind,
                TokenKind::Name(_)
                    | TokenKind::Int(_)
                    | TokenKind::Float(_)
                    | TokenKind::Str(_)
                    | TokenKind::Fixed(FixedToken::OpenBrace | FixedToken::Function)
            );
            let message = format!("`{name}` is no keyword of Buzz");
            let diagnostic = Diagnostic::new(DiagnosticCode::ForeignWord, value.span, message);
            if let Some(diagnostic) = explained(diagnostic, name, same_line && goes_on) {
                let reported = self.report(diagnostic);
                if name == "do" {
                    self.skip_foreign_loop();
                }
                return reported;
            }
            if let Some(diagnostic) = self.operator_word_at(self.start_of(value)) {
                return self.report(diagnostic);
            }
        }
        let before = self.token_at(self.start_of(value).saturating_sub(1));
        let follows_number = matches!(before.kind, TokenKind::Int(_) | TokenKind::Float(_))
            && before.span.file == value.span.file
            && before.span.end == value.span.start;
        let help = if follows_number {
            "a letter cannot follow a number; a product is written with `*`".to_owned()
        } else {
            format!("call it: `{written}()`, or assign to it: `{written} = ...`")
        };
        let message = format!("`{written}` stands alone: it is neither called nor assigned");
        let diagnostic = Diagnostic::new(DiagnosticCode::ValueAsStatement, value.span, message);
        self.report(diagnostic.help(help))
    }

    /// Returns the position of the first token of `value`, which ends directly before the current
    /// token.
    fn start_of(&self, value: &Expr) -> usize {
        let mut position = self.position;
        while position > 0 && self.token_at(position).span.start > value.span.start {
            position -= 1;
        }
        position
    }
}

/// Adds help to a diagnostic about a word that cannot begin a statement; `None` if there is none. The
/// word may be a misspelt keyword.
fn explained(diagnostic: Diagnostic, word: &str, may_be_keyword: bool) -> Option<Diagnostic> {
    if let Some(help) = instead_of(word) {
        let keyword = [DECLARES, DEFINES, INCLUDES].into_iter().find(|(known, _)| *known == help);
        let span = diagnostic.span;
        let diagnostic = diagnostic.help(help);
        return Some(match keyword.filter(|_| may_be_keyword) {
            Some((_, keyword)) => diagnostic.guess(span, keyword),
            None => diagnostic,
        });
    }
    let keyword = misspelt_keyword(word).filter(|_| may_be_keyword)?;
    let span = diagnostic.span;
    Some(diagnostic.help(format!("did you mean `{keyword}`?")).guess(span, keyword))
}
