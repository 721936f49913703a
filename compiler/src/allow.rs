//! Comments that silence warnings: `# bbz: allow(W0102)`.
//!
//! A comment after a statement applies to its own line. A comment on a line of its own applies to
//! the next line with code. Commas separate several codes. Errors cannot be silenced.

use std::collections::HashSet;

use crate::codes::DiagnosticCode;
use crate::diagnostic::{Diagnostic, Severity};
use crate::source::{FileId, SourceMap, Span};

/// The beginning of a comment for the compiler.
const MARK: &str = "# bbz:";

/// The warnings that the comments of a script silence.
#[derive(Debug, Clone, Default)]
pub struct Allowances {
    /// The file, the line counted from 0, and the silenced code.
    lines: HashSet<(FileId, usize, DiagnosticCode)>,
    /// Diagnostics about comments that cannot be read.
    pub problems: Vec<Diagnostic>,
}

impl Allowances {
    /// Reads the comments of a script and of the files that it includes.
    pub fn read(sources: &SourceMap) -> Self {
        let mut allowances = Allowances::default();
        for (file, source) in sources.files() {
            allowances.read_file(file, &source.text);
        }
        allowances
    }

    /// Returns true if a comment silences the diagnostic.
    pub fn cover(&self, diagnostic: &Diagnostic, sources: &SourceMap) -> bool {
        let span = diagnostic.span;
        if self.lines.is_empty() || diagnostic.severity() == Severity::Error {
            return false;
        }
        let before = &sources.file(span.file).text[..span.start as usize];
        let line = before.matches('\n').count();
        self.lines.contains(&(span.file, line, diagnostic.code))
    }

    fn read_file(&mut self, file: FileId, text: &str) {
        if !text.contains(MARK) {
            return;
        }
        let mut start = 0;
        // Codes from comments on lines of their own, which apply to the next line with code.
        let mut waiting: Vec<DiagnosticCode> = Vec::new();
        for (number, line) in text.split('\n').enumerate() {
            let comment = line.find(MARK);
            let code = line.find('#').map_or(line, |hash| &line[..hash]);
            let codes =
                comment.map_or(Vec::new(), |at| self.comment(file, start + at, &line[at..]));
            if code.trim().is_empty() {
                waiting.extend(codes);
            } else {
                let here = codes.into_iter().chain(waiting.drain(..));
                self.lines.extend(here.map(|code| (file, number, code)));
            }
            start += line.len() + 1;
        }
    }

    /// Returns the codes that the comment at `start` allows.
    fn comment(&mut self, file: FileId, start: usize, comment: &str) -> Vec<DiagnosticCode> {
        let comment = comment.trim_end();
        let span = Span { file, start: start as u32, end: (start + comment.len()) as u32 };
        let inside = comment[MARK.len()..].trim().strip_prefix("allow(");
        let Some(list) = inside.and_then(|rest| rest.strip_suffix(')')) else {
            self.problem(span, "this is no comment that bbz knows".to_owned());
            return Vec::new();
        };
        let mut codes = Vec::new();
        for text in list.split(',').map(str::trim) {
            match DiagnosticCode::ALL.iter().find(|code| code.text() == text) {
                Some(code) if code.severity() == Severity::Warning => codes.push(*code),
                Some(_) => {
                    self.problem(span, format!("{text} is an error, which cannot be allowed"))
                }
                None => self.problem(span, format!("there is no warning `{text}`")),
            }
        }
        codes
    }

    fn problem(&mut self, span: Span, message: String) {
        let diagnostic = Diagnostic::new(DiagnosticCode::UnknownAllowance, span, message)
            .help("write `# bbz: allow(W0102)`, several codes with commas between them");
        self.problems.push(diagnostic);
    }
}
