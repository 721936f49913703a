//! Debug files.

use std::path::Path;

use bittybuzz_compiler::bo::debug::{DebugError, DebugInfo, DebugPlace};
use bittybuzz_compiler::bo::read::Bo;
use bittybuzz_compiler::bo::{Imported, Warning, import};
use bittybuzz_robot_spec::NumberProfile;

use crate::bo::machine::recorder;
use crate::bo::vectors::{self, Vector};

fn record(offset: u32, line: u64, column: u64, file: &str) -> Vec<u8> {
    let mut bytes = offset.to_le_bytes().to_vec();
    bytes.extend(line.to_le_bytes());
    bytes.extend(column.to_le_bytes());
    bytes.extend((file.len() as u16).to_le_bytes());
    bytes.extend(file.bytes());
    bytes
}

/// What the reference compiler wrote for `x = 1`.
fn of_global() -> Vec<u8> {
    [
        record(5, 1, 2, "/p/v.bzz"),
        record(10, 1, 4, "/p/v.bzz"),
        record(15, 0, 1, "(null)"),
        record(16, 0, 1, "(null)"),
    ]
    .concat()
}

fn import_with(vector: &Vector, debug: &[u8]) -> Imported {
    import(Path::new("v.bo"), vector.bytes, Some(debug), &recorder(NumberProfile::Full))
        .expect("a program")
}

#[test]
fn file_of_the_reference() {
    let bo = Bo::read(vectors::GLOBAL.bytes).expect("a vector");
    let debug = of_global();
    assert_eq!(debug[..4], [5, 0, 0, 0]);
    let info = DebugInfo::read(&debug, &bo).expect("a debug file");
    assert_eq!(info.files, ["/p/v.bzz"]);
    assert_eq!(info.place(5), Some(DebugPlace { file: 0, line: 1, column: 2 }));
    assert_eq!(info.place(10), Some(DebugPlace { file: 0, line: 1, column: 4 }));
    // Behind the end of the script there is no place.
    assert_eq!(info.place(15), None);
    assert_eq!(info.place(4), None);
}

#[test]
fn symbols_name_places_of_the_script() {
    let bytes = [record(10, 7, 4, "/p/v.bzz"), record(15, 8, 1, "/p/w.bzz")].concat();
    let symbols = import_with(&vectors::GLOBAL, &bytes).compiled.symbols.expect("an image");
    assert_eq!(symbols.files, ["v.bo", "/p/v.bzz", "/p/w.bzz"]);
    let places: Vec<_> = symbols
        .lines
        .iter()
        .map(|entry| (symbols.file(entry.place.file).unwrap_or("?"), entry.place.line))
        .collect();
    // The value, the assignment, and the end, which has the place of the last statement.
    assert_eq!(places, [("/p/v.bzz", 7), ("/p/w.bzz", 8), ("/p/w.bzz", 8)]);
    // What the debug file does not know is a line of the listing.
    let symbols = import_with(&vectors::GLOBAL, &record(10, 7, 4, "/p/v.bzz")).compiled.symbols;
    let place = symbols.expect("an image").lines[1].place;
    assert_eq!((place.file, place.line, place.column), (0, 4, 1));
}

#[test]
fn without_debug_file_places_are_lines_of_the_listing() {
    let imported =
        import(Path::new("v.bo"), vectors::LAMBDA.bytes, None, &recorder(NumberProfile::Full));
    let symbols = imported.expect("a program").compiled.symbols.expect("an image");
    assert_eq!(symbols.files, ["v.bo"]);
    let listing = bittybuzz_compiler::bo::disassemble(vectors::LAMBDA.bytes).expect("a program");
    let line =
        listing.lines().position(|line| line.starts_with("77: lload 2")).expect("the lambda");
    let names: Vec<&str> =
        symbols.functions.iter().map(|function| function.name.as_str()).collect();
    assert!(names.contains(&format!("lambda at v.bo:{}", line + 1).as_str()), "{names:?}");
}

#[test]
fn lambdas_are_named_by_their_place_in_the_script() {
    let imported = import_with(&vectors::LAMBDA, &record(77, 2, 23, "/p/v.bzz"));
    let symbols = imported.compiled.symbols.expect("an image");
    let names: Vec<&str> =
        symbols.functions.iter().map(|function| function.name.as_str()).collect();
    assert!(names.contains(&"lambda at /p/v.bzz:2"), "{names:?}");
}

#[test]
fn diagnostics_name_the_place_in_the_script() {
    // `h` in line 3 is pushed at offset 66.
    let at = vectors::METHODS.bytes.windows(5).position(|w| w == [0x25, 3, 0, 0, 0]).expect("h");
    let imported = import_with(&vectors::METHODS, &record(at as u32, 3, 2, "/p/v.bzz"));
    let labels: Vec<_> = imported.compiled.diagnostics.iter().map(|d| &d.label).collect();
    assert!(labels.iter().any(|label| label.ends_with("(/p/v.bzz:3:2)")), "{labels:?}");
}

#[test]
fn damaged_debug_file_is_a_warning() {
    let damaged = |bytes: &[u8]| {
        let imported = import_with(&vectors::GLOBAL, bytes);
        assert!(imported.compiled.image.is_some());
        imported.warnings
    };
    let whole = of_global();
    assert_eq!(damaged(&whole), []);
    assert_eq!(damaged(&[]), []);
    assert_eq!(damaged(&whole[..10]), [Warning::Debug(DebugError::Truncated(0))]);
    assert_eq!(damaged(&whole[..40]), [Warning::Debug(DebugError::Truncated(30))]);
    assert_eq!(damaged(&record(6, 1, 1, "f")), [Warning::Debug(DebugError::OtherProgram(0))]);
    let mut bytes = record(5, 1, 1, "f");
    bytes[22] = 0xff;
    assert_eq!(damaged(&bytes), [Warning::Debug(DebugError::NotUtf8(0))]);
    // Absurd numbers are no problem.
    assert_eq!(damaged(&record(5, u64::MAX, u64::MAX, "f")), []);
}
