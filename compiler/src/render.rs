//! Prints diagnostics as text for people and as JSON for programs.

use std::ops::Range;

use annotate_snippets::{
    Annotation, AnnotationKind, Element, Group, Level, Origin, Renderer as Style, Snippet,
};
use serde::Serialize;
use serde_json::Value;

use crate::diagnostic::{Diagnostic, Severity};
use crate::source::{FileId, SourceFile, SourceMap, Span};
use crate::steps;

/// The length in bytes of the longest source line that is shown, because finding the part around a
/// mark takes time that grows with the line. For longer lines, only the place is printed.
pub const LINE_BYTES_MAX: usize = 1 << 16;

/// The maximum length in bytes of a normal line. Of a longer, wide line only the part around a mark
/// is shown. Each mark in a wide line is shown on its own, because one piece would include all text
/// between two marks.
pub const WIDE_LINE: usize = 400;

/// The maximum number of bytes of a wide line that are marked.
pub const MARKED_BYTES_MAX: usize = 60;

/// The maximum number of source lines that one mark covers. Of a longer span only the first line is
/// marked.
const MARKED_LINES_MAX: usize = 6;

/// The maximum length in bytes of a help that stands under the mark, where a longer one would leave a
/// terminal of 80 columns.
const HELP_AT_MARK_MAX: usize = 50;

/// Maximum distance in lines between two places that are shown in one piece of source text.
const NEAR: usize = 10;

/// Renders the diagnostics of one compilation.
///
/// The map knows the lines of every file, and a diagnostic touches only the lines around it. The
/// time therefore grows with the sum of the sizes of files and diagnostics, not with their product.
pub struct Renderer<'a> {
    sources: &'a SourceMap,
}

/// A diagnostic with lines and columns, as other programs read it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DescribedDiagnostic {
    /// `error` or `warning`
    pub severity: &'static str,
    /// The code, such as `E0201`.
    pub code: &'static str,
    pub message: String,
    pub label: String,
    pub help: Option<String>,
    #[serde(flatten)]
    pub place: DescribedSpan,
    pub related: Vec<DescribedPlace>,
    pub edits: Vec<DescribedEdit>,
}

/// A part of a file. Lines and columns count from 1.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DescribedSpan {
    pub file: String,
    pub line: usize,
    pub column: usize,
    pub end_line: usize,
    pub end_column: usize,
}

/// A place with a remark.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DescribedPlace {
    #[serde(flatten)]
    pub place: DescribedSpan,
    pub label: String,
}

/// A text that replaces the one at a place.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DescribedEdit {
    #[serde(flatten)]
    pub place: DescribedSpan,
    pub text: String,
    /// True if the change is certainly right.
    pub certain: bool,
}

/// The choice of colors by ANSI escape sequences in text output.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColorChoice {
    /// Plain text.
    Never,
    /// Colored text for a terminal.
    Always,
}

impl<'a> Renderer<'a> {
    /// Creates a renderer for diagnostics about `sources`.
    pub fn new(sources: &'a SourceMap) -> Self {
        Renderer { sources }
    }

    /// Returns a diagnostic as several lines of text that end with a newline: headline, place,
    /// source, help.
    pub fn text(&self, diagnostic: &Diagnostic, color: ColorChoice) -> String {
        let level = match diagnostic.severity() {
            Severity::Error => Level::ERROR,
            Severity::Warning => Level::WARNING,
        };
        let title = level.primary_title(printable(&diagnostic.message)).id(diagnostic.code.text());
        let help_at_mark = self.help_at_mark(diagnostic);
        let label = help_at_mark.as_deref().unwrap_or(&diagnostic.label);
        let mut report = title.elements(self.places(diagnostic, label));
        if let (None, Some(help)) = (&help_at_mark, &diagnostic.help) {
            report = report.element(Level::HELP.message(printable(help)));
        }
        let style = match color {
            ColorChoice::Never => Style::plain(),
            ColorChoice::Always => Style::styled(),
        };
        let mut text = style.render(&[report] as &[Group]);
        text.push('\n');
        text
    }

    /// Returns a diagnostic as a JSON object.
    pub fn json(&self, diagnostic: &Diagnostic) -> Value {
        serde_json::to_value(self.described(diagnostic)).expect("each key is a text")
    }

    /// Returns a diagnostic with lines and columns.
    pub fn described(&self, diagnostic: &Diagnostic) -> DescribedDiagnostic {
        let related = diagnostic.related.iter().map(|(span, label)| DescribedPlace {
            place: self.described_span(*span),
            label: label.clone(),
        });
        let edits = diagnostic.edits.iter().map(|edit| DescribedEdit {
            place: self.described_span(edit.span),
            text: edit.text.clone(),
            certain: edit.is_certain,
        });
        DescribedDiagnostic {
            severity: match diagnostic.severity() {
                Severity::Error => "error",
                Severity::Warning => "warning",
            },
            code: diagnostic.code.text(),
            message: diagnostic.message.clone(),
            label: diagnostic.label.clone(),
            help: diagnostic.help.clone(),
            place: self.described_span(diagnostic.span),
            related: related.collect(),
            edits: edits.collect(),
        }
    }

