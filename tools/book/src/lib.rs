//! Builds the book: the pages of `docs/`, and the pages of other folders that they link to.
//!
//! # Principles
//! * `docs/` is an ordinary mdBook, so authors can view it with `mdbook serve docs`. This program
//!   adds the rest of the repository: a page outside `docs/` that a chapter links to becomes a
//!   chapter, and any other file becomes a text file of the book, so that the book needs no host
//!   and no network.
//! * A broken link is an error: the links of the generated HTML are followed, anchors included.
//! * A robot's page is generated from its robot file, and committed, so that it can be read in the repository too. A test
//!   compares; `UPDATE_DOCS=1 cargo test --locked -p bittybuzz-book` writes the pages.
//!
//! # What it will not do
//! It does not check addresses on the network.

pub mod links;
mod outside;

use anyhow::Result;
use mdbook_driver::MDBook;
use std::path::{Path, PathBuf, absolute};

/// The folder of the book's pages, from the root.
const DOCS: &str = "docs";

/// Writes the book into the folder and follows its links. Returns the path of the first page.
pub fn build(folder: &Path) -> Result<PathBuf> {
    let folder = &absolute(folder)?;
    let mut book = MDBook::load(root().join(DOCS))?;
    book.config.build.build_dir = folder.clone();
    let files = outside::take_in(root(), &mut book.book)?;
    book.build()?;
    for file in files {
        file.write(folder)?;
    }
    links::check(folder)?;
    Ok(folder.join("index.html"))
}

/// The root of the repository.
fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}
