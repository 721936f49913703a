//! Every message of the back end: where it is given, and where it is not.

use std::collections::BTreeSet;

use bittybuzz_compiler::codes::DiagnosticCode;
use bittybuzz_compiler::diagnostic::Diagnostic;

use bittybuzz_testkit::Program;

use crate::back::machine::{FULL, TINY, build, build_for, build_with};

/// Code and marked text of every message, in order.
fn messages(script: &str) -> Vec<(&'static str, String)> {
    let compiled = build(script, FULL);
    let marked = |diagnostic: &Diagnostic| {
        let (start, end) = (diagnostic.span.start as usize, diagnostic.span.end as usize);
        script.get(start..end).unwrap_or("?").to_owned()
    };
    compiled.diagnostics.iter().map(|d| (d.code.text(), marked(d))).collect()
}

/// Script, code, and what is marked.
pub(super) const CASES: &[(&str, &str, &str)] = &[
    ("nosuch(1)", "E0401", "nosuch"),
    ("function f() { return function() { nosuch() } } f()", "E0401", "nosuch"),
    ("log(size())", "E0403", "size()"),
    ("x = map({})", "E0403", "map({})"),
    ("x = math.atan(1)", "E0403", "math.atan(1)"),
    ("x = math.rng.uniform(1, 2, 3)", "E0403", "math.rng.uniform(1, 2, 3)"),
    ("x = string.concat(\"a\")", "E0403", "string.concat(\"a\")"),
    ("neighbors.broadcast(\"k\")", "E0403", "neighbors.broadcast(\"k\")"),
    ("led()", "E0404", "led()"),
    ("led(\"red\")", "E0405", "\"red\""),
    ("function f() { var x = 1 var x = 2 } f()", "E0406", "x"),
    ("function f(a) { var a = 2 } f(1)", "E0406", "a"),
    ("function f(a) { return function() { var a = 2 } } f(1)", "E0406", "a"),
    ("if(1) { var x = 1 if(x) { var x = 2 } }", "E0406", "x"),
    ("function f(a, b, a) { return a } f(1, 2, 3)", "E0407", "a"),
    ("function f() { self = 1 } f()", "E0408", "self"),
    ("var self = 1", "E0408", "self"),
    ("function f(self) { return 1 } f(1)", "E0408", "self"),
    ("f = io.fopen(\"a\", \"r\")", "E0409", "io"),
    ("x = math.sqr(1)", "E0410", "sqr"),
    ("x = math.rng.uniforn(1)", "E0410", "uniforn"),
    ("math.pi()", "E0411", "pi"),
    ("math()", "E0411", "math"),
    ("id()", "E0411", "id"),
    ("x = 2147483648", "E0501", "2147483648"),
    ("x = -2147483649", "E0501", "-2147483649"),
    ("t = { .2147483648 = 1 }", "E0501", "2147483648"),
    ("x = 1e39", "E0502", "1e39"),
    ("x = 1e-60", "E0502", "1e-60"),
    ("x = 1 < \"a\"", "E0503", "1 < \"a\""),
    ("if(\"a\" >= 2) log(1)", "E0503", "\"a\" >= 2"),
    ("x = log < 1", "E0503", "log < 1"),
    ("x = log < log", "E0503", "log < log"),
    ("counter = 1 log(conter)", "W0201", "conter"),
    ("size = 3", "W0203", "size"),
    ("function log(x) { return x } log(1)", "W0203", "log"),
    ("math = {}", "W0203", "math"),
    ("id = 3", "W0203", "id"),
    ("led = 3", "W0202", "led"),
    ("function f() { return 1 } function f() { return 2 } f()", "W0204", "f"),
    ("function f(a, b) { return a + b } f(1)", "W0205", "f(1)"),
    ("function f(a) { return a } f(1, 2)", "W0206", "f(1, 2)"),
    ("function f() { var n = 1 return function() { n = 2 n = 3 } } f()", "W0207", "n"),
    ("x = math.tau", "W0208", "tau"),
    ("log(self)", "W0209", "self"),
    ("if(1) { log(self) }", "W0209", "self"),
    ("function f() { return self } f()", "W0209", "self"),
    ("function f() { var x = x return x } f()", "W0210", "x"),
    ("function f() { var x = function() { return x } return x } f()", "W0210", "x"),
    ("function f() { return 1; log(2) log(3) } f()", "W0211", "log(2)"),
    ("function f(x) { if(x) { return 1 } else { return 2 } log(3) } f(1)", "W0211", "log(3)"),
    ("x = 1 + nil", "W0301", "1 + nil"),
    ("x = \"a\" * 2", "W0301", "\"a\" * 2"),
    ("x = -\"a\"", "W0301", "-\"a\""),
    ("x = 1.5 & 1", "W0301", "1.5 & 1"),
    ("x = !1.5", "W0301", "!1.5"),
    ("x = 1 - log", "W0301", "1 - log"),
    ("x = id / 0", "W0302", "id / 0"),
    ("y = 1 x = y % 0", "W0302", "y % 0"),
    ("x = 1 << 32", "W0303", "1 << 32"),
    ("x = 1 >> -1", "W0303", "1 >> -1"),
    ("t = {} t[nil] = 1", "W0304", "nil"),
    ("t = {} x = t[log]", "W0304", "log"),
    ("x = 1 == \"1\"", "W0305", "1 == \"1\""),
    ("x = log != 3", "W0305", "log != 3"),
    ("function stpe() { log(1) }", "W0212", "stpe"),
    ("function Init() { log(1) }", "W0212", "Init"),
    ("function setp() { log(1) }", "W0212", "setp"),
    ("function init() { log(1) } function Step() { log(1) }", "W0212", "Step"),
    ("function step(dt) { log(dt) }", "W0213", "dt"),
    ("step = 5", "W0214", "5"),
    ("init = \"a\"", "W0214", "\"a\""),
    ("function f() { var x = 1 } f()", "W0215", "x"),
    ("if(1) { var x = 1 x = 2 }", "W0215", "x"),
    ("function f(a, b) { return a } f(1, 2)", "W0216", "b"),
    ("function f() { log(1) } function step() { log(2) }", "W0217", "f"),
    ("z = 1 z = z", "W0218", "z = z"),
    ("function f(a) { a = a return a } f(1)", "W0218", "a = a"),
    ("function step() { counter = counter + 1 }", "W0219", "counter"),
    ("x = 65536 * 65536", "W0309", "65536 * 65536"),
    ("x = 2147483647 + 1 + 1", "W0309", "2147483647 + 1"),
    ("x = 1 - -2147483648", "W0309", "1 - -2147483648"),
    ("x = -2147483648 / -1", "W0309", "-2147483648 / -1"),
    ("x = -(-2147483648)", "W0309", "-(-2147483648)"),
    ("x = 3 << 31", "W0309", "3 << 31"),
    ("x = 1e38 * 10 * 2", "W0310", "1e38 * 10"),
    ("x = 10.0 ^ 40", "W0310", "10.0 ^ 40"),
    ("var n n = 2 * (n - 1)", "W0219", "n"),
    ("foreach({}, function(k, v, i) { log(k, v, i) })", "W0220", "i"),
    ("function f(id, data, x) { log(id, data, x) } neighbors.foreach(f)", "W0220", "x"),
    ("s = swarm.create(1) s.exec(function(a) { log(a) })", "W0220", "a"),
    ("neighbors.listen(\"k\", function(v) { log(v + 1) })", "W0221", "v"),
    ("neighbors.listen(\"k\", function(value) { log(value) })", "W0221", "value"),
    ("foreach({}, function(v) { log(v) })", "W0221", "v"),
    ("foreach({}, function(item) { log(item.x) })", "W0221", "item"),
    ("neighbors.foreach(function(data) { log(data.distance) })", "W0221", "data"),
    ("neighbors.foreach(function(data, id) { log(data, id) })", "W0221", "data"),
    ("x = neighbors.reduce(function(id, data, sum) { return sum + data }, 0)", "W0221", "data"),
    ("v = stigmergy.create(1) v.foreach(function(value) { log(value) })", "W0221", "value"),
    ("neighbors.foreach(function(id, data) { log(data.distnace) })", "W0222", "distnace"),
    ("neighbors.kin().foreach(function(id, data) { log(data.dist) })", "W0222", "dist"),
    ("log(neighbors.get(1).angle)", "W0222", "angle"),
    ("x = neighbors.count > 3", "W0223", "neighbors.count"),
    ("if(neighbors.count > 0) log(1)", "W0223", "neighbors.count"),
    ("x = neighbors.count", "W0223", "neighbors.count"),
    ("x = neighbors.count if(x > 1) log(x)", "W0223", "neighbors.count"),
    ("if(neighbors.count) log(1)", "W0223", "neighbors.count"),
    ("log(\"n \", neighbors.count)", "W0223", "neighbors.count"),
    ("x = 1 + math.sqrt", "W0223", "math.sqrt"),
    ("function step() { v = stigmergy.create(1) v.put(\"a\", 1) }", "W0224", "stigmergy.create(1)"),
    ("v = stigmergy.create(1) v.onconflict(function(k, l, r) { return l })", "W0226", "l"),
    ("v = stigmergy.create(1) v.onconflict(function(k, l, r) { return r })", "W0226", "r"),
    (
        "function mine(k, l, r) { if(l.data > r.data) return l else return l } \
         v = stigmergy.create(1) v.onconflict(mine) v.onconflict(mine)",
        "W0226",
        "l",
    ),
    (
        "v = stigmergy.create(1) v.onconflict(function(k, l, r) { if(k == 1) { return r } \
         while(k) { k = k - 1 } var x = r return x })",
        "W0226",
        "r",
    ),
    (
        "v = stigmergy.create(1) v.onconflict(function(k, l, r) { \
         return { .robot = l.robot, .data = r.data } })",
        "W0226",
        "{ .robot = l.robot, .data = r.data }",
    ),
    (
        "function step() { neighbors.broadcast(\"k\", { .a = 1, .b = 2, .c = 3, .d = 4 }) }",
        "W0227",
        "neighbors.broadcast(\"k\", { .a = 1, .b = 2, .c = 3, .d = 4 })",
    ),
    ("function _f() { g() } function step() { log(1) }", "W0228", "g"),
    ("i = 0 while(i < neighbors.count()) { log(neighbors.get(i)) i = i + 1 }", "W0312", "i"),
    ("x = 1 while(x > 0) log(x)", "W0313", "x > 0"),
    ("x = math.tan(-45)", "W0314", "-45"),
    ("function init() { neighbors.listen(\"k\", function(t, v, r) { log(v) }) }", "W0229", "\"k\""),
    ("set_motor(0, 999)", "W0315", "999"),
    ("function _f() { return math.atan2(1, 2) } function init() { log(1) }", "W0228", "atan2"),
    (
        "math.v = {} math.v.f = function() { return math.atan2(1, 2) } function init() { log(1) }",
        "W0228",
        "atan2",
    ),
    ("math.v = {.f = function() { g() }} function init() { log(math.v.x) }", "W0228", "g"),
    ("math.v = {} math.v.f = function() { g() } function init() { math.v.f() }", "E0401", "g"),
    (
        "math.v = {} math.v.f = function() { g() } function init() { var v = math.v v.f() }",
        "E0401",
        "g",
    ),
    (
        "math.v = {} math.v.f = function() { g() } function init() { foreach(math, log) }",
        "E0401",
        "g",
    ),
    ("v = stigmergy.create(\"vs\")", "W0306", "\"vs\""),
    ("s = swarm.create(\"red\")", "W0306", "\"red\""),
    ("x = math.abs(\"1\")", "W0306", "\"1\""),
    ("foreach(1, function(k, v) { log(k, v) })", "W0306", "1"),
    ("neighbors.listen(\"k\", 3)", "W0306", "3"),
    ("x = string.length(3)", "W0306", "3"),
    ("neighbors.broadcast(1, 2)", "W0306", "1"),
    ("math.rng.setseed(1.5)", "W0306", "1.5"),
    ("log(\"battery: %d\", 3)", "W0307", "\"battery: %d\""),
    ("log(\"%.2f m\", 3)", "W0307", "\"%.2f m\""),
    ("t = { .x = 1, .x = 2 }", "W0308", "x"),
    ("t = { .1 = 1, .2 = 2, .1 = 3 }", "W0308", "1"),
];