    fn described_span(&self, span: Span) -> DescribedSpan {
        let start = self.sources.position(span.file, span.start);
        let end = self.sources.position(span.file, span.end);
        DescribedSpan {
            file: self.sources.path(span.file).display().to_string(),
            line: start.line as usize,
            column: start.column as usize,
            end_line: end.line as usize,
            end_column: end.column as usize,
        }
    }

    /// Returns the line, counted from 0, that contains the byte at `offset`.
    fn line_of(&self, file: FileId, offset: usize) -> usize {
        self.sources.file(file).layout.line_of(offset)
    }

    /// Returns the offset of a line, or the end of the file for lines after the last one.
    fn line_start(&self, file: FileId, line: usize) -> usize {
        let SourceFile { text, layout, .. } = self.sources.file(file);
        layout.line_start(line).unwrap_or(text.len())
    }

    fn source(&self, file: FileId, range: Range<usize>) -> &'a str {
        steps::take(range.len());
        &self.sources.file(file).text[range]
    }

    /// Returns the help as text under the mark: where the place needs no words of its own, a short help
    /// makes the message two lines shorter.
    fn help_at_mark(&self, diagnostic: &Diagnostic) -> Option<String> {
        let Diagnostic { span, label, help, .. } = diagnostic;
        let help = help.as_ref().filter(|help| help.len() <= HELP_AT_MARK_MAX)?;
        let is_shown = !self.has_longer_line(span.file, self.lines(*span), LINE_BYTES_MAX);
        (label.is_empty() && is_shown).then(|| format!("help: {help}"))
    }

    /// Returns the source text around the place of a diagnostic, with `label` under its mark, and around
    /// its related places.
    fn places<'b>(&self, diagnostic: &'b Diagnostic, label: &'b str) -> Vec<Element<'b>>
    where
        'a: 'b,
    {
        let primary = SourceMark { span: diagnostic.span, label, primary: true };
        let mut pieces = vec![vec![primary]];
        for (span, label) in &diagnostic.related {
            let mark = SourceMark { span: *span, label, primary: false };
            match pieces.first_mut() {
                Some(piece) if self.are_near(diagnostic.span, *span) => piece.push(mark),
                _ => pieces.push(vec![mark]),
            }
        }
        pieces.into_iter().map(|piece| self.piece(&piece)).collect()
    }

    fn are_near(&self, a: Span, b: Span) -> bool {
        let distance = || self.lines(a).start.abs_diff(self.lines(b).start);
        let is_wide = |span: Span| self.has_longer_line(span.file, self.lines(span), WIDE_LINE);
        a.file == b.file && distance() <= NEAR && !is_wide(a) && !is_wide(b)
    }

    /// Returns the lines of a span that are shown.
    fn lines(&self, span: Span) -> Range<usize> {
        let first = self.line_of(span.file, span.start as usize);
        let last = self.line_of(span.file, span.end as usize).max(first);
        let all = first..last + 1;
        let is_shown = last - first < MARKED_LINES_MAX
            && !self.has_longer_line(span.file, all.clone(), WIDE_LINE);
        if is_shown { all } else { first..first + 1 }
    }

    /// Returns true if one of the lines has more than `most` bytes.
    fn has_longer_line(&self, file: FileId, mut lines: Range<usize>, most: usize) -> bool {
        lines.any(|line| self.line_start(file, line + 1) - self.line_start(file, line) > most)
    }

    /// Returns a piece of source text with marks. There is at least one, and all are in one file.
    fn piece<'b>(&self, marks: &[SourceMark<'b>]) -> Element<'b>
    where
        'a: 'b,
    {
        let Span { file, start, .. } = marks[0].span;
        let path = printable(&self.sources.path(file).display().to_string());
        let (mut first, mut last) = (usize::MAX, 0);
        for lines in marks.iter().map(|mark| self.lines(mark.span)) {
            first = first.min(lines.start);
            last = last.max(lines.end);
        }
        if self.has_longer_line(file, first..last, LINE_BYTES_MAX) {
            let at = self.sources.position(file, start);
            let origin = Origin::path(path).line(at.line as usize).char_column(at.column as usize);
            return origin.into();
        }
        let (begin, end) = (self.line_start(file, first), self.line_start(file, last));
        let text = self.source(file, begin..end);
        Snippet::source(text)
            .line_start(first + 1)
            .path(path)
            .annotations(marks.iter().map(|mark| self.annotation(mark, begin..end)))
            .into()
    }

    fn annotation<'b>(&self, mark: &SourceMark<'b>, piece: Range<usize>) -> Annotation<'b> {
        let end_of_lines = self.line_start(mark.span.file, self.lines(mark.span).end);
        let start = mark.span.start as usize - piece.start;
        let mut end = (mark.span.end as usize).min(end_of_lines).min(piece.end) - piece.start;
        if self.has_longer_line(mark.span.file, self.lines(mark.span), WIDE_LINE) {
            let text = self.source(mark.span.file, piece);
            end = end.min(text.floor_char_boundary(start + MARKED_BYTES_MAX));
        }
        let kind = match mark.primary {
            true => AnnotationKind::Primary,
            false => AnnotationKind::Context,
        };
        let label = (!mark.label.is_empty()).then(|| printable(mark.label));
        kind.span(start..end).label(label)
    }
}

/// A place in the source text with the label under it.
struct SourceMark<'a> {
    span: Span,
    label: &'a str,
    primary: bool,
}

/// Replaces control characters, because text from a script must not control the terminal.
fn printable(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}
