//! Frames from outside: which are foreign, malformed or dropped, and which of them make a neighbor.

use super::rules::{LISTEN, broadcast};
use bittybuzz_testkit::{FORGER, Received, Swarm, fragments, frame};
use bittybuzz_vm_core::message::content::{ContentItem, Head};
use bittybuzz_vm_core::message::{Message, ScriptIdentity, StigmergyEntry, Swarms};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{NetworkCounters, Value, builtin};

#[test]
fn messages_with_the_robots_own_id_are_counted_and_ignored() {
    let frame = broadcast();
    let mut swarm: Swarm<Tiny> = Swarm::new(2, LISTEN);
    swarm.air.reaches = Box::new(|_, _| false);
    swarm.step();
    swarm.inject(&frame, [1]);
    swarm.step();
    assert_eq!(swarm.last()[1], "0 0");
    assert_eq!(swarm.robots[1].counters().own_id, 1);
}

/// Nothing is counted where all is well.
#[test]
fn robots_of_one_script_understand_each_other() {
    let script = "function init() {
            s = stigmergy.create(1)
            s.onconflict(function(key, local, remote) {
              if(local.robot > remote.robot) return local
              return remote
            })
            w = swarm.create(1)
            w.join()
            neighbors.listen(\"x\", function(topic, value, robot) { s.put(\"k\", value) })
        }
        function step() { neighbors.broadcast(\"x\", {.a = id})  s.put(id, \"y\") }";
    let mut swarm: Swarm<Tiny> = Swarm::new(1, script);
    swarm.steps(5);
    assert_eq!(swarm.robots[0].counters(), NetworkCounters::default());
    let mut swarm: Swarm<Tiny> = Swarm::new(2, &script.replace("robot >", "robot <"));
    swarm.steps(40);
    for robot in &swarm.robots {
        assert_eq!(robot.counters(), NetworkCounters::default());
    }
}

/// A script knows strings of its own and those of all scripts, which come first.
#[test]
fn strings_that_the_script_does_not_have_are_foreign() {
    let known = {
        let swarm: Swarm<Tiny> = Swarm::new(1, LISTEN);
        builtin::string::COUNT + swarm.robots[0].vm.header().expect("an image").strings()
    };
    for (number, foreign) in [(known - 1, 0), (known, 1)] {
        let mut swarm: Swarm<Tiny> = Swarm::new(1, LISTEN);
        let robot = &mut swarm.robots[0];
        let topic = builtin::string::COUNT;
        robot.receive(&Message::Broadcast { robot: 2, topic, value: Value::string(number) });
        robot.step().expect("no fault");
        assert_eq!(robot.counters().foreign, foreign, "string {number} of {known}");
    }
}

/// A message carries some bytes of the script's hash, or four bits and the low bytes in its strings. Each of them counts,
/// also where two differ in the same bits.
#[test]
fn messages_with_another_hash_are_foreign() {
    fn check<P: Profile>() {
        let script = Swarm::<P>::new(1, LISTEN).robots[0].script();
        let mut swarms = Swarms::default();
        swarms.push(1, true);
        let greater = |difference| script.hash.wrapping_add(difference);
        let other_bits = |difference| script.hash ^ difference;
        let differences = [0x0101_0101, 0x5555_5555, 0xf0f0_f0f0].iter().flat_map(|bits: &u32| {
            let bytes = (0..16).map(|bytes: u32| {
                (0..4).map(|byte| ((bytes >> byte & 1) * 0xff) << (8 * byte)).sum::<u32>()
            });
            bytes.map(move |bytes| bits & bytes)
        });
        let mut foreign = 0;
        for hash in differences.flat_map(|difference| [greater(difference), other_bits(difference)])
        {
            // No string of the script is less than the first one or greater than the last one.
            let is_less = (hash as u16) < script.hash as u16;
            let topic = if is_less { 0 } else { script.strings - 1 };
            let (string, number) = (Value::string(topic), Value::int(7));
            let entry = |key, value| {
                Message::<P>::Entry(StigmergyEntry { stigmergy: 1, owner: 2, clock: 3, key, value })
            };
            let four_bits = if P::FULL { 0xf0ff_ffff } else { 0xf000_0000 };
            let ten_bits = if P::FULL { 0xc0ff_ffff } else { 0xc000_00ff };
            for (message, carried) in [
                (Message::Beacon { robot: 2 }, u32::MAX),
                (Message::Digest { robot: 2, digest: 9, floor: 8 }, ten_bits),
                (Message::Swarms { robot: 2, swarms }, 0xffff),
                (Message::Broadcast { robot: 2, topic, value: number }, 0xff_ffff),
                (Message::Broadcast { robot: 2, topic, value: string }, 0xff_ffff),
                (entry(number, number), four_bits),
                (entry(string, number), four_bits | 0xffff),
                (entry(number, string), four_bits | 0xffff),
                (entry(string, string), four_bits | 0xffff),
            ] {
                let is_ours = (hash ^ script.hash) & carried == 0;
                let mut robot = Swarm::<P>::new(1, LISTEN).robots.remove(0);
                robot
                    .host
                    .link
                    .push(Received::new(&frame(ScriptIdentity { hash, ..script }, &message)));
                robot.step().expect("no fault");
                let counted = robot.counters().foreign;
                assert_eq!(counted, u16::from(!is_ours), "{}: {message:?} {hash:08x}", P::NAME);
                foreign += counted;
            }
        }
        assert!(foreign > 300, "{foreign}");
    }
    check::<Tiny>();
    check::<Full>();
}

/// A word of four bytes has room for greater numbers than a string may have.
#[test]
fn strings_with_high_bytes_are_foreign() {
    let mut robot = Swarm::<Full>::new(1, LISTEN).robots.remove(0);
    let message = Message::Broadcast { robot: 2, topic: 0, value: Value::string(1) };
    let bytes = robot.frame(&message);
    for (at, foreign) in [(None, 0), (Some(5), 1), (Some(6), 1), (Some(9), 1), (Some(10), 1)] {
        let mut bytes = bytes.clone();
        // Topic and value are at 3 and 7.
        at.into_iter().for_each(|at: usize| bytes[at] ^= 1);
        robot.host.link.push(Received::new(&bytes));
        let before = robot.counters().foreign;
        robot.step().expect("no fault");
        assert_eq!(robot.counters().foreign - before, foreign, "{at:?}");
    }
}

/// The robot that put an entry may be far away. The link of some robots names the sender of each frame.
#[test]
fn only_the_sender_of_an_entry_becomes_a_neighbor() {
    let script = "function init() { s = stigmergy.create(1) }
        function step() { log(neighbors.count(), \" \", s.get(5)) }";
    for (sender, expected) in [(None, "0 7"), (Some(3), "1 7"), (Some(1), "0 nil")] {
        let mut swarm: Swarm<Tiny> = Swarm::new(1, script);
        let (key, value) = (Value::int(5), Value::int(7));
        let entry = StigmergyEntry { stigmergy: 1, owner: FORGER, clock: 1, key, value };
        let bytes = swarm.robots[0].frame(&Message::Entry(entry));
        swarm.step();
        swarm.robots[0].host.link.push(Received { sender, ..Received::new(&bytes) });
        swarm.step();
        assert_eq!(swarm.last(), [expected], "from {sender:?}");
    }
}

/// A function that captures values is none without them.
#[test]
fn functions_with_captures_are_not_delivered() {
    let script = "n = 0
        function plain() { return 1 }
        function make(x) { return function() { return x } }
        function init() { neighbors.listen(\"x\", function(topic, value, robot) { n = n + 1 }) }
        function step() { made = make(plain()) log(n) }";
    let swarm: Swarm<Tiny> = Swarm::new(1, script);
    let symbols = swarm.robots[0].host.symbols.clone().expect("the script has names");
    let own = symbols.strings.iter().position(|name| name == "x").expect("a topic");
    let topic = bittybuzz_vm_core::builtin::string::COUNT + own as u16;
    let functions = swarm.robots[0].vm.header().expect("an image").functions();
    let arrives = |number: u16| {
        let mut swarm: Swarm<Tiny> = Swarm::new(1, script);
        swarm.step();
        let items = [ContentItem::Plain(Value::string(topic)), ContentItem::Function(number)];
        let script = swarm.robots[0].script();
        for frame in fragments::<Tiny>(script, FORGER, Head::Broadcast, &items) {
            swarm.inject(&frame, [0]);
        }
        swarm.step();
        swarm.last() == ["1"]
    };
    let arrived = (0..functions).filter(|number| arrives(*number)).count();
    assert_eq!(arrived, usize::from(functions) - 1, "one of them captures a value");
    assert!(!arrives(functions), "there is no such function");
}

/// Robots without run-time strings cannot read one.
#[test]
fn a_text_is_dropped_by_scripts_that_make_none() {
    let mut swarm: Swarm<Tiny> = Swarm::new(1, LISTEN);
    let robot = &mut swarm.robots[0];
    let topic = ContentItem::Plain(Value::string(builtin::string::COUNT));
    let items = [topic, ContentItem::Text(0)];
    for frame in fragments::<Tiny>(robot.script(), FORGER, Head::Broadcast, &items) {
        robot.host.link.push(Received::new(&frame));
    }
    robot.step().expect("no fault");
    assert_eq!(robot.counters(), NetworkCounters { incomplete: 1, ..NetworkCounters::default() });
}

/// The swarm of another robot that this robot has not created.
#[test]
fn an_unknown_swarm_has_no_members() {
    let script = "function init() { s = {} var i = 0
            while(i < 8) { s[i] = swarm.create(i) s[i].join() i = i + 1 } }
        function step() { var i = 0
            while(i < 8) { s[i].exec(function() { log(neighbors.kin().count()) }) i = i + 1 } }";
    let mut swarm: Swarm<Tiny> = Swarm::new(1, script);
    swarm.step();
    let mut swarms = Swarms::default();
    swarms.push(30, true);
    swarm.robots[0].receive(&Message::Swarms { robot: 2, swarms });
    swarm.step();
    assert_eq!(swarm.logs()[0], vec!["0"; 16]);
}
