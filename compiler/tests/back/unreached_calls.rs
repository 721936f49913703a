//! Calls of unknown functions: errors where code runs, warnings where nothing reaches them.

use crate::back::machine::{FULL, build};

/// The unknown function is called in `_f`. What reaches `_f` decides between error and warning.
#[test]
fn an_unknown_function_is_an_error_only_where_code_runs() {
    let runs = [
        "_f()",
        "function step() { _f() }",
        "function g() { _f() } function init() { log(1) } function destroy() { g() }",
        "function step() { t = { .f = _f } }",
        "function step() { neighbors.listen(\"k\", _f) neighbors.broadcast(\"k\", 1) }",
        "function go() { _f() } function init() { step = go }",
        "function init() { foreach({}, function(k, v) { log(k, v) _f() }) }",
        "step = function() { return function() { _f() } }",
        "t = {} t.f = _f function step() { log(1) }",
        "t = {} t.f = function() { _f() } function step() { t.f() }",
        "function step() { t.f() } t = { .f = function() { _f() } }",
        "t = { .g = function() { _f() } } t.f = function() { t.g() } function step() { t.f() }",
        "t = { .f = function() { _f() } } function step() { foreach(t, function(k, v) { v(k) }) }",
        "t = { .f = function() { _f() } } function step() { t[\"f\"]() }",
        "t = { .f = function() { _f() } } function step() { u = t u.f() }",
        "t = { .f = function() { _f() }, .g = function() { return self } } function step() { t.g().f() }",
        "t = { .f = function() { _f() }, .g = function() { return self } } function step() { u = t.g() u[\"f\"]() }",
        "function step() { var t = { .f = function() { _f() } } log(t) }",
        // A file without an entry point may be a library.
        "",
    ];
    let does_not_run = [
        "function step() { log(1) }",
        "function _g() { _f() } function step() { log(1) }",
        "function _g() { return function() { _f() } } function init() { log(1) }",
        "function _g() { _f() } function _h() { _g() } function step() { log(1) }",
        "t = {} t.f = function() { _f() } t.g = 1 function step() { log(t.g) }",
        "t = { .f = function() { _f() }, .g = function() { return 1 } } function step() { log(t.g()) }",
        "t = { .f = function() { return self.h() }, .h = function() { _f() } } function step() { log(1) }",
        "t = { .f = function() { _f() } } function step() { t.f = nil t = nil }",
    ];
    for unknown in ["nosuch(1)", "math.nosuch(1)"] {
        let messages_of = |rest: &str| {
            let script = format!("function _f() {{ {unknown} }} {rest}");
            let compiled = build(&script, FULL);
            let codes: Vec<_> =
                compiled.diagnostics.iter().map(|found| found.code.text()).collect();
            (codes, compiled.image.is_some())
        };
        let code = if unknown.starts_with("math") { "E0410" } else { "E0401" };
        for rest in runs {
            assert_eq!(messages_of(rest), (vec![code], false), "{unknown}: {rest}");
        }
        for rest in does_not_run {
            assert_eq!(messages_of(rest), (vec!["W0228"], true), "{unknown}: {rest}");
        }
    }
    // There are no files anywhere.
    let io = build("function _f() { io.fopen(\"a\", \"w\") } function step() { log(1) }", FULL);
    assert_eq!(io.diagnostics[0].code.text(), "E0409");
}
