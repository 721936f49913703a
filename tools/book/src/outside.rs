//! Adds the files outside `docs/` that chapters link to.
//!
//! Chapters are written for readers of the repository, so their links are paths between its files.
//! In the book, a page of another folder becomes the chapter `repository/PATH`, and every other
//! file the text `files/PATH.txt`, which a browser shows.

use crate::DOCS;
use anyhow::{Context, Result, ensure};
use fs_err as fs;
use mdbook_driver::book::{Book, BookItem, Chapter};
use pulldown_cmark::{Event, Parser, Tag};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

/// The folder of chapters from outside `docs/`, in the book.
const PAGES: &str = "repository";

/// The folder of all other files, in the book.
const FILES: &str = "files";

/// The title of the part with the chapters from outside `docs/`.
const PART: &str = "Pages of the repository";

/// A text file of the book.
pub struct BookFile {
    /// The path in the book.
    path: PathBuf,
    text: String,
}

impl BookFile {
    /// Writes the file into the folder of the book.
    pub fn write(&self, book: &Path) -> Result<()> {
        let path = book.join(&self.path);
        fs::create_dir_all(path.parent().context("a file without a folder")?)?;
        Ok(fs::write(path, &self.text)?)
    }
}

/// Adds a chapter for every page outside `docs/` that a chapter links to, and returns the other files that are linked to.
pub fn take_in(root: &Path, book: &mut Book) -> Result<Vec<BookFile>> {
    let mut found = LinkedPaths::default();
    book.for_each_chapter_mut(|chapter| {
        if let Some(path) = &chapter.path {
            let source = Path::new(DOCS).join(path);
            chapter.content = relinked(root, &source, &chapter.content, &mut found);
        }
    });
    let mut chapters = BTreeMap::new();
    while let Some(page) = found.pages.iter().find(|page| !chapters.contains_key(*page)).cloned() {
        let text = fs::read_to_string(root.join(&page))?;
        let content = relinked(root, &page, &text, &mut found);
        let title = text.lines().find_map(|line| line.strip_prefix("# "));
        let title = title.with_context(|| format!("{} has no title", page.display()))?;
        let chapter = Chapter::new(title, content, in_book(&page), vec![]);
        chapters.insert(page, chapter);
    }
    ensure!(found.broken.is_empty(), "links to no file:\n{}", found.broken.join("\n"));
    book.push_item(BookItem::PartTitle(PART.to_owned()));
    for chapter in chapters.into_values() {
        book.push_item(chapter);
    }
    found.files.iter().map(|path| text_file(root, path)).collect()
}

/// Paths from the root to which chapters link.
#[derive(Default)]
struct LinkedPaths {
    pages: BTreeSet<PathBuf>,
    files: BTreeSet<PathBuf>,
    /// Pages and their links that lead to no file.
    broken: Vec<String>,
}

/// Returns the text of the page with its links as they are in the book.
fn relinked(root: &Path, page: &Path, text: &str, found: &mut LinkedPaths) -> String {
    let mut content = text.to_owned();
    // The last link comes first, so that the positions of the others stay valid.
    let links: Vec<_> = Parser::new(text).into_offset_iter().collect();
    for (event, range) in links.into_iter().rev() {
        let Event::Start(Tag::Link { dest_url, .. } | Tag::Image { dest_url, .. }) = event else {
            continue;
        };
        let (path, anchor) = match dest_url.split_once('#') {
            Some((path, anchor)) => (path, format!("#{anchor}")),
            None => (&*dest_url, String::new()),
        };
        if path.is_empty() || path.contains("://") {
            continue;
        }
        let folder = page.parent().unwrap_or(Path::new(""));
        let target = normal(&folder.join(path)).filter(|target| root.join(target).exists());
        let place = text[range.clone()].rfind(&*dest_url).map(|at| range.start + at);
        let (Some(target), Some(start)) = (target, place) else {
            found.broken.push(format!("{}: {dest_url}", page.display()));
            continue;
        };
        let target = match target.join("README.md") {
            readme if root.join(&readme).is_file() => readme,
            _ => target,
        };
        if !target.starts_with(DOCS) {
            match is_page(&target) {
                true => found.pages.insert(target.clone()),
                false => found.files.insert(target.clone()),
            };
        }
        let from = in_book(page);
        let link = relative(from.parent().unwrap_or(Path::new("")), &in_book(&target));
        content.replace_range(start..start + dest_url.len(), &(link + &anchor));
    }
    content
}

