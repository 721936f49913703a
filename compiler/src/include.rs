//! Reads scripts: the main file, and the files that replace each `include`.

mod files;
mod loader;
mod search;

use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};

pub use files::{DiskFiles, FileKind, Files, MemoryFiles, OverlaidFiles, normal};
pub use loader::{IncludeLoader, LIBRARY_FOLDER};

use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::lexer::lex;
use crate::source::{FileId, SourceMap, Span};
use crate::token::{Separation, Token, TokenKind};
use search::IncludeResult;

/// The maximum size of a script in bytes: far more than any robot can store, but little for a host.
pub const SOURCE_BYTES_MAX: usize = 1 << 20;

/// The tokens of a script with everything it includes.
pub(crate) struct Loaded {
    pub tokens: Vec<Token>,
    pub sources: SourceMap,
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads the main script with `loader`.
pub(crate) fn load_file(main: &Path, loader: &IncludeLoader) -> Loaded {
    match loader.files.read(main, SOURCE_BYTES_MAX) {
        Ok(bytes) => match decode(bytes) {
            Ok(text) => load_text(main, text, loader),
            Err((problem, text)) => rejected(main, text, &problem),
        },
        Err(error) => rejected(main, String::new(), &ScriptProblem::Unreadable(error)),
    }
}

/// Takes the main script from memory.
pub(crate) fn load_text(main: &Path, text: String, loader: &IncludeLoader) -> Loaded {
    if text.len() > SOURCE_BYTES_MAX {
        return rejected(main, String::new(), &ScriptProblem::TooLarge);
    }
    let mut loading = Loading {
        loader,
        sources: SourceMap::default(),
        diagnostics: Vec::new(),
        seen: loader.files.canonical(main).into_iter().collect(),
    };
    let file = loading.sources.add(main, text);
    let lexed = loading.lex(file);
    let tokens = expand(lexed, |name, span| {
        let file = loading.include(name, span)?;
        Some(loading.lex(file))
    });
    Loaded { tokens, sources: loading.sources, diagnostics: loading.diagnostics }
}

/// Takes a script and everything that it includes from memory, where [`load_text`] or [`load_file`]
/// has put them.
pub(crate) fn load_again(sources: SourceMap) -> Loaded {
    let mut diagnostics = Vec::new();
    let mut lexed = |file| lex(file, &sources.file(file).text, &mut diagnostics).into_iter();
    let main = lexed(FileId::default());
    let tokens = expand(main, |_, span| sources.included_at(span).map(&mut lexed));
    Loaded { tokens, sources, diagnostics }
}

/// Returns the tokens of a script, in which those of an included file replace its include. `include`
/// returns the tokens of the file that the include at a place names, unless it was read before.
fn expand(
    main: std::vec::IntoIter<Token>,
    mut include: impl FnMut(&Path, Span) -> Option<std::vec::IntoIter<Token>>,
) -> Vec<Token> {
    let mut tokens = Vec::new();
    // The stack is explicit, because a long chain of includes must not overflow the thread's stack.
    let mut open = vec![main];
    while let Some(current) = open.last_mut() {
        let Some(token) = current.next() else {
            open.pop();
            continue;
        };
        let TokenKind::Include(path) = &token.kind else {
            tokens.push(token);
            continue;
        };
        let included = include(Path::new(path), token.span);
        tokens.push(Token { kind: TokenKind::FileStart, ..token.clone() });
        match included {
            Some(file) => open.push(file),
            None => tokens.push(Token { kind: TokenKind::FileEnd, ..token }),
        }
    }
    tokens
}

/// Returns an empty script with an error, for a script that cannot be read.
fn rejected(main: &Path, text: String, problem: &ScriptProblem) -> Loaded {
    let mut sources = SourceMap::default();
    let file = sources.add(main, text);
    let start = problem.offset();
    let span = Span { file, start, end: start };
    let end = Token { kind: TokenKind::FileEnd, span, separation: Separation::Newline };
    Loaded { tokens: vec![end], sources, diagnostics: vec![problem.diagnostic(main, span)] }
}

/// A reason why a file cannot be a script.
enum ScriptProblem {
    Unreadable(io::Error),
    TooLarge,
    NotUtf8 { offset: usize },
}

impl ScriptProblem {
    fn offset(&self) -> u32 {
        match self {
            ScriptProblem::NotUtf8 { offset } => *offset as u32,
            ScriptProblem::Unreadable(_) | ScriptProblem::TooLarge => 0,
        }
    }

