//! Rules of the protocol, each shown by few messages.

use bittybuzz_testkit::{FORGER, Program, SIZES, Swarm, TestRobot};
use bittybuzz_vm_core::message::{Message, StigmergyEntry};
use bittybuzz_vm_core::number::{Full, Tiny};
use bittybuzz_vm_core::opcode::CALL_BUILTIN;
use bittybuzz_vm_core::{ENTRIES_MAX, FaultCode, SLOTS_MAX, Sizes, Value, builtin};

/// Counts broadcasts. Robot 2 sends one in each step.
pub const LISTEN: &str = "n = 0
    function init() { neighbors.listen(\"x\", function(topic, value, robot) { n = n + 1 }) }
    function step() { log(n, \" \", neighbors.count())  if(id == 2) neighbors.broadcast(\"x\", 1) }";

/// The frame of robot 2.
pub fn broadcast() -> Vec<u8> {
    let mut sender: Swarm<Tiny> = Swarm::new(2, LISTEN);
    sender.robots[1].step().expect("it sends");
    sender.robots[1].take_sent().remove(0)
}

/// A robot that babbles does not hold up a step.
#[test]
fn a_step_handles_32_messages() {
    let frame = broadcast();
    let mut swarm: Swarm<Tiny> = Swarm::new(1, LISTEN);
    swarm.step();
    (0..100).for_each(|_| swarm.inject(&frame, [0]));
    for expected in ["32 1", "64 1", "96 1", "100 1"] {
        swarm.step();
        assert_eq!(swarm.last(), [expected]);
    }
}

/// A robot that knows so many keys and has sent all that, and the frame of nil under another key.
fn with_keys(keys: u16, clock: u32) -> (Swarm<Tiny>, Vec<u8>) {
    let script = format!(
        "function init() {{ s = stigmergy.create(1) var i = 0
            while(i < {keys}) {{ s.put(i, 1) i = i + 1 }}
            if(s.size() > {keys}) s.put(i, nil) }}
         function step() {{ log(s.size()) }}"
    );
    let mut swarm: Swarm<Tiny> = Swarm::new(1, &script);
    swarm.steps(100);
    swarm.robots[0].take_sent();
    let (key, value) = (Value::int(9), Value::nil());
    let entry = StigmergyEntry { stigmergy: 1, owner: FORGER, clock, key, value };
    let frame = swarm.robots[0].frame(&Message::Entry(entry));
    (swarm, frame)
}

/// A question for a key that is not known is no entry, even where there is no room for one.
#[test]
fn a_query_is_not_stored_or_relayed() {
    for keys in [0, 4] {
        let (mut swarm, frame) = with_keys(keys, 0);
        swarm.inject(&frame, [0]);
        swarm.robots[0].step().expect("the script goes on");
        assert_eq!(swarm.last(), [keys.to_string()]);
        assert_eq!(swarm.robots[0].counters().not_kept, 0);
        assert!(!swarm.robots[0].take_sent().contains(&frame));
    }
}

/// A deletion of a key that is not known leaves nothing; where the store is full, others may need it.
#[test]
fn a_deletion_is_relayed_by_a_full_store() {
    for (keys, is_relayed) in [(0, false), (3, false), (4, true)] {
        let (mut swarm, frame) = with_keys(keys, 5);
        swarm.inject(&frame, [0]);
        swarm.robots[0].step().expect("the script goes on");
        assert_eq!(swarm.last(), [keys.to_string()]);
        assert_eq!(swarm.robots[0].take_sent().contains(&frame), is_relayed, "{keys} keys");
    }
}

/// A robot that could not keep an entry sends no digest. One without room for a deletion does: no digest covers those.
#[test]
fn a_robot_without_room_for_an_entry_sends_no_digest() {
    for (value, sends_digests) in [(Value::nil(), true), (Value::int(1), false)] {
        // Robots whose script asks for neighbors send beacons also without a digest.
        let script = "function init() { s = stigmergy.create(1) var i = 0 while(i < 4) { s.put(i, 1) i = i + 1 } }
            function step() { log(neighbors.count()) }";
        let mut swarm: Swarm<Tiny> = Swarm::new(1, script);
        swarm.steps(100);
        let entry =
            StigmergyEntry { stigmergy: 1, owner: FORGER, clock: 5, key: Value::int(9), value };
        let robot = &mut swarm.robots[0];
        robot.take_sent();
        robot.receive(&Message::Entry(entry));
        (0..40).for_each(|_| robot.step().expect("the script goes on"));
        let (sent, script) = (robot.take_sent(), robot.script());
        let is_digest = |frame: &Vec<u8>| match Message::<Tiny>::decode(frame, script) {
            Ok(Message::Digest { .. }) => Some(true),
            Ok(Message::Beacon { .. }) => Some(false),
            _ => None,
        };
        let beacons: Vec<bool> = sent.iter().filter_map(is_digest).collect();
        assert!(beacons.len() >= 3, "{beacons:?}");
        assert!(beacons.iter().all(|is_digest| *is_digest == sends_digests), "{beacons:?}");
    }
}

/// Beacons are for scripts that ask who is near, and for digests.
#[test]
fn a_robot_without_neighbors_and_digest_sends_no_beacons() {
    let (mut swarm, _) = with_keys(4, 5);
    let (key, value) = (Value::int(9), Value::int(1));
    let robot = &mut swarm.robots[0];
    robot.receive(&Message::Entry(StigmergyEntry {
        stigmergy: 1,
        owner: FORGER,
        clock: 5,
        key,
        value,
    }));
    (0..40).for_each(|_| robot.step().expect("the script goes on"));
    let (sent, script) = (robot.take_sent(), robot.script());
    for frame in sent {
        assert!(matches!(Message::<Tiny>::decode(&frame, script), Ok(Message::Entry(_))));
    }
}

/// Entries that find no room are relayed with a pause of 64 to 95 steps.
#[test]
fn the_pause_between_relayed_entries_ends() {
    let (mut swarm, _) = with_keys(4, 5);
    let mut relays = |key: i32| {
        let (key, value) = (Value::int(key), Value::int(1));
        let entry = StigmergyEntry { stigmergy: 1, owner: FORGER, clock: 5, key, value };
        let frame = swarm.robots[0].frame(&Message::Entry(entry));
        swarm.inject(&frame, [0]);
        swarm.robots[0].step().expect("the script goes on");
        let is_relayed = swarm.robots[0].take_sent().contains(&frame);
        (0..50).for_each(|_| swarm.step());
        is_relayed
    };
    assert_eq!([10, 11, 12, 13, 14].map(&mut relays), [true, false, true, false, true]);
}

/// An entry that comes again and again is relayed once, as long as no other one is.
#[test]
fn an_entry_is_not_relayed_twice_in_a_row() {
    let (mut swarm, _) = with_keys(4, 5);
    let mut relays = |key: i32| {
        let (key, value) = (Value::int(key), Value::int(1));
        let entry = StigmergyEntry { stigmergy: 1, owner: FORGER, clock: 5, key, value };
        let frame = swarm.robots[0].frame(&Message::Entry(entry));
        swarm.inject(&frame, [0]);
        swarm.robots[0].step().expect("the script goes on");
        let is_relayed = swarm.robots[0].take_sent().contains(&frame);
        (0..100).for_each(|_| swarm.step());
        is_relayed
    };
    assert_eq!([10, 10, 11, 10].map(&mut relays), [true, false, true, true]);
}

/// However much a script puts, a step sends four entries at most; the others follow.
#[test]
fn a_step_sends_four_new_entries() {
    let sizes = Sizes { entries: 12, ..SIZES };
    let script = "t = 0
        function init() { s = stigmergy.create(1) }
        function step() {
          t = t + 1
          var i = 0
          if(t == 2) while(i < 10) { s.put(i, 1) i = i + 1 }
        }";
    let image = Program::new::<Tiny>(script).leak();
    let mut robot: TestRobot<Tiny, _, 2000> = TestRobot::new(image, 1, sizes);
    robot.step().expect("no fault");
    let mut entries = || {
        robot.take_sent();
        robot.step().expect("no fault");
        let (sent, script) = (robot.take_sent(), robot.script());
        let keys = sent.iter().filter_map(|frame| match Message::<Tiny>::decode(frame, script) {
            Ok(Message::Entry(entry)) => entry.key.as_int(),
            _ => None,
        });
        keys.collect::<Vec<i32>>()
    };
    assert_eq!(entries(), [0, 1, 2, 3]);
    // The newest entry is also sent in turn.
    let (second, third) = (entries(), entries());
    assert!(
        (4..=8).all(|key| [&second[..], &third].concat().contains(&key)),
        "{second:?} {third:?}"
    );
    assert!(second.len() <= 6 && third.len() <= 6, "{second:?} {third:?}");
}

/// Robots that ask for more have eight swarms and a hundred stigmergies. They have all entries.
#[test]
fn sizes_are_clamped() {
    let sizes = Sizes { swarms: 20, entries: 200, ..SIZES };
    for (what, count, code) in [
        ("swarm.create(i)", 8, FaultCode::TooMany),
        ("stigmergy.create(i)", 100, FaultCode::TooMany),
        ("s.put(i, 1)", 200, FaultCode::StoreFull),
    ] {
        let script = format!(
            "function init() {{ s = stigmergy.create(1) var i = 0
                while(i < 250) {{ log(i) {what} i = i + 1 }} }}"
        );
        let image = Program::new::<Tiny>(&script).leak();
        let mut robot: TestRobot<Tiny, _, 2000> = TestRobot::new(image, 1, sizes);
        let fault = robot.begin().expect_err("there are not so many");
        assert_eq!(fault.code, code);
        assert_eq!(robot.host.logs().last(), Some(&count.to_string()));
    }
}

