//! A value of a class that the script never sends under that name is dropped on arrival.

use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_testkit::{FORGER, SIZES, TestRobot, in_both_profiles};
use bittybuzz_tests::compiler;
use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::builtin::string;
use bittybuzz_vm_core::message::content::{ContentItem, ContentWriter, Head};
use bittybuzz_vm_core::message::{
    FRAGMENT_HEAD, FULL_FRAME, Fragment, Message, StigmergyEntry, TINY_FRAME,
};
use bittybuzz_vm_core::number::Profile;

/// A value of each class, and whether a number is expected.
fn values<P: Profile>() -> Vec<(&'static str, Vec<ContentItem<P>>, bool)> {
    let pair = [ContentItem::Plain(Value::int(1)), ContentItem::Plain(Value::int(2))];
    vec![
        ("nil", vec![ContentItem::Plain(Value::nil())], false),
        ("string", vec![ContentItem::Plain(Value::string(string::COUNT))], false),
        ("empty table", vec![ContentItem::Table(0)], false),
        ("table", [&[ContentItem::Table(1)], &pair[..]].concat(), false),
        ("function", vec![ContentItem::Function(0)], false),
        ("int", vec![ContentItem::Plain(Value::int(7))], true),
        ("float", vec![ContentItem::Plain(Value::float(7.5))], true),
    ]
}

/// Where a message goes.
#[derive(Clone, Copy)]
enum To<P: Profile> {
    Topic(u16),
    Key(Value<P>),
}

/// A frame that carries the value, if it fits one, or else all of its fragments.
fn receive<P: Profile>(robot: &mut TestRobot<P>, to: To<P>, clock: u32, items: &[ContentItem<P>]) {
    if let [ContentItem::Plain(value)] = *items {
        let message = match to {
            To::Topic(topic) => Message::Broadcast { robot: FORGER, topic, value },
            To::Key(key) => {
                Message::Entry(StigmergyEntry { stigmergy: 1, owner: FORGER, clock, key, value })
            }
        };
        return robot.receive(&message);
    }
    let (head, first) = match to {
        To::Topic(topic) => (Head::Broadcast, Value::string(topic)),
        To::Key(key) => (Head::Entry { stigmergy: 1, owner: FORGER, clock, digest: 0 }, key),
    };
    let mut room = [0; 64];
    let mut writer = ContentWriter::new(&mut room, robot.script(), head);
    writer.item(ContentItem::Plain(first));
    items.iter().for_each(|item| writer.item(*item));
    let length = writer.finish().expect("there is room");
    let frame = if P::FULL { FULL_FRAME } else { TINY_FRAME };
    let parts: Vec<&[u8]> = room[..length].chunks(frame - FRAGMENT_HEAD).collect();
    for (index, content) in parts.iter().enumerate() {
        let (last, index) = (index + 1 == parts.len(), index as u8);
        let fragment = Fragment { robot: FORGER, number: room[0], index, last, content };
        robot.receive(&Message::Fragment(fragment));
    }
}

/// The number of a string of a compiled script.
fn number(strings: &[String], text: &str) -> u16 {
    let own = strings.iter().position(|known| known == text);
    string::COUNT + own.expect("a string of the script") as u16
}

fn robot<P: Profile>(script: &str) -> (TestRobot<P>, Vec<String>) {
    let compiled = compiler::compile(script.to_owned(), P::FULL, &MemoryFiles::default());
    let (Some(image), Some(symbols)) = (compiled.image, compiled.symbols) else {
        panic!("{script}: {:?}", compiled.diagnostics);
    };
    (TestRobot::new(Vec::leak(image), 3, SIZES), symbols.strings)
}

