//! The class table: the classes of value that a script may send on each topic and under each key.

use bittybuzz_compiler::profile::NumberProfile;
use bittybuzz_vm_core::builtin::Feature;
use bittybuzz_vm_core::class;
use bittybuzz_vm_core::image::{ALL_CLASSES, Image};

use crate::back::machine::{FULL, TINY, image};

/// The row of a string, or of all other names, as letters: `n`il, number (`i`), `s`tring, `t`able, `f`unction.
fn row(script: &str, profile: NumberProfile, name: Option<&str>) -> String {
    let (bytes, symbols) = image(script, profile);
    let header = Image::new(bytes.as_slice()).header().expect("an image");
    let row = match (header.classes_at().map(usize::from), name) {
        (None, _) => ALL_CLASSES,
        (Some(at), None) => bytes[at],
        (Some(at), Some(name)) => {
            let number = symbols.strings.iter().position(|known| known == name);
            bytes[at + symbols.strings.len() - number.expect("a string of the script")]
        }
    };
    let letters = [
        (class::NIL, 'n'),
        (class::NUMBER, 'i'),
        (class::STRING, 's'),
        (class::TABLE, 't'),
        (class::FUNCTION, 'f'),
    ];
    letters.iter().filter(|(class, _)| row & class != 0).map(|(_, letter)| letter).collect()
}

/// What a script may send on topic `t` and under key `t`.
fn on_t(script: &str) -> String {
    row(script, FULL, Some("t"))
}

/// The row if the script broadcasts that expression on topic `t`.
fn said(value: &str, rest: &str) -> String {
    on_t(&format!("function step() {{ neighbors.broadcast(\"t\", {value}) }} {rest}"))
}

#[test]
fn each_kind_of_expression() {
    for (value, expected) in [
        ("nil", "n"),
        ("1", "i"),
        ("1.5", "i"),
        ("id", "i"),
        ("\"a\"", "s"),
        ("{}", "t"),
        ("{.t = nil}", "t"),
        ("function() { }", "f"),
        ("step", "f"),
        // Neither can be sent.
        ("log", "f"),
        ("led", "nf"),
        ("-id", "i"),
        ("not id", "i"),
        ("id + 1", "i"),
        ("id and {}", "i"),
        ("nil or \"a\"", "i"),
        ("id == nil", "i"),
        ("math.pi", "i"),
        ("math.sqrt(2)", "i"),
        ("math.rng.uniform(1)", "i"),
        ("int(2.5)", "i"),
        ("size({})", "i"),
        ("type(id)", "s"),
        ("string.concat(\"a\", \"b\")", "s"),
        ("string.toint(\"a\")", "ni"),
        ("clone(1)", "i"),
        ("clone({})", "t"),
        ("log(1)", "n"),
        ("neighbors.count()", "i"),
        ("neighbors.get(1)", "nt"),
        ("neighbors.map(log)", "t"),
        ("swarm.id()", "ni"),
        // The result of a robot function, of which nothing is known.
        ("led(1)", "nis"),
        // Another robot may have it.
        ("nobody_has_this", "n"),
        ("if_only(1)", "nis"),
    ] {
        let guard = if value.starts_with("if_only") { "if_only = nil" } else { "" };
        assert_eq!(said(value, guard), expected, "{value}");
    }
}

