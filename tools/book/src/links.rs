//! Checks the links of the generated book.

use anyhow::{Context, Result, ensure};
use fs_err as fs;
use html5ever::tendril::StrTendril;
use html5ever::tokenizer::states::RawKind;
use html5ever::tokenizer::{
    BufferQueue, Tag, TagKind, Token, TokenSink, TokenSinkResult, Tokenizer, TokenizerOpts,
};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The page that repeats all others for printing; its links are the same as theirs.
const PRINT: &str = "print.html";

/// The links and the anchors of a page.
#[derive(Default)]
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
            let page = BookPage::parse(&fs::read_to_string(&path)?);
            pages.insert(path, page);
        }
    }
    Ok(())
}

impl BookPage {
    fn parse(html: &str) -> BookPage {
        let input = BufferQueue::default();
        input.push_back(StrTendril::from_slice(html));
        let tokenizer = Tokenizer::new(Attributes::default(), TokenizerOpts::default());
        // No tag makes `Attributes` stop before the end of the input.
        let _ = tokenizer.feed(&input);
        tokenizer.end();
        tokenizer.sink.0.into_inner()
    }

    /// Adds the links and the anchor of an element.
    fn add(&mut self, tag: &Tag) {
        for attribute in &tag.attrs {
            let value = attribute.value.to_string();
            match &*attribute.name.local {
                "href" | "src" => self.links.push(value),
                "id" => drop(self.anchors.insert(value)),
                _ => {}
            }
        }
    }
}

/// Collects the attributes of all elements.
#[derive(Default)]
struct Attributes(RefCell<BookPage>);

impl TokenSink for Attributes {
    type Handle = ();

    fn process_token(&self, token: Token, _line: u64) -> TokenSinkResult<()> {
        let Token::TagToken(tag) = token else { return TokenSinkResult::Continue };
        if tag.kind == TagKind::EndTag {
            return TokenSinkResult::Continue;
        }
        self.0.borrow_mut().add(&tag);
        // The text in these elements is no HTML (HTML Living Standard, 13.4).
        match &*tag.name {
            "script" => TokenSinkResult::RawData(RawKind::ScriptData),
            "style" => TokenSinkResult::RawData(RawKind::Rawtext),
            "title" | "textarea" => TokenSinkResult::RawData(RawKind::Rcdata),
            _ => TokenSinkResult::Continue,
        }
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_and_anchors_are_those_of_elements() {
        let page = BookPage::parse(
            "<title><a href=title></title><h1 id=top>A</h1>\
             <script src=book.js>x = '<a href=script id=script>'</script>\
             <style>a::after { content: '<a href=style>' }</style>\
             <!-- <a href=comment> --><a HREF='b.html#c&amp;d' class=x>b</a><img src=\"e.svg\"/>",
        );
        assert_eq!(page.links, ["book.js", "b.html#c&d", "e.svg"]);
        assert_eq!(page.anchors, BTreeSet::from(["top".to_owned()]));
    }
}
