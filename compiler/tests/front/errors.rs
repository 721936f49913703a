//! Every error of the parser: code and place, one message for one mistake, and what is found after it.

use bittybuzz_compiler::parser::NESTING_MAX;

use crate::front::support::{expect, expect_words, parse_text, stmts};

#[test]
fn unexpected_tokens() {
    expect("x = * 3", &["E0201 1:5"]);
    expect("x = ", &["E0201 1:4"]);
    expect("= 3", &["E0201 1:1"]);
    expect("x = 5 5", &["E0201 1:7"]);
    expect("x = a == ", &["E0201 1:9"]);
    expect("f(a b)", &["E0201 1:5"]);
    expect("x = [1, 2]", &["E0201 1:5"]);
    expect("t. = 3", &["E0201 1:4"]);
    expect("var 1 = 2", &["E0201 1:5"]);
    expect("function 1() {}", &["E0201 1:10"]);
    expect("function f {}", &["E0201 1:12"]);
    expect("function f() return 1", &["E0201 1:14"]);
    expect("x = 1 + not a", &["E0201 1:9"]);
    expect("x = a == not b", &["E0201 1:10"]);
    expect("a, b = 1, 2", &["E0201 1:2"]);
    expect("var a, b", &["E0201 1:6"]);
    expect("var t.x = 1", &["E0201 1:6"]);
    expect("return x = 3", &["E0201 1:10"]);
    expect("x = if", &["E0201 1:5"]);
}

#[test]
fn every_error_of_a_run_is_found() {
    expect(
        "x = * 1\ny = 2\nz = = 3\nif(a { b = ] }\nw = (1 + )",
        &["E0201 1:5", "E0201 3:5", "E0202 4:5", "E0201 4:12", "E0201 5:10"],
    );
    expect("function f(a) {\n x = *\n y = /\n}\nz = %", &["E0201 2:6", "E0201 3:6", "E0201 5:5"]);
    expect("f(function() { x = * 1 }, 2)\ny = *", &["E0201 1:20", "E0201 2:5"]);
}

#[test]
fn a_missing_value_does_not_take_the_next_line() {
    expect("x =\ny = 3", &["E0201 1:4"]);
    expect("x = 4 +\ny = 5", &["E0201 1:8"]);
    expect("x = a and\nt.y = 5", &["E0201 1:10"]);
    let parsed = parse_text("x =\ny = 3");
    assert_eq!(stmts(&parsed.script.stmts), "(= x <error>) (= y 3)");
}

#[test]
fn keywords_are_no_names() {
    expect("var for = 1\nx = 2", &["E0201 1:5"]);
    expect("function while() {}", &["E0201 1:10"]);
    expect("function f(if) {}", &["E0201 1:12"]);
    expect("t.if = 3", &["E0201 1:3"]);
    expect("x = {.else = 1}", &["E0201 1:7"]);
    expect_words("var for = 1", &["`for` is a keyword"]);
    expect_words("t.if = 3", &["[\"if\"]"]);
}

#[test]
fn unclosed_brackets_point_at_the_opening_one() {
    for (text, place, opening) in [
        ("foo(a, b\nx = 1", "E0202 1:9", (1, 4)),
        ("y = (1 + 2\nx = 1", "E0202 1:11", (1, 5)),
        ("z = t[1\nx = 1", "E0202 1:8", (1, 6)),
        ("t = {.a = 1\nx = 1", "E0202 1:12", (1, 5)),
        ("if(a) {\n x = 1\n", "E0202 2:7", (1, 7)),
        ("if(a {\n x = 1\n}", "E0202 1:5", (1, 3)),
        ("while(f(a) {\n x = 1\n}", "E0202 1:11", (1, 6)),
        ("function f(a, b {\n}", "E0202 1:16", (1, 11)),
        ("x = f(", "E0202 1:7", (1, 6)),
        ("x = {", "E0202 1:6", (1, 5)),
        ("x = t[", "E0202 1:7", (1, 6)),
        ("function f() { if(x) { y = 1 }\n", "E0202 1:31", (1, 14)),
    ] {
        expect(text, &[place]);
        let parsed = parse_text(text);
        let at = parsed.sources.line_column(parsed.diagnostics[0].related[0].0);
        assert_eq!((at.line, at.column), opening, "{text}");
    }
}