#[test]
fn each_is_given_once_and_marks_its_cause() {
    for (script, code, marked) in CASES {
        assert_eq!(messages(script), [(*code, (*marked).to_owned())], "{script}");
    }
}

/// Codes that depend on the robot, on the profile or on long scripts are tested where those are.
const ELSEWHERE: [&str; 14] = [
    "E0402", "E0412", "E0601", "E0602", "E0603", "E0604", "E0605", "E0606", "E0607", "E0608",
    "E0609", "E0699", "W0225", "W0311",
];

#[test]
fn no_code_of_the_back_end_is_untested() {
    let ours = |code: &DiagnosticCode| {
        ["E04", "E05", "E06", "W02", "W03"].iter().any(|prefix| code.text().starts_with(prefix))
    };
    let mut tested: BTreeSet<&str> = CASES.iter().map(|(_, code, _)| *code).collect();
    tested.extend(ELSEWHERE);
    let untested: Vec<&str> = DiagnosticCode::ALL
        .iter()
        .filter(|code| ours(code))
        .map(|code| code.text())
        .filter(|c| !tested.contains(c))
        .collect();
    assert_eq!(untested, [""; 0]);
}

#[test]
fn correct_scripts_have_no_diagnostics() {
    let scripts = [
        "x = nil if(x == nil) log(1)",
        "x = 1 < nil y = nil >= \"a\" z = \"a\" < \"b\" w = 1 == 1.0",
        "x = led == nil y = nil != math z = isnil(log)",
        "function f(a) { log(a) return function(a) { return a } } f(1)",
        "x = 1 function f() { var x = 2 return x } f()",
        "x = -2147483648 y = 2147483647 z = 3.4e38 w = 0.0 v = -0.0",
        "x = 1.0 / 0 y = 1.0 % 0",
        "x = 1 << 31 y = 1 << 0",
        "math.sqr = function(x) { return x * x } log(math.sqr(2))",
        "m = math log(m.nosuch, math.nosuch)",
        "function f(t) { return self } t = { .f = f } t.f(1)",
        "t = { .f = function() { return self } } t.f()",
        "function f() { if(1) return 1 else log(2)  log(3) } f()",
        "function f() { return 1 } function g() { return 2 } f() g()",
        "function f() { var t = {} return function() { t.n = 1 } } f()",
        "var x = 1 var x = 2 log(x)",
        "log() log(1) log(1, 2, 3)",
        "x = (1 == 2) + 3",
        "function stop() { log(1) } function step() { stop() }",
        "function steps() { log(1) } steps()",
        "function stop() { log(1) } function unit() { log(1) } function steps() { log(1) }",
        "function step() { log(1) } function init() { log(1) } function reset() { log(1) }",
        "function step(n) { log(n) } step(1)",
        "step = function() { log(1) }",
        "step = nil",
        "function f() { var _x = 1 } f()",
        "function f(_a) { return 1 } f(1)",
        "function f(a) { return 1 } t = { .f = f }",
        "function f() { return 1 }",
        "function _f() { return 1 } function step() { log(1) }",
        "counter = 0 function step() { counter = counter + 1 }",
        "if(isnil(c)) c = 0 c = c + 1",
        "if(not c) c = 0 else c = c + 1",
        "foreach({}, function(key) { log(key) })",
        "foreach({}, function() { log(1) })",
        "foreach({}, function(v) { log(1) })",
        "x = map({}, function(k, v) { return v + 1 })",
        "neighbors.foreach(function(rid, data) { log(data.distance, rid + 1) })",
        "neighbors.listen(\"k\", function(topic, value, id) { log(topic, value.x, id) })",
        "neighbors.listen(\"k\", nil)",
        "neighbors.foreach(function(id, d) { d.seen = 1 log(d.seen) })",
        "x = neighbors.map(function(id, d) { return { .a = d.distance } }) x.foreach(function(id, d) { log(d.a) })",
        "neighbors.map(function(id, d) { return string.sub(\"abc\", id, 2) }).foreach(function(id, d) { log(d.x) })",
        "c = neighbors.count log(c())",
        "c = neighbors.count t = { .f = c }",
        "f = math.sqrt",
        "x = neighbors.count() > 3",
        "x = neighbors.count == nil",
        "function f() { var c = neighbors.count return c() } f()",
        "function step() { if(isnil(v)) v = stigmergy.create(1) }",
        "function step() { if(done) { return } v = stigmergy.create(1) done = 1 }",
        "x = math.min(nil, 1) y = math.max(\"a\", \"b\")",
        "log(\"100 % sure\", 1)",
        "log(\"50 %done\", 1)",
        "log(\"%d\")",
        "t = { .x = 1, .y = 1, .1 = 2, .1.5 = 3 }",
        "s = stigmergy.create(1) s.onconflict(function(k, l, r) { if(l.data > r.data) return l return r })",
        "s = stigmergy.create(1) s.onconflict(function(k, l, r) { if(l.data > r.data) return l })",
        "s = stigmergy.create(1) s.onconflict(function(k, l, r) { if(l.data > r.data) l = r return l })",
        "s = stigmergy.create(1) s.onconflict(function(k, l, r) { l.robot = math.max(l.robot, r.robot) return l })",
        "s = stigmergy.create(1) s.onconflict(function(k, l, r) { var x = l if(k) x = r return x })",
        "s = stigmergy.create(1) s.onconflict(function(k, l, r) { return { .robot = l.robot, .data = 7 } })",
        "s = stigmergy.create(1) s.onconflict(function(k, l, r) { log(k, l, r) return nil })",
        "s = stigmergy.create(1) s.onconflictlost(function(k, l) { return l })",
    ];
    for script in scripts {
        assert_eq!(messages(script), [], "{script}");
    }
}

