//! The guides of the book, each of which a test carries out in a copy of the repository, command by
//! command, as a reader would.
//!
//! A guide compiles large parts of the copy, so it takes minutes. `cargo xtask soak guides` carries
//! out all of them and records in `runs.toml`, for each guide, the date and a hash of the files that
//! the guide names, reads or edits. `cargo xtask ci guides` carries out only the guides for which
//! one of these files has changed since.

pub mod console;
pub mod edit;
pub mod guide;
pub mod runs;

pub use guide::Guide;
pub use runs::Runs;
