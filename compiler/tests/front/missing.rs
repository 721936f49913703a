//! The functions that a script calls and that only a robot can have.

use bittybuzz_compiler::check::missing::missing;

use crate::front::support::parse_text;

/// Each missing function as `name counts line:column`, with `!` after the name if its result is used.
fn found(text: &str) -> Vec<String> {
    let parsed = parse_text(text);
    assert!(!parsed.has_errors(), "{text}\n{:#?}", parsed.diagnostics);
    let missing = missing(&parsed.script).functions.into_iter();
    let shown = missing.map(|function| {
        let mark = if function.is_result_used { "!" } else { "" };
        let counts: Vec<String> = function.counts.iter().map(usize::to_string).collect();
        let at = parsed.sources.line_column(function.first_call);
        format!("{}{mark} {} {}:{}", function.name, counts.join(","), at.line, at.column)
    });
    shown.collect()
}

#[test]
fn calls_of_names_that_nothing_defines() {
    assert_eq!(found("led(1)\nled(1, 2) led(3)"), ["led 1,2 1:1"]);
    assert_eq!(
        found("function step() { if(id) { go() } else stop() }"),
        ["go 0 1:28", "stop 0 1:40"]
    );
    assert_eq!(
        found("f = function() { while(near()) go(far(1)) }"),
        ["near! 0 1:24", "go 1 1:32", "far! 1 1:35"]
    );
    // One use of the result is enough.
    assert_eq!(found("go() x = go() go()"), ["go! 0 1:1"]);
    assert_eq!(found("for(i = 0, i < 3, next()) { go(i) }"), ["next 0 1:19", "go 1 1:29"]);
    assert_eq!(found("if(goto) goto(1, 2)"), ["goto 2 1:10"]);
}

#[test]
fn names_of_the_script_and_the_language_are_not_missing() {
    for text in [
        "function led(x) { return x } led(1)",
        "led = function(x) { return x } led(1)",
        "function step(f) { f(1) }",
        "function step() { var f = 1 f(1) }",
        "t = {} t.led(1) t[0](1) t.x.y()",
        "log(size({}), math.abs(1), id) neighbors.foreach(function(k, v) { log(k) })",
        "delay(100) string.length(\"a\") swarm.create(1)",
        "x = led",
    ] {
        assert_eq!(found(text), [""; 0], "{text}");
    }
}

#[test]
fn use_of_the_position_table_is_detected() {
    for (text, has_position) in [
        ("log(pos.x)", true),
        ("if(pos) log(1)", true),
        ("pos = { .x = 1 } log(pos.x)", false),
        ("function f(pos) { log(pos.x) }", false),
        ("log(1)", false),
    ] {
        assert_eq!(missing(&parse_text(text).script).has_position, has_position, "{text}");
    }
}

/// The paths of the missing values, and the missing functions in tables with their counts.
fn values(text: &str) -> (Vec<String>, Vec<String>) {
    let parsed = parse_text(text);
    assert!(!parsed.has_errors(), "{text}\n{:#?}", parsed.diagnostics);
    let missing = missing(&parsed.script);
    let functions = missing.functions.iter().filter(|function| function.name.contains('.'));
    (
        missing.values.into_iter().map(|value| value.path).collect(),
        functions.map(|function| format!("{} {:?}", function.name, function.counts)).collect(),
    )
}

#[test]
fn fields_of_tables_that_nothing_defines() {
    for (text, expected) in [
        ("log(pose.position.x, pose.orientation.yaw)", "pose.orientation.yaw pose.position.x"),
        (
            "i = 0 log(proximity[i].value) log(proximity[2].angle)",
            "proximity[].angle proximity[].value",
        ),
        // A path that leads on is a table.
        ("p = pose.position log(pose.position.x)", "pose.position.x"),
        (
            "foreach(ground, function(k, v) { log(k, v.value, v.offset) })",
            "ground[].offset ground[].value",
        ),
        ("function f(k, v) { log(v.value) } foreach(ground, f)", "ground[].value"),
        ("foreach(lidar, function(k, v) { log(v) })", "lidar[]"),
        ("log(blobs[0].color.red)", "blobs[].color.red"),
        // A key may itself be such a value.
        ("log(a[b.c].d)", "a[].d b.c"),
        // Neither of these is a value of the robot's.
        ("t = {} log(t.x, t[1].y) log(pos.x) log(x)", ""),
        ("function f(t) { log(t.x) } var u = {} log(u.x)", ""),
        ("log(a[1][2])", ""),
    ] {
        assert_eq!(values(text).0.join(" "), expected, "{text}");
    }
}

#[test]
fn functions_in_tables_that_nothing_defines() {
    let (found, functions) =
        values("debug.print(1) debug.rays.add(1, 2) debug.print() log(debug.queue.total)");
    assert_eq!(found, ["debug.queue.total"]);
    assert_eq!(functions, ["debug.print {0, 1}", "debug.rays.add {2}"]);
    // What is called is no value.
    assert_eq!(values("goto(1) log(goto.x) ui.set(1) f = ui.set").0, [""; 0]);
    // A function in a list has no name in a robot file.
    assert_eq!(values("x[1].run(2)"), (vec![], vec![]));
}

#[test]
fn results_that_are_used_as_texts() {
    let is_text = |text: &str| {
        let missing = missing(&parse_text(text).script);
        missing.functions.iter().find(|function| function.name == "cell").map(|it| it.is_text)
    };
    for text in [
        "log(string.length(cell()))",
        "c = cell() log(string.sub(c, 0, 1))",
        "function f() { var c = cell() return string.concat(\"a\", c) }",
        "if(cell() == \"home\") log(1)",
        "c = cell() if(\"home\" != c) log(1)",
    ] {
        assert_eq!(is_text(text), Some(true), "{text}");
    }
    for text in ["log(cell())", "x = cell() + 1", "log(string.tostring(cell()))", "cell()"] {
        assert_eq!(is_text(text), Some(false), "{text}");
    }
}