#[test]
fn a_missing_brace_is_noticed_at_the_next_function() {
    let text = "function a() {\n  x = 1\n\nfunction b() {\n  y = = 2\n}";
    expect(text, &["E0202 2:8", "E0201 5:7"]);
    let parsed = parse_text(text);
    assert_eq!(parsed.script.stmts.len(), 2);
}

#[test]
fn a_missing_opening_brace_gives_one_error() {
    expect("function f(a)\n  return a\n}\nx = 1", &["E0201 1:14"]);
    expect("x = function(a) return a }\ny = = 1", &["E0201 1:17", "E0201 2:5"]);
    expect("f(function(a) if(a) { b() } }, 2)\ny = = 1", &["E0201 1:15", "E0201 2:5"]);
    expect("if(a) x = 1 }\nelse { y = 1 }", &["E0203 1:13"]);
    // Where the closing one is missing, too, the rest is no body.
    let parsed = parse_text("function f(a) return a\nfunction g() {}");
    assert_eq!(codes(&parsed), ["E0201"]);
    assert_eq!(stmts(&parsed.script.stmts), "(function g () {})");
}

#[test]
fn a_missing_parenthesis_before_a_body_gives_one_error() {
    expect("foreach(t, function(k, v { log(k) })\ny = = 1", &["E0202 1:25", "E0201 2:5"]);
    expect("f(function() { if(a { b() } })\ny = = 1", &["E0202 1:20", "E0201 2:5"]);
    expect("f(a {.x = 1})", &["E0201 1:5"]);
}

#[test]
fn unmatched_closing_brackets() {
    expect("x = 1 }\ny = = 2", &["E0203 1:7", "E0201 2:5"]);
    expect("foo())\ny = = 2", &["E0203 1:6", "E0201 2:5"]);
    expect("x = 1 ]", &["E0203 1:7"]);
    expect("x = 1 }}}\n}", &["E0203 1:7", "E0203 2:1"]);
}

#[test]
fn an_unmatched_brace_does_not_end_the_script() {
    let parsed = parse_text("x = 1 }\nfunction f() {}");
    assert_eq!(stmts(&parsed.script.stmts), "(= x 1) (function f () {})");
}

#[test]
fn comparisons_do_not_chain() {
    expect("x = a < b < c", &["E0204 1:11"]);
    expect("if(a == b == c) {}", &["E0204 1:11"]);
    expect("x = (a < b) == c", &[]);
    expect_words("x = a < b < c", &["a < b and b < c"]);
}

#[test]
fn table_literals_are_no_operands() {
    expect("x = {} + 1", &["E0205 1:5"]);
    expect("x = 1 + {}", &["E0205 1:9"]);
    expect("x = -{}", &["E0205 1:6"]);
    expect("x = 2 ^ {.a = 1} ^ 2", &["E0205 1:9"]);
}

#[test]
fn trailing_commas() {
    expect("t = {.a = 1,}", &["E0206 1:12"]);
    expect("f(a,)", &["E0206 1:4"]);
    expect("function f(a,) {}", &["E0206 1:13"]);
    expect("t = {.a = 1,\n}", &["E0206 1:12"]);
}

#[test]
fn calls_are_no_targets() {
    expect("f() = 3", &["E0207 1:1"]);
    expect("t.a[1].f(2) = 3", &["E0207 1:1"]);
}

#[test]
fn bare_blocks() {
    expect("{ x = 1 }\ny = 2", &["E0208 1:1"]);
    expect("{ x = * }\ny = *", &["E0208 1:1", "E0201 1:7", "E0201 2:5"]);
    expect("{}", &["E0208 1:1"]);
    expect("{.a = 1}", &["E0214 1:1"]);
}

