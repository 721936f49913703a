//! Diagnostics as people and programs see them.

use std::path::Path;

use bittybuzz_compiler::compile::{Options, compile};
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::parser::{Parsed, parse};
use bittybuzz_compiler::render::{ColorChoice, Renderer};

use crate::front::support::parse_text;

fn text(parsed: &Parsed, index: usize) -> String {
    Renderer::new(&parsed.sources).text(&parsed.diagnostics[index], ColorChoice::Never)
}

#[test]
fn headline_place_source_label_and_help() {
    let text = "log(1 == \"a\")\n".to_owned();
    let files = MemoryFiles::default();
    let loader = IncludeLoader::new(&files);
    let compiled = compile(Path::new("main.bzz"), text, &loader, &Options::default());
    let renderer = Renderer::new(&compiled.sources);
    let text = renderer.text(&compiled.diagnostics[0], ColorChoice::Never);
    let expected = "\
warning[W0305]: an integer never equals a string
 --> main.bzz:1:5
  |
1 | log(1 == \"a\")
  |     ^^^^^^^^ always false
  |
  = help: values of different types are unequal; no text is converted to a number
";
    assert_eq!(text, expected);
}

#[test]
fn a_short_help_stands_under_a_mark_without_label() {
    let parsed = parse_text("a = 1\nif(x = 3) { y = 1 }\n");
    let expected = "\
error[E0219]: an assignment is no condition
 --> main.bzz:2:6
  |
2 | if(x = 3) { y = 1 }
  |      ^ help: to compare, write `==`
";
    assert_eq!(text(&parsed, 0), expected);
}

#[test]
fn warnings_are_labeled() {
    let parsed = parse_text("if(not a and b) {}");
    let text = text(&parsed, 0);
    assert!(text.starts_with("warning[W0104]: "), "{text}");
    assert!(text.contains("this is `not (a and b)`"), "{text}");
}

#[test]
fn related_places_nearby_share_the_source_text() {
    let parsed = parse_text("function a() {\n  x = 1\n");
    let expected = "\
error[E0202]: `{` is never closed
 --> main.bzz:2:8
  |
1 | function a() {
  |              - this `{` is open
2 |   x = 1
  |        ^ `}` is missing
";
    assert_eq!(text(&parsed, 0), expected);
}

#[test]
fn related_places_far_away_have_their_own() {
    let parsed = parse_text(&format!("function a() {{\n{}", "  x = 1\n".repeat(100)));
    let text = text(&parsed, 0);
    assert!(text.contains("main.bzz:101:8"), "{text}");
    assert!(text.contains("main.bzz:1:14"), "{text}");
    assert!(text.lines().count() < 15, "{text}");
}

#[test]
fn the_place_is_that_of_the_source_map() {
    let text = "x = 1\n\n\tlog(“ä”)\r\ny = \"ü\" = 2\nz = (1\n\n\nw = = 3\nv = \n";
    let parsed = parse_text(text);
    assert!(parsed.diagnostics.len() >= 5, "{:?}", parsed.diagnostics);
    for (index, diagnostic) in parsed.diagnostics.iter().enumerate() {
        let at = parsed.sources.line_column(diagnostic.span);
        let place = format!("main.bzz:{}:{}", at.line, at.column);
        assert!(
            self::text(&parsed, index).contains(&place),
            "{place}\n{}",
            self::text(&parsed, index)
        );
    }
}

#[test]
fn included_files_are_named() {
    let files = MemoryFiles::default().with("lib/a.bzz", "\nx = = 1");
    let loader = IncludeLoader::new(&files);
    let parsed = parse(Path::new("main.bzz"), "include \"lib/a.bzz\"".to_owned(), &loader);
    assert!(text(&parsed, 0).contains("--> lib/a.bzz:2:5"), "{}", text(&parsed, 0));
}

#[test]
fn color_is_optional() {
    let parsed = parse_text("x = = 1");
    let renderer = Renderer::new(&parsed.sources);
    assert!(!renderer.text(&parsed.diagnostics[0], ColorChoice::Never).contains('\u{1b}'));
    assert!(renderer.text(&parsed.diagnostics[0], ColorChoice::Always).contains('\u{1b}'));
}

#[test]
fn a_script_cannot_control_the_terminal() {
    let parsed = parse_text("t = {\"\u{1b}[31m\n\" = 1}\nx = \"\u{1b}[0m\" = 1\n\u{7}\u{1b}");
    assert_eq!(parsed.diagnostics.len(), 3, "{:?}", parsed.diagnostics);
    for index in 0..3 {
        let text = text(&parsed, index);
        let bad = text.chars().find(|c| c.is_control() && *c != '\n');
        assert_eq!(bad, None, "{text:?}");
    }
}

/// The column of `character` in the line that marks the place, and the character above it.
fn marked(text: &str, character: char) -> (usize, Option<char>) {
    let lines: Vec<&str> = text.lines().collect();
    let under = lines.iter().position(|line| line.contains(character)).expect("a mark");
    let column = lines[under].chars().position(|c| c == character).expect("a mark");
    (column, lines[under - 1].chars().nth(column))
}

#[test]
fn long_lines_show_the_part_around_the_place() {
    for filling in [" ", "\t", "1 + ", "'ä' + "] {
        let before = filling.repeat(2000);
        let parsed = parse_text(&format!("x = {before}= 1{}\ny = 2", " ".repeat(2000)));
        let text = text(&parsed, 0);
        let column = "x = ".len() + before.chars().count() + 1;
        assert!(text.contains(&format!("--> main.bzz:1:{column}\n")), "{text}");
        assert!(text.contains("= 1"), "{text}");
        assert_eq!(marked(&text, '^').1, Some('='), "{text}");
        assert!(text.lines().all(|line| line.chars().count() < 180), "{text}");
    }
}

#[test]
fn places_in_a_long_line_are_shown_one_by_one() {
    let parsed = parse_text(&format!("x = (1{}\ny = 2", " + 1".repeat(1000)));
    let text = text(&parsed, 0);
    assert!(text.contains("main.bzz:1:4007"), "{text}");
    assert!(text.contains("main.bzz:1:5"), "{text}");
    assert!(text.contains("`)` is missing") && text.contains("this `(` is open"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() < 180), "{text}");
}

#[test]
fn a_long_mark_in_a_long_line_is_cut() {
    let parsed = parse_text(&format!("x = 1 + {}(2", "f(3)(".repeat(500)));
    assert!(!parsed.diagnostics.is_empty());
    let sum = parse_text(&format!("if(a == {}b) {{ x = 1 }}", "c + ".repeat(500)));
    for parsed in [parsed, sum] {
        for index in 0..parsed.diagnostics.len() {
            let text = text(&parsed, index);
            assert!(text.lines().all(|line| line.chars().count() < 300), "{text}");
        }
    }
}

#[test]
fn very_long_lines_show_only_the_place() {
    let parsed = parse_text(&format!("x = {}= 1", " ".repeat(100_000)));
    let text = text(&parsed, 0);
    assert!(text.len() < 300, "{}", text.len());
    assert!(text.contains("main.bzz:1:100005"), "{text}");
}

#[test]
fn long_spans_show_their_first_line() {
    let lines = "a,\n".repeat(50);
    let parsed = parse_text(&format!("f({lines}b) + 1"));
    assert!(text(&parsed, 0).lines().count() < 8, "{}", text(&parsed, 0));
}

#[test]
fn json_has_one_object_for_a_diagnostic() {
    let parsed = parse_text("x = \"ä\" y = (1\nz = 2");
    let line = Renderer::new(&parsed.sources).json(&parsed.diagnostics[0]).to_string();
    assert!(!line.contains('\n'));
    let object: serde_json::Value = serde_json::from_str(&line).unwrap();
    let expected = serde_json::json!({
        "code": "E0202",
        "severity": "error",
        "message": "`(` is never closed",
        "file": "main.bzz",
        "line": 1,
        "column": 15,
        "end_line": 1,
        "end_column": 15,
        "label": "`)` is missing",
        "help": null,
        "related": [{
            "file": "main.bzz",
            "line": 1,
            "column": 13,
            "end_line": 1,
            "end_column": 14,
            "label": "this `(` is open",
        }],
        "edits": [],
    });
    assert_eq!(object, expected);
}

#[test]
fn an_empty_file_has_a_place() {
    let files = MemoryFiles::default();
    let parsed =
        bittybuzz_compiler::parser::parse_file(Path::new("x.bzz"), &IncludeLoader::new(&files));
    assert!(text(&parsed, 0).contains("x.bzz:1:1"), "{}", text(&parsed, 0));
}
