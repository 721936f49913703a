//! The reader of scenario files: the types of [`bittybuzz_toml_reader`], with [`Cause`] as the
//! mistakes.

use bittybuzz_toml_reader as toml_reader;

use super::error::Cause;

/// A table of a scenario.
pub type Section<'a> = toml_reader::Section<'a, Cause>;
/// A value of a scenario.
pub type Entry<'a> = toml_reader::Entry<'a, Cause>;
