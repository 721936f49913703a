//! Values, objects and frames of scripts, compared with their sources.

use std::collections::BTreeSet;

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_inspect::{
    FrameFunction, Inspection, Limits, Named, Object, ObjectId, ScriptFrame, ScriptMemory,
    ScriptValue, inspect,
};
use bittybuzz_testkit::profiles::{Full, Tiny};
use bittybuzz_testkit::{
    Answer, Event, Program, RecordedArgument, SIZES, TestRobot, in_both_profiles,
};
use bittybuzz_vm_core::inspect::Activity;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{Entry, FaultCode, Outcome};

use ScriptValue::{Int, Nil, Table};

fn robot<P: Profile>(script: &str) -> (TestRobot<P>, Symbols) {
    let program = Program::new::<P>(script);
    let symbols = program.symbols.clone();
    (TestRobot::new(program.leak(), 1, SIZES), symbols)
}

/// Returns the machine after the global code of a script.
fn after_global<P: Profile>(script: &str, limits: Limits) -> Inspection {
    let (mut robot, symbols) = robot::<P>(script);
    robot.enter(Entry::Global).expect("no fault");
    inspect(&robot.vm, Some(&symbols), limits)
}

fn named<'a>(all: &'a [Named], name: &str) -> &'a ScriptValue {
    let found = all.iter().find(|named| named.name == name);
    &found.unwrap_or_else(|| panic!("{name} is not in {all:?}")).value
}

fn text(text: &str) -> ScriptValue {
    ScriptValue::String(text.to_owned())
}

/// Returns the entries of a table.
fn entries<'a>(
    inspection: &'a Inspection,
    value: &ScriptValue,
) -> &'a [(ScriptValue, ScriptValue)] {
    let Table(id) = value else { panic!("{value:?} is no table") };
    match inspection.objects.get(id) {
        Some(Object::Table { entries, left_out: 0 }) => entries,
        other => panic!("{other:?}"),
    }
}

fn tables<P: Profile>() {
    let script = "t = { .name = \"x\", .1 = 11, .inner = { .deep = 5 } }
        t[0] = 10
        t[7] = t.inner
        t.own = t
        empty = {}";
    let found = after_global::<P>(script, Limits::NONE);
    let t = named(&found.globals, "t").clone();
    let all = entries(&found, &t);
    let inner = all[3].1.clone();
    // Keys 0, 1, ... come first, then the others in the order of insertion. A table within itself
    // is named, not expanded again.
    let expected = [
        (Int(0), Int(10)),
        (Int(1), Int(11)),
        (text("name"), text("x")),
        (text("inner"), inner.clone()),
        (Int(7), inner.clone()),
        (text("own"), t.clone()),
    ];
    assert_eq!(all, expected);
    assert_eq!(entries(&found, &inner), [(text("deep"), Int(5))]);
    assert_eq!(entries(&found, named(&found.globals, "empty")), []);
    assert_eq!(found.objects.len(), 3);
    assert_eq!(found.activity, Activity::Idle);
}

in_both_profiles!(tables_are_expanded_once, tables);

#[test]
fn entries_are_in_the_order_of_foreach() {
    let script = "t = {}
        for(i = 0, i < 20, i = i + 1) t[(i * 7) % 20] = i
        for(i = 0, i < 20, i = i + 1) t[i + 100] = i
        t[3] = nil  t[105] = nil  t[12] = nil
        t.last = 1  t[3] = 2
        foreach(t, function(key, value) { log(key) })";
    let (mut robot, symbols) = robot::<Full>(script);
    robot.enter(Entry::Global).expect("no fault");
    let logged: Vec<ScriptValue> = robot
        .host
        .events
        .iter()
        .map(|event| match event {
            Event::Log(arguments) => match &arguments[0] {
                RecordedArgument::Int(key) => Int(*key),
                RecordedArgument::String(number) => {
                    text(symbols.string(*number).expect("is known"))
                }
                other => panic!("{other}"),
            },
            other => panic!("{other:?}"),
        })
        .collect();
    let found = inspect(&robot.vm, Some(&symbols), Limits::NONE);
    let t = entries(&found, named(&found.globals, "t"));
    assert_eq!(t.iter().map(|(key, _)| key.clone()).collect::<Vec<_>>(), logged);
    assert_eq!(t.len(), 39);
}