#[test]
fn values_are_followed() {
    for (value, rest, expected) in [
        // A variable that is assigned before anything can read it is never nil.
        ("x", "x = 1", "i"),
        ("x", "function init() { x = 1 }", "i"),
        ("x", "x = 1 function init() { x = \"a\" }", "is"),
        ("x", "if(id == 1) x = 1", "ni"),
        ("x", "function init() { if(id == 1) { return } x = 1 }", "ni"),
        ("x", "function init() { y() x = 1 } y = step", "ni"),
        ("x", "function init() { y(2) x = 1 } function y(a) { return a }", "i"),
        ("x", "function init() { y() x = 1 } function y() { return x }", "ni"),
        ("x", "y = x x = 1", "ni"),
        ("x", "function reset() { x = 1 }", "ni"),
        ("x", "x = 1 function reset() { x = nil }", "ni"),
        ("x", "x = 1 function reset() { x = {} }", "it"),
        ("x", "function x() { } function reset() { x = 1 }", "if"),
        // Built-in functions under a name that is assigned are followed no further.
        ("size", "size = 1", "nistf"),
        // Parameters and results.
        ("f(1)", "function f(a) { return a }", "i"),
        ("f(1)", "function f(a) { return a } x = f(\"a\")", "is"),
        ("f(1)", "function f(a) { if(a == 1) return a }", "ni"),
        ("f(1)", "function f(a) { if(a == 1) return 1 else return \"a\" }", "is"),
        ("f(1)", "function f(a) { return }", "n"),
        ("f(1)", "function f(a) { return g(a) } function g(a) { return {.a = a} }", "t"),
        ("f(3)", "function f(a) { if(a > 0) return f(a - 1) return \"end\" }", "s"),
        // A function as a value: with any argument that any such function gets.
        ("f(1)", "f = nil function init() { f = function(a) { return a } }", "nis"),
        ("f(1)", "f = nil function init() { f = g } function g(a) { return a } x = f({})", "nist"),
        // Tables: an element is any element, and may be missing.
        ("x.a", "x = {.a = 1}", "ni"),
        ("x[1]", "x = {.a = 1} y = {.b = \"b\"}", "nis"),
        ("x.a", "x = {} function init() { x.a = step }", "nif"),
        ("x.a", "x = {} function init() { x[3] = {} }", "nit"),
        ("x.a.b", "x = {.a = {.b = \"b\"}}", "nist"),
        // Methods and self.
        ("x.f()", "x = {.a = \"a\", .f = function() { return self.a }}", "nisf"),
        ("x.f({})", "x = {.f = function(a) { return a }}", "nist"),
        ("x[1]({})", "x = {} function init() { x[1] = function(a) { return a } }", "nist"),
        ("x.f()", "x = {.f = function() { return self }}", "nist"),
        // Closures.
        ("f()()", "function f() { var a = \"a\" return function() { return a } }", "nis"),
        ("f()()", "function f() { var a = 1 return function() { a = {} return a } }", "nist"),
        // Callbacks.
        ("x", "x = 1 foreach({.a = 1}, function(k, v) { x = k })", "is"),
        ("x", "x = 1 function init() { foreach({.a = {}}, function(k, v) { x = v }) }", "it"),
        ("map({.1 = 1}, function(k, v) { return \"a\" })[1]", "", "nis"),
        ("filter({.1 = {}}, function(k, v) { return 1 })[1]", "", "nit"),
        ("reduce({.1 = 1}, function(k, v, a) { return a + v }, 0)", "", "i"),
        ("reduce({.1 = 1}, function(k, v, a) { return a }, \"a\")", "", "s"),
        ("reduce({.1 = {}}, function(k, v, a) { return v }, \"a\")", "", "ist"),
        ("reduce({.1 = {}}, f, 0)", "f = nil", "nist"),
        ("neighbors.reduce(function(r, d, a) { return a + d.distance }, 0)", "", "i"),
        ("neighbors.reduce(function(r, d, a) { return d }, 0)", "", "it"),
        ("neighbors.map(function(r, d) { return \"a\" }).get(1)", "", "nist"),
        ("s.exec(f)", "s = swarm.create(1) function f() { return {} }", "nt"),
        ("s.id", "s = swarm.create(1)", "ni"),
        // `min` and `max` pass over nil.
        ("math.min(x, 3)", "if(id) x = 1", "i"),
        ("math.max(x, y)", "if(id) x = 1 if(id) y = 1", "ni"),
    ] {
        assert_eq!(said(value, rest), expected, "{value} with {rest}");
    }
}

