//! Entries that meet others: conflicts that handlers decide, deletions that are forgotten, and puts from before a restart.

use bittybuzz_testkit::Swarm;
use bittybuzz_vm_core::message::{FrameKind, Message, StigmergyEntry};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{FaultCode, Value};
use std::cell::RefCell;
use std::rc::Rc;

/// Frames that a robot sends, from now on.
fn sent_by<P: Profile>(swarm: &mut Swarm<P>, robot: usize) -> Rc<RefCell<Vec<Vec<u8>>>> {
    let sent = Rc::new(RefCell::new(Vec::new()));
    let all = sent.clone();
    swarm.air.observe = Box::new(move |frame| {
        if frame.from == Some(robot) {
            all.borrow_mut().push(frame.bytes.clone());
        }
    });
    sent
}

/// Three values each of which gives way to the next: all robots have one of them in the end. A later put is decided by the handler
/// again.
#[test]
fn choices_in_a_circle_end() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        3,
        "t = 0
         function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) {
             if((local.data + 1) % 3 == remote.data) return remote
             return local
           })
         }
         function step() {
           t = t + 1
           if(t == 1) v.put(1, id % 3)
           if(t == 3000 and id < 3) v.put(1, 2 - id)
           log(v.get(1))
         }",
    );
    swarm.steps(2900);
    // Robot 3 has the greatest id.
    assert_eq!(swarm.last(), ["0"; 3]);
    swarm.steps(200);
    assert_eq!(swarm.last(), ["1"; 3]);
}

/// Merged values meet others at one clock again: a robot merges four times, and once more in 1,024 steps.
#[test]
fn merged_values_are_merged_a_limited_number_of_times() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        2,
        "t = 0
         function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) { return {.data = local.data + remote.data} })
           v.put(1, id)
         }
         function step() { log(v.get(1)) }",
    );
    swarm.steps(60);
    assert_eq!(swarm.last(), ["24"; 2]);
}

/// A robot sends no digest while others have entries that it does not keep. A question is none.
#[test]
fn a_robot_without_a_stigmergy_has_no_digest() {
    for (clock, kind) in [(1, FrameKind::Beacon), (0, FrameKind::Digest)] {
        let mut swarm: Swarm<Tiny> = Swarm::new(
            1,
            "function init() { v = stigmergy.create(1)  v.put(1, 1) }
             function step() { neighbors.count()  if(false) w = stigmergy.create(2) }",
        );
        swarm.steps(20);
        let entry = StigmergyEntry {
            stigmergy: 2,
            owner: 9,
            clock,
            key: Value::int(1),
            value: if clock == 0 { Value::nil() } else { Value::int(5) },
        };
        let frame = swarm.robots[0].frame(&Message::Entry(entry));
        swarm.inject(&frame, [0]);
        swarm.steps(2);
        let sent = sent_by(&mut swarm, 0);
        swarm.steps(30);
        let kinds: Vec<_> =
            sent.borrow().iter().filter_map(|frame| FrameKind::of(frame[0])).collect();
        let beacons: Vec<_> = kinds
            .iter()
            .filter(|one| matches!(one, FrameKind::Beacon | FrameKind::Digest))
            .collect();
        assert!(beacons.len() > 2 && beacons.iter().all(|one| **one == kind), "{kinds:?}");
    }
}

/// The place of a deletion that others may not know yet is not taken by another key.
#[test]
fn a_young_deletion_keeps_its_place() {
    let script = "t = 0
         function init() { v = stigmergy.create(1) for(i = 0, i < 4, i = i + 1) v.put(i, i) }
         function step() { t = t + 1  if(t == 2) v.put(0, nil)  if(t == LATER) v.put(9, 9)  log(v.get(9)) }";
    let mut early: Swarm<Tiny> = Swarm::new(1, &script.replace("LATER", "600"));
    for _ in 1..600 {
        assert_eq!(early.robots[0].step(), Ok(()));
    }
    let fault = early.robots[0].step().expect_err("the deletion is there");
    assert_eq!(fault.code, FaultCode::StoreFull);
    let mut late: Swarm<Tiny> = Swarm::new(1, &script.replace("LATER", "680"));
    late.steps(680);
    assert_eq!(late.last(), ["9"]);
}

