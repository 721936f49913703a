//! Every warning of the parser, and what keeps it silent.

use crate::front::support::{expect, expect_words};

/// The first text warns with `code` at `column` of its last line; the others do not warn.
#[track_caller]
fn warns(code: &str, column: u32, text: &str, silent: &[&str]) {
    let line = text.lines().count();
    expect(text, &[&format!("{code} {line}:{column}")]);
    for text in silent {
        expect(text, &[]);
    }
}

#[test]
fn statements_that_run_on() {
    warns("W0101", 1, "f = g\n(3)", &["f = g(3)", "f = g(\n3)"]);
    warns("W0101", 1, "x = t\n[1]", &["x = t[1]", "x = t[\n1]"]);
    warns("W0101", 1, "x = a\n-1", &["x = a -\n1", "x = (a\n-1)", "f(a\n-1)", "x = t[a\n-1]"]);
    warns("W0101", 3, "x = a\n  + 1", &["x = {.a = b\n+ 1}"]);
    warns("W0101", 8, "f = g; (3)", &["f = (g; (3))"]);
    warns("W0101", 1, "f\n(3)", &["x = a\n* 2", "x = a\n.b"]);
    // The braces of a lambda hold statements again.
    warns("W0101", 1, "f(function() { x = a\n- 1 })", &["f(function() { x = (a\n- 1) })"]);
}

#[test]
fn and_or_as_a_value() {
    let silent = [
        "x = a == b or c == d",
        "x = isnil(a) or isnil(b)",
        "x = (a or b)",
        "x = a or not b",
        "x = a or (b < c)",
        "x = not a",
        "if(a or b) {}",
        "f(a or b)",
        "function f(a, b) { return a and b }",
    ];
    warns("W0102", 5, "x = a or 0", &silent);
    warns("W0102", 9, "var x = a and b", &[]);
    warns("W0102", 11, "x = {.a = b or c}", &["x = {.a = (b or c)}"]);
    expect("x = a and 3 or 4", &["W0102 1:5"]);
    expect("t.x = a == b or \"\"", &["W0102 1:7"]);
}

#[test]
fn and_mixed_with_or() {
    let silent = ["if(a and b or c) {}", "if((a or b) and c) {}", "if(a or (b and c)) {}"];
    warns("W0103", 4, "if(a or b and c) {}", &silent);
    expect("if(a or b and c or d and e) {}", &["W0103 1:4"]);
    expect_words("if(a or b and c) {}", &["`(a or b) and c`"]);
}

#[test]
fn wide_not() {
    let silent =
        ["if(not a) {}", "if(not a == b) {}", "if(not (a and b)) {}", "if((not a) and b) {}"];
    warns("W0104", 4, "if(not a and b) {}", &silent);
    warns("W0104", 10, "if(a and not b or c) {}", &["if(a and not b) {}"]);
    expect_words("if(not a and b) {}", &["`not (a and b)`"]);
}

#[test]
fn operators_that_group_otherwise() {
    for (text, reading) in [
        ("x = 1 << 2 + 1", "`(1 << 2) + 1`"),
        ("x = 7 & 3 + 1", "`(7 & 3) + 1`"),
        ("x = 2*7%4", "`2*(7%4)`"),
        ("x = 2 / 7 % 4", "`2 / (7 % 4)`"),
        ("x = 2 * 1 | 4", "`2 * (1 | 4)`"),
        ("x = 8 >> 1 & 1", "`8 >> (1 & 1)`"),
        ("x = a | b & c", "`(a | b) & c`"),
        ("x = a ^ b << c", "`a ^ (b << c)`"),
        ("x = 6 & 3 == 2", "`(6 & 3) == 2`"),
        ("x = -a & b", "`-(a & b)`"),
        ("x = -2^2", "`(-2)^2`"),
    ] {
        let column = 5;
        warns("W0105", column, text, &[]);
        expect_words(text, &[reading]);
    }
    for text in [
        "x = (1 << 2) + 1",
        "x = 1 << (2 + 1)",
        "x = a * b + c",
        "x = a % b * c",
        "x = 2 * (7 % 4)",
        "x = a & b | c",
        "x = a | b | c",
        "x = a << b << c",
        "x = -y^2",
        "x = -a * b",
        "x = (-2)^2",
        "x = 2^3^2",
        "x = 2^-1",
        "x = a + 1 == b",
        "x = !a & b",
        "x = a - b + c",
        "x = (a & 1) == 0",
        "x = a << 1 == b",
    ] {
        expect(text, &[]);
    }
}

#[test]
fn return_from_the_next_line() {
    let silent = ["function f() { return\nx = 1 }", "return g()", "return;\ng()", "return (\n1)"];
    warns("W0106", 1, "return\ng()", &silent);
}

#[test]
fn bitwise_not_of_a_condition() {
    let silent = ["if(not (a == b)) {}", "x = !a", "x = !(a + b)", "x = !f(a == b)"];
    warns("W0108", 4, "if(!(a == b)) {}", &silent);
    expect("if(!(a and b)) {}", &["W0108 1:4"]);
    expect("if(!(not a)) {}", &["W0108 1:4"]);
}

#[test]
fn semicolon_before_a_body() {
    warns("W0109", 9, "while(a); x = 1", &["while(a) {}; x = 1", "while(a) x = 1; y = 2"]);
    expect("if(a);\n{ x = 1 }", &["W0109 1:6"]);
    expect("if(a) b() else; c()", &["W0109 1:15"]);
}

#[test]
fn empty_bodies() {
    expect("function f() { if(a) }", &["W0110 1:20"]);
    expect("if(a) b() else", &["W0110 1:11"]);
    expect("while(a) {}", &[]);
}