#[test]
fn limits_of_depth_and_number_leave_objects_out() {
    let script = "t = { .a = { .b = { .c = 1 } } }  many = {}
        for(i = 0, i < 30, i = i + 1) many[i] = i";
    let depths: Vec<usize> = (0..5)
        .map(|depth| after_global::<Tiny>(script, Limits { depth, values: 1000 }).objects.len())
        .collect();
    // `t` and `many`, then the table in `t`, then the one in that.
    assert_eq!(depths, [0, 2, 3, 4, 4]);
    let found = after_global::<Tiny>(script, Limits { depth: 1, values: 12 });
    let sizes: BTreeSet<(usize, usize)> = found
        .objects
        .values()
        .map(|object| match object {
            Object::Table { entries, left_out } => (entries.len(), *left_out),
            other => panic!("{other:?}"),
        })
        .collect();
    // Twelve entries in total, from both tables.
    assert_eq!(sizes.iter().map(|(shown, _)| shown).sum::<usize>(), 12);
    assert_eq!(sizes.iter().map(|(_, left_out)| left_out).sum::<usize>(), 19);
}

fn closures<P: Profile>() {
    let script =
        "function make(n, m) { var sum = n + m  return function(x) { return x + n + sum } }
        f = make(3, 4)
        t = { .g = function() { return self } }
        bound = t.g
        plain = make
        built_in = math.abs";
    let found = after_global::<P>(script, Limits::NONE);
    let object = |name| match named(&found.globals, name) {
        ScriptValue::Closure(id) => &found.objects[id],
        other => panic!("{other:?}"),
    };
    let captured = |name: &str, value| Named { name: name.to_owned(), value: Int(value) };
    let captures = vec![captured("n", 3), captured("sum", 7)];
    let function = "lambda at test.bzz:1".to_owned();
    assert_eq!(*object("f"), Object::Closure { function, self_value: Nil, captures });
    let lambda = ScriptValue::Function("lambda at test.bzz:3".to_owned());
    let t = named(&found.globals, "t").clone();
    assert_eq!(*object("bound"), Object::Bound { function: lambda.clone(), self_value: t.clone() });
    assert_eq!(entries(&found, &t), [(text("g"), lambda)]);
    assert_eq!(*named(&found.globals, "plain"), ScriptValue::Function("make".to_owned()));
    assert_eq!(*named(&found.globals, "built_in"), ScriptValue::Builtin("math.abs".to_owned()));
}

in_both_profiles!(closures_name_what_they_captured, closures);

#[test]
fn strings_made_at_run_time_are_read() {
    let script = "s = string.concat(\"a long beginning, \", \"and an end\")  c = \"constant\"";
    let found = after_global::<Full>(script, Limits::NONE);
    assert_eq!(*named(&found.globals, "s"), text("a long beginning, and an end"));
    assert_eq!(*named(&found.globals, "c"), text("constant"));
}

/// Runs the global code one instruction at a time, and inspects the machine before each.
fn step_through<P: Profile>(
    script: &str,
    mut look: impl FnMut(&Inspection, &[Event], &Symbols),
) -> Outcome {
    let (mut robot, symbols) = robot::<P>(script);
    assert!(robot.vm.begin(Entry::Global));
    for _ in 0..100_000 {
        let found = inspect(&robot.vm, Some(&symbols), Limits::NONE);
        let before = robot.host.events.len();
        let outcome = robot.vm.run(&mut robot.host, 1);
        look(&found, &robot.host.events[before..], &symbols);
        if !matches!(outcome, Outcome::Pending | Outcome::Waiting) {
            return outcome;
        }
    }
    panic!("no end");
}

