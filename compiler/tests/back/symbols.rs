//! Symbols: from numbers that a robot reports to names and places.

use bittybuzz_compiler::symbols::{FORMAT, SourceSpan, Symbols, SymbolsError};

use crate::back::machine::{FULL, TINY, image, run};

#[test]
fn a_fault_is_found_in_the_source() {
    let script = "function inner(x) {\n  return x + nil\n}\n\nlog(inner(1))";
    let (_, symbols) = image(script, FULL);
    let fault = run(script, FULL).fault.expect("faults");
    let place = symbols.position(u32::from(fault.position)).expect("is known");
    assert_eq!(place, SourceSpan { file: 0, line: 2, column: 10, end_line: 2, end_column: 17 });
    assert_eq!(symbols.function(u32::from(fault.position)).map(|f| f.name.as_str()), Some("inner"));
    assert_eq!(symbols.file(place.file), Some("test.bzz"));
}

#[test]
fn columns_count_characters() {
    let script = "s = \"\u{e9}\u{e9}\" x = 1 + nil";
    let (_, symbols) = image(script, FULL);
    let fault = run(script, FULL).fault.expect("faults");
    let place = symbols.position(u32::from(fault.position)).expect("is known");
    assert_eq!((place.column, place.end_column), (14, 21));
}

#[test]
fn every_fault_names_its_operation() {
    // What is marked, and the text that faults.
    let cases = [
        ("x = nil y = x.field", "x.field"),
        ("x = nil x.field = 1", "x.field = 1"),
        ("x = 5 y = x[1]", "x[1]"),
        ("x = 5 x()", "x()"),
        ("t = {} t.f(1)", "t.f(1)"),
        ("a = 1 b = a / 0", "a / 0"),
        ("t = {} t[nil] = 1", "t[nil] = 1"),
        ("x = {} if(x < 1) log(1)", "x < 1"),
        ("function f(a) { a = a + 1 return a } f(\"x\")", "a + 1"),
        ("function f(a) { return -a } f(\"x\")", "-a"),
        ("function f(a) { return 1 + a } f()", "a"),
        ("x = math.sqrt(\"a\")", "math.sqrt(\"a\")"),
    ];
    for (script, marked) in cases {
        for profile in [TINY, FULL] {
            let (_, symbols) = image(script, profile);
            let fault = run(script, profile).fault.expect(script);
            let place = symbols.position(u32::from(fault.position)).expect("is known");
            let text = &script[place.column as usize - 1..place.end_column as usize - 1];
            assert_eq!(text, marked, "{script}: {fault:?}");
        }
    }
}

#[test]
fn functions_have_names() {
    let script = "function f() { return function() { return 1 } }\nx = f()\nt = {\n.g = function() { return 2 } }\nx()";
    let (_, symbols) = image(script, TINY);
    let names: Vec<&str> = symbols.functions.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["global code", "f", "lambda at test.bzz:4", "lambda at test.bzz:1"]);
    assert_eq!(symbols.function(0).map(|f| f.name.as_str()), Some("global code"));
    assert_eq!(symbols.function(u32::MAX).map(|f| f.name.as_str()), Some("lambda at test.bzz:1"));
}

#[test]
fn symbols_survive_json() {
    let (_, symbols) =
        image("t = { .key = \"text \\\"quoted\\\"\" } led(1) function step() { log(t) }", TINY);
    let json = symbols.to_json();
    assert_eq!(Symbols::from_json(&json).unwrap(), symbols);
    assert!(
        json.starts_with(&format!("{{\"format\":{FORMAT},\"profile\":\"tiny\",\"script_hash\":")),
        "{json}"
    );
    // A row of the line table is offset, file, line, column, end line, end column.
    assert!(json.contains("\"lines\":[[2,0,1,5,"), "{json}");
}

/// Returns the texts of the statements, in the order of the code.
fn statements(script: &str) -> Vec<&str> {
    let (_, symbols) = image(script, FULL);
    let offsets: Vec<u32> = symbols.statements.iter().map(|entry| entry.offset).collect();
    assert!(offsets.is_sorted_by(|one, next| one < next), "{offsets:?}");
    let text = |place: SourceSpan| {
        let line = script.lines().nth(place.line as usize - 1).expect("is in the script");
        let end =
            if place.end_line == place.line { place.end_column - 1 } else { line.len() as u32 };
        &line[place.column as usize - 1..end as usize]
    };
    symbols.statements.iter().map(|entry| text(entry.place)).collect()
}

#[test]
fn statements_have_places() {
    assert_eq!(statements("x = 1\nlog(x)"), ["x = 1", "log(x)"]);
    assert_eq!(
        statements("x = 1\nif(x > 2) { log(1) } else if(x > 1) log(2) else log(3)"),
        ["x = 1", "x > 2", "log(1)", "x > 1", "log(2)", "log(3)"]
    );
    // The code of a loop's condition comes after that of its body.
    assert_eq!(
        statements("for(i = 0, i < 3, i = i + 1) {\n  log(i)\n}"),
        ["i = 0", "log(i)", "i = i + 1", "i < 3"]
    );
    assert_eq!(
        statements("function f(a) {\n  var b = a\n  return b\n}\nfunction step() { x = f(2) }"),
        ["x = f(2)", "var b = a", "return b"]
    );
}

#[test]
fn the_condition_of_a_loop_is_a_statement_in_each_turn() {
    let (_, symbols) = image("i = 5 while(i > 0) i = i - 1", TINY);
    let known = |text: u32| symbols.statements.iter().find(|entry| entry.place.column == text);
    let condition = known(13).expect("`i > 0` has a place");
    assert_eq!(symbols.statement(condition.offset), Some(condition.place));
    assert_eq!(symbols.statement(condition.offset + 1), None);
}

#[test]
fn bad_symbol_files_are_refused() {
    assert!(matches!(Symbols::from_json(""), Err(SymbolsError::Malformed(_))));
    assert!(matches!(Symbols::from_json("[]"), Err(SymbolsError::Malformed(_))));
    assert!(matches!(Symbols::from_json("{\"format\":3}"), Err(SymbolsError::Malformed(_))));
    assert!(matches!(Symbols::from_json("{\"format\":99}"), Err(SymbolsError::Format(99))));
    let old = Symbols::from_json("{\"format\":2}").unwrap_err().to_string();
    assert!(old.contains("format 2, older than format 3"), "{old}");
}

#[test]
fn bad_locals_are_refused() {
    let (_, symbols) = image("function f(a) { return a } log(f(1))", TINY);
    let json = symbols.to_json();
    let row = "[\"a\",\"frame\",-1,";
    assert!(json.contains(row), "{json}");
    for (bad, words) in [
        ("[\"a\",\"stack\",-1,", "unknown variant `stack`, expected `frame` or `capture`"),
        ("[\"a\",\"capture\",-1,", "`a` has no place -1"),
        ("[\"a\",\"frame\",40000,", "`a` has no place 40000"),
        ("[\"a\",\"frame\",", "invalid length 4"),
    ] {
        let error = Symbols::from_json(&json.replace(row, bad)).unwrap_err().to_string();
        assert!(error.contains(words) && error.contains("line 1 column"), "{error}");
    }
}

#[test]
fn empty_symbols_have_no_names() {
    let (_, mut symbols) = image("x = 1", FULL);
    symbols.lines.clear();
    symbols.functions.clear();
    assert_eq!(symbols.position(0), None);
    assert_eq!(symbols.function(0), None);
    assert_eq!(symbols.file(7), None);
}
