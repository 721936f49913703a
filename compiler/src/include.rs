//! Reads scripts: the main file, and the files that replace each `include`.

mod files;
mod search;

use std::collections::HashSet;
use std::io;
use std::path::{Path, PathBuf};

pub use files::{DiskFiles, FileKind, Files, MemoryFiles};

use crate::codes::DiagnosticCode;
use crate::diagnostic::Diagnostic;
use crate::lexer::lex;
use crate::source::{FileId, SourceMap, Span};
use crate::token::{Separation, Token, TokenKind};
use search::IncludeResult;

/// The maximum size of a script in bytes: far more than any robot can store, but little for a host.
pub const MAX_SOURCE_BYTES: usize = 1 << 20;

/// The folder in messages about files of the shipped library: `<library>/vec2.bzz`.
const LIBRARY_FOLDER: &str = "<library>";

/// The configuration of the search for included files. The search order is the folder of the
/// including file, the working folder, then the lists below.
pub struct IncludeLoader<'a> {
    /// The file system, or a replacement for it.
    pub files: &'a dyn Files,
    /// The folder the compiler was started in; relative paths of the main script start here.
    pub working_folder: PathBuf,
    /// The folders given with `-I`.
    pub folders: Vec<PathBuf>,
    /// The folders listed in the environment variable `BUZZ_INCLUDE_PATH`.
    pub environment: Vec<PathBuf>,
    /// The shipped library: file name and text.
    pub library: &'a [(&'a str, &'a str)],
}

impl<'a> IncludeLoader<'a> {
    /// Creates a loader that searches only the folder of the including file and the working folder.
    pub fn new(files: &'a dyn Files) -> Self {
        IncludeLoader {
            files,
            working_folder: PathBuf::new(),
            folders: Vec::new(),
            environment: Vec::new(),
            library: &[],
        }
    }
}

/// The tokens of a script with everything it includes.
pub(crate) struct Loaded {
    pub tokens: Vec<Token>,
    pub sources: SourceMap,
    pub diagnostics: Vec<Diagnostic>,
}

/// Reads the main script with `loader`.
pub(crate) fn load_file(main: &Path, loader: &IncludeLoader) -> Loaded {
    match loader.files.read(main, MAX_SOURCE_BYTES) {
        Ok(bytes) => match decode(bytes) {
            Ok(text) => load_text(main, text, loader),
            Err((problem, text)) => rejected(main, text, &problem),
        },
        Err(error) => rejected(main, String::new(), &ScriptProblem::Unreadable(error)),
    }
}

/// Takes the main script from memory.
pub(crate) fn load_text(main: &Path, text: String, loader: &IncludeLoader) -> Loaded {
    if text.len() > MAX_SOURCE_BYTES {
        return rejected(main, String::new(), &ScriptProblem::TooLarge);
    }
    let mut loading = Loading {
        loader,
        sources: SourceMap::default(),
        diagnostics: Vec::new(),
        seen: loader.files.canonical(main).into_iter().collect(),
    };
    let file = loading.sources.add(main, text);
    let tokens = loading.expand(file);
    Loaded { tokens, sources: loading.sources, diagnostics: loading.diagnostics }
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
                format!("`{path}` is larger than {MAX_SOURCE_BYTES} bytes"),
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
    if bytes.len() > MAX_SOURCE_BYTES {
        return Err((ScriptProblem::TooLarge, String::new()));
    }
    String::from_utf8(bytes).map_err(|error| {
        let offset = error.utf8_error().valid_up_to();
        let mut bytes = error.into_bytes();
        bytes.truncate(offset);
        (ScriptProblem::NotUtf8 { offset }, String::from_utf8(bytes).unwrap_or_default())
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

    /// Returns the tokens of `file`, in which the tokens of an included file replace its include.
    fn expand(&mut self, file: FileId) -> Vec<Token> {
        let mut tokens = Vec::new();
        // The stack is explicit, because a long chain of includes must not overflow the thread's
        // stack.
        let mut open = vec![self.lex(file)];
        while let Some(current) = open.last_mut() {
            let Some(token) = current.next() else {
                open.pop();
                continue;
            };
            let TokenKind::Include(path) = &token.kind else {
                tokens.push(token);
                continue;
            };
            let included = self.include(Path::new(path), token.span);
            tokens.push(Token { kind: TokenKind::FileStart, ..token.clone() });
            match included {
                Some(file) => open.push(self.lex(file)),
                None => tokens.push(Token { kind: TokenKind::FileEnd, ..token }),
            }
        }
        tokens
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
                    .read(&path, MAX_SOURCE_BYTES)
                    .map_err(|error| (ScriptProblem::Unreadable(error), String::new()))
                    .and_then(decode);
                (path, identity, text)
            }
        };
        if !self.seen.insert(identity) {
            return None;
        }
        match text {
            Ok(text) => Some(self.sources.add(path, text)),
            Err((problem, _)) => {
                self.diagnostics.push(problem.diagnostic(&path, span));
                None
            }
        }
    }
}