#[test]
fn the_least_integer_is_one_number() {
    let help = |script, profile| build(script, profile).diagnostics[0].help.clone();
    let found = help("x = 0 - 2147483648", FULL);
    assert!(found.is_some_and(|help| help.contains("`-2147483648`")));
    let found = help("x = 0 - 32768", TINY);
    assert!(found.is_some_and(|help| help.contains("`-32768`")));
    assert!(help("x = 0 - 2147483649", FULL).is_some_and(|help| help.contains("float")));
}

#[test]
fn a_name_that_is_nil_everywhere_is_reported_once() {
    assert_eq!(messages("x = speed y = speed z = speed"), [("W0201", "speed".to_owned())]);
    // But every call is an error of its own.
    assert_eq!(messages("nosuch() nosuch()").len(), 2);
}

#[test]
fn the_tiny_profile() {
    let codes = |script: &str| -> Vec<&str> {
        build(script, TINY).diagnostics.iter().map(|d| d.code.text()).collect()
    };
    assert_eq!(codes("x = 32768"), ["E0501"]);
    assert_eq!(codes("x = -32769"), ["E0501"]);
    assert_eq!(codes("x = -32768 y = 32767 z = 4.29e9 w = 9.4e-10"), [""; 0]);
    assert_eq!(codes("x = 4.295e9"), ["E0502"]);
    assert_eq!(codes("x = 9e-10"), ["E0502"]);
    assert_eq!(codes("x = 1 << 16"), ["W0303"]);
    assert_eq!(codes("x = string.length(\"a\")"), ["E0412"]);
    assert_eq!(codes("s = string"), ["E0412"]);
    assert_eq!(codes("if(string) log(string.length(\"a\"))"), [""; 0]);
}

