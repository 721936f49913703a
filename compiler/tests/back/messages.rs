//! The costs of messages that the compiler states: frames, rates, and the warning about long messages in steps.

use bittybuzz_compiler::compile::Compiled;
use bittybuzz_compiler::diagnostic::Diagnostic;
use bittybuzz_compiler::messages::{Frames, Rate, SentMessage};
use bittybuzz_robot_spec::NumberProfile;
use bittybuzz_testkit::{Program, Recorder};
use bittybuzz_vm_core::message::Fragment;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Entry, Image, Outcome, Sizes, Vm};
use proptest::prelude::*;

use crate::back::machine::{FULL, TINY, at_least, build, build_for, build_with};

fn messages(script: &str, profile: NumberProfile) -> Vec<SentMessage> {
    let Compiled { image, diagnostics, messages, .. } = build(script, profile);
    assert!(image.is_some(), "{script}: {diagnostics:?}");
    messages
}

/// The frames of the only message, as words, in `tiny` and in `full`.
fn frames(script: &str) -> [String; 2] {
    [TINY, FULL].map(|profile| {
        let messages = messages(script, profile);
        let [message] = messages.as_slice() else { panic!("{script}: {messages:?}") };
        message.frames.map_or("too long".to_owned(), Frames::text)
    })
}

/// Contents have 48 and 360 bytes, fragments 6 and 45. The content of a broadcast begins with a check of 2 bytes, the
/// kind and the topic, which is a word with its type: 3 and 5 bytes.
#[test]
fn values_of_broadcasts() {
    for (value, tiny, full) in [
        ("1", "1 frame", "1 frame"),
        ("nil", "1 frame", "1 frame"),
        ("1.5", "1 frame", "1 frame"),
        ("\"text\"", "1 frame", "1 frame"),
        ("id + 1", "1 frame", "1 frame"),
        ("neighbors.count()", "1 frame", "1 frame"),
        // 2 + 1 + 3 and the byte of the type with two of the number: 9. In `full` 11.
        ("f", "2 frames", "1 frame"),
        ("function(a) { return a }", "2 frames", "1 frame"),
        // 6 + 2 = 8 and 8 + 2 = 10.
        ("{}", "2 frames", "1 frame"),
        // An entry is two words: 6 and 10 bytes. 8 + 12 = 20 and 10 + 20 = 30.
        ("{ .x = 1, .y = 2.5 }", "4 frames", "1 frame"),
        // 8 + 24 = 32 and 10 + 40 = 50.
        ("{ .a = 1, .b = 1, .c = 1, .d = 1 }", "6 frames", "2 frames"),
        // An element that is nil does not exist, and of equal keys the last one counts.
        ("{ .x = 1, .y = nil }", "3 frames", "1 frame"),
        ("{ .1 = 2, .1.0 = 3 }", "3 frames", "1 frame"),
        // A table in a table: key 3 and its head 2. 8 + 3 + 2 + 6 = 19.
        ("{ .x = { .y = 1 } }", "4 frames", "1 frame"),
        // 8 + 7 * 6 = 50: no place for it in eight fragments of 6 bytes. 10 + 70 = 80.
        ("{ .a = 1, .b = 1, .c = 1, .d = 1, .e = 1, .f = 1, .g = 1 }", "too long", "2 frames"),
        // Any table.
        ("t", "2 to 8 frames", "1 to 8 frames"),
        ("{ .x = t }", "3 to 8 frames", "1 to 8 frames"),
        // `m` is nil or a number.
        ("m", "1 frame", "1 frame"),
        ("{ .m = m }", "2 to 3 frames", "1 frame"),
    ] {
        let script = format!(
            "function f() {{ return 1 }} t = {{}} t.n = t m = nil if(id) m = 1 \
             neighbors.broadcast(\"k\", {value})"
        );
        assert_eq!(frames(&script), [tiny, full], "{value}");
    }
}

