//! Checks the links of the generated book.

use anyhow::{Context, Result, ensure};
use fs_err as fs;
use scraper::{Html, Selector};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The page that repeats all others for printing; its links are the same as theirs.
const PRINT: &str = "print.html";

/// The links and the anchors of a page.
struct BookPage {
    links: Vec<String>,
    anchors: BTreeSet<String>,
}

/// Checks all links, and fails with the list of those that lead nowhere.
pub fn check(book: &Path) -> Result<()> {
    let mut pages = BTreeMap::new();
    read(book, &mut pages)?;
    let mut broken = Vec::new();
    let mut links = 0;
    for (path, page) in &pages {
        for link in &page.links {
            links += 1;
            if !leads_somewhere(&pages, path, link)? {
                broken.push(format!("{}: {link}", path.strip_prefix(book)?.display()));
            }
        }
    }
    ensure!(links > 0, "no links in {}", book.display());
    ensure!(broken.is_empty(), "links that lead nowhere:\n{}", broken.join("\n"));
    println!("{links} links of {} pages lead somewhere", pages.len());
    Ok(())
}

/// Reads all pages of a folder and its subfolders.
fn read(folder: &Path, pages: &mut BTreeMap<PathBuf, BookPage>) -> Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            read(&path, pages)?;
        } else if path.extension().is_some_and(|ending| ending == "html") && !path.ends_with(PRINT)
        {
            let html = Html::parse_document(&fs::read_to_string(&path)?);
            let page = BookPage {
                links: values(&html, "[href], [src]", &["href", "src"]),
                anchors: values(&html, "[id]", &["id"]).into_iter().collect(),
            };
            pages.insert(path, page);
        }
    }
    Ok(())
}

/// Returns the values of attributes of all elements that match a selector.
fn values(html: &Html, selector: &'static str, attributes: &[&str]) -> Vec<String> {
    let Ok(selector) = Selector::parse(selector) else { return Vec::new() };
    let elements = html.select(&selector);
    let values = elements
        .flat_map(|element| attributes.iter().filter_map(move |name| element.value().attr(name)));
    values.map(str::to_owned).collect()
}

fn leads_somewhere(pages: &BTreeMap<PathBuf, BookPage>, from: &Path, link: &str) -> Result<bool> {
    if link.contains("://") || link.starts_with("data:") {
        return Ok(true);
    }
    let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
    let target = match path {
        "" => from.to_owned(),
        path => {
            let folder = from.parent().context("a page without a folder")?;
            let Ok(target) = fs::canonicalize(folder.join(path)) else { return Ok(false) };
            target
        }
    };
    if anchor.is_empty() {
        return Ok(target.exists());
    }
    Ok(pages.get(&target).is_some_and(|page| page.anchors.contains(anchor)))
}