#[test]
fn limits() {
    let codes = |script: &str| -> Vec<&str> {
        build(script, FULL).diagnostics.iter().map(|d| d.code.text()).collect()
    };
    let list = |count: usize| (0..count).map(|n| format!("p{n}")).collect::<Vec<_>>().join(", ");
    assert_eq!(codes(&format!("function f({}) {{ return 1 }}", list(31))), [""; 0]);
    assert_eq!(codes(&format!("function f({}) {{ return 1 }}", list(32))), ["E0601"]);
    assert_eq!(codes(&format!("f = function({}) {{ return 1 }}", list(40))), ["E0601"]);
    let variables = |count: usize| {
        let body: Vec<String> = (0..count).map(|n| format!("var _v{n} = {n}")).collect();
        format!("function f() {{ {} }} f()", body.join("\n"))
    };
    assert_eq!(codes(&variables(200)), [""; 0]);
    assert_eq!(codes(&variables(201)), ["E0602"]);
    let arguments = |count: usize| format!("log({})", vec!["1"; count].join(", "));
    assert_eq!(codes(&arguments(127)), [""; 0]);
    assert_eq!(codes(&arguments(128)), ["E0603"]);
}

#[test]
fn keywords_are_lowercase() {
    let help = |script: &str| {
        let found = build(script, FULL).diagnostics;
        found.into_iter().find_map(|d| d.help).unwrap_or_default()
    };
    assert_eq!(help("If(1)"), "the keyword is written `if`");
    assert_eq!(help("x = NIL"), "the empty value is written `nil`");
}

