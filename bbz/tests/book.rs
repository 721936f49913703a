//! Scripts in the book compile without a warning, and print the text that is shown below them.

use crate::support::Folder;
use std::fs;
use std::path::{Path, PathBuf};

/// A page of the book, and its name in messages.
struct Page {
    name: String,
    text: String,
}

/// A script of a page, and the block of text directly below it.
struct Script {
    line: usize,
    text: String,
    output: Option<String>,
}

fn pages() -> Vec<Page> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let mut paths: Vec<PathBuf> =
        ["language.md", "debugging.md", "data.md"].map(|name| docs.join(name)).into();
    let lessons = fs::read_dir(docs.join("lessons")).unwrap();
    // A test compares the scripts of the pages in French with these.
    paths.extend(lessons.map(|entry| entry.unwrap().path()).filter(|path| path.is_file()));
    paths.sort();
    let page = |path: PathBuf| Page {
        name: path.file_name().unwrap().to_string_lossy().into(),
        text: fs::read_to_string(path).unwrap(),
    };
    paths.into_iter().map(page).collect()
}

fn scripts(page: &str) -> Vec<Script> {
    let mut scripts: Vec<Script> = Vec::new();
    // True while nothing but blank lines came after a script.
    let mut is_after_script = false;
    let mut lines = page.lines().zip(1..);
    while let Some((line, number)) = lines.next() {
        let Some(language) = line.strip_prefix("```") else {
            is_after_script &= line.is_empty();
            continue;
        };
        let block = lines.by_ref().map(|(line, _)| line).take_while(|line| *line != "```");
        let text: String = block.map(|line| format!("{line}\n")).collect();
        match (language, scripts.last_mut()) {
            ("buzz", _) => scripts.push(Script { line: number, text, output: None }),
            ("text", Some(script)) if is_after_script => script.output = Some(text),
            _ => {}
        }
        is_after_script = language == "buzz";
    }
    scripts
}

#[test]
fn scripts_print_the_text_below_them() {
    let folder = Folder::new("book");
    let mut outputs = 0;
    let mut wrong = Vec::new();
    for Page { name, text } in pages() {
        for Script { line, text, output } in scripts(&text) {
            folder.write("a.bzz", text);
            let checked = folder.bbz(&["check", "a.bzz", "--deny", "warnings"]);
            if checked.status != Some(0) {
                wrong.push(format!("{name}:{line}: {}", checked.stderr));
            }
            if let Some(output) = output {
                let outcome = folder.bbz(&["run", "a.bzz", "--steps", "2"]);
                let printed = outcome.stdout + &outcome.stderr;
                if printed != output {
                    wrong.push(format!("{name}:{line} prints\n{printed}and not\n{output}"));
                }
                outputs += 1;
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(outputs >= 10, "{outputs} scripts with output");
}