/// The most entries fit the largest memory, with their index and room for a script; a machine that is asked for more has these.
#[test]
fn the_most_entries_fit_the_largest_memory() {
    let sizes = |entries| Sizes { neighbors: 0, bearings: false, entries, swarms: 0 };
    let slots = sizes(ENTRIES_MAX).slots();
    assert!((60_000 - 2_000..SLOTS_MAX).contains(&slots), "{slots} of {SLOTS_MAX}");
    let script = "function init() { v = stigmergy.create(1)  v.put(1, 5) }
        function step() { log(v.get(1)) }";
    let image = Program::new::<Full>(script).leak();
    let mut robot: TestRobot<Full, _, SLOTS_MAX> = TestRobot::new(image, 1, sizes(u16::MAX));
    robot.step().expect("there is room");
    assert_eq!(robot.host.logs(), ["5"]);
}

/// A put in a handler of conflicts is later than the conflict, whatever it returns.
#[test]
fn a_put_in_a_conflict_handler_persists() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        2,
        "function init() {
            s = stigmergy.create(1)
            s.onconflict(function(key, local, remote) { s.put(key, 99) return remote })
            s.put(1, id)
         }
         function step() { log(s.get(1)) }",
    );
    swarm.steps(20);
    assert_eq!(swarm.last(), ["99", "99"]);
}