/// 8 bytes of a `tiny` content before the elements, and 6 for each element.
#[test]
fn tables_in_variables() {
    for (body, tiny) in [
        ("var t = { .x = 1, .y = 2 } neighbors.broadcast(\"k\", t)", "4 frames"),
        ("var t = {} t.x = 1 t[\"y\"] = 2 t[3] = 4 neighbors.broadcast(\"k\", t)", "5 frames"),
        ("var t = {} t.x = 1 t.x = 2 neighbors.broadcast(\"k\", t)", "3 frames"),
        // An assignment that may not run, or that runs later in a loop.
        ("var t = { .x = 1 } if(id) t.y = 1 neighbors.broadcast(\"k\", t)", "3 to 4 frames"),
        ("var t = { .x = 1 } if(id) t.x = nil neighbors.broadcast(\"k\", t)", "2 to 3 frames"),
        ("var t = {} while(id) { neighbors.broadcast(\"k\", t) t.x = 1 }", "2 to 3 frames"),
        // Something else has the table, too.
        ("var t = { .x = 1 } g = t neighbors.broadcast(\"k\", t)", "2 to 8 frames"),
        ("var t = { .x = 1 } h(t) neighbors.broadcast(\"k\", t)", "2 to 8 frames"),
        (
            "var t = { .x = 1 } g = function() { return t } neighbors.broadcast(\"k\", t)",
            "2 to 8 frames",
        ),
        ("var t = { .x = 1 } t = {} neighbors.broadcast(\"k\", t)", "2 to 8 frames"),
        ("var t = {} t[id] = 1 neighbors.broadcast(\"k\", t)", "2 to 8 frames"),
        ("var t = 3 neighbors.broadcast(\"k\", t)", "1 frame"),
    ] {
        let script = format!("g = nil function h(t) {{ t.n = 1 }} function f() {{ {body} }} f()");
        assert_eq!(frames(&script)[0], tiny, "{body}");
    }
}

/// The content of an entry begins with 12 bytes. With two numbers 18 and 22 bytes follow.
#[test]
fn entries() {
    for (put, tiny, full) in [
        ("s.put(\"k\", 1)", "1 frame", "1 frame"),
        ("s.put(7, \"text\")", "1 frame", "1 frame"),
        ("s.put(id, 1)", "1 frame", "1 frame"),
        ("stigmergy.create(20).put(\"k\", 1)", "1 frame", "1 frame"),
        ("s.put(1.5, 1)", "3 frames", "1 frame"),
        // A float that is an integer is that integer.
        ("s.put(2.0, 1)", "1 to 3 frames", "1 frame"),
        ("fourth.put(\"k\", 1)", "3 frames", "1 frame"),
        ("fourth.put(\"k\", nil)", "3 frames", "1 frame"),
        // 12 + 3 + 2 + 6 = 23; 12 + 5 + 2 + 10 = 29.
        ("s.put(\"k\", { .a = 1 })", "4 frames", "1 frame"),
    ] {
        let script = format!(
            "s = stigmergy.create(101) stigmergy.create(20) stigmergy.create(0) \
             fourth = stigmergy.create(1) {put}"
        );
        assert_eq!(frames(&script), [tiny, full], "{put}");
    }
}

#[test]
fn names_are_those_of_the_source() {
    let script = "s = stigmergy.create(1) topic = \"a\" neighbors.broadcast(\"b\", 1) \
                  neighbors.broadcast(topic, 1) s.put(\"key\", 1) s.put(-3, 1)";
    let found = messages(script, TINY);
    let named: Vec<_> = found.iter().map(|it| (it.is_entry, it.name.as_deref())).collect();
    let expected =
        [(false, Some("\"b\"")), (false, None), (true, Some("\"key\"")), (true, Some("-3"))];
    assert_eq!(named, expected);
}

#[test]
fn rates() {
    let certain = |period| Some(Rate { period, is_certain: true });
    let at_most = |period| Some(Rate { period, is_certain: false });
    for (script, rate) in [
        ("function step() { SEND }", certain(1)),
        ("function step() { report() } function report() { SEND }", certain(1)),
        ("function step() { if(n % 20 == 3) SEND  n = n + 1 }", certain(20)),
        ("N = 20 function step() { n = n + 1  if(n % N == 0) { SEND } }", certain(20)),
        ("function step() { n = n + 1  if(id == 1 and n % 20 == 0) SEND }", at_most(20)),
        ("function step() { n = n + 1  if(n % 3 == 0) { if(n % 4 == 0) SEND } }", certain(4)),
        ("function step() { if(id == 1) SEND }", at_most(1)),
        ("function step() { if(id == 1) return; SEND }", at_most(1)),
        // `id` does not count steps, and 7 is no remainder of a division by 5.
        ("function step() { if(id % 20 == 0) SEND }", at_most(1)),
        ("function step() { n = n + 1  if(n % 5 == 7) SEND }", at_most(1)),
        ("function init() { SEND }", None),
        ("function step() { while(n < 3) { n = n + 1 SEND } }", None),
        ("function step() { neighbors.foreach(function(_id, _d) { SEND }) }", None),
        ("function step() { neighbors.foreach(report) } function report(_id, _d) { SEND }", None),
        (
            "f = nil function init() { f = report } function step() { f() } function report() { SEND }",
            None,
        ),
        // The most frequent call counts.
        (
            "function step() { n = n + 1 if(n % 9 == 0) report() if(n % 5 == 0) report() } function report() { SEND }",
            certain(5),
        ),
        (
            "function step() { report() } function report() { SEND } function other() { foreach({}, report) }",
            certain(1),
        ),
    ] {
        let script = format!("n = 0 {}", script.replace("SEND", "neighbors.broadcast(\"k\", 1)"));
        let found: Vec<_> = messages(&script, TINY).iter().map(|message| message.rate).collect();
        assert_eq!(found, [rate], "{script}");
    }
}