#[test]
fn constants_are_computed_with_the_numbers_of_the_robot() {
    let codes = |script: &str, profile, robot: Option<&str>| -> Vec<String> {
        let mut options = Program::options(FULL);
        options.profile = profile;
        let named = |name: &str| options.robots.iter().find(|known| known.name == name).cloned();
        options.robot = robot.and_then(named);
        let found = build_with(script, &options).diagnostics;
        found.iter().map(|d| format!("{} {}", d.code.text(), d.message)).collect()
    };
    let wraps = "W0309 this is 40000, but -25536 with the integers of the `tiny` profile";
    for (profile, robot) in [(None, None), (Some(TINY), None), (None, Some("kilobot"))] {
        assert_eq!(codes("log(200 * 200)", profile, robot), [wraps]);
        let found = codes("log(100000.0 * 100000)", profile, robot);
        // The integer does not fit either, where the robot is known.
        assert!(robot.is_none() && profile.is_none() || found[0].starts_with("E0501"), "{found:?}");
        let found = codes("log(1000.0 ^ 4)", profile, robot);
        assert_eq!(found, ["W0310 this is more than the floats of the `tiny` profile can hold"]);
    }
    for (profile, robot) in [(Some(FULL), None), (None, Some("crazyflie"))] {
        assert_eq!(codes("log(200 * 200, 1000.0 ^ 4)", profile, robot), [""; 0]);
    }
    // A script with larger numbers is not for small ones.
    assert_eq!(codes("log(100000 * 2)", None, None), [""; 0]);
}

