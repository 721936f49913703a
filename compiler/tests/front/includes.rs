//! Where includes are searched, that each file is read once, and what can be wrong with a file.

use std::path::{Path, PathBuf};

use bittybuzz_compiler::include::{IncludeLoader, MemoryFiles, SOURCE_BYTES_MAX};
use bittybuzz_compiler::parser::{Parsed, parse, parse_file};

use crate::front::support::{found, stmts};

/// Parses `text` as the script at `path`; nothing else is configured than the files.
fn parse_at(path: &str, text: &str, files: &MemoryFiles) -> Parsed {
    parse(Path::new(path), text.to_owned(), &IncludeLoader::new(files))
}

fn tree(parsed: &Parsed) -> String {
    assert!(!parsed.has_errors(), "{:#?}", parsed.diagnostics);
    stmts(&parsed.script.stmts)
}

/// The diagnostics as `path CODE line:column`.
fn placed(parsed: &Parsed) -> Vec<String> {
    let paths = parsed.diagnostics.iter().map(|d| parsed.sources.path(d.span.file).display());
    paths.zip(found(parsed)).map(|(path, at)| format!("{path} {at}")).collect()
}

#[test]
fn statements_of_the_file_stand_in_the_place_of_the_include() {
    let files = MemoryFiles::default().with("a.bzz", "b = 2 c = 3");
    let parsed = parse_at("main.bzz", "a = 1 include \"a.bzz\" d = 4", &files);
    assert_eq!(tree(&parsed), "(= a 1) (= b 2) (= c 3) (= d 4)");
    let parsed = parse_at("main.bzz", "function f() { include 'a.bzz' return b }", &files);
    assert_eq!(tree(&parsed), "(function f () {(= b 2) (= c 3) (return b)})");
}

#[test]
fn a_statement_ends_with_its_file() {
    let files = MemoryFiles::default().with("a.bzz", "a = b");
    let parsed = parse_at("main.bzz", "include 'a.bzz'\nf(1)\n", &files);
    assert_eq!(tree(&parsed), "(= a b) f(1)");
    let parsed = parse_at("main.bzz", "return\ninclude 'a.bzz'", &files);
    assert_eq!(tree(&parsed), "(return) (= a b)");
}

#[test]
fn every_file_is_read_once() {
    let files = MemoryFiles::default()
        .with("a.bzz", "include 'lib/b.bzz' a = 1")
        .with("lib/b.bzz", "include \"../a.bzz\" include \"b.bzz\" include '../main.bzz' b = 1")
        .with("main.bzz", "include 'a.bzz' include './lib/../lib/b.bzz' include 'a.bzz' m = 1");
    let parsed = parse_file(Path::new("main.bzz"), &IncludeLoader::new(&files));
    assert_eq!(tree(&parsed), "(= b 1) (= a 1) (= m 1)");
    assert!(parsed.diagnostics.is_empty());
    let paths: Vec<_> = parsed.sources.files().map(|(_, file)| file.path.clone()).collect();
    assert_eq!(paths, [PathBuf::from("main.bzz"), "a.bzz".into(), "lib/b.bzz".into()]);
}

#[test]
fn the_folder_of_the_including_file_comes_first() {
    let files = MemoryFiles::default()
        .with("scripts/x.bzz", "here = 1")
        .with("x.bzz", "working = 1")
        .with("inc/x.bzz", "folder = 1")
        .with("env/x.bzz", "environment = 1");
    let library = [("x.bzz", "library = 1")];
    let mut expected = vec!["here", "working", "folder", "environment", "library"];
    let folders = ["scripts/x.bzz", "x.bzz", "inc/x.bzz", "env/x.bzz"];
    for removed in 0..=folders.len() {
        let mut left = MemoryFiles::default();
        for (path, text) in folders.iter().zip(&expected).skip(removed) {
            left = left.with(path, format!("{text} = 1"));
        }
        let loader = IncludeLoader {
            folders: vec!["inc".into()],
            environment: vec!["env".into()],
            library: &library,
            ..IncludeLoader::new(&left)
        };
        let parsed = parse(Path::new("scripts/main.bzz"), "include 'x.bzz'".to_owned(), &loader);
        assert_eq!(tree(&parsed), format!("(= {} 1)", expected[removed]));
        let warned = !parsed.diagnostics.is_empty();
        assert_eq!(warned, expected[removed] == "working", "{removed}");
    }
    expected.clear();
    let parsed = parse_at("scripts/main.bzz", "include 'x.bzz'", &files);
    assert_eq!(tree(&parsed), "(= here 1)");
}

