//! The reader of scenario files: the types of [`bittybuzz_toml_reader`], with [`ScenarioCause`] as the
//! mistakes.

use bittybuzz_toml_reader as toml_reader;

use super::error::ScenarioCause;

/// A table of a scenario.
pub type Section<'a> = toml_reader::Section<'a, ScenarioCause>;
/// A value of a scenario.
pub type Entry<'a> = toml_reader::TomlEntry<'a, ScenarioCause>;
