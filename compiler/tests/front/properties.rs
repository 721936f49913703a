//! What must hold for every input: no panic, an end, and places inside of the text.

use std::path::Path;

use bittybuzz_compiler::diagnostic::Severity;
use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles};
use bittybuzz_compiler::parser::{Parsed, parse, parse_file};
use bittybuzz_compiler::render::{ColorChoice, Renderer};
use proptest::prelude::*;

use crate::front::support::{expect_tree, parse_text};

const WORDS: &[&str] = &[
    "var",
    "if",
    "else",
    "function",
    "return",
    "for",
    "while",
    "and",
    "or",
    "not",
    "nil",
    "x",
    "y",
    "f",
    "t",
    "include",
    "elseif",
    "break",
    "in",
    "+",
    "-",
    "*",
    "/",
    "%",
    "^",
    "&",
    "|",
    "!",
    "<<",
    ">>",
    "==",
    "!=",
    "<",
    "<=",
    ">",
    ">=",
    "=",
    ".",
    ",",
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    "++",
    "&&",
    "..",
    "//",
    "/*",
    "\"s\"",
    "'",
    "\"",
    "1",
    "2.5",
    ".5",
    "0x1F",
    "1.2.3",
    "@",
    "“",
    "ä",
    "#",
    "\n",
    "\n",
    ";",
    "include 'a.bzz'",
    "if(x) {",
    "function f(a) {",
    "x = ",
    "f(",
    "{.a =",
    "\\",
    "\r\n",
];

fn word_soup() -> impl Strategy<Value = String> {
    prop::collection::vec(prop::sample::select(WORDS), 0..80).prop_map(|words| words.join(" "))
}

/// Correct scripts, some of whose tokens are removed, doubled or exchanged.
fn mutated_script() -> impl Strategy<Value = String> {
    const SCRIPT: &str = "include \"a.bzz\" ; var t = { .a = 1 , .2 = function ( x ) { return x + 1 } } \
        function step ( a , b ) \"doc\" { if ( a == b and not c ) { t . a = - 2 ^ 2 } else if ( d ) \
        return ; for ( i = 0 , i < 5 , i = i + 1 ) { log ( t [ i ] , \"s\" ) } while ( g ( ) ( ) ) x = 1 }";
    let words: Vec<&str> = SCRIPT.split(' ').collect();
    let count = words.len();
    let change = (0..count, 0..3, prop::sample::select(WORDS));
    prop::collection::vec(change, 1..6).prop_map(move |changes| {
        let mut words: Vec<Vec<&str>> = words.iter().map(|word| vec![*word]).collect();
        for (index, what, word) in changes {
            match what {
                0 => words[index].clear(),
                1 => words[index].push(word),
                _ => words[index] = vec![word],
            }
        }
        words.concat().join(" ")
    })
}

fn check(parsed: &Parsed) {
    let renderer = Renderer::new(&parsed.sources);
    for diagnostic in &parsed.diagnostics {
        let places = diagnostic.related.iter().map(|(span, _)| *span);
        for span in places.chain([diagnostic.span]) {
            let text = &parsed.sources.file(span.file).text;
            assert!(text.get(span.start as usize..span.end as usize).is_some(), "{diagnostic:?}");
        }
        let at = parsed.sources.line_column(diagnostic.span);
        let text = renderer.text(diagnostic, ColorChoice::Never);
        assert!(text.contains(&format!(":{}:{}", at.line, at.column)), "{at:?}\n{text}");
        renderer.json(diagnostic);
    }
    if parsed.diagnostics.iter().all(|d| d.severity() == Severity::Warning) {
        let tree = format!("{:?}", parsed.script);
        assert!(!tree.contains("Error"), "an error in the tree, but none reported");
    }
}

fn parse_with_files(text: String) -> Parsed {
    let files = MemoryFiles::default().with("a.bzz", "a = 1 include 'main.bzz'");
    parse(Path::new("main.bzz"), text, &IncludeLoader::new(&files))
}

proptest! {
    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let files = MemoryFiles::default().with("main.bzz", bytes);
        check(&parse_file(Path::new("main.bzz"), &IncludeLoader::new(&files)));
    }

    #[test]
    fn any_characters(text in any::<String>()) {
        check(&parse_text(&text));
    }

    #[test]
    fn any_punctuation(text in "[ -/:-@\\[-`{-~a\\n0]{0,100}") {
        check(&parse_text(&text));
    }

    #[test]
    fn any_words(text in word_soup()) {
        check(&parse_with_files(text));
    }

    #[test]
    fn damaged_scripts(text in mutated_script()) {
        let parsed = parse_with_files(text);
        check(&parsed);
        // A handful of mistakes gives a handful of messages.
        prop_assert!(parsed.diagnostics.len() < 30, "{:?}", parsed.diagnostics);
    }

    #[test]
    fn layout_does_not_change_the_hash(
        words in prop::collection::vec(prop::sample::select(&WORDS[..45]), 0..40),
        blank in prop::sample::select(&[" ", "\t", "\n", " # x\n", "\r\n"][..]),
    ) {
        let plain = parse_text(&words.join(" "));
        let spread = parse_text(&words.join(blank));
        prop_assert_eq!(plain.token_hash, spread.token_hash);
    }
}

#[test]
fn a_large_correct_script_is_parsed() {
    let text = "x = 1\n".repeat(1000);
    expect_tree(&text, &["(= x 1)"; 1000].join(" "));
}