/// Each function calls the next one, always or now and then: the analysis neither recurses nor follows a function twice.
#[test]
fn long_chains_of_calls() {
    let chain: String = (0..1000)
        .map(|number| {
            format!(
                "function f{number}() {{ f{}() if(n % {} == 0) f{}() }}\n",
                number + 1,
                number + 2,
                number + 2
            )
        })
        .collect();
    let script = format!(
        "n = 0\n{chain}function f1001() {{ log(1) }}\nfunction f1000() {{ neighbors.broadcast(\"k\", 1) }}\n\
         function step() {{ n = n + 1 f0() }}"
    );
    let found = messages(&script, FULL);
    assert_eq!(found[0].rate, Some(Rate { period: 1, is_certain: true }));
}

fn warnings(compiled: &Compiled) -> Vec<&Diagnostic> {
    compiled.diagnostics.iter().filter(|found| found.code.text() == "W0227").collect()
}

/// A Kilobot sends two frames per second: four frames take 2 s, for which it needs 20 steps.
#[test]
fn the_warning_states_frames_air_and_a_cure() {
    let script =
        "n = 0 function step() { n = n + 1 EVERY neighbors.broadcast(\"p\", {.x = 1, .y = 2}) }";
    let text = |every: &str, robot| {
        let compiled = build_for(&script.replace("EVERY", every), TINY, Some(robot));
        let found = warnings(&compiled);
        found
            .first()
            .map(|it| (it.message.clone(), it.label.clone(), it.help.clone().unwrap_or_default()))
    };
    let (message, label, help) = text("", "kilobot").expect("a warning");
    assert_eq!(message, "every step sends a message of 4 frames: 2 s of the Kilobot's air");
    assert_eq!(label, "4 frames");
    assert!(help.contains("`if(ticks % 20 == 0)`") && help.contains("topic"), "{help}");
    // A frame of a Zooid and the pause before it take 10.2 ms.
    let (message, ..) = text("", "zooids").expect("a warning");
    assert_eq!(message, "every step sends a message of 4 frames: 40.8 ms of the Zooid's air");
    let (message, ..) = text("if(n % 19 == 0)", "kilobot").expect("a warning");
    assert_eq!(message, "a message every 19 steps: 4 frames take 2 s of the Kilobot's air");
    assert_eq!(text("if(n % 20 == 0)", "kilobot"), None);
    assert_eq!(text("if(n % 2 == 0)", "zooids"), None);
    assert_eq!(text("if(id == 0)", "kilobot"), None);
}

#[test]
fn without_a_robot_the_slowest_one_that_can_run_the_script_is_named() {
    let titles = |script: &str, profile| {
        let mut options = Program::options(FULL);
        options.profile = profile;
        let compiled = build_with(script, &options);
        let named = ["Kilobot", "Zooid", "Crazyflie"];
        let in_text = |text: &str| named.iter().find(|title| text.contains(**title)).copied();
        warnings(&compiled).iter().filter_map(|it| in_text(&it.message)).collect::<Vec<_>>()
    };
    let small = "function step() { CALL neighbors.broadcast(\"p\", {.x = 1, .y = 2}) }";
    let of = |call| small.replace("CALL", call);
    assert_eq!(titles(&of(""), None), ["Kilobot"]);
    assert_eq!(titles(&of("goto(1, 2)"), None), ["Zooid"]);
    // One frame of a Crazyflie holds 45 bytes of a content; with small numbers it needs four.
    assert_eq!(titles(&of("takeoff(1)"), None), [""; 0]);
    assert_eq!(titles(&of("takeoff(1)"), Some(TINY)), ["Crazyflie"]);
    // A Kilobot cannot run a script with large numbers.
    let large = "function step() { neighbors.broadcast(\"p\", {.a = 1, .b = 2, .c = 3, .d = 4}) }";
    assert_eq!(titles(large, Some(FULL)), ["Crazyflie"]);
}

#[test]
fn puts_are_warned_about_too_and_numbers_are_not() {
    let found = |script: &str| warnings(&build_for(script, TINY, Some("kilobot"))).len();
    let put = |value: &str| {
        format!(
            "function init() {{ s = stigmergy.create(77) }} function step() {{ s.put(id, {value}) }}"
        )
    };
    assert_eq!(found(&put("{ .x = 1 }")), 1);
    assert_eq!(found(&put("3")), 0);
    // The analysis does not know how long the table is, but it takes more than one frame.
    let put = "t = {} function init() { s = stigmergy.create(1) t.n = id } function step() { s.put(1, t) }";
    assert_eq!(found(put), 1);
    assert_eq!(found("function step() { neighbors.broadcast(\"k\", id) }"), 0);
}

