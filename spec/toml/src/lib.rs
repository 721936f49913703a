//! Reads TOML files that people write: robot files, scenarios and manifests of tests.
//!
//! # Principles
//! * Every mistake of a file is reported in one pass. A reading function records a mistake and
//!   returns `None`; the caller continues with the next key.
//! * A mistake has a place (file, line, column) and, if one is known, a correction. A misspelled
//!   key or word gets the likely one as help.
//! * A file is refused rather than guessed at: unknown keys, missing keys and numbers out of range are mistakes.
//! * The work is linear in the size of the file, and at most [`MISTAKES_MAX`] mistakes are kept. The last
//!   one has the number of further mistakes.
//!
//! # Use
//! A format has an enum of its own mistakes, which implements [`Cause`] and includes those of this
//! crate ([`TomlError`]). [`read`] parses the text and calls the format's reading function with the
//! root [`Section`].
//!
//! [`mod@file`] reads the files themselves and all others that commands are given, always with a
//! limit.
//!
//! # Limits
//! This crate defines no format and does not deserialize into types. Each section has a reading
//! function, which includes its checks.

mod entry;
mod error;
pub mod file;
mod place;
mod reader;
mod section;
mod unclosed;

pub use entry::{TomlEntry, number_text};
pub use error::{Cause, FileError, MISTAKES_MAX, TomlError, one_of};
pub use place::{Place, SourceText};
pub use reader::{Override, Reader, Schema, read};
pub use section::Section;

#[cfg(test)]
mod tests;