/// Membership of eight swarms is eight bits, one of which is elsewhere.
#[test]
fn each_of_eight_swarms_has_its_own_members() {
    for joined in 0..8 {
        let script = format!(
            "s = {{}}
             function init() {{
               var i = 0
               while(i < 8) {{ s[i] = swarm.create(i) if(id == 1) s[i].join() i = i + 1 }}
               if(id == 2) s[{joined}].join()
             }}
             function step() {{
               if(id == 1) {{
                 var i = 0
                 while(i < 8) {{ s[i].exec(function() {{ log(neighbors.kin().count()) }}) i = i + 1 }}
               }}
             }}"
        );
        let mut swarm: Swarm<Tiny> = Swarm::new(2, &script);
        swarm.steps(80);
        let logs = &swarm.logs()[0];
        let last: Vec<usize> =
            logs[logs.len() - 8..].iter().map(|line| line.parse().expect("a number")).collect();
        let expected: Vec<usize> = (0..8).map(|number| usize::from(number == joined)).collect();
        assert_eq!(last, expected);
    }
}

/// Runs scripts whose `step()` puts more than there is memory for, each with one global more, and lets them start again after
/// a rest. Returns the sizes of their stigmergies then.
fn sizes_after_a_rest(step: &str) -> Vec<String> {
    let size = |globals: usize| {
        let globals: String = (0..globals).map(|number| format!("g{number} = 0\n")).collect();
        let script = format!(
            "{globals} i = 0
             function init() {{ s = stigmergy.create(1) log(s.size()) }}
             function step() {{ {step} }}"
        );
        let image = Program::new::<Full>(&script).leak();
        let room = Sizes { neighbors: 2, entries: 20, ..SIZES };
        let mut robot: TestRobot<Full, _, 240> = TestRobot::new(image, 3, room);
        robot.begin().expect("nothing is put");
        let fault = robot.step().expect_err("it puts too much").code;
        assert!(matches!(fault, FaultCode::OutOfMemory | FaultCode::StackOverflow), "{fault:?}");
        robot.rest();
        (0..3).for_each(|_| robot.step().expect("there is room for messages"));
        robot.start().expect("there is room for global code");
        robot.host.logs().pop().expect("a size")
    };
    (0..20).map(size).collect()
}