    fn diagnostic(&self, path: &Path, span: Span) -> Diagnostic {
        let path = path.display();
        match self {
            ScriptProblem::Unreadable(error) => Diagnostic::new(
                DiagnosticCode::FileUnreadable,
                span,
                format!("cannot read `{path}`: {error}"),
            ),
            ScriptProblem::TooLarge => Diagnostic::new(
                DiagnosticCode::FileTooLarge,
                span,
                format!("`{path}` is larger than {SOURCE_BYTES_MAX} bytes"),
            )
            .help("is this a script at all?"),
            ScriptProblem::NotUtf8 { offset } => Diagnostic::new(
                DiagnosticCode::FileNotUtf8,
                span,
                format!("`{path}` is not UTF-8 text: the byte at offset {offset} is invalid"),
            )
            .help("save the file as UTF-8"),
        }
    }
}

/// Decodes UTF-8. On failure, returns the problem and the text before it.
fn decode(bytes: Vec<u8>) -> Result<String, (ScriptProblem, String)> {
    if bytes.len() > SOURCE_BYTES_MAX {
        return Err((ScriptProblem::TooLarge, String::new()));
    }
    String::from_utf8(bytes).map_err(|error| {
        let offset = error.utf8_error().valid_up_to();
        let mut bytes = error.into_bytes();
        bytes.truncate(offset);
        let before = String::from_utf8(bytes).expect("the bytes before the offset are valid");
        (ScriptProblem::NotUtf8 { offset }, before)
    })
}

struct Loading<'a> {
    loader: &'a IncludeLoader<'a>,
    sources: SourceMap,
    diagnostics: Vec<Diagnostic>,
    /// Canonical paths of the files that were read.
    seen: HashSet<PathBuf>,
}

impl Loading<'_> {
    fn lex(&mut self, file: FileId) -> std::vec::IntoIter<Token> {
        lex(file, &self.sources.file(file).text, &mut self.diagnostics).into_iter()
    }

    /// Reads the file that the include at `span` names, unless it was read before.
    fn include(&mut self, name: &Path, span: Span) -> Option<FileId> {
        let including = self.sources.path(span.file).to_owned();
        let found = match search::find(self.loader, &including, name) {
            Ok(found) => found,
            Err(not_found) => {
                self.diagnostics.push(not_found.diagnostic(name, span));
                return None;
            }
        };
        if let IncludeResult::InWorkingFolder { path, .. } = &found {
            self.diagnostics.push(search::working_folder_warning(path, &including, span));
        }
        let (path, identity, text) = match found {
            IncludeResult::InLibrary { name, text } => {
                let path = Path::new(LIBRARY_FOLDER).join(name);
                (path.clone(), path, Ok(text.to_owned()))
            }
            IncludeResult::OnDisk { path, identity }
            | IncludeResult::InWorkingFolder { path, identity } => {
                if self.seen.contains(&identity) {
                    return None;
                }
                let text = self
                    .loader
                    .files
                    .read(&path, SOURCE_BYTES_MAX)
                    .map_err(|error| (ScriptProblem::Unreadable(error), String::new()))
                    .and_then(decode);
                (path, identity, text)
            }
        };
        if !self.seen.insert(identity) {
            return None;
        }
        match text {
            Ok(text) => Some(self.sources.add_included(path, text, span)),
            Err((problem, _)) => {
                self.diagnostics.push(problem.diagnostic(&path, span));
                None
            }
        }
    }
}