/// A constant value, with tables up to two levels deep.
fn value() -> impl Strategy<Value = String> {
    let leaf = prop_oneof![
        4 => (-200..200_i32).prop_map(|number| format!("{number}")),
        1 => (-200..200_i32).prop_map(|number| format!("{:.1}", f64::from(number) / 4.0)),
        1 => prop::sample::select(vec!["nil", "\"a\"", "\"b\"", "f", "id", "unset"]).prop_map(str::to_owned),
    ];
    leaf.prop_recursive(2, 12, 5, |inner| {
        let key = prop_oneof![
            prop::sample::select(vec!["a", "b", "c", "d", "e"]).prop_map(str::to_owned),
            (0..9_i32).prop_map(|key| key.to_string()),
            (0..9_i32).prop_map(|key| format!("{:.1}", f64::from(key) / 2.0)),
        ];
        prop::collection::vec((key, inner), 0..8).prop_map(|entries| {
            let entries: Vec<_> =
                entries.iter().map(|(key, value)| format!(".{key} = {value}")).collect();
            format!("{{ {} }}", entries.join(", "))
        })
    })
}

/// The numbers of frames of the messages that a machine sends in the global code and its first step.
fn sent<P: Profile>(image: &[u8]) -> Vec<usize> {
    let mut vm: Box<Vm<P, &[u8], 4000>> = Box::new(Vm::new());
    vm.set_robot_id(1, 0);
    vm.set_network_capacity(Sizes { neighbors: 2, bearings: true, entries: 4, swarms: 1 });
    vm.load(Image::new(image), |_| true).expect("the compiler's image");
    let mut host = Recorder::default();
    for entry in [Entry::Global, Entry::Step] {
        if vm.begin(entry) {
            match vm.run(&mut host, u16::MAX) {
                // A value that is too long or cannot be sent.
                Outcome::Fault(_) => break,
                outcome => assert_eq!(outcome, Outcome::Done),
            }
        }
    }
    let mut counts = Vec::new();
    let mut parts = 0;
    while let Some(frame) = host.link.pop_sent() {
        // Beacons and the like are no values.
        if matches!(frame[0], 0x08..=0x0a) {
            continue;
        }
        parts += 1;
        if Fragment::parse(&frame).is_none_or(|fragment| fragment.last) {
            counts.push(std::mem::take(&mut parts));
        }
    }
    counts
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(at_least(200)))]

    /// The stated number of frames is that of the machine, exactly so for constants.
    #[test]
    fn a_machine_sends_as_many_frames_as_stated(
        value in value(),
        key in prop::sample::select(vec!["\"k\"", "3", "2.5", "2.0"]),
        number in 0..4_usize,
        send in 0..4_usize,
    ) {
        let statement = match send {
            0 => format!("neighbors.broadcast(\"k\", {value})"),
            1 => format!("s{number}.put({key}, {value})"),
            2 => format!("var v = {value} neighbors.broadcast(\"k\", v)"),
            _ => format!("var v = {{}} v.x = {value} v[2] = 7 s{number}.put({key}, v)"),
        };
        let script = format!(
            "function f() {{ return 1 }} unset = nil if(id > 1) unset = 1 \
             s0 = stigmergy.create(30) s1 = stigmergy.create(1) s2 = stigmergy.create(20) \
             s3 = stigmergy.create(0) function send() {{ {statement} }} send() function step() {{}}"
        );
        for profile in [TINY, FULL] {
            let compiled = build(&script, profile);
            let image = compiled.image.expect("a script without errors");
            let [message] = compiled.messages.as_slice() else { panic!("{script}") };
            let found = match profile {
                TINY => sent::<Tiny>(&image),
                FULL => sent::<Full>(&image),
            };
            match (message.frames, found.as_slice()) {
                (None, []) => {}
                // Nothing is sent for the deletion of a key that no robot has.
                (Some(_), []) if send == 1 && matches!(value.as_str(), "nil" | "unset") => {}
                // The entry of a put is sent again in later steps.
                (Some(Frames { least, most }), [count, again @ ..]) => {
                    prop_assert!(again.iter().all(|next| next == count), "{found:?}");
                    let count = *count as u32;
                    prop_assert!((least..=most).contains(&count), "{script}: {count} in {least}..={most}");
                    // `unset` may be nil, and 2.0 is the key 2.
                    let is_exact = value.contains("unset") || key == "2.0" || least == most;
                    prop_assert!(is_exact, "{script}: {least}..={most}");
                }
                // A table that is close to the limit may be too long.
                (Some(Frames { most: 8, .. }), []) => {}
                (frames, found) => prop_assert!(false, "{script}: {frames:?}, but {found:?}"),
            }
        }
    }
}