/// A robot of another kind runs the same source, where other names are robot functions.
#[test]
fn names_that_mean_nothing_here_may_be_functions_there() {
    let script = "function init() { neighbors.broadcast(\"u\", 1) } lift_at = lift
        function step() { if(lift) neighbors.broadcast(\"t\", lift(\"a\")) }";
    assert_eq!(on_t(script), "nis");
    assert_eq!(said("x()", "x = nil function init() { x = lift }"), "nis");
    assert_eq!(said("pos.x", ""), "ni");
    assert_eq!(said("pos.up", ""), "ni");
}

#[test]
fn received_values_are_those_that_were_sent() {
    let listen = "neighbors.listen(\"t\", function(topic, value, robot) { x = value })";
    assert_eq!(said("x", &format!("x = 1 {listen}")), "i");
    assert_eq!(said("x", &format!("x = {{}} {listen}")), "t");
    let other = "function init() { neighbors.broadcast(\"u\", \"a\") }";
    assert_eq!(said("x", &format!("x = 1 {listen} {other}")), "i");
    let forwards = "neighbors.listen(\"u\", function(topic, value, robot) { x = value })";
    assert_eq!(said("x", &format!("x = 1 {forwards} {other}")), "is");
    let topic = "neighbors.listen(\"u\", function(topic, value, robot) { x = topic })";
    assert_eq!(said("x", &format!("x = 1 {topic}")), "is");
    let robot = "neighbors.listen(\"u\", function(topic, value, robot) { x = robot })";
    assert_eq!(said("x", &format!("x = \"a\" {robot}")), "is");
    // A listener that is a value.
    let value =
        "f = nil function init() { f = function(t, v, r) { x = v } neighbors.listen(\"t\", f) }";
    assert_eq!(said("x", &format!("x = {{}} {value}")), "ist");
}

#[test]
fn topics_and_keys_that_are_computed_may_be_any() {
    let script =
        "function step() { neighbors.broadcast(k, {}) neighbors.broadcast(\"t\", 1) } k = \"u\"";
    assert_eq!(on_t(script), "it");
    assert_eq!(row(script, FULL, None), "t");
    // Each is listened to.
    let script = "x = 1 k = \"t\" neighbors.listen(k, function(t, v, r) { x = v })
        function step() { neighbors.broadcast(\"t\", x) neighbors.broadcast(\"u\", \"a\") }";
    assert_eq!(on_t(script), "is");
    // A string that is sent nowhere is for others than this script.
    assert_eq!(row("neighbors.broadcast(\"t\", 1) x = \"u\"", FULL, Some("u")), "nistf");
    // A topic of the machine has no row, a number has one with all others.
    assert_eq!(row("neighbors.broadcast(\"data\", 1)", FULL, None), "nistf");
}

/// The row of key `t` and that of numbers, of a stigmergy `s`.
fn keys(rest: &str) -> [String; 2] {
    let script = format!("s = stigmergy.create(1) k = \"t\" {rest}");
    [Some("t"), None].map(|name| row(&script, FULL, name))
}

#[test]
fn keys_of_stigmergies() {
    let of = |rest: &str| keys(rest).join(" ");
    assert_eq!(of("s.put(\"t\", 1)"), "i nistf");
    assert_eq!(of("s.put(3, 1)"), "nistf i");
    assert_eq!(of("s.put(id, \"a\")"), "nistf s");
    assert_eq!(of("s.put(k, \"a\")"), "s s");
    assert_eq!(of("s.put(\"t\", nil)"), "n nistf");
    assert_eq!(of("s.put(\"t\", 1) s.put(\"t\", s.get(\"t\"))"), "ni nistf");
    assert_eq!(of("s.put(\"t\", 1 + s.get(\"t\"))"), "i nistf");
    assert_eq!(of("s.put(1, {}) s.put(\"t\", s.get(id))"), "nt t");
    assert_eq!(of("x = 1 s.put(1, x) s.foreach(function(k, v, r) { x = v })"), "nistf i");
    assert_eq!(
        of("x = 1 s.put(1, {}) s.put(\"t\", x) s.foreach(function(k, v, r) { x = v })"),
        "it t"
    );
    assert_eq!(of("s.put(1, s.reduce(function(k, v, r, a) { return a + v }, 0))"), "nistf i");
    assert_eq!(of("s.put(1, s.reduce(function(k, v, r, a) { return k }, 0))"), "nistf is");
    assert_eq!(of("s.put(1, s.map(function(k, v, r) { return v }).get(1))"), "nistf nis");
    assert_eq!(of("s.put(1, s.size()) s.put(\"t\", s.id)"), "ni i");
    // In a table, and as a parameter.
    assert_eq!(of("x = {.s = s} x.s.put(1, {})"), "nistf t");
    assert_eq!(of("function f(a) { a.put(1, {}) } f(s)"), "nistf t");
    assert_eq!(of("x = {.f = function(a) { a.put(1, {}) }} x.f(s)"), "nistf t");
    // In a function of the script that the stigmergy holds.
    assert_eq!(of("s.put(\"t\", 1) s.f = function() { self.put(\"t\", {}) } s.f()"), "it nistf");
    assert_eq!(of("s.put(\"t\", 1) s[1] = function() { self.put(\"t\", {}) } s[1]()"), "it nistf");
    // A table of the script with a function of that name sends nothing.
    assert_eq!(of("x = {.put = function(k, v) { }} x.put(\"t\", {}) s.put(\"t\", 1)"), "i nistf");
}

#[test]
fn conflicts_write_what_the_handler_returns() {
    let of = |handler: &str| keys(&format!("s.put(\"t\", 1) s.onconflict({handler})"))[0].clone();
    assert_eq!(of("function(k, a, b) { if(a.data < b.data) return a return b }"), "i");
    assert_eq!(of("function(k, a, b) { return {.robot = a.robot, .data = a.data + 1} }"), "i");
    assert_eq!(of("function(k, a, b) { return {.robot = a.robot, .data = \"a\"} }"), "is");
    assert_eq!(of("function(k, a, b) { return {.robot = a.robot} }"), "ni");
    assert_eq!(of("function(k, a, b) { return {.robot = a.robot, .data = nil} }"), "ni");
    assert_eq!(of("function(k, a, b) { return {.robot = 1, .data = 1, .data = nil} }"), "ni");
    assert_eq!(of("function(k, a, b) { a.data = nil return a }"), "ni");
    assert_eq!(of("function(k, a, b) { var x = {} x.robot = a.robot return x }"), "ni");
    assert_eq!(of("function(k, a, b) { a.data = k return a }"), "is");
    assert_eq!(of("function(k, a, b) { a[k] = nil return a }"), "ni");
    let lost = "s.put(\"t\", {}) s.onconflictlost(function(k, a) { x = a.data }) x = 1 s.put(1, x)";
    assert_eq!(keys(lost), ["t", "nit"]);
}

/// By another name anything may be sent anywhere: there is no table.
#[test]
fn no_table_where_it_is_unknown_who_sends() {
    for rest in [
        "n = neighbors",
        "p = clone(pos)",
        "b = neighbors.broadcast",
        "neighbors.broadcast = step",
        "neighbors = nil",
        "g = stigmergy",
        "c = stigmergy.create",
        "s = stigmergy.create(1) p = s.put",
        "s = stigmergy.create(1) k = \"put\" s[k](\"t\", 2)",
        "s = stigmergy.create(1) x = s[k] k = \"put\"",
        "s = stigmergy.create(1) s.put = step",
        "s = stigmergy.create(1) s[k] = step k = \"put\"",
        "s = stigmergy.create(1) c = clone(s)",
        "s = stigmergy.create(1) foreach(s, log)",
    ] {
        assert_eq!(said("1", rest), "nistf", "{rest}");
    }
    // Fields of its own that the script adds to `neighbors` change nothing.
    assert_eq!(said("1", "neighbors.last = {} x = neighbors.last"), "i");
    assert_eq!(said("neighbors.f(1)", "neighbors.f = function(a) { return a }"), "nis");
}

#[test]
fn the_table_is_there_only_if_it_refuses_something() {
    for script in ["x = \"t\"", "function step() { neighbors.broadcast(\"data\", 1) }"] {
        let bytes = image(script, TINY).0;
        let header = Image::new(bytes.as_slice()).header().expect("an image");
        assert_eq!(header.classes_at(), None, "{script}");
    }
    let (bytes, symbols) = image("neighbors.broadcast(\"t\", id) x = \"u\"", TINY);
    let header = Image::new(bytes.as_slice()).header().expect("an image");
    let at = usize::from(header.classes_at().expect("a table"));
    assert_eq!(symbols.strings, ["broadcast", "t", "u"]);
    let end = usize::from(header.functions_at());
    assert_eq!(bytes[at..end], [ALL_CLASSES, ALL_CLASSES, class::NUMBER, ALL_CLASSES]);
    assert_eq!(header.features() & Feature::Numbers as u8, Feature::Numbers as u8);
    // A machine looks at numbers only if some name refuses them.
    let (bytes, _) =
        image("neighbors.broadcast(\"t\", id) neighbors.broadcast(\"u\", \"a\")", TINY);
    let header = Image::new(bytes.as_slice()).header().expect("an image");
    assert!(header.classes_at().is_some());
    assert_eq!(header.features() & Feature::Numbers as u8, 0);
}

/// Whatever it does with libraries and robot functions, it needs nothing of the machine that a robot without links lacks.
#[test]
fn a_script_that_sends_nothing_has_no_table() {
    for script in ["x = pos", "x = math x.y = 1", "function f(t, k) { t[k] = 1 } f(math, \"pi\")"] {
        for profile in [TINY, FULL] {
            let (bytes, _) = image(script, profile);
            let header = Image::new(bytes.as_slice()).header().expect("an image");
            assert_eq!(header.classes_at(), None, "{script}");
            let sending = Feature::LongMessages as u8 | Feature::Numbers as u8;
            assert_eq!(header.features() & sending, 0, "{script}");
        }
    }
}
