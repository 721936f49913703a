//! Neighbors, swarms, stigmergies, handlers and queues of two robots that receive each other.

use bittybuzz_inspect::{
    HandlerTrigger, InspectedQueue, Inspection, Limits, QueuedMessage, ScriptValue, inspect,
};
use bittybuzz_testkit::profiles::{Full, Tiny};
use bittybuzz_testkit::{Program, Swarm, in_both_profiles};
use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::inspect::KnownSwarm;
use bittybuzz_vm_core::message::{Message, StigmergyEntry};
use bittybuzz_vm_core::number::Profile;

use ScriptValue::Int;

const SCRIPT: &str = "
    neighbors.listen(\"topic\", function(topic, value, robot) { last = value })
    function init() {
        odd = swarm.create(7)
        odd.select(id % 2)
        even = swarm.create(9)
        even.unselect(1)
        v = stigmergy.create(101)
        v.onconflict(function(key, local, remote) { return local })
        if(id == 1) v.put(\"answer\", 42)
        else v.put(5, id)
    }
    function step() { neighbors.broadcast(\"topic\", id) }";

fn text(text: &str) -> ScriptValue {
    ScriptValue::String(text.to_owned())
}

fn inspected<P: Profile>(swarm: &Swarm<P>, robot: usize) -> Inspection {
    let robot = &swarm.robots[robot];
    inspect(&robot.vm, robot.host.symbols.as_deref(), Limits::NONE)
}

fn pair<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(2, SCRIPT);
    swarm.steps(30);
    for (number, other) in [(0, 2), (1, 1)] {
        let found = inspected(&swarm, number);
        let [neighbor] = &found.neighbors[..] else { panic!("{:?}", found.neighbors) };
        assert_eq!(neighbor.id, other);
        // The robots stand in a row, 10 mm apart, and face along it, so that the second is ahead of
        // the first.
        let [distance, azimuth, elevation] = neighbor.place.expect("is measured");
        let expected = if number == 0 { 0.0 } else { std::f32::consts::PI };
        assert!(distance == 10.0 && elevation == 0.0 && (azimuth - expected).abs() < 0.01);
        // The neighbor was received in the last step or in the one before: the period is 10 steps.
        assert!((8..=10).contains(&neighbor.steps_left), "{}", neighbor.steps_left);
        assert_eq!(neighbor.swarms, if other == 1 { vec![7] } else { vec![] });
        let known = |number, is_member| KnownSwarm { number, is_member, is_unsent: false };
        assert_eq!(found.swarms, [known(7, number == 0), known(9, false)]);
        let [stigmergy] = &found.stigmergies[..] else { panic!("{:?}", found.stigmergies) };
        assert_eq!(stigmergy.number, 101);
        let entry = |key: &ScriptValue| {
            let found = stigmergy.entries.iter().find(|entry| entry.key == *key);
            found.unwrap_or_else(|| panic!("{key:?} is not in {stigmergy:?}"))
        };
        let (answer, five) = (entry(&text("answer")), entry(&Int(5)));
        assert_eq!((answer.value.clone(), answer.owner, answer.is_own), (Int(42), 1, number == 0));
        assert_eq!((five.value.clone(), five.owner, five.is_own), (Int(2), 2, number == 1));
        assert!([answer, five].iter().all(|entry| entry.clock > 0 && !entry.is_unsent));
        assert!([answer, five].iter().all(|entry| entry.digest == Some(0)));
        let triggers: Vec<_> = found.handlers.iter().map(|handler| &handler.trigger).collect();
        let expected = [HandlerTrigger::Message(text("topic")), HandlerTrigger::Conflict(101)];
        assert_eq!(triggers, expected.iter().collect::<Vec<_>>());
        let last = found.globals.iter().find(|global| global.name == "last");
        assert_eq!(last.map(|global| global.value.clone()), Some(Int(other.into())));
    }
}

in_both_profiles!(neighbors_swarms_and_entries_of_a_pair_are_read, pair);

#[test]
fn a_deleted_entry_has_no_value_and_no_digest() {
    let script = "v = stigmergy.create(1)  v.put(\"k\", 1)  v.put(\"k\", nil)";
    let mut swarm: Swarm<Tiny> = Swarm::new(1, script);
    swarm.steps(1);
    let found = inspected(&swarm, 0);
    let [entry] = &found.stigmergies[0].entries[..] else { panic!("{:?}", found.stigmergies) };
    assert_eq!((entry.value.clone(), entry.digest, entry.clock), (ScriptValue::Nil, None, 2));
}

#[test]
fn messages_in_a_queue_are_decoded() {
    let mut swarm: Swarm<Full> = Swarm::new(1, SCRIPT);
    swarm.steps(1);
    let program = Program::new::<Full>(SCRIPT);
    let robot = &swarm.robots[0];
    let topic =
        (0..).find(|number| program.symbols.string(*number) == Some("topic")).expect("is known");
    let broadcast = robot.frame(&Message::Broadcast { robot: 3, topic, value: Value::float(2.5) });
    let beacon = robot.frame(&Message::Beacon { robot: 4 });
    // In messages the stigmergy has number 0.
    let (key, value) = (Value::int(5), Value::int(6));
    let entry = StigmergyEntry { stigmergy: 0, owner: 7, clock: 8, key, value };
    let entry = robot.frame(&Message::Entry(entry));
    let mut foreign = beacon.clone();
    foreign[4] ^= 1;
    let frames = [broadcast, beacon, entry, foreign, vec![0xff; 5]];
    let queue = InspectedQueue::of(&*robot.vm, Some(&program.symbols), 6, &frames);
    let value = ScriptValue::Float(2.5);
    let expected = [
        QueuedMessage::Broadcast { robot: 3, topic: text("topic"), value },
        QueuedMessage::Beacon { robot: 4 },
        QueuedMessage::Entry { stigmergy: 101, owner: 7, clock: 8, key: Int(5), value: Int(6) },
        QueuedMessage::Foreign,
        QueuedMessage::Malformed,
    ];
    assert_eq!((queue.capacity, &queue.messages[..]), (6, &expected[..]));
}