/// Checks the logged lines of a script. Each is a name and its value, as seen in the frame that
/// logs.
fn names<P: Profile>() {
    let script = "function f(a, b) {
            var x = a + 1
            log(\"x\", x)  log(\"a\", a)  log(\"b\", b)
            if(b) {
                var y = x * 2
                log(\"y\", y)
                y = y + 1
                log(\"y\", y)
            }
            if(a) { var y = 99  log(\"y\", y) }
            var empty
            log(\"empty\", empty)
            for(i = 0, i < 3, i = i + 1) {
                var square = i * i
                log(\"square\", square)
                x = x + square
            }
            log(\"x\", x)
            return function(c) {
                x = x + c
                log(\"x\", x)  log(\"c\", c)  log(\"b\", b)
                return x
            }
        }
        g = f(1, 2)
        log(\"i\", i)
        g(5)
        g(6)
        if(g) { var inside = 8  log(\"inside\", inside) }
        t = { .0 = 4, .1 = 5 }
        foreach(t, function(key, value) {
            var both = key + value
            log(\"both\", both)  log(\"key\", key)  log(\"value\", value)
        })
        function deep(n) { var m = n * 10  if(n > 0) { log(\"m\", m)  deep(n - 1) }  log(\"m\", m) }
        deep(3)";
    let mut count = 0;
    let outcome = step_through::<P>(script, |found, events, symbols| {
        for event in events {
            let Event::Log(arguments) = event else { continue };
            let [RecordedArgument::String(name), value] = &arguments[..] else {
                panic!("{event:?}")
            };
            let name = symbols.string(*name).expect("is known");
            let value = value.as_int().map_or(Nil, Int);
            let locals = &found.frames[0].locals;
            let known = locals.iter().chain(&found.globals).find(|known| known.name == name);
            let known = &known.unwrap_or_else(|| panic!("{name} has no place")).value;
            assert_eq!(*known, value, "{name}");
            count += 1;
        }
    });
    assert_eq!((outcome, count), (Outcome::Done, 32));
}

in_both_profiles!(names_have_the_values_that_the_script_logs, names);

fn name(frame: &ScriptFrame) -> String {
    match &frame.function {
        FrameFunction::Script { name, .. } => name.clone(),
        FrameFunction::Builtin(name) => name.clone(),
        other => format!("{other:?}"),
    }
}

#[test]
fn frames_are_the_calls_with_their_lines() {
    let script = "t = { .0 = 7 }
function inner(v) {
  log(v)
}
foreach(t, function(key, value) {
  inner(value)
})";
    let mut seen = false;
    step_through::<Tiny>(script, |found, events, _| {
        if events.is_empty() {
            return;
        }
        seen = true;
        let names: Vec<String> = found.frames.iter().map(name).collect();
        assert_eq!(names, ["inner", "lambda at test.bzz:5", "foreach", "global code"]);
        let lines: Vec<Option<u32>> = found
            .frames
            .iter()
            .map(|frame| match &frame.function {
                FrameFunction::Script { source, .. } => {
                    source.as_ref().map(|source| source.place.line)
                }
                _ => None,
            })
            .collect();
        assert_eq!(lines, [Some(3), Some(6), None, Some(5)]);
        let locals: Vec<Vec<(&str, &ScriptValue)>> = found
            .frames
            .iter()
            .map(|frame| frame.locals.iter().map(|l| (l.name.as_str(), &l.value)).collect())
            .collect();
        let lambda = vec![("key", &Int(0)), ("value", &Int(7))];
        assert_eq!(locals, [vec![("v", &Int(7))], lambda, vec![], vec![]]);
        assert_eq!(found.activity, Activity::Running);
    });
    assert!(seen);
}

#[test]
fn a_fault_keeps_the_frames() {
    let script = "function f(a) { var b = a + 1  return b + nil }  f(41)";
    let (mut robot, symbols) = robot::<Full>(script);
    let fault = robot.enter(Entry::Global).expect_err("faults");
    let found = inspect(&robot.vm, Some(&symbols), Limits::NONE);
    assert_eq!(found.activity, Activity::Faulted(fault));
    let names: Vec<String> = found.frames.iter().map(name).collect();
    assert_eq!(names, ["f", "global code"]);
    assert_eq!(*named(&found.frames[0].locals, "b"), Int(42));
    let FrameFunction::Script { position, .. } = found.frames[0].function else { panic!() };
    assert_eq!(position, fault.position);
    // A restart of the script clears everything.
    robot.rest();
    let found = inspect(&robot.vm, Some(&symbols), Limits::NONE);
    assert!(found.frames.is_empty());
    assert_eq!(found.activity, Activity::Resting);
}

#[test]
fn a_waiting_machine_names_the_awaited_function() {
    for (call, expected) in [
        ("delay(100)", FrameFunction::Builtin("delay".to_owned())),
        ("led(3)", FrameFunction::RobotFunction("led".to_owned())),
    ] {
        let (mut robot, symbols) = robot::<Tiny>(&format!("function f(a) {{ {call} }}  f(5)"));
        robot.host.answer = Box::new(|_| Answer::Wait);
        robot.host.delay_polls = Box::new(|_| 3);
        assert!(robot.vm.begin(Entry::Global));
        assert_eq!(robot.vm.run(&mut robot.host, 100), Outcome::Waiting);
        let found = inspect(&robot.vm, Some(&symbols), Limits::NONE);
        assert_eq!(found.activity, Activity::Waiting);
        assert_eq!(found.frames[0].function, expected);
        assert_eq!(*named(&found.frames[1].locals, "a"), Int(5));
    }
}

#[test]
fn without_symbols_numbers_replace_names() {
    let script = "t = { .k = 1 }
        function f(a, b) { var x = a  return function() { log(x, b, t.k) } }
        f(3, 4)()";
    let (mut robot, symbols) = robot::<Tiny>(script);
    assert!(robot.vm.begin(Entry::Global));
    let mut other = symbols.clone();
    other.script_hash ^= 1;
    let mut locals = BTreeSet::new();
    while robot.vm.run(&mut robot.host, 1) == Outcome::Pending {
        let found = inspect(&robot.vm, None, Limits::NONE);
        assert_eq!(
            found,
            inspect(&robot.vm, Some(&other), Limits::NONE),
            "symbols of another script"
        );
        locals.extend(found.frames.iter().flat_map(|frame| &frame.locals).map(|l| l.name.clone()));
        for object in found.objects.values() {
            match object {
                Object::Table { entries, .. } => {
                    // A tiny image does not contain the text of a string.
                    let keys = entries.iter().map(|(key, _)| key);
                    assert!(keys.clone().all(|key| *key == ScriptValue::UnknownString(12)));
                }
                Object::Closure { function, captures, .. } => {
                    assert_eq!(function, "function 2");
                    let captures: Vec<&str> = captures.iter().map(|c| c.name.as_str()).collect();
                    assert_eq!(captures, ["captured 0", "captured 1"]);
                }
                other => panic!("{other:?}"),
            }
        }
        assert_eq!(found.globals[0].name, "global 0");
    }
    assert!(
        locals.is_superset(&["parameter 0", "parameter 1", "slot 1"].map(str::to_owned).into())
    );
}

#[test]
fn an_empty_machine_has_nothing() {
    let vm: bittybuzz_vm_core::Vm<Tiny, &[u8], 100> = bittybuzz_vm_core::Vm::new();
    let found = inspect(&vm, None, Limits::NONE);
    assert_eq!(found.activity, Activity::Empty);
    assert!(found.globals.is_empty() && found.frames.is_empty() && found.objects.is_empty());
    assert!(found.neighbors.is_empty() && found.stigmergies.is_empty());
}

#[test]
fn a_cell_that_is_used_again_is_another_object() {
    let script = "function step() { t = { .n = 1 } }";
    let (mut robot, symbols) = robot::<Tiny>(script);
    let mut ids: BTreeSet<ObjectId> = BTreeSet::new();
    for _ in 0..200 {
        robot.step().expect("no fault");
        let found = inspect(&robot.vm, Some(&symbols), Limits::NONE);
        assert_eq!(entries(&found, named(&found.globals, "t")), [(text("n"), Int(1))]);
        ids.extend(found.objects.keys());
    }
    assert!(ids.len() > 1 && ids.len() < 200, "{}", ids.len());
}

#[test]
fn full_memory_is_held_by_globals() {
    let script = "much = {}  little = { .x = 1 }  none = 5
        i = 0
        while(1) { much[i] = { .n = i }  i = i + 1 }";
    let (mut robot, _) = robot::<Tiny>(script);
    let fault = robot.enter(Entry::Global).expect_err("the memory ends");
    assert_eq!(fault.code, FaultCode::OutOfMemory);
    let memory = ScriptMemory::after(&fault, &*robot.vm, 500).expect("it was full");
    let held: Vec<usize> = memory.held.iter().map(|(_, slots)| *slots).collect();
    // A cell has seven slots. `little` is one.
    assert_eq!((held.len(), held[1]), (2, 7));
    assert!(held[0] > 300 && memory.heap >= held[0] + held[1], "{memory:?}");
    let (mut robot, _) = self::robot::<Tiny>("x = 1 + nil");
    let other = robot.enter(Entry::Global).expect_err("faults");
    assert_eq!(ScriptMemory::after(&other, &*robot.vm, 500), None);
}

fn counts_after_overflow<P: Profile>() {
    for locals in 0..12 {
        let declared: String = (0..locals).map(|number| format!("var v{number} = n ")).collect();
        for kept in ["n", "{ .n = n }", "{ .1 = { .2 = n } }"] {
            let script = format!(
                "kept = nil function f(n) {{ {declared} kept = {{ .next = kept, .now = {kept} }} \
                 var t = {{ .n = n }} f(n + 1) return t }} f(0)"
            );
            let (mut robot, _) = robot::<P>(&script);
            let fault = robot.enter(Entry::Global).expect_err("the recursion has no end");
            let memory = ScriptMemory::after(&fault, &*robot.vm, 600).expect("it was full");
            assert!(memory.stack > 0 && memory.heap > 0, "{script}\n{memory:?}");
            assert!(memory.stack + memory.heap <= memory.slots, "{script}\n{memory:?}");
        }
    }
}

in_both_profiles!(memory_is_counted_after_any_overflow, counts_after_overflow);
