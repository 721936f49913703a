//! The swarm of the test kit: what its air does to frames, and that a seed decides all of it.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_testkit::{OnAir, Queues, Swarm};
use bittybuzz_vm_core::FaultCode;
use bittybuzz_vm_core::message::Message;
use bittybuzz_vm_core::number::{Full, Tiny};

/// Counts the broadcasts that arrive, and sends one.
const COUNT: &str = "n = 0
    function init() { neighbors.listen(\"x\", function(t, v, r) { n = n + 1 }) }
    function step() { log(n)  neighbors.broadcast(\"x\", 1) }";

/// Returns the frames that will have been sent.
fn observe(swarm: &mut Swarm<Tiny>) -> Rc<RefCell<Vec<OnAir>>> {
    let frames = Rc::new(RefCell::new(Vec::new()));
    let seen = frames.clone();
    swarm.air.observe = Box::new(move |frame| seen.borrow_mut().push(frame.clone()));
    frames
}

#[test]
fn equal_seeds_give_equal_runs() {
    let run = |seed| {
        let mut swarm: Swarm<Tiny> =
            Swarm::new(5, COUNT).with_links(Queues::<Tiny, 10, 10>::default);
        swarm.air.seed(seed);
        (swarm.air.loss, swarm.air.duplication, swarm.air.delay) = (0.3, 0.2, 0.2);
        let frames = observe(&mut swarm);
        swarm.steps(50);
        (swarm.logs(), frames.take())
    };
    assert_eq!(run(1), run(1));
    assert_ne!(run(1).0, run(2).0);
}

#[test]
fn frames_are_lost_duplicated_and_delayed() {
    let heard = |loss, duplication, delay| {
        let mut swarm: Swarm<Tiny> = Swarm::new(2, COUNT);
        (swarm.air.loss, swarm.air.duplication, swarm.air.delay) = (loss, duplication, delay);
        swarm.steps(11);
        swarm.last()
    };
    assert_eq!(heard(0.0, 0.0, 0.0), ["10", "10"]);
    assert_eq!(heard(1.0, 0.0, 0.0), ["0", "0"]);
    assert_eq!(heard(0.0, 1.0, 0.0), ["20", "20"]);
    assert_eq!(heard(0.0, 0.0, 1.0), ["9", "9"]);
}

#[test]
fn a_late_frame_arrives_after_those_of_the_next_step() {
    let mut swarm: Swarm<Full> = Swarm::new(
        2,
        "n = 0
         function init() { neighbors.listen(\"x\", function(t, v, r) { log(v) }) }
         function step() { n = n + 1  if(id == 2 and n < 3) neighbors.broadcast(\"x\", n) }",
    );
    swarm.air.delay = 1.0;
    swarm.step();
    swarm.air.delay = 0.0;
    swarm.steps(2);
    assert_eq!(swarm.logs()[0], ["2", "1"]);
}

#[test]
fn a_robot_sends_as_many_frames_as_the_channel_accepts() {
    let script = "function step() { foreach({.a = 1, .b = 2, .c = 3}, neighbors.broadcast) }";
    let mut swarm: Swarm<Tiny> = Swarm::new(3, script).with_links(Queues::<Tiny, 10, 10>::default);
    swarm.air.frames_per_step = 2;
    let frames = observe(&mut swarm);
    for step in 0..20 {
        assert_eq!(swarm.try_step(), 6, "step {step}");
    }
    assert_eq!(frames.borrow().len(), 120);
    assert!(frames.borrow().iter().all(|frame| frame.from.is_some_and(|from| from < 3)));
}

#[test]
fn a_restarted_robot_has_empty_state() {
    let mut swarm: Swarm<Tiny> = Swarm::new(2, COUNT);
    swarm.steps(10);
    assert_eq!(swarm.last(), ["9", "9"]);
    swarm.robots[1].restart();
    swarm.steps(2);
    // The frame of the step before the restart waited in its link.
    assert_eq!(swarm.last(), ["11", "2"]);
}

#[test]
fn a_frame_from_outside_arrives_and_is_observed() {
    let mut swarm: Swarm<Tiny> = Swarm::new(3, "function step() { log(neighbors.count()) }");
    swarm.air.reaches = Box::new(|_, _| false);
    let frames = observe(&mut swarm);
    swarm.step();
    let beacon = swarm.robots[0].frame(&Message::Beacon { robot: 77 });
    swarm.inject(&beacon, [0, 2]);
    swarm.step();
    assert_eq!(swarm.last(), ["1", "0", "1"]);
    let outside = OnAir { step: 1, from: None, bytes: beacon };
    assert!(frames.borrow().contains(&outside), "{frames:?}");
}

#[test]
fn a_stopped_script_keeps_its_fault_and_other_robots_continue() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        2,
        "n = 0 function step() { n = n + 1  if(id == 1 and n == 3) log(nil + n)  log(n) }",
    );
    for _ in 0..5 {
        swarm.try_step();
    }
    let codes: Vec<_> = swarm.faults().iter().map(|fault| fault.map(|fault| fault.code)).collect();
    assert_eq!(codes, [Some(FaultCode::WrongType), None]);
    assert_eq!(swarm.last(), ["2", "5"]);
}
