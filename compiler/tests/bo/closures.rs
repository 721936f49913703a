//! Locals, parameters and captured values.

use std::path::Path;

use bittybuzz_compiler::bo::{Warning, error::BoCause, import as import_file};
use bittybuzz_robot_spec::NumberProfile;

use crate::bo::assembler::assemble;
use crate::bo::interpreter;
use crate::bo::machine::{import, parse_script, recorder, run};
use crate::bo::reference;

/// The `.bo` file of a script.
fn bo_file(script: &str) -> Vec<u8> {
    let parsed = parse_script("script.bzz", script);
    assert!(!parsed.has_errors(), "{script}");
    reference::compile(&parsed)
}

/// Imports and runs the `.bo` file of a script; gives what it recorded. The file's own machine must do the same.
fn recorded(script: &str) -> Vec<String> {
    let bytes = bo_file(script);
    let lines = run(&import(&bytes).compiled).lines;
    let trace = interpreter::run(&bytes);
    assert_eq!(trace.stop, None, "{script}");
    assert_eq!(trace.lines, lines, "{script}");
    lines
}

fn refused(bytes: &[u8]) -> BoCause {
    let path = std::path::Path::new("test.bo");
    match import_file(path, bytes, None, &recorder(NumberProfile::Full)) {
        Ok(_) => panic!("it was imported"),
        Err(error) => error.cause,
    }
}

#[test]
fn variables_of_blocks() {
    let lines = recorded(
        "function f(a) {
           var b = a + 1
           if(a > 1) { var c = b * 2  record(c) } else { var c = b * 3  var d = c  record(d) }
           var e = b
           while(e > 0) { var g = e  record(g)  e = e - 1 }
         }
         f(1)  f(2)",
    );
    assert_eq!(
        lines,
        ["record(6)", "record(2)", "record(1)", "record(6)", "record(3)", "record(2)", "record(1)"]
    );
}

#[test]
fn parameter_set_to_nil_is_no_variable() {
    let lines = recorded("function f(a, b) { b = nil  record(a)  record(b) }  f(1, 2)");
    assert_eq!(lines, ["record(1)", "record(nil)"]);
    let lines = recorded("function f(a) { a = nil  var b = 2  record(a, b) }  f(1)");
    assert_eq!(lines, ["record(nil, 2)"]);
}

#[test]
fn variable_without_braces_belongs_to_the_block_around() {
    let lines = recorded(
        "function f(c) { if(c) var a = 1  var b = 2  if(c) record(a)  record(b) }
         f(1)  f(0)",
    );
    assert_eq!(lines, ["record(1)", "record(2)", "record(2)"]);
    // Where its own machine finds no such local, it is nil here.
    let faulty = |script: &str| {
        let bytes = bo_file(script);
        assert_eq!(interpreter::run(&bytes).stop, Some(interpreter::Stop::Fault));
        run(&import(&bytes).compiled).lines
    };
    assert_eq!(faulty("function f(c) { if(c) var a = 1  record(a) }  f(0)"), ["record(nil)"]);
    let lines = faulty(
        "function f(c) { while(c > 0) { if(c > 1) var a = c else var b = c  record(c)  c = c - 1 } }
         f(2)",
    );
    assert_eq!(lines, ["record(2)", "record(1)"]);
}

#[test]
fn variable_in_its_own_value_is_nil() {
    assert_eq!(recorded("function f() { var x = isnil(x)  record(x) }  f()"), ["record(1)"]);
    // The lambda holds the nil that x was when it was created.
    let lines =
        recorded("function f() { var x = function() { return isnil(x) }  record(x()) }  f()");
    assert_eq!(lines, ["record(1)"]);
}

#[test]
fn captured_values_are_copies() {
    let lines = recorded(
        "function counter() { var n = 0  return function() { n = n + 1  return n } }
         c = counter()  record(c())  record(c())
         function later() { var n = 1  var f = function() { return n }  n = 2  return f() }
         record(later())",
    );
    assert_eq!(lines, ["record(1)", "record(1)", "record(1)"]);
}

#[test]
fn parameters_that_only_a_lambda_uses() {
    // By the calls of a global, a field, a local, an element.
    assert_eq!(
        recorded(
            "function mk(a, b) { return function(c) { return a + b * c } }  record(mk(1, 10)(2))"
        ),
        ["record(21)"]
    );
    assert_eq!(
        recorded(
            "t = {}  t.mk = function(a) { return function(c) { return a - c } }  record(t.mk(5)(2))"
        ),
        ["record(3)"]
    );
    assert_eq!(
        recorded(
            "function f() { var mk = function(a) { return function(c) { return a - c } }  record(mk(5)(2)) }  f()"
        ),
        ["record(3)"]
    );
    assert_eq!(
        recorded(
            "t = {}  t[1] = function(a) { return function(c) { return a - c } }  record(t[1](5)(2))"
        ),
        ["record(3)"]
    );
}

