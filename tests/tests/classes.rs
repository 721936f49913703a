//! A value of a class that the script never sends under that name is dropped on arrival, and no other value is.

use bittybuzz_compiler::include::MemoryFiles;
use bittybuzz_testkit::{
    Answer, Argument, Event, Recorder, SIZES, Swarm, TestRobot, in_both_profiles,
};
use bittybuzz_tests::generator::{self, Options};
use bittybuzz_tests::{compiler, files, report};
use bittybuzz_vm_core::builtin::string;
use bittybuzz_vm_core::image::{ALL_CLASSES, Image};
use bittybuzz_vm_core::message::content::{Head, Item, Writer};
use bittybuzz_vm_core::message::{Entry, FRAGMENT_HEAD, FULL_FRAME, Fragment, Message, TINY_FRAME};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Entry as EntryPoint, Value, class};

/// The robot that nobody knows.
const FORGER: u16 = 77;

/// A value of each class, and whether a number is expected.
fn values<P: Profile>() -> Vec<(&'static str, Vec<Item<P>>, bool)> {
    let pair = [Item::Plain(Value::int(1)), Item::Plain(Value::int(2))];
    vec![
        ("nil", vec![Item::Plain(Value::nil())], false),
        ("string", vec![Item::Plain(Value::string(string::COUNT))], false),
        ("empty table", vec![Item::Table(0)], false),
        ("table", [&[Item::Table(1)], &pair[..]].concat(), false),
        ("function", vec![Item::Function(0)], false),
        ("int", vec![Item::Plain(Value::int(7))], true),
        ("float", vec![Item::Plain(Value::float(7.5))], true),
    ]
}

/// Where a message goes.
#[derive(Clone, Copy)]
enum To<P: Profile> {
    Topic(u16),
    Key(Value<P>),
}

