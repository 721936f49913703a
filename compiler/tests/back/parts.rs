//! The parts of the machine that scripts use: what is found of them, and that a machine without the others does the same.

use std::fs;
use std::path::Path;

use bittybuzz_compiler::compile::Options;
use bittybuzz_compiler::fit::{self, CapacityError};
use bittybuzz_testkit::{Event, Swarm, TestRobot};
use bittybuzz_vm_core::builtin::Feature;
use bittybuzz_vm_core::number::{Profile, Tiny};
use bittybuzz_vm_core::{ByteCode, Image, ImageError, Part, Parts, Sizes, Vm};

use crate::back::machine::{TINY, build_with, image, robot};

fn parts(script: &str) -> Vec<Part> {
    fit::parts(&image(script, TINY).0).iter().collect()
}

#[test]
fn parts_are_those_that_the_script_uses() {
    use Part::*;
    for (script, expected) in [
        ("", &[][..]),
        ("x = 1 / 2 + rand() function step() { x = {.a = x} delay(5) }", &[]),
        ("x = 1.5", &[Floats]),
        ("x = float(1)", &[Floats]),
        ("function step() { x = 2 ^ step }", &[Floats, Maths]),
        ("x = math.sin(id)", &[Floats, Maths]),
        ("x = math.abs(id)", &[]),
        ("foreach({}, log)", &[Iteration]),
        ("m = math", &[Floats, Maths, Libraries]),
        ("function f(a) { return function() { return a } }  x = f(1)", &[Closures]),
        ("function f() { return self.a } x = f", &[Closures]),
        ("x = neighbors.count()", &[Neighbors]),
        ("x = neighbors.get(1)", &[Floats, Neighbors]),
        ("neighbors.foreach(log)", &[Floats, Iteration, Neighbors]),
        ("neighbors.broadcast(\"a\", 1)", &[Messages]),
        ("s = swarm.create(1)", &[Swarms]),
        ("s = swarm.create(1) s.join()", &[Libraries, Swarms]),
        ("v = stigmergy.create(1) v.put(\"a\", 1)", &[Libraries, Stigmergy]),
        ("v = stigmergy.create(1) v.onconflict(math.max)", &[Libraries, Stigmergy, Conflicts]),
    ] {
        let mut found = parts(script);
        found.sort_by_key(|part| *part as u8);
        assert_eq!(found, expected, "{script}");
    }
}

/// What travels in one frame, and what may need more.
#[test]
fn long_messages_are_those_that_may_need_several_frames() {
    let said = |value: &str| format!("function step() {{ neighbors.broadcast(\"t\", {value}) }} ");
    for (script, expected) in [
        (said("1 + id"), false),
        (said("{}"), true),
        (said("step"), true),
        (said("x") + "x = 1", false),
        (said("x") + "x = 1 function init() { x = {} }", true),
        (said("t.a") + "t = {.a = 1}", false),
        (said("t.a") + "t = {.a = {}}", true),
        (said("t[1]") + "t = {} function init() { t[1] = step }", true),
        (said("f(1)") + "function f(a) { return a }", false),
        (said("f({})") + "function f(a) { return a }", true),
        (said("f(1)") + "function f(a) { return g } function init() { g = {} }", true),
        (said("f()") + "f = nil function init() { f = function() { return {} } }", true),
        (said("math.min(x, 3)") + "x = 1", false),
        (said("neighbors.get(1)"), true),
        (said("neighbors.count()"), false),
        (said("type(id)"), false),
        // A listener receives the values that were broadcast.
        (said("x") + "x = 1 neighbors.listen(\"t\", function(t, v, r) { x = v })", false),
        (said("x") + "x = {} neighbors.listen(\"t\", function(t, v, r) { x = v })", true),
        (said("x") + "x = 0 neighbors.foreach(function(r, d) { x = r })", false),
        (said("x") + "x = 0 neighbors.foreach(function(r, d) { x = d })", true),
        (said("neighbors.reduce(function(r, d, a) { return a + 1 }, 0)"), false),
        (said("neighbors.reduce(function(r, d, a) { return d }, 0)"), true),
        // A captured variable.
        ("function f() { var x = {} return function() { neighbors.broadcast(\"t\", x) } }  function step() { f()() }".to_owned(), true),
        // By another name.
        ("n = neighbors".to_owned(), true),
        ("v = stigmergy.create(1) v.put(\"a\", 1)".to_owned(), false),
        ("v = stigmergy.create(1) v.put(\"a\", {})".to_owned(), true),
        ("v = stigmergy.create(1) v.put(0.5, 1)".to_owned(), true),
        // Only three of them have frames of their own.
        ("v = stigmergy.create(2) v.put(\"a\", 1)".to_owned(), false),
        ("v = stigmergy.create(3) v.put(\"a\", 1)".to_owned(), false),
        (
            "u = stigmergy.create(5) v = stigmergy.create(6) w = stigmergy.create(7) x = stigmergy.create(8)".to_owned(),
            true,
        ),
        ("v = stigmergy.create(id) v.put(\"a\", 1)".to_owned(), true),
    ] {
        assert_eq!(parts(&script).contains(&Part::LongMessages), expected, "{script}");
    }
}

