//! Generated parts of pages, which stand between two comments.

use fs_err as fs;
use std::env;
use std::path::{Path, PathBuf};

/// Returns the path of a file of the repository.
pub fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(name)
}

/// Compares parts of a page with what a test generates. With `UPDATE_DOCS` the page is written.
pub fn check(page: &str, test: &str, parts: &[(&str, String)]) {
    let before = fs::read_to_string(path(page)).unwrap();
    let mut text = before.clone();
    for (name, part) in parts {
        let start = format!("<!-- {name}: written by tools/book/tests/{test} -->\n");
        let (head, rest) = text.split_once(&start).unwrap();
        let (_, tail) = rest.split_once("<!-- end -->").unwrap();
        text = format!("{head}{start}{part}<!-- end -->{tail}");
    }
    if env::var_os("UPDATE_DOCS").is_some() {
        fs::write(path(page), &text).unwrap();
    }
    let committed = fs::read_to_string(path(page)).unwrap();
    assert!(
        committed == text,
        "`UPDATE_DOCS=1 cargo test --locked -p bittybuzz-book` writes {page} again"
    );
}