/// Tables of entries may take memory in which messages are handled while the script rests. Then they are forgotten: the
/// neighbors send them again.
#[test]
fn received_messages_displace_entries_of_a_robot_in_a_pause() {
    let sizes = sizes_after_a_rest(
        "while(i < 100) { s.put(i, {.a = i, .b = i, .c = i, .d = i}) i = i + 1 }",
    );
    assert!(sizes.iter().any(|size| size == "0"), "{sizes:?}");
    assert!(sizes.iter().any(|size| size != "0"), "{sizes:?}");
}

/// Keys may be made at run time, and take memory, too. Entries that take none are kept.
#[test]
fn received_messages_displace_entries_with_keys_on_the_heap() {
    let sizes = sizes_after_a_rest(
        "s.put(1, 1)
         while(i < 100) {
           s.put(string.concat(\"a key of such a length that it takes some cells of memory \", string.tostring(i)), 1)
           i = i + 1
         }",
    );
    assert!(sizes.iter().any(|size| size == "1"), "{sizes:?}");
    assert!(sizes.iter().any(|size| size != "1"), "{sizes:?}");
    assert!(sizes.iter().all(|size| size != "0"), "{sizes:?}");
}

/// `step` may be any function, also after messages.
#[test]
fn a_step_of_the_machine_itself_follows_messages() {
    let mut swarm: Swarm<Full> = Swarm::new(
        2,
        "function init() {
           neighbors.listen(\"x\", function(topic, value, robot) { log(value) })
           neighbors.broadcast(\"x\", 5)
         }
         step = log",
    );
    swarm.steps(4);
    // The broadcasts of the first step arrive in the second.
    assert_eq!(swarm.logs(), [["", "5", "", "", ""]; 2]);
}

/// A neighbor whose store has no room sends beacons without a digest, which show nothing about its entries: all of them
/// are advertised around it, and none where there is no such neighbor.
#[test]
fn entries_are_advertised_next_to_a_robot_without_a_digest() {
    for is_met in [false, true] {
        let (mut swarm, _) = with_keys(3, 5);
        swarm.steps(300);
        let robot = &mut swarm.robots[0];
        robot.take_sent();
        let script = robot.script();
        for _ in 0..100 {
            if is_met {
                robot.receive(&Message::Beacon { robot: 2 });
            }
            (0..5).for_each(|_| robot.step().expect("the script goes on"));
        }
        let keys = robot.take_sent().into_iter().filter_map(|frame| {
            let message = Message::<Tiny>::decode(&frame, script);
            message.ok().and_then(|message| match message {
                Message::Entry(entry) => entry.key.as_int(),
                _ => None,
            })
        });
        let mut keys: Vec<i32> = keys.collect();
        keys.sort_unstable();
        keys.dedup();
        assert_eq!(keys, if is_met { vec![0, 1, 2] } else { vec![] });
    }
}

/// A robot that receives many old values answers four at once, and then one in two steps.
#[test]
fn answers_are_limited() {
    let (mut swarm, _) = with_keys(4, 5);
    let robot = &mut swarm.robots[0];
    let mut sent = Vec::new();
    for _ in 0..20 {
        for key in 0..4 {
            let (key, value) = (Value::int(key), Value::int(0));
            robot.receive(&Message::Entry(StigmergyEntry {
                stigmergy: 1,
                owner: 2,
                clock: 1,
                key,
                value,
            }));
        }
        robot.step().expect("the script goes on");
        sent.push(robot.take_sent().len());
    }
    // And the newest entry, with another one, each second step.
    assert!(sent[0] >= 4, "{sent:?}");
    assert!(sent.iter().sum::<usize>() <= 4 + 10 + 20, "{sent:?}");
}

/// Two robots may have the same old value.
#[test]
fn a_repeated_old_value_is_answered() {
    let (mut swarm, _) = with_keys(1, 5);
    let robot = &mut swarm.robots[0];
    for _ in 0..2 {
        let (key, value) = (Value::int(0), Value::int(0));
        robot.receive(&Message::Entry(StigmergyEntry {
            stigmergy: 1,
            owner: 2,
            clock: 0,
            key,
            value,
        }));
    }
    robot.step().expect("the script goes on");
    let script = robot.script();
    let is_answer = |frame: &Vec<u8>| match Message::<Tiny>::decode(frame, script) {
        Ok(Message::Entry(entry)) => entry.value.as_int() == Some(1),
        _ => false,
    };
    assert_eq!(robot.take_sent().iter().filter(|frame| is_answer(frame)).count(), 1);
}

/// A robot that comes late learns who is in which swarm.
#[test]
fn each_swarm_is_advertised() {
    for joined in 0..3 {
        let script = format!(
            "function init() {{ s = {{}} var i = 0
                while(i < 3) {{ s[i] = swarm.create(20 + i) i = i + 1 }}
                s[{joined}].join() }}
             function step() {{}}"
        );
        let mut swarm: Swarm<Tiny> = Swarm::new(1, &script);
        swarm.steps(50);
        let robot = &mut swarm.robots[0];
        robot.take_sent();
        (0..100).for_each(|_| robot.step().expect("the script goes on"));
        let script = robot.script();
        let mut told = [None; 3];
        for frame in robot.take_sent() {
            if let Ok(Message::Swarms { swarms, .. }) = Message::<Tiny>::decode(&frame, script) {
                for (number, is_member) in swarms.iter() {
                    told[usize::from(number) - 20] = Some(is_member);
                }
            }
        }
        let expected = [0, 1, 2].map(|number| Some(number == joined));
        assert_eq!(told, expected);
    }
}

/// A call whose missing argument the compiler cannot see.
#[test]
fn a_broadcast_of_nothing_is_a_fault() {
    for call in ["tell()", "tell(\"x\")"] {
        let script = format!("function step() {{ var tell = neighbors.broadcast {call} }}");
        let mut swarm: Swarm<Tiny> = Swarm::new(1, &script);
        let fault = swarm.robots[0].step().expect_err(call);
        assert_eq!(fault.code, FaultCode::MissingArgument, "{call}");
    }
}

/// Byte code that no compiler writes calls functions of snapshots, swarms and stigmergies with something else.
#[test]
fn functions_of_objects_need_one() {
    let arguments = ["{}", "5", "neighbors", "stigmergy.create(1)", "swarm.create(1)"];
    let size = (builtin::SIZE, 1, "log(size(OBJECT))");
    let foreach = (builtin::FOREACH, 2, "foreach(OBJECT, function(key, value) {})");
    let functions = [
        (size, builtin::SNAPSHOT_COUNT, None),
        (size, builtin::STIGMERGY_SIZE, Some("stigmergy.create(1)")),
        (size, builtin::SWARM_IN, Some("swarm.create(1)")),
        (foreach, builtin::SNAPSHOT_FOREACH, None),
        (foreach, builtin::SNAPSHOT_MAP, None),
        (foreach, builtin::STIGMERGY_FOREACH, Some("stigmergy.create(1)")),
        (foreach, builtin::SWARM_EXEC, Some("swarm.create(1)")),
    ];
    for ((written, count, call), function, object) in functions {
        for argument in arguments {
            let call = call.replace("OBJECT", argument);
            let script = format!(
                "function step() {{ neighbors.count() stigmergy.create(2) swarm.create(2) {call} }}"
            );
            let mut image = Program::new::<Tiny>(&script).image;
            let call = [CALL_BUILTIN, written, count];
            let at = image.windows(3).position(|bytes| bytes == call).expect("the call");
            image[at + 1] = function;
            let mut robot: TestRobot<Tiny> = TestRobot::new(Vec::leak(image), 1, SIZES);
            let result = robot.step().map_err(|fault| fault.code);
            let expected =
                if object == Some(argument) { Ok(()) } else { Err(FaultCode::WrongType) };
            assert_eq!(result, expected, "function {function} of {argument}");
        }
    }
}