#[test]
fn a_missing_part_is_reported_at_its_first_use() {
    let script = "x = 1\nfunction step() {\n  neighbors.broadcast(\"a\", x)\n  v.put(1, x)\n}\nv = stigmergy.create(1)";
    let few = Parts::of(&[Part::Libraries]);
    let lacking = robot(|robot| robot.parts = few);
    let compiled = build_with(script, &Options { robot: Some(lacking), ..Options::default() });
    let lines: Vec<_> = compiled
        .diagnostics
        .iter()
        .map(|found| (found.code.text(), compiled.sources.line_column(found.span).line))
        .collect();
    assert_eq!(lines, [("E0608", 3), ("E0608", 6)]);
    let capacity_errors =
        fit::capacity_errors(&image(script, TINY).0, &robot(|robot| robot.parts = Parts::ALL));
    assert!(!capacity_errors.iter().any(|misfit| matches!(misfit, CapacityError::Part { .. })));
}

/// An image for a machine that has only these parts.
#[derive(Clone, Copy)]
struct Few<'a, const PARTS: u16>(&'a [u8]);

impl<const PARTS: u16> ByteCode for Few<'_, PARTS> {
    type Slots<P: Profile, const SLOTS: usize> = P::Slots<SLOTS>;

    const PARTS: Parts = Parts::from_bits(PARTS);
    const SIZES: Option<Sizes> = Some(SIZES);

    fn len(&self) -> usize {
        ByteCode::len(&self.0)
    }

    fn byte(&self, at: usize) -> u8 {
        self.0.byte(at)
    }
}

const SIZES: Sizes = Sizes { neighbors: 15, bearings: false, entries: 4, swarms: 8 };
const SLOTS: usize = 339 + SIZES.slots();

/// The verifier does not know parts, but the features that an image declares: a feature is missing with all its parts.
#[test]
fn a_machine_refuses_features_without_a_part_of_theirs() {
    fn load<const PARTS: u16>(script: &str) -> Result<(), ImageError> {
        let image = image(script, TINY).0;
        let mut vm: Vm<Tiny, Few<'_, PARTS>, SLOTS> = Vm::new();
        vm.load(Image::new(Few(&image)), |_| false)
    }
    const LANGUAGE: u16 = Parts::LANGUAGE.bits();
    const MESSAGES: u16 = Parts::LANGUAGE.and(Parts::of(&[Part::Messages])).bits();
    const ALL: u16 = Parts::ALL.bits();
    let refused = |feature: Feature| Err(ImageError::Features((feature as u8).into()));
    for (script, feature) in [
        ("x = math.sin(1)", Feature::Maths),
        ("x = 2 function step() { x = x ^ x }", Feature::Maths),
        ("x = neighbors.count()", Feature::Neighbors),
        ("neighbors.ignore(\"a\")", Feature::Neighbors),
        ("s = swarm.create(1)", Feature::Swarm),
        ("v = stigmergy.create(1)", Feature::Stigmergy),
    ] {
        assert_eq!(load::<LANGUAGE>(script), refused(feature), "{script}");
        assert_eq!(load::<ALL>(script), Ok(()), "{script}");
    }
    assert_eq!(load::<MESSAGES>("neighbors.ignore(\"a\")"), Ok(()));
    assert_eq!(load::<MESSAGES>("s = swarm.create(1)"), refused(Feature::Swarm));
    assert_eq!(load::<LANGUAGE>("x = map({.a = 1}, function(k, v) { return v / 2.0 })"), Ok(()));
}

