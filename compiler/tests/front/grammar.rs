//! One test for each rule of the reference grammar, and for each of this project's extensions.

use crate::front::support::{expect, expect_tree, expect_value, parse_text};

#[test]
fn an_empty_script() {
    expect_tree("", "");
    expect_tree("\n;; # nothing\n", "");
}

#[test]
fn newlines_and_semicolons_do_not_matter() {
    expect_tree("x = 1 y = 2", "(= x 1) (= y 2)");
    expect_tree("x\n=\n1\n", "(= x 1)");
    expect_tree("x = ; 5", "(= x 5)");
}

#[test]
fn var() {
    expect_tree("var x var y = 1 var z = a == b", "(var x) (var y 1) (var z (== a b))");
}

#[test]
fn named_functions() {
    expect_tree("function f() {}", "(function f () {})");
    expect_tree("function f(a, b) { return a }", "(function f (a b) {(return a)})");
    expect_tree("function f(a)\n\n{ return }", "(function f (a) {(return)})");
}

#[test]
fn docstrings_are_dropped() {
    expect_tree("function f(a) \"docs\" { }", "(function f (a) {})");
    expect_tree("function f(a)\n'two\nlines'\n{ }", "(function f (a) {})");
    assert!(parse_text("function f(a) \"docs\" { g(\"x\") }").strings.iter().eq(["x"]));
    expect("x = function(a) \"docs\" { }", &["E0201 1:17"]);
}

#[test]
fn if_else() {
    expect_tree("if(a) x = 1", "(if a {(= x 1)})");
    expect_tree("if(a) { x = 1 } else { y = 2 }", "(if a {(= x 1)} {(= y 2)})");
    expect_tree("if(a) b() else c()", "(if a {b()} {c()})");
    expect_tree("if(a)\n{\n}\nelse\n{\n}", "(if a {} {})");
    expect_tree("if(a) {} ; else {}", "(if a {} {})");
    expect_tree("if(a) var x = 1", "(if a {(var x 1)})");
}

#[test]
fn else_belongs_to_the_nearest_if() {
    expect_tree("if(a) if(b) c() else d()", "(if a {(if b {c()} {d()})})");
    expect_tree(
        "if(a) {} else if(b) {} else if(c) {} else {}",
        "(if a {} {(if b {} {(if c {} {})})})",
    );
}

#[test]
fn conditions_of_statements() {
    expect_tree("if(a and b) {}", "(if (and a b) {})");
    expect_tree("if(not a) {}", "(if (not a) {})");
    expect_tree("while(a < 3) a = a + 1", "(while (< a 3) {(= a (+ a 1))})");
    expect_tree("if({} == x) {}", "(if (== {} x) {})");
}

#[test]
fn for_loops() {
    expect_tree(
        "for(i = 0, i < 5, i = i + 1) { log(i) }",
        "(for (= i 0) (< i 5) (= i (+ i 1)) {log(i)})",
    );
    expect_tree("for(f(), a, t.x = 1) g()", "(for f() a (= t.x 1) {g()})");
    expect_tree("for(i = 0,\n i < 5,\n i = i + 1)\n{\n}", "(for (= i 0) (< i 5) (= i (+ i 1)) {})");
}

#[test]
fn assignments_and_calls() {
    expect_tree("x = 1", "(= x 1)");
    expect_tree("t.x = 1 t[1] = 2 t.a[\"k\"].b = 3", "(= t.x 1) (= t[1] 2) (= t.a[\"k\"].b 3)");
    expect_tree("t.a[1].b(2).c = 3", "(= t.a[1].b(2).c 3)");
    expect_tree("f()() f(1, not a, {.x=1})", "f()() f(1, (not a), {.x=1})");
    expect_tree("t.bar().x.y[\"c\"]()()", "t.bar().x.y[\"c\"]()()");
    expect_tree("t[a == b] = 1", "(= t[(== a b)] 1)");
}

#[test]
fn return_values() {
    expect_tree("function f() { return a == b }", "(function f () {(return (== a b))})");
    expect_tree("function f() { return not a }", "(function f () {(return (not a))})");
    expect_tree("function f() { return {.a=1} }", "(function f () {(return {.a=1})})");
    expect_tree(
        "function f() { return function(x) { return x } }",
        "(function f () {(return (lambda (x) {(return x)}))})",
    );
}

#[test]
fn bare_return() {
    expect_tree("return", "(return)");
    expect_tree("if(a) { return }", "(if a {(return)})");
    expect_tree("return; f()", "(return) f()");
    for keyword in ["var x", "if(a) {}", "while(a) {}", "for(f(), a, g()) {}", "return 1"] {
        let parsed = parse_text(&format!("return {keyword}"));
        assert!(parsed.diagnostics.is_empty(), "{keyword}: {:?}", parsed.diagnostics);
        assert_eq!(parsed.script.stmts.len(), 2, "{keyword}");
    }
    expect_tree("if(a) return else f()", "(if a {(return)} {f()})");
    expect_tree("return\nx = 3", "(return) (= x 3)");
    expect_tree("return\nt.a[f(1)].b(2)[3] = 3", "(return) (= t.a[f(1)].b(2)[3] 3)");
    expect_tree("return\nfunction f() {}", "(return) (function f () {})");
}

#[test]
fn a_value_on_the_line_after_return_is_returned() {
    expect_tree("return\nf()", "(return f())");
    expect_tree("return\n5", "(return 5)");
    expect_tree("return\nfunction(x) {}", "(return (lambda (x) {}))");
}

