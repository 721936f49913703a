//! Removes errors that follow from an earlier one: a mistake is reported once.

use std::ops::Range;

use crate::codes::DiagnosticCode;
use crate::diagnostic::{Diagnostic, Severity};
use crate::source::{SourceMap, Span};
use crate::token::Token;

/// Removes consequences from diagnostics, which are sorted by their places. `lost` are the tokens that
/// could not be parsed.
pub(super) fn remove(
    diagnostics: &mut Vec<Diagnostic>,
    tokens: &[Token],
    lost: &[Range<usize>],
    sources: &SourceMap,
) {
    let is_error = |found: &&Diagnostic| found.severity() == Severity::Error;
    let errors: Vec<Span> = diagnostics.iter().filter(is_error).map(|error| error.span).collect();
    let lost: Vec<Span> = lost.iter().filter_map(|range| span_of(tokens, range)).collect();
    let arrows: Vec<Span> = diagnostics
        .iter()
        .filter(|found| is_arrow(found, sources))
        .map(|found| found.span)
        .collect();
    diagnostics.retain(|found| match found.code {
        // `{"a": 1}`, `a ? b : c` and `case 1:` have a first mistake, after which a colon says nothing
        // more.
        DiagnosticCode::UnknownCharacter if matches!(sources.text(found.span), ":" | "?") => {
            !errors.iter().any(|error| {
                is_before(*error, found.span)
                    && (is_on_one_line(*error, found.span, sources)
                        || lost
                            .iter()
                            .any(|lost| lost.contains(*error) && lost.contains(found.span)))
            })
        }
        // The parameters in `(k, v) => ...` are no expression.
        DiagnosticCode::UnexpectedToken => !arrows.iter().any(|arrow| {
            is_before(found.span, *arrow) && is_on_one_line(found.span, *arrow, sources)
        }),
        _ => true,
    });
}

/// Returns true for the error about the sign of a lambda in other languages.
fn is_arrow(found: &Diagnostic, sources: &SourceMap) -> bool {
    found.code == DiagnosticCode::ForeignOperator && sources.text(found.span) == "=>"
}

/// Returns the source of tokens, if it is of one file.
fn span_of(tokens: &[Token], range: &Range<usize>) -> Option<Span> {
    let tokens = tokens.get(range.clone())?;
    let (first, last) = (tokens.first()?.span, tokens.last()?.span);
    (first.file == last.file).then(|| first.to(last))
}

fn is_before(one: Span, other: Span) -> bool {
    one.file == other.file && one.start < other.start
}

/// Returns true if no line ends between the starts of two places in one file.
fn is_on_one_line(one: Span, other: Span, sources: &SourceMap) -> bool {
    let text = &sources.file(one.file).text;
    let between = text.get(one.start as usize..other.start as usize);
    between.is_some_and(|between| !between.contains('\n'))
}