/// Three robots in a row; the middle one receives the frames of both others. Returns their calls in 150
/// steps.
fn play<C: ByteCode>(script: C) -> Vec<Vec<Event>> {
    let robots = [0, 1, 7].map(|id| TestRobot::<Tiny, C, SLOTS>::new(script, id, SIZES));
    let mut swarm = Swarm::of(Vec::from(robots));
    swarm.air.reaches = Box::new(|from, to| from.abs_diff(to) == 1);
    swarm.air.place = Box::new(|from, to| Some([40.0 + 10.0 * (from + to) as f32, 0.0, 0.0]));
    swarm.steps(150);
    let calls = |robot: TestRobot<_, _, SLOTS>| {
        let events = robot.host.events.into_iter();
        events.filter(|event| matches!(event, Event::Call { .. })).collect()
    };
    swarm.robots.into_iter().map(calls).collect()
}

/// Plays a script on machines that have the parts that it uses and no others. They are known when this is compiled.
fn play_on_few(script: &[u8], name: &str) -> Vec<Vec<Event>> {
    const fn bits(parts: &[Part]) -> u16 {
        Parts::of(parts).bits()
    }
    macro_rules! on_machine {
        ($($parts:expr;)*) => {
            match fit::parts(script).bits() {
                $(few if few == const { bits($parts) } => play(Few::<{ bits($parts) }>(script)),)*
                _ => panic!("{name}: {:?}", fit::parts(script).iter().collect::<Vec<_>>()),
            }
        };
    }
    use Part::*;
    on_machine! {
        &[];
        &[Messages];
        &[Floats, Neighbors, Messages];
        &[Floats, Iteration, Neighbors];
        &[Libraries, Stigmergy, Conflicts];
        &[Libraries, Swarms];
        &[Floats, Maths];
        &[Closures];
        &[Iteration];
        &[Messages, Closures];
        &[Messages, LongMessages];
    }
}

#[test]
fn a_machine_with_the_used_parts_behaves_like_a_complete_one() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/kilobot");
    let files = fs::read_dir(folder).expect("examples").map(|entry| entry.expect("a file").path());
    let files = files.filter(|path| path.extension().is_some_and(|extension| extension == "bzz"));
    let read = |path: std::path::PathBuf| {
        (path.display().to_string(), fs::read_to_string(path).expect("a text"))
    };
    let mut scripts: Vec<(String, String)> = files.map(read).collect();
    assert_eq!(scripts.len(), 7);
    scripts.extend(
        [
            "n = 0 function step() { n = n + 7 led(n % 5 - 1 + n / 3, (n & 6) - n) delay(1) }",
            "x = 0.5 function step() { x = x * 1.25 - 1 led(int(x * 8), x < 2, x == x) x = math.sin(x) }",
            "function adder(n) { return function(x) { return x + n } } function step() { f = adder(3) led(f(4)) }",
            "t = {.a = 3, .b = 4} function step() { led(reduce(t, function(k, v, a) { return a + v }, 0)) t.a = t.a + 1 }",
            "t = {.n = 0, .up = function() { self.n = self.n + 1 return self.n }} function step() { led(t.up()) }",
            "x = {} neighbors.listen(\"t\", function(t, v, r) { led(v.n, r) }) function step() { x.n = id neighbors.broadcast(\"t\", x) }",
        ]
        .map(|script| (script.to_owned(), script.to_owned())),
    );
    for (name, script) in scripts {
        let image = image(&script, TINY).0;
        let whole = play(Few::<{ Parts::ALL.bits() }>(&image));
        assert!(whole.iter().any(|calls| calls.len() > 100), "{name}: {whole:?}");
        assert_eq!(play_on_few(&image, &name), whole, "{name}");
    }
}
