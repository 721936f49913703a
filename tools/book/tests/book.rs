//! Builds the book as readers get it, and follows its links.

use bittybuzz_book::{build, links};
use fs_err as fs;
use std::path::Path;

#[test]
fn the_book_is_built_and_its_links_lead_somewhere() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("book");
    build(&folder).unwrap();
    assert!(folder.join("repository/ARCHITECTURE.html").is_file());
}

#[test]
fn links_to_missing_files_and_anchors_are_found() {
    let book = Path::new(env!("CARGO_TARGET_TMPDIR")).join("links");
    fs::create_dir_all(&book).unwrap();
    let book = fs::canonicalize(book).unwrap();
    let links = "<a href='#here'>a</a> <a href='b.html#there'>b</a> <a href='https://c'>c</a>";
    fs::write(book.join("a.html"), format!("<p id='here'>{links}")).unwrap();
    let links = "<img src='no.png'><a href='a.html#no'>d</a>";
    fs::write(book.join("b.html"), format!("<p id='there'>{links}")).unwrap();
    let error = links::check(&book).unwrap_err().to_string();
    assert_eq!(error, "links that lead nowhere:\nb.html: no.png\nb.html: a.html#no");
}
