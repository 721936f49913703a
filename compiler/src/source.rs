//! Source files and places in them.

use std::path::{Path, PathBuf};

use crate::layout::Layout;
pub use crate::layout::LineColumn;
use crate::steps;

/// Number of a file in a [`SourceMap`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct FileId(pub u32);

/// A range of bytes in one source file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub struct Span {
    pub file: FileId,
    /// Offset of the first byte.
    pub start: u32,
    /// Offset of the byte after the last one.
    pub end: u32,
}

impl Span {
    /// Returns the span from the start of `self` to the end of `other`, or `self` if they are in
    /// different files.
    pub fn to(self, other: Span) -> Span {
        if self.file == other.file { Span { end: other.end.max(self.end), ..self } } else { self }
    }

    /// Returns true if `other` lies in this span.
    pub fn contains(self, other: Span) -> bool {
        self.file == other.file && self.start <= other.start && other.end <= self.end
    }
}

/// A file that was read.
#[derive(Debug, Clone)]
pub struct SourceFile {
    /// The path as the user would write it: the argument of the command line, or the resolved path
    /// of an include.
    pub path: PathBuf,
    pub text: String,
    /// The place of the `include` that the file replaces; `None` for the main script.
    pub(crate) include: Option<Span>,
    pub(crate) layout: Layout,
}

/// Every file of one compilation; the main script is file 0.
#[derive(Debug, Clone, Default)]
pub struct SourceMap {
    files: Vec<SourceFile>,
}

impl SourceMap {
    /// Adds a file and returns its number.
    pub fn add(&mut self, path: impl Into<PathBuf>, text: String) -> FileId {
        let layout = Layout::new(&text);
        self.files.push(SourceFile { path: path.into(), text, include: None, layout });
        FileId(self.files.len() as u32 - 1)
    }

    /// Adds the file that replaces an `include`, and returns its number.
    pub(crate) fn add_included(&mut self, path: PathBuf, text: String, include: Span) -> FileId {
        let file = self.add(path, text);
        self.files[file.0 as usize].include = Some(include);
        file
    }

    /// Returns the file that replaces an `include`; `None` if the file was included before.
    pub(crate) fn included_at(&self, include: Span) -> Option<FileId> {
        let found = self.files().find(|(_, file)| file.include == Some(include));
        found.map(|(id, _)| id)
    }

    /// Returns the file with that number.
    pub fn file(&self, id: FileId) -> &SourceFile {
        &self.files[id.0 as usize]
    }

    /// Returns the path of the file with that number.
    pub fn path(&self, id: FileId) -> &Path {
        &self.file(id).path
    }

    /// Returns every file with its number.
    pub fn files(&self) -> impl Iterator<Item = (FileId, &SourceFile)> {
        self.files.iter().enumerate().map(|(i, f)| (FileId(i as u32), f))
    }

    /// Returns the source text of a span.
    pub fn text(&self, span: Span) -> &str {
        steps::take((span.end - span.start) as usize);
        &self.file(span.file).text[span.start as usize..span.end as usize]
    }

    /// Returns the line and column at which the span starts.
    pub fn line_column(&self, span: Span) -> LineColumn {
        self.position(span.file, span.start)
    }

    /// Returns the line and column of a byte, which begins a character or ends the file.
    pub(crate) fn position(&self, file: FileId, offset: u32) -> LineColumn {
        let SourceFile { text, layout, .. } = self.file(file);
        layout.line_column(text, offset as usize)
    }
}