#[test]
fn named_functions_stand_outside_of_blocks() {
    expect("function f() {\n  function g() {}\n}", &["E0209 2:12"]);
    expect("if(a) {\n  function g() {}\n}", &["E0209 2:12"]);
    expect("if(a) function g() {}", &["E0209 1:16"]);
    expect("x = function() { function g(a) { y = * } }", &["E0209 1:27", "E0201 1:38"]);
    expect_words("if(a) { function g() {} }", &["`var g = function(...) { ... }`"]);
    let parsed = parse_text("function f() { function g(a) { return a } }");
    let expected = "(function f () {(var g (lambda (a) {(return a)}))})";
    assert_eq!(stmts(&parsed.script.stmts), expected);
}

#[test]
fn functions_need_names() {
    expect("function (a) { x = * }", &["E0210 1:1", "E0201 1:20"]);
    expect("function t.f(a) { x = * }", &["E0201 1:10", "E0201 1:23"]);
    expect_words("function t.f(a) {}", &["`t.f = function(...) { ... }`"]);
    expect("x = function foo() {}", &["E0201 1:14"]);
    expect("function f(a = 1) {}", &["E0201 1:14"]);
    expect_words("function f(a = 1) {}", &["no default values"]);
}

#[test]
fn heads_of_for_loops() {
    expect("for(var i = 0, i < 5, i = i + 1) {}", &["E0211 1:5"]);
    expect("for(i = 0; i < 5; i = i + 1) {}", &["E0212 1:10"]);
    expect(
        "for(var i = 0; i < 5; i = i + 1) { x = * }",
        &["E0211 1:5", "E0212 1:14", "E0201 1:40"],
    );
    expect("for(;;) {}", &["E0212 1:5"]);
    expect("for(i = 0, i < 5) {}", &["E0201 1:17"]);
    expect("for(i, i < 5, i = i + 1) {}", &["E0214 1:5"]);
    expect("for(k, v in t) { x = * }", &["E0217 1:10", "E0201 1:22"]);
    expect("for(x in t) {}", &["E0217 1:7"]);
    expect("for i = 0, 5 { x = * }", &["E0201 1:5", "E0201 1:20"]);
    expect_words("for(x in t) {}", &["foreach(t"]);
}

#[test]
fn conditions_stand_in_parentheses() {
    expect("if x > 3 { y = * }", &["E0213 1:4", "E0201 1:16"]);
    expect("while x {}", &["E0213 1:7"]);
    expect("if (a) or (b) { y = 1 }", &["E0213 1:4"]);
    expect("if (a) == b { y = 1 }", &["E0213 1:4"]);
    expect("if x > 3\n  y = 1", &["E0213 1:4"]);
    expect_words("if x > 3 { }", &["`if(x > 3)`"]);
    expect_words("if (a) or (b) {}", &["`if((a) or (b))`"]);
}

#[test]
fn values_that_stand_alone() {
    expect("x", &["E0214 1:1"]);
    expect("t.x", &["E0214 1:1"]);
    expect("x + 1", &["E0214 1:1"]);
    expect("5", &["E0214 1:1"]);
    expect("\"text\"", &["E0214 1:1"]);
    expect("x = 5; 5", &["E0214 1:8"]);
    expect("(f)", &["E0214 1:1"]);
    expect("f() + 1", &["E0214 1:1"]);
    expect("f() == 1", &["E0214 1:1"]);
    expect("not x", &["E0214 1:1"]);
    expect("x = 3m", &["E0214 1:6"]);
    expect_words("x", &["`x()`", "`x = ...`"]);
    expect_words("x = 3m", &["a letter cannot follow a number"]);
}

#[test]
fn comparisons_for_assignments() {
    expect("x == 1", &["E0215 1:3"]);
    expect("t.x == 1 and y", &["E0215 1:5"]);
    expect("var x == 1", &["E0215 1:7"]);
}

