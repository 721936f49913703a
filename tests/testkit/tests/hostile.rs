//! The hostile sender of the test kit: each attack is what it is said to be, as often as asked, and the same for a seed.

use std::cell::RefCell;
use std::collections::BTreeSet;
use std::rc::Rc;

use bittybuzz_testkit::{Attack, FORGER, Hostile, INVENTED, Swarm};
use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::{CLOCK_MAX, Message, StigmergyEntry};
use bittybuzz_vm_core::number::Tiny;

/// Robots with an entry that talk.
const SCRIPT: &str = "function init() { s = stigmergy.create(1) if(id == 1) s.put(1, 5)
        neighbors.listen(\"x\", function(topic, value, robot) {}) }
    function step() { neighbors.broadcast(\"x\", 1) }";

/// The frames of an attack of 60 steps, after ten without, on three robots.
fn frames(attack: Attack, messages_per_step: f64, seed: u64) -> Vec<Vec<u8>> {
    let mut swarm: Swarm<Tiny> = Swarm::new(3, SCRIPT);
    let frames = Rc::new(RefCell::new(Vec::new()));
    let seen = frames.clone();
    swarm.air.observe = Box::new(move |frame| {
        if frame.from.is_none() {
            seen.borrow_mut().push(frame.bytes.clone());
        }
    });
    swarm.hostile = Some(Hostile::new(swarm.robots[0].script(), seed));
    swarm.steps(10);
    assert!(frames.borrow().is_empty(), "it is quiet");
    swarm.hostile.as_mut().expect("there is one").attack(attack, messages_per_step);
    swarm.steps(60);
    let count = frames.borrow().len();
    swarm.hostile.as_mut().expect("there is one").be_quiet();
    swarm.steps(10);
    assert_eq!(frames.borrow().len(), count, "it is quiet again");
    frames.take()
}

/// Runs `check` on each message of an attack of two per step.
fn each(attack: Attack, mut check: impl FnMut(Message<'_, Tiny>)) {
    let swarm: Swarm<Tiny> = Swarm::new(1, SCRIPT);
    let script = swarm.robots[0].script();
    for frame in frames(attack, 2.0, 1) {
        check(Message::decode(&frame, script).expect("a message of this script"));
    }
}

#[test]
fn equal_seeds_give_equal_attacks() {
    for attack in Attack::ALL {
        assert_eq!(frames(attack, 1.0, 1), frames(attack, 1.0, 1), "{attack:?}");
    }
    for attack in [Attack::InventedRobots, Attack::Replays, Attack::Babble] {
        assert_ne!(frames(attack, 1.0, 1), frames(attack, 1.0, 2), "{attack:?}");
    }
}

#[test]
fn the_requested_number_of_messages_is_sent() {
    for (rate, count) in [(0.1, 6), (0.25, 15), (1.0, 60), (20.0, 1200)] {
        for attack in Attack::ALL.into_iter().filter(|attack| *attack != Attack::ForgedValues) {
            assert_eq!(frames(attack, rate, 1).len(), count, "{attack:?}");
        }
    }
}

#[test]
fn clocks_are_forged_for_existing_keys() {
    let mut clocks = BTreeSet::new();
    each(Attack::ForgedClocks, |message| match message {
        Message::Entry(StigmergyEntry { stigmergy: 1, owner: FORGER, clock, key, .. }) => {
            assert_eq!(key.as_int(), Some(1));
            clocks.insert(clock);
        }
        other => panic!("{other:?}"),
    });
    // The robots' clock is 1 at first; then it is the one that was forged.
    let expected = [1001, CLOCK_MAX / 2, CLOCK_MAX / 2 + 1, CLOCK_MAX];
    assert!(clocks.is_superset(&expected.into()), "{clocks:?}");
}

#[test]
fn values_of_all_classes_are_forged() {
    let (mut topics, mut keys, mut long) = (BTreeSet::new(), BTreeSet::new(), 0);
    let class = |value: Value<Tiny>| format!("{:?}", value.type_of());
    each(Attack::ForgedValues, |message| match message {
        Message::Broadcast { value, .. } => _ = topics.insert(class(value)),
        Message::Entry(entry) => _ = keys.insert(class(entry.value)),
        Message::Fragment(_) => long += 1,
        other => panic!("{other:?}"),
    });
    let plain = ["Float", "Int", "Nil", "String"].map(str::to_owned);
    assert_eq!((topics, keys), (plain.clone().into(), plain.into()));
    assert!(long > 0);
}

#[test]
fn invented_messages_differ() {
    let (mut robots, mut keys, mut senders) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    each(Attack::InventedRobots, |message| match message {
        Message::Beacon { robot } => _ = robots.insert(robot),
        other => panic!("{other:?}"),
    });
    each(Attack::InventedKeys, |message| match message {
        Message::Entry(entry) => _ = keys.insert(entry.key.as_int().expect("a number")),
        other => panic!("{other:?}"),
    });
    each(Attack::InventedMessages, |message| match message {
        Message::Fragment(fragment) => _ = senders.insert(fragment.robot),
        other => panic!("{other:?}"),
    });
    assert!(robots.len() > 100 && senders.len() > 100 && keys.len() > 80);
    assert!(robots.iter().chain(&senders).all(|robot| *robot >= INVENTED));
    assert!(!keys.contains(&1));
}

#[test]
fn messages_are_started_and_never_completed() {
    for (attack, expected) in [(Attack::RepeatedFragments, 1), (Attack::BegunMessages, 120)] {
        let mut numbers = BTreeSet::new();
        each(attack, |message| match message {
            Message::Fragment(fragment) => {
                assert_eq!((fragment.robot, fragment.index, fragment.last), (FORGER, 0, false));
                numbers.insert(fragment.number);
            }
            other => panic!("{other:?}"),
        });
        assert_eq!(numbers.len(), expected, "{attack:?}");
    }
}

#[test]
fn frames_of_the_robots_are_replayed() {
    each(Attack::Replays, |message| match message {
        Message::Broadcast { robot, .. } | Message::Digest { robot, .. } => assert!(robot <= 3),
        Message::Entry(entry) => assert_eq!(entry.owner, 1),
        other => panic!("{other:?}"),
    });
}