/// Topic `x` carries numbers. The table of the last line makes the robot able to receive long messages.
const SUM: &str = "sum = 0
    calls = 0
    function init() { neighbors.listen(\"x\", function(topic, value, robot) {
        calls = calls + 1
        sum = sum + value
    }) }
    function step() { neighbors.broadcast(\"x\", sum)  log(calls) }
    function reset() { neighbors.broadcast(\"long\", {}) }";

in_both_profiles!(a_listener_receives_only_the_classes_of_its_topic, listener);
fn listener<P: Profile>() {
    for (name, items, is_expected) in values::<P>() {
        let (mut robot, strings) = robot::<P>(SUM);
        robot.step().expect("it starts");
        receive(&mut robot, To::Topic(number(&strings, "x")), 0, &items);
        robot.step().expect("no fault");
        let called = if is_expected { "1" } else { "0" };
        assert_eq!(robot.host.logs(), ["0", called], "{name}");
        assert_eq!(robot.counters().malformed, u16::from(!is_expected), "{name}");
        assert!(robot.host.contained.is_empty(), "{name}");
    }
}

in_both_profiles!(a_topic_of_all_classes_receives_all_values, any_topic);
fn any_topic<P: Profile>() {
    let script = "n = 0
        function init() { neighbors.listen(\"x\", function(topic, value, robot) { n = n + 1 }) }
        function step() { log(n) }
        function send(value) { neighbors.broadcast(\"x\", value) }
        function reset() { send(nil) send(1) send(\"a\") send({}) send(step) neighbors.broadcast(\"y\", 1) }";
    for (name, items, _) in values::<P>() {
        let (mut robot, strings) = robot::<P>(script);
        robot.step().expect("it starts");
        receive(&mut robot, To::Topic(number(&strings, "x")), 0, &items);
        robot.step().expect("no fault");
        assert_eq!(robot.host.logs(), ["0", "1"], "{name}");
        assert_eq!(robot.counters().malformed, 0, "{name}");
    }
}

/// Key `k` and key 1 carry numbers, a robot deletes key `gone`.
const SHARED: &str = "function init() {
        s = stigmergy.create(1)
        s.put(\"k\", 5)
        s.put(1, 5)
        s.put(\"gone\", 5)
    }
    function step() { log(s.get(\"k\"))  log(s.get(1))  log(s.get(\"gone\")) }
    function reset() { s.put(\"gone\", nil)  s.put(\"long\", {}) }";

in_both_profiles!(a_stigmergy_stores_only_the_classes_of_its_keys, stigmergy);
fn stigmergy<P: Profile>() {
    for (name, items, is_expected) in values::<P>() {
        for at_string in [true, false] {
            let (mut robot, strings) = robot::<P>(SHARED);
            robot.step().expect("it starts");
            let key = if at_string { Value::string(number(&strings, "k")) } else { Value::int(1) };
            receive(&mut robot, To::Key(key), 1000, &items);
            robot.step().expect("no fault");
            let after = &robot.host.logs()[3..];
            let is_kept = after == ["5", "5", "5"];
            assert_eq!(is_kept, !is_expected, "{name}: {after:?}");
            assert_eq!(robot.counters().malformed, u16::from(!is_expected), "{name}");
        }
    }
}

in_both_profiles!(a_deletion_passes_if_the_script_deletes_the_key, deletion);
fn deletion<P: Profile>() {
    let (mut robot, strings) = robot::<P>(SHARED);
    robot.step().expect("it starts");
    let gone = Value::string(number(&strings, "gone"));
    receive(&mut robot, To::Key(gone), 1000, &[ContentItem::Plain(Value::nil())]);
    robot.step().expect("no fault");
    assert_eq!(robot.host.logs(), ["5", "5", "5", "5", "5", "nil"]);
    assert_eq!(robot.counters().malformed, 0);
}

in_both_profiles!(a_query_passes_for_keys_of_any_class, question);
fn question<P: Profile>() {
    let (mut robot, strings) = robot::<P>(SHARED);
    robot.step().expect("it starts");
    let key = Value::string(number(&strings, "k"));
    receive(&mut robot, To::Key(key), 0, &[ContentItem::Plain(Value::nil())]);
    // A question that brings a value along changes nothing either.
    receive(&mut robot, To::Key(key), 0, &[ContentItem::Plain(Value::string(string::COUNT))]);
    robot.step().expect("no fault");
    assert_eq!(robot.host.logs(), ["5"; 6]);
    assert_eq!(robot.counters().malformed, 0);
}

// The machine asks first whether numbers are expected everywhere.
in_both_profiles!(a_topic_of_strings_receives_no_numbers, only_strings);
fn only_strings<P: Profile>() {
    let script = "n = 0
        function init() { neighbors.listen(\"x\", function(topic, value, robot) { n = n + 1 }) }
        function step() { neighbors.broadcast(\"x\", \"word\")  log(n) }
        function reset() { neighbors.broadcast(\"long\", {}) }";
    for (name, items, _) in values::<P>() {
        let (mut robot, strings) = robot::<P>(script);
        robot.step().expect("it starts");
        receive(&mut robot, To::Topic(number(&strings, "x")), 0, &items);
        robot.step().expect("no fault");
        let is_string = name == "string";
        assert_eq!(robot.host.logs(), ["0", if is_string { "1" } else { "0" }], "{name}");
        assert_eq!(robot.counters().malformed, u16::from(!is_string), "{name}");
    }
}
