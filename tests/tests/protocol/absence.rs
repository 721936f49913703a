//! Robots that heard no other one for longer than a deletion is remembered.

use bittybuzz_testkit::Swarm;
use bittybuzz_vm_core::message::Message;
use bittybuzz_vm_core::number::{Full, Tiny};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// Steps after which others may have forgotten deletions that a robot has missed.
const ALONE_STEPS: usize = 40 * 16;

/// A robot that comes back compares its entries with those of the others before it sends any: 3 to 5 s.
#[test]
fn a_robot_that_was_away_for_long_listens_first() {
    let mut swarm: Swarm<Full> = Swarm::new(
        3,
        // The deletion of a text that was made at run time leaves nothing when it is forgotten.
        "t = 0
         function init() {
           v = stigmergy.create(1)
           old = string.concat(\"o\", string.tostring(1))
           if(id == 1) v.put(old, 1)
         }
         function step() {
           t = t + 1
           if(id == 1 and t == 100) v.put(old, nil)
           if(id == 3 and t == 200) v.put(\"away\", 3)
           if(id == 1 and t == 760) v.put(\"new\", 2)
           log(v.get(old), \" \", v.get(\"away\"), \" \", v.get(\"new\"))
         }",
    );
    let is_away = Rc::new(Cell::new(false));
    let away = is_away.clone();
    swarm.air.reaches = Box::new(move |from, to| !away.get() || (from < 2) == (to < 2));
    swarm.steps(50);
    assert_eq!(swarm.last(), ["1 nil nil"; 3]);
    is_away.set(true);
    swarm.steps(ALONE_STEPS + 150);
    assert_eq!(swarm.last(), ["nil nil 2", "nil nil 2", "1 3 nil"]);
    // Steps in which the robot that was away sends its own entry.
    let entries = Rc::new(RefCell::new(Vec::new()));
    let all = entries.clone();
    let script = swarm.robots[0].script();
    swarm.air.observe = Box::new(move |frame| {
        if let Ok(Message::<Full>::Entry(entry)) = Message::decode(&frame.bytes, script)
            && (frame.from, entry.owner) == (Some(2), 3)
            && entry.clock != 0
        {
            all.borrow_mut().push(frame.step);
        }
    });
    is_away.set(false);
    swarm.steps(200);
    assert_eq!(swarm.last(), ["nil 3 2"; 3]);
    let first = entries.borrow().first().map(|step| *step as usize - (50 + ALONE_STEPS + 150));
    assert!(first.is_some_and(|first| (30..=64).contains(&first)), "{first:?}");
}

/// Robots that hear each other are never away, however long they run: a put whose frame is lost is advertised.
#[test]
fn robots_that_hear_each_other_do_not_wait() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        2,
        "t = 0
         function init() { v = stigmergy.create(1) }
         function step() { t = t + 1  if(id == 1 and t == 800) v.put(\"k\", 5)  log(v.get(\"k\")) }",
    );
    let is_lost = Rc::new(Cell::new(false));
    let lost = is_lost.clone();
    swarm.air.reaches = Box::new(move |_, _| !lost.get());
    swarm.steps(799);
    is_lost.set(true);
    swarm.step();
    is_lost.set(false);
    swarm.steps(4);
    assert_eq!(swarm.last(), ["5", "5"]);
}

/// A robot that was stopped does not know how long others heard nothing of it.
#[test]
fn a_robot_that_was_stopped_listens_first() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        2,
        "t = 0
         function init() { v = stigmergy.create(1) }
         function step() { t = t + 1  if(id == 2 and t == 60) v.put(\"k\", 5)  log(v.get(\"k\")) }",
    );
    let is_open = Rc::new(Cell::new(true));
    let open = is_open.clone();
    swarm.air.reaches = Box::new(move |_, _| open.get());
    swarm.steps(50);
    is_open.set(false);
    swarm.steps(30);
    swarm.robots[1].vm.come_back();
    is_open.set(true);
    swarm.steps(30);
    assert_eq!(swarm.last(), ["nil", "5"]);
    swarm.steps(70);
    assert_eq!(swarm.last(), ["5", "5"]);
}
