//! The book as static files.

use anyhow::Result;
use bittybuzz_builds::shell::{cargo, target};

/// The folder of the book, in cargo's.
const BOOK: &str = "book";

/// Builds the book, follows its links and prints the path of its first page.
pub fn run() -> Result<()> {
    let folder = target()?.join(BOOK);
    cargo(&["run", "--package", "bittybuzz-book", "--", &folder.display().to_string()])
}
