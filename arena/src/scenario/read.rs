//! The reader of scenario files: [`bittybuzz_toml_reader`] with the mistakes of a scenario.

use bittybuzz_toml_reader as toml_reader;

use super::error::Cause;

pub type Section<'a> = toml_reader::Section<'a, Cause>;
pub type Entry<'a> = toml_reader::Entry<'a, Cause>;