#[test]
fn the_working_folder_warns() {
    let files = MemoryFiles::default().with("x.bzz", "a = 1");
    let parsed = parse_at("scripts/main.bzz", "b = 1\ninclude 'x.bzz'", &files);
    assert_eq!(placed(&parsed), ["scripts/main.bzz W0107 2:1"]);
    let parsed = parse_at("main.bzz", "include 'x.bzz'", &files);
    assert!(parsed.diagnostics.is_empty());
}

/// Programs for installations of Buzz, whose search path ends above the library, write the folder.
#[test]
fn the_library_is_also_the_folder_include() {
    let library = [("vec2.bzz", "v = 1")];
    let placed_in = |files: &MemoryFiles, text: &str| {
        let loader = IncludeLoader { library: &library, ..IncludeLoader::new(files) };
        placed(&parse(Path::new("main.bzz"), text.to_owned(), &loader))
    };
    let none = MemoryFiles::default();
    assert_eq!(placed_in(&none, "include 'include/vec2.bzz'"), [""; 0]);
    // A file of one's own comes first.
    let own = MemoryFiles::default().with("include/vec2.bzz", "w = = 1");
    assert_eq!(placed_in(&own, "include 'include/vec2.bzz'"), ["include/vec2.bzz E0201 1:5"]);
    assert_eq!(placed_in(&none, "include 'other/vec2.bzz'"), ["main.bzz E0301 1:1"]);
}

#[test]
fn the_library_includes_itself() {
    let files = MemoryFiles::default().with("table.bzz", "mine = 1");
    let library = [("queue.bzz", "include 'table.bzz' q = 1"), ("table.bzz", "t = = 1")];
    let loader = IncludeLoader { library: &library, ..IncludeLoader::new(&files) };
    let text = "include \"queue.bzz\"\ninclude \"table.bzz\"".to_owned();
    let parsed = parse(Path::new("main.bzz"), text, &loader);
    assert_eq!(placed(&parsed), ["<library>/table.bzz E0201 1:5"]);
    assert_eq!(stmts(&parsed.script.stmts), "(= t <error>) (= q 1) (= mine 1)");
}

#[test]
fn a_missing_file_names_the_searched_folders_and_similar_files() {
    let files = MemoryFiles::default().with("scripts/formation.bzz", "").with("inc/x.bzz", "");
    let library = [("vec2.bzz", "")];
    let loader = IncludeLoader {
        folders: vec!["inc".into()],
        library: &library,
        ..IncludeLoader::new(&files)
    };
    let text = "x = 1\ninclude \"formatoin.bzz\"\ninclude 'vec.bzz'\ninclude 'q'\ny = = 2";
    let parsed = parse(Path::new("scripts/main.bzz"), text.to_owned(), &loader);
    assert_eq!(found(&parsed), ["E0301 2:1", "E0301 3:1", "E0301 4:1", "E0201 5:5"]);
    let help = |index: usize| parsed.diagnostics[index].help.clone().unwrap_or_default();
    for place in ["`formation.bzz`", "`scripts`", "the working folder", "`inc`", "<library>"] {
        assert!(help(0).contains(place), "{}", help(0));
    }
    assert!(help(1).contains("did you mean `vec2.bzz`"), "{}", help(1));
    assert!(!help(2).contains("did you mean"), "{}", help(2));
}

#[test]
fn errors_point_into_the_included_file() {
    let files =
        MemoryFiles::default().with("lib/a.bzz", "a = 1\nb = = 2").with("b.bzz", "if(x) {\n");
    let text = "include 'lib/a.bzz'\ninclude 'b.bzz'\nc = = 3";
    let parsed = parse_at("main.bzz", text, &files);
    let expected = ["main.bzz E0201 3:5", "lib/a.bzz E0201 2:5", "b.bzz E0202 1:8"];
    assert_eq!(placed(&parsed), expected);
}

#[test]
fn an_include_stands_where_a_statement_may_stand() {
    let files = MemoryFiles::default().with("a.bzz", "a = 1");
    for (text, place) in [
        ("x = include \"a.bzz\"\ny = 1", "E0302 1:5"),
        ("f(include \"a.bzz\")", "E0302 1:3"),
        ("x = 1 + include \"a.bzz\"", "E0302 1:9"),
        ("if(x) include \"a.bzz\"\ny = 1", "E0302 1:7"),
        ("t = {.a = 1, include \"a.bzz\"}", "E0302 1:14"),
    ] {
        assert_eq!(found(&parse_at("main.bzz", text, &files)), [place], "{text}");
    }
    let parsed = parse_at("main.bzz", "if(x) { include \"a.bzz\" }", &files);
    assert_eq!(tree(&parsed), "(if x {(= a 1)})");
}