/// A frame that carries the value, if it fits one, or else all of its fragments.
fn receive<P: Profile>(robot: &mut TestRobot<P>, to: To<P>, clock: u32, items: &[Item<P>]) {
    if let [Item::Plain(value)] = *items {
        let message = match to {
            To::Topic(topic) => Message::Broadcast { robot: FORGER, topic, value },
            To::Key(key) => {
                Message::Entry(Entry { stigmergy: 1, owner: FORGER, clock, key, value })
            }
        };
        return robot.receive(&message);
    }
    let (head, first) = match to {
        To::Topic(topic) => (Head::Broadcast, Value::string(topic)),
        To::Key(key) => (Head::Entry { stigmergy: 1, owner: FORGER, clock, digest: 0 }, key),
    };
    let mut room = [0; 64];
    let mut writer = Writer::new(&mut room, robot.script(), head);
    writer.item(Item::Plain(first));
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

in_both_profiles!(a_listener_gets_what_its_topic_carries, listener);
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

in_both_profiles!(a_topic_that_carries_all_classes_gets_all, any_topic);
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

in_both_profiles!(a_stigmergy_keeps_what_its_keys_carry, stigmergy);
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

in_both_profiles!(a_key_that_is_deleted_somewhere_may_be_nil, deletion);
fn deletion<P: Profile>() {
    let (mut robot, strings) = robot::<P>(SHARED);
    robot.step().expect("it starts");
    let gone = Value::string(number(&strings, "gone"));
    receive(&mut robot, To::Key(gone), 1000, &[Item::Plain(Value::nil())]);
    robot.step().expect("no fault");
    assert_eq!(robot.host.logs(), ["5", "5", "5", "5", "5", "nil"]);
    assert_eq!(robot.counters().malformed, 0);
}

in_both_profiles!(a_question_passes_whatever_the_key_carries, question);
fn question<P: Profile>() {
    let (mut robot, strings) = robot::<P>(SHARED);
    robot.step().expect("it starts");
    let key = Value::string(number(&strings, "k"));
    receive(&mut robot, To::Key(key), 0, &[Item::Plain(Value::nil())]);
    // A question that brings a value along changes nothing either.
    receive(&mut robot, To::Key(key), 0, &[Item::Plain(Value::string(string::COUNT))]);
    robot.step().expect("no fault");
    assert_eq!(robot.host.logs(), ["5"; 6]);
    assert_eq!(robot.counters().malformed, 0);
}

/// What a robot of a swarm measures, differs from robot to robot and from call to call.
fn measuring(id: i32) -> Recorder {
    let mut host = Recorder::answering(move |call| Answer::Int(id + call.number as i32 % 50));
    host.position = [Some(100.0 * id as f32), Some(50.0), Some(0.0), Some(90.0)];
    host
}

/// Runs a script on four robots. Returns the number of frames, or which robot has dropped one.
fn play<P: Profile>(path: &str) -> Result<usize, String> {
    let Some(image) = compiler::compile_file(path, P::FULL).image else { return Ok(0) };
    let image: &'static [u8] = Vec::leak(image);
    let robots = (0..4).map(|id| {
        let mut robot: TestRobot<P> = TestRobot::new(image, id, SIZES);
        robot.host = measuring(i32::from(id));
        robot
    });
    let mut swarm = Swarm::of(robots.collect());
    swarm.air.place = Box::new(|from, to| Some([40.0 + 10.0 * (from + to) as f32, 0.5, 0.0]));
    let mut frames = 0;
    for _ in 0..150 {
        swarm.try_step();
        for robot in &mut swarm.robots {
            frames += usize::from(!robot.host.events.is_empty());
            if robot.fault.is_some() {
                robot.rest();
                let _ = robot.start();
            }
        }
    }
    for robot in &mut swarm.robots {
        let counters = robot.counters();
        if counters.malformed != 0 {
            return Err(format!("{path}, {}: robot {}: {counters:?}\n", P::NAME, robot.id));
        }
    }
    Ok(frames)
}

/// The analysis of the compiler must not be wrong: robots with one script never drop a message of each other.
#[test]
fn no_script_drops_its_own_messages() {
    let folders = ["examples", "tests/scenarios", "tests/bzz/swarm", "tests/bzz/lib"];
    let mut paths: Vec<String> =
        folders.iter().flat_map(|folder| files::with_extension(folder, "bzz")).collect();
    paths.retain(|path| !path.starts_with("examples/errors/"));
    let results = files::in_parallel(&paths, |path| [play::<Tiny>(path), play::<Full>(path)]);
    let results: Vec<_> = results.into_iter().flatten().collect();
    let active = results.iter().filter(|result| !matches!(result, Ok(0))).count();
    assert!(active > 60, "{active} runs of {} did something", results.len());
    let failures: Vec<String> = results.into_iter().filter_map(Result::err).collect();
    report::conclude("classes", paths.len(), 50, &failures);
}

/// Puts a probe behind each assignment in a line of its own, and into each function for its parameters. Returns the program
/// with the probes that `probe` makes of a number and a variable.
fn with_probes(program: &str, probe: impl Fn(usize, &str) -> String) -> (String, usize) {
    let (mut text, mut count) = (String::new(), 0);
    for line in program.lines() {
        text.push_str(line);
        for variable in probed(line) {
            text.push(' ');
            text.push_str(&probe(count, variable));
            count += 1;
        }
        text.push('\n');
    }
    (text, count)
}

/// The variables that have new values behind a line.
fn probed(line: &str) -> Vec<&str> {
    let is_name = |text: &str| {
        !text.is_empty() && text.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let statement = line.trim();
    if let Some(head) = statement.strip_suffix(") {")
        && let Some((before, parameters)) = head.rsplit_once('(')
        && before.rsplit([' ', '=', '(', ',']).nth(usize::from(!before.ends_with("function")))
            == Some("function")
    {
        return parameters.split(", ").filter(|name| is_name(name)).collect();
    }
    let assignment = statement.strip_prefix("var ").unwrap_or(statement);
    match assignment.split_once(" = ") {
        Some((name, value)) if is_name(name) && is_whole(value) => vec![name],
        _ => vec![],
    }
}

/// Returns true if every bracket in the expression is closed.
fn is_whole(value: &str) -> bool {
    let (mut depth, mut is_text) = (0, false);
    for c in value.chars() {
        match c {
            '"' => is_text = !is_text,
            '(' | '[' | '{' if !is_text => depth += 1,
            ')' | ']' | '}' if !is_text => depth -= 1,
            _ => {}
        }
    }
    depth == 0 && !is_text && !value.ends_with([',', '=', '+', '-', '*', '/', '|', '&'])
}

fn class(value: &Argument) -> u8 {
    match value {
        Argument::Nil => class::NIL,
        Argument::Int(_) | Argument::Float(_) => class::NUMBER,
        Argument::String(_) => class::STRING,
        Argument::Text(_) => class::TEXT,
        Argument::Table(_) => class::TABLE,
        Argument::Function => class::FUNCTION,
    }
}

/// Slots of a machine that no random program fills.
const SLOTS: usize = 60_000;

/// Compiles a random program that sends the value of each probe, each on a topic of its own, and runs the same program
/// with `log` in place of `broadcast`. Returns how many values the class table would have let pass, and how many of them it
/// looked at.
fn probe_program<P: Profile>(seed: u64) -> Result<(usize, usize), String> {
    let program = generator::program(Options { seed, full: P::FULL, hide_literals: false });
    let (sends, _) = with_probes(&program, |number, variable| {
        format!("neighbors.broadcast(\"probe{number}\", {variable})")
    });
    let (logs, _) = with_probes(&program, |number, variable| {
        format!("log({number}, {variable}, {})", number + 10_000)
    });
    let compile = |text: &str| compiler::compile(text.to_owned(), P::FULL, &MemoryFiles::default());
    let (sender, logger) = (compile(&sends), compile(&logs));
    let (Some(sender), Some(symbols), Some(image)) = (sender.image, sender.symbols, logger.image)
    else {
        return Ok((0, 0));
    };
    let header = Image::new(sender.as_slice()).header().map_err(|error| format!("{error:?}"))?;
    let row = |number: i32| {
        let topic = format!("probe{number}");
        let string = symbols.strings.iter().position(|known| *known == topic);
        let at = header.classes_at().map(usize::from);
        let last = symbols.strings.len();
        at.zip(string).map_or(ALL_CLASSES, |(at, string)| sender[at + last - string])
    };
    let mut robot: TestRobot<P, &'static [u8], SLOTS> = TestRobot::new(Vec::leak(image), 1, SIZES);
    robot.host = measuring(1);
    // Some robot functions return what they get.
    robot.host.answer = Box::new(|call| match call.number % 3 {
        0 => Answer::First,
        1 => Answer::Nil,
        _ => Answer::Int(call.number as i32),
    });
    let _ = (0..3).try_for_each(|_| robot.step());
    let _ = robot.enter(EntryPoint::Reset).and_then(|()| robot.enter(EntryPoint::Destroy));
    let (mut passed, mut checked) = (0, 0);
    for event in &robot.host.events {
        let Event::Log(arguments) = event else { continue };
        let [Argument::Int(number), value, Argument::Int(end)] = arguments.as_slice() else {
            continue;
        };
        if *end != number + 10_000 {
            continue;
        }
        let row = row(*number);
        if row & class(value) == 0 {
            return Err(format!(
                "seed {seed}, {}: probe {number} is {:?}, but the row is {row:#b}\n{logs}",
                P::NAME,
                value.type_of()
            ));
        }
        passed += 1;
        checked += usize::from(row != ALL_CLASSES);
    }
    Ok((passed, checked))
}

#[test]
fn random_programs_send_what_the_table_says() {
    let seeds = 0..200;
    let runs: Vec<(u64, bool)> =
        seeds.clone().flat_map(|seed| [(seed, false), (seed, true)]).collect();
    let results = files::in_parallel(&runs, |(seed, full)| {
        if *full { probe_program::<Full>(*seed) } else { probe_program::<Tiny>(*seed) }
    });
    let done: Vec<&(usize, usize)> = results.iter().flatten().collect();
    let compiled = done.iter().filter(|(passed, _)| *passed > 0).count();
    let checked: usize = done.iter().map(|(_, checked)| checked).sum();
    println!("{compiled} of {} programs, {checked} values checked", runs.len());
    assert!(compiled * 2 > runs.len(), "{compiled} of {} programs have probes", runs.len());
    assert!(checked > 50_000, "{checked} values were looked at");
    let failures: Vec<String> = results.into_iter().filter_map(Result::err).collect();
    report::conclude("programs with probes", runs.len(), seeds.count(), &failures);
}