#[test]
fn statements_run_on_over_the_end_of_the_line() {
    expect_tree("a = b\n-1", "(= a (- b 1))");
    expect_tree("f = g\n(3)", "(= f g(3))");
    expect_tree("a = b\n[1]", "(= a b[1])");
    expect_tree("a = b;\n+ c", "(= a (+ b c))");
}

#[test]
fn the_precedence_of_operators() {
    // The results that the reference computes.
    expect_value("1<<2+1", "(+ (<< 1 2) 1)");
    expect_value("7 & 3 + 1", "(+ (& 7 3) 1)");
    expect_value("2*7%4", "(* 2 (% 7 4))");
    expect_value("2^3^2", "(^ 2 (^ 3 2))");
    // Each level against the next looser one.
    expect_value("!a & b", "(& (! a) b)");
    expect_value("a & b << c", "(<< (& a b) c)");
    expect_value("a << b & c", "(<< a (& b c))");
    expect_value("a << b ^ c", "(^ (<< a b) c)");
    expect_value("a ^ b << c", "(^ a (<< b c))");
    expect_value("a ^ b % c", "(% (^ a b) c)");
    expect_value("a % b ^ c", "(% a (^ b c))");
    expect_value("a % b * c", "(* (% a b) c)");
    expect_value("a / b % c", "(/ a (% b c))");
    expect_value("a * b + c", "(+ (* a b) c)");
    expect_value("a - b / c", "(- a (/ b c))");
    expect_value("a + b == c - d", "(== (+ a b) (- c d))");
    expect_value("(a == b and c != d)", "[(and (== a b) (!= c d))]");
}

#[test]
fn operators_of_one_level_group_from_the_left() {
    expect_value("a - b + c - d", "(- (+ (- a b) c) d)");
    expect_value("a / b * c", "(* (/ a b) c)");
    expect_value("a % b % c", "(% (% a b) c)");
    expect_value("a << b >> c", "(>> (<< a b) c)");
    expect_value("a & b | c & d", "(& (| (& a b) c) d)");
    expect_value("a or b and c or d", "(or (and (or a b) c) d)");
}

#[test]
fn not_takes_everything_to_its_right() {
    expect_value("not a and b", "(not (and a b))");
    expect_value("not a == b", "(not (== a b))");
    expect_value("not not a", "(not (not a))");
    expect_value("a and not b", "(and a (not b))");
    expect_value("a or not b == c", "(or a (not (== b c)))");
    expect_value("a and not b or c", "(and a (not (or b c)))");
    expect_value("(not a) and b", "(and [(not a)] b)");
}

#[test]
fn a_sign_belongs_to_the_literal_behind_it() {
    expect_value("-2^2", "(^ -2 2)");
    expect_value("- 2", "-2");
    expect_value("-2.5", "-2.5");
    expect_value("+5", "5");
    expect_value("1 - -1", "(- 1 -1)");
    expect_value("1 -1", "(- 1 1)");
    expect_value("2 ^ -1", "(^ 2 -1)");
    expect_value("-0x10", "-16");
    expect_value("-9223372036854775807", "-9223372036854775807");
}

#[test]
fn any_other_sign_applies_to_a_whole_power() {
    expect_value("-y^2", "(- (^ y 2))");
    expect_value("-a & b", "(- (& a b))");
    expect_value("-a << 2", "(- (<< a 2))");
    expect_value("-a % b", "(% (- a) b)");
    expect_value("-a * b", "(* (- a) b)");
    expect_value("a & -b & c", "(& a (- (& b c)))");
    expect_value("-(2)^2", "(- (^ [2] 2))");
    expect_value("-f(1).x", "(- f(1).x)");
    expect_value("+a", "(+ a)");
    expect_value("!-a", "(! (- a))");
    expect_value("-!a", "(- (! a))");
    expect_value("!!a", "(! (! a))");
}

#[test]
fn the_right_side_of_an_assignment_is_a_condition() {
    expect_value("a == b", "(== a b)");
    expect_value("not a", "(not a)");
    expect_value("a == b or c", "(or (== a b) c)");
    expect_value("{.x = a < b}", "{.x=(< a b)}");
}

#[test]
fn operands() {
    expect_value("nil", "nil");
    expect_value("\"text\"", "\"text\"");
    expect_value("(1)", "[1]");
    expect_value("((a) + b)", "[(+ [a] b)]");
    expect_value("function() {}", "(lambda () {})");
    expect_value("function(a, b) { return a + b }", "(lambda (a b) {(return (+ a b))})");
}

#[test]
fn table_literals() {
    expect_value("{}", "{}");
    expect_value("{.a = 1}", "{.a=1}");
    expect_value("{.a = 1, .2 = \"x\", .2.5 = nil, .0 = {}}", "{.a=1, .2=\"x\", .2.5=nil, .0={}}");
    expect_value(
        "{\n.a = {\n.b = function() { return {} }\n}\n}",
        "{.a={.b=(lambda () {(return {})})}}",
    );
    expect_tree("f({}, {.x = 1})", "f({}, {.x=1})");
    expect_value("{} == {}", "(== {} {})");
    expect_value("({}) + 1", "(+ [{}] 1)");
}

#[test]
fn includes_leave_no_trace_in_the_grammar() {
    expect_tree("include_x = 1", "(= include_x 1)");
}

#[test]
fn the_strings_of_a_script_are_its_literals_and_field_names() {
    let text = "t.b = \"d\" x = {.a = 1, .5 = 'c'} y.e.f(g[\"b\"]) function i() \"doc\" {} j()";
    assert!(parse_text(text).strings.iter().eq(["a", "b", "c", "d", "e", "f"]));
}
