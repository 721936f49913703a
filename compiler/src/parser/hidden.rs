//! Names that syntax errors hide: a name in source that could not be parsed may have uses or
//! definitions that the compiler does not know.

use std::collections::BTreeSet;
use std::ops::Range;

use crate::codes::DiagnosticCode;
use crate::diagnostic::{Diagnostic, Severity};
use crate::source::{FileId, SourceMap};
use crate::steps;
use crate::token::{FixedToken, Token, TokenKind};

/// The names that syntax errors hide. A script without syntax errors hides none.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Hidden {
    is_any: bool,
    /// True if a file could not be included, or the parser gave up. Any name may be defined in
    /// source that was not read.
    is_everything: bool,
    /// Names in statements and brackets that could not be parsed.
    lost: BTreeSet<String>,
    /// Names that the source defines somewhere. A missing bracket can move a definition to another
    /// function.
    defined: BTreeSet<String>,
}

impl Hidden {
    /// Returns true if the script has syntax errors.
    pub fn is_any(&self) -> bool {
        self.is_any
    }

    /// Returns true if the name may have uses that could not be parsed.
    pub fn is_lost(&self, name: &str) -> bool {
        self.is_everything || self.lost.contains(name)
    }

    /// Returns true if the name may have a definition that could not be parsed, or was parsed at
    /// the wrong place.
    pub fn may_define(&self, name: &str) -> bool {
        self.is_lost(name) || self.defined.contains(name)
    }

    /// Collects the names that the errors among `diagnostics` hide. `lost` are the tokens that
    /// could not be parsed.
    pub(super) fn find(
        tokens: &[Token],
        lost: &[Range<usize>],
        has_given_up: bool,
        sources: &SourceMap,
        diagnostics: &[Diagnostic],
    ) -> Hidden {
        let errors = || diagnostics.iter().filter(|found| found.severity() == Severity::Error);
        if errors().next().is_none() {
            return Hidden::default();
        }
        let mut hidden = Hidden {
            is_any: true,
            is_everything: has_given_up || errors().any(|error| hides_a_file(error, sources)),
            lost: BTreeSet::new(),
            defined: defined(tokens),
        };
        let lost = lost.iter().filter_map(|range| tokens.get(range.clone())).flatten();
        hidden.lost.extend(lost.filter_map(name).map(str::to_owned));
        for error in errors().filter(|error| error.code == DiagnosticCode::UnterminatedString) {
            let text = sources.file(error.span.file).text.get(error.span.start as usize..);
            let line = text.and_then(|text| text.lines().next()).unwrap_or_default();
            steps::take(line.len());
            hidden.lost.extend(words(line));
        }
        // A missing quote may have turned lines of code into a string.
        let strings = tokens.iter().filter(|token| matches!(token.kind, TokenKind::Str(_)));
        for text in strings.map(|token| sources.text(token.span)) {
            if text.contains('\n') {
                hidden.lost.extend(words(text));
            }
        }
        hidden.lost.extend(unfinished(tokens, sources));
        hidden
    }
}

fn words(text: &str) -> impl Iterator<Item = String> {
    text.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned)
}

fn name(token: &Token) -> Option<&str> {
    match &token.kind {
        TokenKind::Name(name) => Some(name),
        _ => None,
    }
}

/// The words of other languages for `include`.
const INCLUDE_WORDS: [&str; 5] = ["import", "require", "using", "use", "from"];

fn hides_a_file(error: &Diagnostic, sources: &SourceMap) -> bool {
    let is_import = error.code == DiagnosticCode::ForeignWord
        && INCLUDE_WORDS.contains(&sources.text(error.span));
    is_import
        || matches!(
            error.code,
            DiagnosticCode::IncludeNotFound
                | DiagnosticCode::IncludeMisplaced
                | DiagnosticCode::IncludeWithoutString
                | DiagnosticCode::FileUnreadable
                | DiagnosticCode::FileTooLarge
                | DiagnosticCode::FileNotUtf8
        )
}

/// Returns the name at the very end of the script, which the author may not have finished.
fn unfinished(tokens: &[Token], sources: &SourceMap) -> Option<String> {
    let last = tokens.iter().rev().find(|token| token.kind != TokenKind::FileEnd)?;
    let is_at_end = last.span.file == FileId::default()
        && last.span.end as usize == sources.file(last.span.file).text.len();
    name(last).filter(|_| is_at_end).map(str::to_owned)
}

/// Returns the names after `var` and `function`, those before `=`, and those of parameters.
fn defined(tokens: &[Token]) -> BTreeSet<String> {
    let mut names = BTreeSet::new();
    let mut is_in_parameters = false;
    let fixed = |token: &Token| match token.kind {
        TokenKind::Fixed(fixed) => Some(fixed),
        _ => None,
    };
    for (position, token) in tokens.iter().enumerate() {
        let before = position.checked_sub(1).and_then(|before| fixed(&tokens[before]));
        let following = tokens.get(position + 1).and_then(fixed);
        match fixed(token) {
            Some(FixedToken::Function) => is_in_parameters = true,
            Some(FixedToken::CloseParen | FixedToken::OpenBrace) => is_in_parameters = false,
            _ => {}
        }
        if let Some(name) = name(token)
            && (is_in_parameters
                || matches!(before, Some(FixedToken::Var))
                || matches!(following, Some(FixedToken::Assign)))
        {
            names.insert(name.to_owned());
        }
    }
    names
}
