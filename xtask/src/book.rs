//! Builds the book as static files.

use anyhow::Result;
use bittybuzz_builds::shell::{cargo, target};
use std::path::Path;

/// The folder of the book in cargo's target folder.
const BOOK: &str = "book";

/// Builds the book and prints the path of its first page.
pub fn run() -> Result<()> {
    build(&target()?.join(BOOK))
}

/// Builds the book into a folder, and checks its links.
pub fn build(folder: &Path) -> Result<()> {
    cargo(&["run", "--package", "bittybuzz-book", "--", &folder.display().to_string()])
}