#[test]
fn parameters_of_functions_that_are_passed_on() {
    // Through a parameter of a script function, a built-in, and a result.
    assert_eq!(
        recorded(
            "function apply(f, x) { return f(x) }
             function mk(a) { return function(c) { return a - c } }
             record(apply(mk, 5)(2))"
        ),
        ["record(3)"]
    );
    assert_eq!(
        recorded(
            "t = {.0 = 7}
             foreach(t, function(k, v) { var f = function() { record(k, v) }  f() })"
        ),
        ["record(0, 7)"]
    );
    assert_eq!(
        recorded(
            "t = {.0 = 7}
             foreach(t, function(k, v) { foreach(t, function(k2, v2) { record(v, v2) }) })"
        ),
        ["record(7, 7)"]
    );
    assert_eq!(
        recorded(
            "function mkmk() { return function(a) { return function(c) { return a - c } } }
             mk = mkmk()  record(mk(5)(2))"
        ),
        ["record(3)"]
    );
}

#[test]
fn three_levels() {
    let lines = recorded(
        "function a(x) { var p = x + 1
           return function(y) { var q = y + p
             return function(z) { record(x, y)  record(p, q)  record(z) } } }
         a(1)(10)(100)",
    );
    assert_eq!(lines, ["record(1, 10)", "record(2, 12)", "record(100)"]);
}

#[test]
fn function_with_two_possible_numbers_of_parameters_is_refused() {
    let script =
        "function mk(a) { return function(c) { return a } }  record(mk(1)(2))  record(mk(1, 2)(3))";
    let cause = refused(&bo_file(script));
    assert_eq!(cause, BoCause::UnknownParameters([1, 2].into()));
    // It does not matter where the function itself shows how many it has.
    let script = "function mk(a) { var b = a  return function(c) { return b } }
                  record(mk(1)(2))  record(mk(1, 2)(3))";
    assert_eq!(recorded(script), ["record(1)", "record(1)"]);
}

#[test]
fn uncalled_functions_are_imported() {
    let script = "function unused(a) { return function() { return a } }
                  t = {.unused = function(a) { return function() { return a } }}
                  record(1)";
    assert_eq!(recorded(script), ["record(1)"]);
}

/// The machine of the reference gives a lambda of the global code no captured values.
#[test]
fn lambda_of_global_code() {
    let lines = recorded(
        "f = function(a, b) { return a - b }  record(f(5, 3))
         if(1) g = function(a) { return a }
         record(g(4))",
    );
    assert_eq!(lines, ["record(2)", "record(4)"]);
}

#[test]
fn lambda_of_a_top_level_block_is_a_warning() {
    // With braces the reference compiler numbers the parameter 0, which its machine takes for self.
    let bytes =
        reference::compile(&parse_script("script.bzz", "if(1) { g = function(a) { return a } }"));
    let imported = import(&bytes);
    let offset = bytes.len() - 7;
    assert_eq!(bytes[offset..], [0x29, 0, 0, 0, 0, 6, 5]);
    assert_eq!(imported.warnings, [Warning::TopLevelLambda(offset)]);
    assert!(
        import(&reference::compile(&parse_script("s", "g = function(a) { return self }")))
            .warnings
            .is_empty()
    );
}

#[test]
fn variable_of_a_top_level_block_is_refused() {
    let bytes = reference::compile(&parse_script("script.bzz", "if(1) { var a = 1 }"));
    assert_eq!(refused(&bytes), BoCause::LocalInGlobalCode);
}

#[test]
fn self_of_lambdas() {
    let lines = recorded(
        "t = {.n = 1, .f = function() { var g = function() { return self.n }  return g() }}
         record(t.f())",
    );
    assert_eq!(lines, ["record(1)"]);
}

#[test]
fn parameter_with_the_name_of_a_captured_local() {
    // The reference reads the captured value; the argument of that name is lost, and b reads it.
    let lines = recorded(
        "function f(a) { return function(a, b) { return a * 100 + b } }  record(f(1)(2, 3))",
    );
    assert_eq!(lines, ["record(102)"]);
}

#[test]
fn locals_that_no_compiler_writes_are_refused() {
    let with_body = |body: &str| {
        assemble(&format!(
            "!1 / 'f / pushs 0 / pushcn @f / gstore / nop / done / @f / {body} / ret0"
        ))
    };
    for body in [
        // Removes what it did not make.
        "lremove 1",
        "pushnil / lstore 1 / lremove 2",
        // A variable that starts with something else, above a gap, or never ends.
        "pushnil / lstore 1 / pushi 1 / lstore 3 / lremove 2",
        "lload 1 / jumpz @e / pushnil / lstore 2 / lremove 1 / @e / lload 2 / ret1 / pushnil / lstore 4 / lremove 1",
        // Goes on after the end of a variable.
        "pushnil / lstore 1 / lremove 1 / pushnil / lstore 1 / lremove 1",
    ] {
        assert_eq!(refused(&with_body(body)), BoCause::InconsistentLocals, "{body}");
    }
    for local in [32, 1_000_000] {
        let body = format!("lload {local} / ret1");
        assert_eq!(refused(&with_body(&body)), BoCause::TooManyParameters, "{local}");
    }
    let code = with_body("lload 31 / ret1");
    let greatest = import_file(Path::new("test.bo"), &code, None, &recorder(NumberProfile::Full));
    assert!(greatest.is_ok(), "{:?}", greatest.err());
    assert_eq!(refused(&with_body("pushi 1 / lstore 0")), BoCause::SelfAssigned);
}
