//! A fault ends what caused it: a listener's or handler's call, or the run of the script, which starts again. The robot
//! goes on with its neighbors in every case.

use bittybuzz_testkit::{Program, SIZES, Swarm, TestRobot, in_both_profiles};
use bittybuzz_vm_core::message::{FrameKind, Message};
use bittybuzz_vm_core::number::{Profile, Tiny};
use bittybuzz_vm_core::{Entry, FaultCode, Image};
use std::cell::Cell;
use std::rc::Rc;

/// Robot 2 sends nil where robot 1 expects a number, every second step.
const SUM: &str = "sum = 0
    t = 0
    function init() { neighbors.listen(\"x\", function(topic, value, robot) { sum = sum + value }) }
    function step() {
        t = t + 1
        if(id == 2) { if(t % 2 == 0) neighbors.broadcast(\"x\", nil) else neighbors.broadcast(\"x\", 1) }
        log(sum)
    }";

in_both_profiles!(a_fault_in_a_listener_drops_its_message, drops_the_message);
fn drops_the_message<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(2, SUM);
    swarm.steps(11);
    assert_eq!(swarm.last(), ["5", "0"]);
    assert_eq!(swarm.robots[0].counters().failed, 5);
    let contained = &swarm.robots[0].host.contained;
    assert_eq!(contained.len(), 5);
    assert!(contained.iter().all(|fault| fault.code == FaultCode::WrongType));
    assert!(contained[0].position > 0, "the place in the listener is known");
    assert_eq!(swarm.robots[0].host.contained_calls, [1; 5], "nothing has called the listener");
    assert_eq!(swarm.robots[1].counters().failed, 0);
}

in_both_profiles!(
    messages_after_the_one_that_failed_are_handled_in_the_same_step,
    handles_the_rest
);
fn handles_the_rest<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        4,
        "sum = 0
         function init() { neighbors.listen(\"x\", function(topic, value, robot) { sum = sum + value }) }
         function step() {
            if(id == 2) neighbors.broadcast(\"x\", \"poison\")
            if(id > 2) neighbors.broadcast(\"x\", id)
            log(sum)
         }",
    );
    swarm.steps(2);
    assert_eq!(swarm.last()[0], "7");
}

in_both_profiles!(a_listener_that_calls_too_deep_ends_alone, recovers_the_stack);
fn recovers_the_stack<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        2,
        "n = 0
         function deep(x) { return 1 + deep(x) }
         function init() { neighbors.listen(\"x\", function(topic, value, robot) {
            n = n + 1
            var t = {.a = {.b = n}}
            deep(t)
         }) }
         function step() { neighbors.broadcast(\"x\", 1)  var t = {.a = 1}  log(n + t.a) }",
    );
    swarm.steps(5);
    assert_eq!(swarm.last(), ["5", "5"]);
    assert_eq!(swarm.robots[0].host.contained[0].code, FaultCode::StackOverflow);
}

in_both_profiles!(the_higher_robot_wins_a_conflict_whose_handler_faults, default_rule);
fn default_rule<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        3,
        "lost = 0
         function init() {
            s = stigmergy.create(1)
            s.onconflict(function(key, local, remote) { return local + remote })
            s.onconflictlost(function(key, mine) { lost = mine.data })
            s.put(\"k\", id * 10)
         }
         function step() { log(s.get(\"k\"), \" \", lost) }",
    );
    swarm.steps(20);
    assert_eq!(swarm.last(), ["30 10", "30 20", "30 0"]);
    assert!(swarm.robots[0].counters().failed > 0);
}

in_both_profiles!(
    a_conflict_whose_handler_returns_what_cannot_be_sent_falls_to_the_higher_robot,
    unsendable_verdict
);
fn unsendable_verdict<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        3,
        "function init() {
            s = stigmergy.create(1)
            s.onconflict(function(key, local, remote) { return {.robot = local.robot, .data = math} })
            s.put(\"k\", id * 10)
         }
         function step() { log(s.get(\"k\")) }",
    );
    swarm.steps(20);
    assert_eq!(swarm.last(), ["30"; 3]);
    let contained = &swarm.robots[0].host.contained;
    assert!(
        contained.iter().all(|fault| fault.code == FaultCode::NotSendable) && !contained.is_empty()
    );
}

// The stamp of the other robot waits while the handler runs, and its digest is part of it: replicas that differ in that
// only would send entries for ever.
in_both_profiles!(a_conflict_about_tables_whose_handler_faults_converges, tables_in_conflict);
fn tables_in_conflict<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        3,
        "function init() {
            s = stigmergy.create(1)
            s.onconflict(function(key, local, remote) { var x = {.a = 1} return x + remote })
            s.put(\"k\", {.a = id, .b = {.c = id}})
         }
         function step() { var k = s.get(\"k\") log(k.a, k.b.c) }",
    );
    swarm.steps(60);
    assert_eq!(swarm.last(), ["33"; 3]);
    let others = Rc::new(Cell::new(0));
    let count = others.clone();
    swarm.air.observe = Box::new(move |frame| {
        let is_beacon =
            matches!(FrameKind::of(frame.bytes[0]), Some(FrameKind::Beacon | FrameKind::Digest));
        count.set(count.get() + u32::from(!is_beacon));
    });
    swarm.steps(100);
    assert_eq!(others.get(), 0, "frames that are no beacons");
}

in_both_profiles!(a_fault_in_onconflictlost_changes_nothing_else, lost_handler);
fn lost_handler<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        2,
        "function init() {
            s = stigmergy.create(1)
            s.onconflictlost(function(key, mine) { return nil + 1 })
            s.put(\"k\", id * 10)
         }
         function step() { log(s.get(\"k\")) }",
    );
    swarm.steps(10);
    assert_eq!(swarm.last(), ["20", "20"]);
    assert_eq!(swarm.robots[0].counters().failed, 1);
}

in_both_profiles!(a_failed_assert_stops_the_script_in_a_listener_too, assert_stops);
fn assert_stops<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        2,
        "function init() { neighbors.listen(\"x\", function(t, value, r) { assert(value > 3) }) }
         function step() { if(id == 2) neighbors.broadcast(\"x\", 1) }",
    );
    swarm.step();
    let fault = swarm.robots[0].step().expect_err("the assertion fails");
    assert_eq!(fault.code, FaultCode::AssertFailed);
    assert!(swarm.robots[0].host.contained.is_empty());
}

in_both_profiles!(a_fault_in_a_step_is_not_contained, step_fault);
fn step_fault<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        2,
        "heard = 0
         function init() { neighbors.listen(\"x\", function(t, value, r) { heard = value }) }
         function step() { neighbors.broadcast(\"x\", nil)  log(heard + 1) }",
    );
    swarm.step();
    let fault = swarm.robots[0].step().expect_err("nil + 1");
    assert_eq!(fault.code, FaultCode::WrongType);
    assert_eq!(swarm.robots[0].counters().failed, 0);
}

/// Robot 1 divides by a number that robot 2 sends.
const FRAGILE: &str = "n = 0
    c = 0
    function init() {
        s = stigmergy.create(1)
        w = swarm.create(3)
        w.join()
        neighbors.listen(\"x\", function(topic, value, robot) { n = value })
    }
    function step() {
        c = c + 1
        if(id == 1) s.put(\"a\", c)
        if(id == 2) { neighbors.broadcast(\"x\", 5)  s.put(\"b\", c) }
        if(c == 6) { if(id == 1) c = c / (n - 5) }
        log(c, \" \", n, \" \", s.get(\"a\"), \" \", s.get(\"b\"), \" \", neighbors.count())
    }";

in_both_profiles!(a_restart_clears_globals_and_keeps_entries, restart);
fn restart<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(3, FRAGILE);
    swarm.steps(5);
    let robot = &mut swarm.robots[0];
    let fault = robot.step().expect_err("a division by zero");
    assert_eq!(fault.code, FaultCode::DivisionByZero);
    robot.rest();
    let before = robot.host.logs().len();
    // In the pause the robot handles messages without listeners; the script does not run.
    swarm.steps(20);
    assert_eq!(swarm.robots[0].host.logs().len(), before);
    assert!(swarm.last()[2].ends_with(" 2"), "the resting robot is a neighbor by its beacons");
    swarm.robots[0].start().expect("it starts again");
    swarm.step();
    // `c` counts from zero again, and the entry of robot 2 is known at once.
    assert_eq!(swarm.last()[0], "1 5 1 25 2");
    swarm.steps(4);
    // The puts after the restart are the later ones everywhere, since the clock went on.
    let last = swarm.last();
    let received = last[2].split(' ').nth(2);
    assert_eq!(received, Some("4"), "{:?}", swarm.last());
}

in_both_profiles!(a_robot_in_a_pause_relays_entries, relays);
fn relays<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(3, FRAGILE);
    // A row: robot 1 stands between the others.
    swarm.air.reaches = Box::new(|from, to| from == 0 || to == 0);
    swarm.steps(5);
    swarm.robots[0].step().expect_err("a division by zero");
    swarm.robots[0].rest();
    swarm.steps(40);
    let relayed = swarm.last()[2].split(' ').nth(3).and_then(|b| b.parse::<i32>().ok());
    assert!(relayed.is_some_and(|b| b > 30), "{:?}", swarm.last());
}

in_both_profiles!(a_script_without_neighbors_runs_no_steps_in_a_pause, lonely);
fn lonely<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        1,
        "n = 0
         function step() { n = n + 1  log(n)  if(n == 2) n = nil + 1 }",
    );
    swarm.step();
    swarm.robots[0].step().expect_err("nil + 1");
    swarm.robots[0].rest();
    assert!(!swarm.robots[0].vm.begin(Entry::Step));
    swarm.steps(5);
    assert_eq!(swarm.robots[0].host.logs(), ["1", "2"]);
    swarm.robots[0].start().expect("it starts again");
    swarm.step();
    assert_eq!(swarm.robots[0].host.logs(), ["1", "2", "1"]);
}

in_both_profiles!(a_second_create_still_empties_the_replica, second_create);
fn second_create<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        1,
        "function init() {
            s = stigmergy.create(1)
            log(s.size())
            s.put(\"k\", 1)
            s = stigmergy.create(1)
            log(s.size())
            s.put(\"k\", 2)
         }",
    );
    swarm.step();
    swarm.robots[0].rest();
    swarm.robots[0].start().expect("init() runs again");
    assert_eq!(swarm.robots[0].host.logs(), ["0", "0", "1", "0"]);
}

in_both_profiles!(a_restart_leaves_all_swarms, leaves);
fn leaves<P: Profile>() {
    let mut swarm: Swarm<P> = Swarm::new(
        1,
        "function init() {
           v = stigmergy.create(1)
           s = swarm.create(1)
           if(isnil(v.get(1))) s.join()
           v.put(1, 1)
         }
         function step() { log(s.in()) }",
    );
    let robot = &mut swarm.robots[0];
    robot.step().expect("no fault");
    robot.rest();
    robot.start().expect("no fault");
    robot.step().expect("no fault");
    assert_eq!(robot.host.logs(), ["1", "0"]);
}

/// Entries and clocks of a script are nothing to the next one.
#[test]
fn another_script_starts_without_entries() {
    let image = |script: &str| Program::new::<Tiny>(script).leak();
    let before = "function init() {
            s = stigmergy.create(1)
            var i = 0
            while(i < 9) { s.put(2, i) i = i + 1 }
            t = stigmergy.create(2)
            t.put(1, 1)
        }
        function step() {}";
    let after = "function init() { s = stigmergy.create(0) s.put(4, 5) }
        function step() { log(s.size()) }";
    let mut robot: TestRobot<Tiny> = TestRobot::new(image(before), 1, SIZES);
    (0..10).for_each(|_| robot.step().expect("no fault"));
    robot.take_sent();
    robot.vm.load(Image::new(image(after)), |_| true).expect("the image is sound");
    robot.start().expect("no fault");
    let mut sent = robot.take_sent();
    for _ in 0..50 {
        robot.step().expect("no fault");
        sent.extend(robot.take_sent());
    }
    assert_eq!(robot.host.last_log(), Some("1".to_owned()));
    let script = robot.script();
    let entries = sent.iter().filter_map(|frame| match Message::<Tiny>::decode(frame, script) {
        Ok(Message::Entry(entry)) => Some((entry.stigmergy, entry.key.as_int(), entry.clock)),
        _ => None,
    });
    let entries: Vec<(u16, Option<i32>, u32)> = entries.collect();
    assert!(!entries.is_empty());
    assert!(entries.iter().all(|entry| *entry == (0, Some(4), 1)), "{entries:?}");
}