fn is_page(path: &Path) -> bool {
    path.extension().is_some_and(|ending| ending == "md")
}

/// Returns the path in the book for a path from the root. mdBook names the page `README.md` of a
/// folder `index.md`.
fn in_book(path: &Path) -> PathBuf {
    let path = &match path.ends_with("README.md") {
        true => path.with_file_name("index.md"),
        false => path.to_owned(),
    };
    match path.strip_prefix(DOCS) {
        Ok(inside) => inside.to_owned(),
        Err(_) if is_page(path) => Path::new(PAGES).join(path),
        Err(_) => {
            let name =
                if path == Path::new("") { "root".into() } else { path.display().to_string() };
            Path::new(FILES).join(name + ".txt")
        }
    }
}

/// Returns a file as it is, or the list of a folder's files.
fn text_file(root: &Path, path: &Path) -> Result<BookFile> {
    let text = match root.join(path).is_dir() {
        false => fs::read_to_string(root.join(path))?,
        true => {
            let entries = fs::read_dir(root.join(path))?.collect::<Result<Vec<_>, _>>()?;
            let names =
                entries.iter().map(|entry| entry.file_name().to_string_lossy().into_owned());
            let names: BTreeSet<String> = names.filter(|name| name != "target").collect();
            names.into_iter().map(|name| name + "\n").collect()
        }
    };
    Ok(BookFile { path: in_book(path), text })
}

/// Returns the path without `.` and `..`; `None` if it leads out of the repository.
fn normal(path: &Path) -> Option<PathBuf> {
    let mut normal = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir if !normal.pop() => return None,
            Component::Normal(name) => normal.push(name),
            _ => {}
        }
    }
    Some(normal)
}

/// Returns the link from a folder of the book to one of its files.
fn relative(folder: &Path, file: &Path) -> String {
    let shared = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    let up = folder.components().skip(shared).map(|_| "..".to_owned());
    let down = file.components().skip(shared).map(|name| name.as_os_str().to_string_lossy().into());
    up.chain(down).collect::<Vec<String>>().join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_lead_from_folder_to_folder() {
        let link = |folder, file| relative(Path::new(folder), Path::new(file));
        assert_eq!(link("", "cli.md"), "cli.md");
        assert_eq!(link("lessons", "cli.md"), "../cli.md");
        assert_eq!(link("lessons", "lessons/hops.md"), "hops.md");
        assert_eq!(
            link("repository/robots", "files/lib/vec2.bzz.txt"),
            "../../files/lib/vec2.bzz.txt"
        );
    }

    #[test]
    fn paths_stay_in_the_repository() {
        assert_eq!(normal(Path::new("docs/../lib/./a.bzz")), Some("lib/a.bzz".into()));
        assert_eq!(normal(Path::new("docs/../../a")), None);
    }

    #[test]
    fn a_link_that_leads_nowhere_is_named() {
        let page = Path::new("docs/cli.md");
        let text = "see [there](../no/such.md#place)";
        let mut found = LinkedPaths::default();
        assert_eq!(relinked(crate::root(), page, text, &mut found), text);
        assert_eq!(found.broken, ["docs/cli.md: ../no/such.md#place"]);
    }

    #[test]
    fn links_are_written_for_the_book() {
        let mut found = LinkedPaths::default();
        let text = "[a](../lib/vec2.bzz), [b](../README.md#start), [c](scenario.md), [d](#e) and [f](https://g)";
        let content = relinked(crate::root(), Path::new("docs/cli.md"), text, &mut found);
        assert_eq!(
            content,
            "[a](files/lib/vec2.bzz.txt), [b](repository/index.md#start), [c](scenario.md), [d](#e) and [f](https://g)"
        );
        assert_eq!(found.pages, BTreeSet::from(["README.md".into()]));
        assert_eq!(found.files, BTreeSet::from(["lib/vec2.bzz".into()]));
    }
}