#[test]
fn syntax_errors_hide_no_other_diagnostics_and_cause_no_false_ones() {
    let others = |script: &str| -> Vec<(&'static str, String)> {
        let found = messages(script);
        assert!(found.iter().any(|(code, _)| code.starts_with("E0")), "{script}");
        let is_syntax =
            |code: &str| ["E01", "E02", "E03", "W01"].iter().any(|kind| code.starts_with(kind));
        found.into_iter().filter(|(code, _)| !is_syntax(code)).collect()
    };
    for (script, expected) in [
        ("nosuch(1)\nx = 1 +\nfunction f(a, a) { return a }\nlog(size())", "E0401 E0407 E0403"),
        (
            "function step() { log(hight)\n x = = 3\n foo(3) }\nfunction other() { bar() }",
            "W0201 E0401 E0401",
        ),
        ("for(i = 0; i < ; i = i + 1) { nosuch(i) }", "E0401"),
        ("for i = 0 to 3 { nosuch(i) }", "E0401"),
        ("if(a b) { nosuch(a) } else { x = 1 + nil }", "E0401 W0301"),
        ("{ nosuch(1) }", "E0401"),
        ("x = 1 else { nosuch(1) }", "E0401"),
        ("function(a) { nosuch(a) }", "E0401"),
        ("y = = 3\nlog(mat.pi) log(math.tau)", "W0201 W0208"),
        ("y = = 3\nfunction step(dt) { log(dt) }", "W0213"),
        // Names in source that could not be read may be defined there.
        ("int x 5\nlog(x)", ""),
        ("local function f(a) { return a }\nf(1)", ""),
        ("f(1) def f(a) { y = 2 }", ""),
        ("function f(a b) { return a + b } f(1, 2)", ""),
        ("function f(a, b { return a + b } f(1, 2) }", ""),
        ("function f(a, b) { return a } f(1, = )", ""),
        ("function f(a, b) { return a } f(1", ""),
        ("x = size(", ""),
        ("var s = 'text log(a) \nlog(s, text, a)", ""),
        ("function f() \"text { return 1 }\nh = 2 log(\"a\")\nfunction g() { log(h) }", ""),
        ("if(a = 3) b = 1", ""),
        // A bracket too many or too few moves names to other functions.
        ("function f() { var a = 1 } log(a) }", ""),
        ("function f(a) { if(a) { log(a) \nfunction g() { log(1) }\nfunction h() { g() }", ""),
        ("function f() { if(1) { function g() { log(1) } } }\ng()", ""),
        ("t = { .f = function(a { return a } }\nlog(a)", ""),
        // The name at the end may not be complete.
        ("function f() { log(neighb", ""),
        ("function f() { neighbors.coun", ""),
        ("function f() { if(neighbors.coun", ""),
        // An included file may define anything.
        ("include 'nowhere.bzz'\nlog(a) f()", ""),
    ] {
        let codes: Vec<&str> = others(script).into_iter().map(|(code, _)| code).collect();
        assert_eq!(codes.join(" "), expected, "{script}");
    }
}