#[test]
fn deep_nesting_is_refused() {
    let deep = |open: &str, close: &str, count: usize| {
        format!("x = {}1{}\ny = = 2", open.repeat(count), close.repeat(count))
    };
    let limit = NESTING_MAX as usize;
    for (open, close) in
        [("(", ")"), ("f(", ")"), ("t[", "]"), ("{.a=", "}"), ("-", ""), ("not ", "")]
    {
        // Some levels are spent on the statement itself.
        let within = parse_text(&deep(open, close, limit / 2 - 5));
        assert_eq!(codes(&within), ["E0201"], "{open} within");
        let beyond = parse_text(&deep(open, close, limit + 1));
        assert_eq!(codes(&beyond), ["E0216"], "{open} beyond");
        let far_beyond = parse_text(&deep(open, close, 100_000));
        assert_eq!(codes(&far_beyond), ["E0216"], "{open} far beyond");
    }
}

#[test]
fn long_chains_are_refused_where_their_trees_are_deep() {
    for (first, next) in [("a", ".b"), ("f", "()"), ("a", "^ a")] {
        let text = format!("f({first}{})", next.repeat(100));
        assert!(codes(&parse_text(&text)).is_empty(), "{next}");
        let text = format!("f({first}{})", next.repeat(100_000));
        assert_eq!(codes(&parse_text(&text)), ["E0216"], "{next}");
    }
    // Chains inside of chains add up.
    let text = format!("x = {}a{}", "f(".repeat(60), ".b.c.d.e.f)".repeat(60));
    assert_eq!(codes(&parse_text(&text)), ["E0216"]);
}

#[test]
fn operators_that_are_computed_from_the_left_are_no_levels() {
    let operators = ["+ -", "* /", "% %", "<< >>", "& |", "and or"];
    for (a, b) in operators.iter().filter_map(|pair| pair.split_once(' ')) {
        let text = format!("f(a{})", format!(" {a} b {b} (c)").repeat(50_000));
        assert!(!parse_text(&text).has_errors(), "{a} {b}");
    }
    // As high as its highest operand, wherever that stands.
    let limit = NESTING_MAX as usize;
    let deep = |levels: usize| format!("{}b{}", "(".repeat(levels), ")".repeat(levels));
    for levels in [limit / 2 - 10, limit] {
        let (a, b) = (deep(levels), " + a".repeat(1000));
        for text in [format!("x = {a}{b}"), format!("x = a{b} + {a}"), format!("x = a + {a}{b}")] {
            assert_eq!(parse_text(&text).has_errors(), levels == limit, "{levels}: {text}");
        }
    }
}

#[test]
fn a_row_of_else_if_is_no_level() {
    let row = "else if(b) { y = 2 } else if(c) z = 3 ".repeat(25_000);
    let text = format!("if(a) {{ x = 1 }} {row} else {{ x = 4 }} n = 5");
    let parsed = parse_text(&text);
    assert!(!parsed.has_errors());
    assert_eq!(parsed.script.stmts.len(), 2);
    // An error in a later condition keeps the branches before it.
    let parsed = parse_text("if(a) { x = 1 } else if(b { y = = 2 } else if(c) { z = 3 }\nn = = 5");
    assert_eq!(codes(&parsed), ["E0202", "E0201", "E0201"]);
}

#[test]
fn deep_blocks_are_refused() {
    for (open, close) in
        [("if(a) {", "}"), ("if(a) ", ""), ("if(a) {} else { ", "}"), ("while(a) ", "")]
    {
        let text = format!("{}x = 1{}", open.repeat(50_000), close.repeat(50_000));
        assert_eq!(codes(&parse_text(&text)), ["E0216"], "{open}");
    }
    let text = format!("x = {}", "function() { return ".repeat(40_000));
    assert_eq!(codes(&parse_text(&text)), ["E0216"]);
}

#[test]
fn the_deepest_scripts_fit_the_stack_of_a_thread() {
    // Every level of precedence in every level of nesting; calls, tables, lambdas, blocks.
    let brackets = [
        ("x = (a==a+b*c%d^e<<f&(", "))", 20),
        ("x = f(", ")", 195),
        ("x = {.a = ", "}", 195),
        ("x = f(function() { return ", "})", 65),
        ("if(a) {", "}", 195),
    ];
    let parse_all = move || {
        for (open, close, count) in brackets {
            let (first, again) = open.split_at(if open.starts_with('x') { 4 } else { 0 });
            let text = |count| {
                let inside = if first.is_empty() { "b = 1" } else { "1" };
                format!("{first}{}{inside}{}", again.repeat(count), close.repeat(count))
            };
            assert!(!parse_text(&text(count)).has_errors(), "{open} {count}");
            assert_eq!(codes(&parse_text(&text(20_000))), ["E0216"], "{open}");
        }
    };
    // Less than the 2 MiB that a thread has by default.
    let thread = std::thread::Builder::new().stack_size(3 << 19).spawn(parse_all).unwrap();
    thread.join().unwrap();
}