/// An entry from before a deletion that all have forgotten is answered by a deletion.
#[test]
fn an_entry_from_before_a_forgotten_deletion_is_deleted_again() {
    let mut swarm: Swarm<Full> = Swarm::new(
        2,
        "t = 0
         function init() {
           v = stigmergy.create(1)
           text = string.concat(\"a\", string.tostring(1))
           if(id == 1) { v.put(1, 1) v.put(text, 1) }
         }
         function step() { t = t + 1  if(t == 20 and id == 1) v.put(text, nil)  log(v.size()) }",
    );
    swarm.steps(800);
    assert_eq!(swarm.last(), ["1"; 2]);
    let (key, value) = (Value::int(7), Value::int(5));
    let entry = StigmergyEntry { stigmergy: 1, owner: 9, clock: 2, key, value };
    let frame = swarm.robots[0].frame(&Message::Entry(entry));
    let script = swarm.robots[0].script();
    let sent = sent_by(&mut swarm, 0);
    swarm.inject(&frame, [0]);
    swarm.step();
    let answers: Vec<_> = sent
        .borrow()
        .iter()
        .filter_map(|frame| match Message::<Full>::decode(frame, script) {
            Ok(Message::Entry(entry)) if entry.key.as_int() == Some(7) => Some(entry),
            _ => None,
        })
        .map(|entry| (entry.owner, entry.value.is_nil(), entry.clock > 2))
        .collect();
    assert_eq!(answers, [(9, true, true)]);
    swarm.steps(20);
    assert_eq!(swarm.last(), ["1"; 2]);
}

/// A deletion in a robot's own name, later than its put, is undone if no other robot can have known the put.
#[test]
fn a_robot_puts_again_what_no_other_robot_knew() {
    for (robots, expected) in [(1, "5"), (2, "nil")] {
        let mut swarm: Swarm<Tiny> = Swarm::new(
            robots,
            // Only a script that deletes expects deletions.
            "function init() { v = stigmergy.create(1)  if(id == 1) v.put(1, 5) }
             function step() { if(id == 77) v.put(1, nil)  log(v.get(1)) }",
        );
        // Robots compare their digests meanwhile.
        swarm.steps(200);
        let (key, value) = (Value::int(1), Value::nil());
        let entry = StigmergyEntry { stigmergy: 1, owner: 1, clock: 6, key, value };
        let frame = swarm.robots[0].frame(&Message::Entry(entry));
        swarm.inject(&frame, [0]);
        swarm.steps(10);
        assert_eq!(swarm.last()[0], expected, "{robots} robots");
    }
}

/// A robot that has put nothing since it was switched on takes what others know from its former life, and what follows on that.
#[test]
fn a_robot_that_has_put_nothing_takes_entries_in_its_name() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        1,
        "function init() { v = stigmergy.create(1) }
         function step() { log(v.get(1))  if(id == 7) v.put(1, 9) }",
    );
    for clock in [5, 9, 20] {
        let (key, value) = (Value::int(1), Value::int(clock));
        let clock = clock as u32;
        let entry = StigmergyEntry { stigmergy: 1, owner: 1, clock, key, value };
        let frame = swarm.robots[0].frame(&Message::Entry(entry));
        swarm.inject(&frame, [0]);
        swarm.steps(3);
        assert_eq!(swarm.last(), [clock.to_string()]);
    }
}

/// A later put takes the place of one that no neighbor has confirmed.
#[test]
fn the_last_put_is_advertised() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        1,
        "t = 0
         function init() { v = stigmergy.create(1) }
         function step() { t = t + 1  if(t == 20) v.put(1, 5)  if(t == 30) v.put(2, 5) }",
    );
    swarm.steps(30);
    let sent = sent_by(&mut swarm, 0);
    swarm.steps(30);
    let script = swarm.robots[0].script();
    let keys: Vec<Option<i32>> = sent
        .borrow()
        .iter()
        .filter_map(|frame| match Message::<Tiny>::decode(frame, script) {
            Ok(Message::Entry(entry)) => Some(entry.key.as_int()),
            _ => None,
        })
        .collect();
    assert!(keys.len() >= 3 && keys.iter().all(|key| *key == Some(2)), "{keys:?}");
}

/// Keys that robot 1 sends while another robot's entries of key 2 come, with a clock of their own each or always the same. The put of
/// key 1 is confirmed before, or not.
fn keys_sent(is_confirmed: bool, is_new: bool) -> (usize, usize) {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        1,
        "t = 0
         function init() { v = stigmergy.create(1) }
         function step() { t = t + 1  if(t == 20) v.put(1, 5) }",
    );
    let frame = |swarm: &Swarm<Tiny>, owner, key, clock| {
        let (key, value) = (Value::int(key), Value::int(5));
        let entry = StigmergyEntry { stigmergy: 1, owner, clock, key, value };
        swarm.robots[0].frame(&Message::Entry(entry))
    };
    let other = frame(&swarm, 9, 2, 30);
    swarm.inject(&other, [0]);
    swarm.steps(20);
    if is_confirmed {
        let clock = swarm.robots[0].vm.stored_entries().find(|entry| entry.is_own);
        let own = frame(&swarm, 1, 1, clock.expect("the robot has put one").clock);
        swarm.inject(&own, [0]);
    }
    let sent = sent_by(&mut swarm, 0);
    for step in 0..30 {
        let other = frame(&swarm, 9, 2, if is_new { 31 + step } else { 30 });
        swarm.inject(&other, [0]);
        swarm.step();
    }
    let script = swarm.robots[0].script();
    let count = |key| {
        let is_it = |frame: &&Vec<u8>| match Message::<Tiny>::decode(frame, script) {
            Ok(Message::Entry(entry)) => entry.key.as_int() == Some(key),
            _ => false,
        };
        sent.borrow().iter().filter(is_it).count()
    };
    (count(1), count(2))
}

/// A put that no neighbor has confirmed is advertised until one does, whatever the others send.
#[test]
fn an_unconfirmed_put_is_advertised() {
    let (new, others) = (keys_sent(false, true), keys_sent(false, false));
    assert!(new.0 >= 8, "{new:?}");
    assert!(others.0 >= 4, "{others:?}");
    let (confirmed, quiet) = (keys_sent(true, true), keys_sent(true, false));
    assert!(confirmed.0 <= 1, "{confirmed:?}");
    assert!(quiet.0 < others.0, "{quiet:?} {others:?}");
}