#[test]
fn an_include_needs_a_string() {
    let files = MemoryFiles::default().with("a.bzz", "a = 1");
    for text in ["include a", "include(\"a.bzz\")", "include"] {
        assert_eq!(found(&parse_at("main.bzz", text, &files)), ["E0306 1:1"], "{text}");
    }
    assert_eq!(found(&parse_at("main.bzz", "include \"a.bzz", &files)), ["E0102 1:9"]);
}

#[test]
fn files_that_are_no_scripts() {
    let files = MemoryFiles::default()
        .with("latin1.bzz", b"x = 1\n# caf\xe9\n".as_slice())
        .with("huge.bzz", vec![b' '; SOURCE_BYTES_MAX + 1])
        .with("full.bzz", vec![b' '; SOURCE_BYTES_MAX])
        .with_unreadable("secret.bzz");
    for (name, code, words) in [
        ("latin1.bzz", "E0304", "offset 11"),
        ("huge.bzz", "E0305", "1048576 bytes"),
        ("secret.bzz", "E0303", "permission denied"),
    ] {
        let parsed = parse_at("main.bzz", &format!("y = 2\ninclude '{name}'\n"), &files);
        assert_eq!(found(&parsed), [format!("{code} 2:1")], "{name}");
        assert!(parsed.diagnostics[0].message.contains(words), "{:?}", parsed.diagnostics);
        let parsed = parse_file(Path::new(name), &IncludeLoader::new(&files));
        assert_eq!(parsed.diagnostics.len(), 1, "{name}");
        assert_eq!(parsed.diagnostics[0].code.text(), code, "{name}");
        assert!(parsed.diagnostics[0].message.contains(words), "{:?}", parsed.diagnostics);
    }
    let parsed = parse_file(Path::new("latin1.bzz"), &IncludeLoader::new(&files));
    assert_eq!(found(&parsed), ["E0304 2:6"]);
    let parsed = parse_file(Path::new("full.bzz"), &IncludeLoader::new(&files));
    assert!(parsed.diagnostics.is_empty());
    let parsed = parse_file(Path::new("nowhere.bzz"), &IncludeLoader::new(&files));
    assert_eq!(found(&parsed), ["E0303 1:1"]);
    let parsed = parse_at("main.bzz", &" ".repeat(SOURCE_BYTES_MAX), &files);
    assert!(parsed.diagnostics.is_empty());
    let parsed = parse_at("main.bzz", &" ".repeat(SOURCE_BYTES_MAX + 1), &files);
    assert_eq!(found(&parsed), ["E0305 1:1"]);
}

#[test]
fn the_hash_does_not_depend_on_how_a_script_is_split() {
    let files = MemoryFiles::default().with("a.bzz", "b = 2 # two\n").with("lib/c.bzz", "b = 2");
    let whole = parse_at("main.bzz", "a = 1 b = 2 c = 3", &files);
    let split = parse_at("main.bzz", "a = 1 include 'a.bzz' include 'a.bzz' c = 3", &files);
    let moved = parse_at("other.bzz", "a = 1\ninclude 'lib/c.bzz'\nc = 3", &files);
    assert_eq!(whole.token_hash, split.token_hash);
    assert_eq!(whole.token_hash, moved.token_hash);
}

#[test]
fn long_chains_of_includes_do_not_overflow_the_stack() {
    let mut files = MemoryFiles::default();
    for number in 0..2000 {
        files = files.with(format!("{number}.bzz"), format!("include '{}.bzz'", number + 1));
    }
    let parsed = parse_at("main.bzz", "include '0.bzz'", &files.with("2000.bzz", "x = 1"));
    let codes: Vec<_> = parsed.diagnostics.iter().map(|d| d.code.text()).collect();
    assert_eq!(codes, ["E0216"]);
}

#[test]
fn files_on_disk() {
    use bittybuzz_compiler::include::{DiskFiles, Files};
    let this_file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/front/includes.rs");
    let roundabout = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/../tests/front/includes.rs");
    assert_eq!(DiskFiles.canonical(&this_file), DiskFiles.canonical(&roundabout));
    assert!(DiskFiles.canonical(&this_file).is_some());
    assert_eq!(DiskFiles.canonical(this_file.parent().unwrap()), None);
    assert!(
        DiskFiles.read(&this_file, SOURCE_BYTES_MAX).unwrap().starts_with(b"//! Where includes")
    );
    let names = DiskFiles.names(this_file.parent().unwrap());
    assert!(names.contains(&"includes.rs".to_owned()), "{names:?}");
}