#[test]
fn words_of_other_languages() {
    for (text, column, help) in [
        ("while(a) { break }", 12, "leave a loop"),
        ("while(a) { continue }", 12, "leave a loop"),
        ("if(a) {} elseif(b) {} else {}", 10, "`else if(...)`"),
        ("if(a) {} elif(b) {}", 10, "`else if(...)`"),
        ("elseif(b) {}", 1, "`else if(...)`"),
        ("local x = 1", 1, "`var`"),
        ("int x = 1", 1, "`var`"),
        ("def f(x) { y = 1 }", 1, "function name"),
        ("local function f(x) { y = 1 }", 1, "`var`"),
        ("switch(x) { y = 1 }", 1, "else if"),
        ("if(a) then x = 1 end", 7, "braces"),
        ("import \"a.bzz\"", 1, "include"),
        ("fnction f(x) { y = 1 }", 1, "`function`"),
        ("whlie(x) { y = 1 }", 1, "`while`"),
        ("retrun x", 1, "`return`"),
        ("VAR x = 1", 1, "`var`"),
    ] {
        expect(text, &[&format!("E0217 1:{column}")]);
        expect_words(text, &[help]);
    }
}

#[test]
fn words_of_other_languages_are_ordinary_names() {
    for text in ["end = 1", "break()", "local.x = 2", "do[1] = 2", "goto(1, 2)", "then = end"] {
        expect(text, &[]);
    }
}

#[test]
fn assignments_are_no_conditions() {
    expect("if(x = 3) { y = * }", &["E0219 1:6", "E0201 1:17"]);
    expect("while(x = f()) {}", &["E0219 1:9"]);
    expect_words("if(x = 3) {}", &["`==`"]);
}

#[test]
fn table_fields_begin_with_a_dot() {
    expect("t = {x = 1}", &["E0220 1:6"]);
    expect("t = {1, 2, 3}\nx = *", &["E0220 1:6", "E0201 2:5"]);
    expect("t = {\"a\" = 1}", &["E0220 1:6"]);
    expect("t = {[1] = 2}", &["E0220 1:6"]);
    expect("t = {.-1 = 2}", &["E0220 1:6"]);
    expect("t = {.a = 1 .b = 2}", &["E0201 1:13"]);
    expect("t = {.a = x .b = 2}", &["E0201 1:16"]);
    expect_words("t = {1, 2}", &["{.0 = \"a\", .1 = \"b\"}"]);
    expect_words("t = {.a = x .b = 2}", &["comma"]);
}

#[test]
fn only_names_can_be_called_and_indexed() {
    expect("x = (f)(1)", &["E0221 1:8"]);
    expect("x = \"s\".x", &["E0221 1:8"]);
    expect("x = {.a = 1}.a", &["E0221 1:13"]);
    expect("x = function() {}(3)", &["E0221 1:18"]);
    expect("x = (t)[1]", &["E0221 1:8"]);
    expect("x = nil()", &["E0221 1:8"]);
}

#[test]
fn an_else_needs_an_if() {
    expect("else { x = * }\ny = *", &["E0222 1:1", "E0201 1:12", "E0201 2:5"]);
    expect("if(a) b() c() else d()", &["E0222 1:15"]);
    // Not after an `if` that could not be parsed.
    expect("if(a b) x = 1 else y = 2", &["E0201 1:6"]);
    expect("if > { x = 1 } else { y = * }", &["E0201 1:4", "E0201 1:27"]);
}

fn codes(parsed: &bittybuzz_compiler::parser::Parsed) -> Vec<&'static str> {
    parsed.diagnostics.iter().map(|d| d.code.text()).collect()
}