#[test]
fn messages_are_in_the_order_of_the_source() {
    let compiled = build("log(aaaa)\nlog(size())\nfunction f(x, x) { return bbbb }\ncccc()", FULL);
    let starts: Vec<u32> = compiled.diagnostics.iter().map(|d| d.span.start).collect();
    assert!(starts.is_sorted(), "{starts:?}");
    assert_eq!(starts.len(), 5);
}

/// Floats of `tiny` have ten bits: next to 128 they are 0.25 apart, and a half of that or less adds nothing.
#[test]
fn a_sum_that_stops_growing_is_reported_with_its_end() {
    let reports = |script: &str, profile| -> Vec<String> {
        let found = build(script, profile).diagnostics.into_iter();
        found.filter(|found| found.code.text() == "W0311").map(|found| found.message).collect()
    };
    let stopping = [
        ("t = 0.0 function step() { t = t + 0.1 }", "128"),
        ("t = 0.0 function step() { t = 0.1 + t }", "128"),
        ("t = 7 function step() { t = t - 0.5 }", "-512"),
        ("function init() { t = 0 } function step() { t = t + 0.25 }", "256"),
        ("t = 0.0 function step() { t = t + 1 }", "1024"),
        (
            "t = 0.0 function add() { t = t + 0.1 } function step() { add() if(t > 60) log(t) }",
            "128",
        ),
        ("t = 0.0 function step() { if(id == 3) t = t + 0.1 }", "128"),
        ("t = 0.0 function step() { if(id) { t = t + 0.1 } else { t = t + 0.5 } }", "512"),
    ];
    for (script, end) in stopping {
        let found = reports(script, TINY);
        assert_eq!(found.len(), 1, "{script}: {found:?}");
        assert!(found[0].starts_with(&format!("`t` stops at {end}: ")), "{script}: {found:?}");
        assert_eq!(reports(script, FULL), [""; 0], "{script}");
    }
    let others = [
        "n = 0 function step() { n = n + 1 }",
        "t = 0.0 function add() { t = t + 0.1 } function init() { add() } function step() { log(t) }",
        "t = 0.0 function _add() { t = t + 0.1 } function step() { log(t) }",
        "t = 0.0 function init() { neighbors.listen(\"k\", function() { t = 0.0 }) } function step() { t = t + 0.1 }",
        "t = 0.0 function step() { t = t + 0.1 if(t > 10) t = 0.0 }",
        "t = 0.0 function step() { if(t < 10) t = t + 0.1 }",
        "t = 0.0 function step() { if(t > 10) { log(t) return } t = t + 0.1 }",
        "t = 0.0 function step() { while(t < 3) t = t + 0.1 }",
        "t = 0.0 function step() { t = t + 0.1 } function reset() { t = 0.0 }",
        "t = 0.0 function step() { if(id) { t = t + 0.1 } else { t = t - 0.1 } }",
        "for(t = 0.0, t < 3, t = t + 0.1) log(t)",
        "function step() { var t = 0.0 t = t + 0.1 log(t) }",
        "t = 0.0 function step() { t = t + id }",
        "t = 0.0 function step() { t = 2 * t + 0.1 }",
        "function step() { if(isnil(t)) t = 0.0 t = t + 0.1 }",
    ];
    for script in others {
        assert_eq!(reports(script, TINY), [""; 0], "{script}");
    }
}

#[test]
fn the_robot_is_named_where_it_matters() {
    let first = |script: &str, robot| {
        let compiled = build_for(script, TINY, Some(robot));
        compiled.diagnostics.first().cloned().expect("a message")
    };
    let missing = first("goto(1, 2)", "kilobot");
    assert_eq!(missing.message, "the Kilobot has no function `goto`");
    let help = missing.help.unwrap_or_default();
    assert!(
        help.contains("Zooid") && help.contains("Crazyflie") && help.contains("if(goto)"),
        "{help}"
    );
    let taken = first("led = 1", "kilobot");
    assert!(taken.message.contains("Kilobot"), "{}", taken.message);
}
