//! Conflicts that a handler decides: how often it may, whose entry it chooses, and what it may return.

use bittybuzz_testkit::{SIZES, Swarm, TestRobot};
use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::{Message, StigmergyEntry};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use std::cell::Cell;
use std::rc::Rc;

/// An entry of key 1 in stigmergy 1 whose value is its owner.
fn entry<P: Profile>(owner: u16, clock: u32) -> Message<'static, P> {
    let value = Value::int(owner.into());
    Message::Entry(StigmergyEntry { stigmergy: 1, owner, clock, key: Value::int(1), value })
}

/// The conflicts that each robot's handler left to the order of stamps.
fn undecided<P: Profile>(swarm: &Swarm<P>) -> Vec<u16> {
    swarm.robots.iter().map(|robot| robot.counters().undecided).collect()
}

/// A handler chooses against the order of stamps a hundred times for one key and clock, and then for the next clock again.
#[test]
fn a_handler_chooses_a_hundred_times() {
    let script = "function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) {
             if(local.robot < remote.robot) return local
             return remote
           })
         }
         function step() { log(v.get(1)) }";
    let mut swarm: Swarm<Tiny> = Swarm::new(1, script);
    swarm.step();
    let mut undecided = 0;
    for clock in [5, 6] {
        for owner in (1..=300).rev().step_by(2) {
            let frame = swarm.robots[0].frame(&entry(owner, clock));
            swarm.inject(&frame, [0]);
            swarm.step();
            // The first one meets none of this clock.
            let choices = (300 - owner) / 2;
            let expected = if choices <= 100 { owner } else { 100 };
            assert_eq!(swarm.last(), [expected.to_string()], "clock {clock}, from {owner}");
            undecided += u16::from(choices > 100);
            assert_eq!(swarm.robots[0].counters().undecided, undecided, "clock {clock}, {owner}");
        }
    }
}

/// Tables that the handler makes from both are merged values, too.
#[test]
fn tables_are_merged() {
    fn run<P: Profile>() {
        let mut swarm: Swarm<P> = Swarm::new(
            2,
            "function init() {
               v = stigmergy.create(1)
               v.onconflict(function(key, local, remote) {
                 return {.data = {.n = local.data.n + remote.data.n}}
               })
               v.put(1, {.n = id})
             }
             function step() { log(v.get(1).n) }",
        );
        // Robots collect whenever they can.
        for robot in &mut swarm.robots {
            robot.vm.torture.collect_always = true;
        }
        swarm.step();
        swarm.steps(60);
        let last = swarm.last();
        assert_eq!(last[0], last[1]);
        // Both may merge, and merge the results.
        assert!(["3", "6", "12", "24"].contains(&last[0].as_str()), "{last:?}");
    }
    run::<Tiny>();
    run::<Full>();
}

/// A handler may return a value of one of the entries without the robot that put it.
#[test]
fn a_value_stands_for_its_entry() {
    for greatest in ["local.data > remote.data", "local.data < remote.data"] {
        let mut swarm: Swarm<Tiny> = Swarm::new(
            3,
            &format!(
                "function init() {{
                   v = stigmergy.create(1)
                   v.onconflict(function(key, local, remote) {{
                     var x = remote.data
                     if({greatest}) x = local.data
                     return {{.data = x}}
                   }})
                   v.put(1, (id + 1) % 3)
                 }}
                 function step() {{ v.foreach(function(key, value, robot) {{ log(value, \" \", robot) }}) }}"
            ),
        );
        swarm.steps(20);
        // Values 2, 0, 1 of the robots 1, 2, 3; a merged value would name the robot that merged it.
        let expected = if greatest.contains('>') { "2 1" } else { "0 2" };
        assert_eq!(swarm.last(), [expected; 3], "{greatest}");
    }
}

/// Of two equal values the handler says whose entry stays.
#[test]
fn of_equal_values_one_stays() {
    for (choice, expected) in [("<", "5 1"), (">", "5 2")] {
        let mut swarm: Swarm<Tiny> = Swarm::new(
            2,
            &format!(
                "function init() {{
                   v = stigmergy.create(1)
                   v.onconflict(function(key, local, remote) {{
                     if(local.robot {choice} remote.robot) return local
                     return remote
                   }})
                   v.put(1, 5)
                 }}
                 function step() {{ v.foreach(function(key, value, robot) {{ log(value, \" \", robot) }}) }}"
            ),
        );
        swarm.steps(20);
        assert_eq!(swarm.last(), [expected; 2], "{choice}");
        assert_eq!(undecided(&swarm), [0, 0], "{choice}");
    }
}

/// A handler that always returns the other robot's entry gives two robots each other's values. The order decides then, and the robot
/// that asked twice counts it.
#[test]
fn a_handler_that_always_returns_the_other_entry_is_undecided() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        2,
        "function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) { return remote })
           v.put(1, id)
         }
         function step() { log(v.get(1)) }",
    );
    swarm.steps(20);
    assert_eq!(swarm.last(), ["2", "2"]);
    let [first, second] = undecided(&swarm)[..] else { panic!("two robots") };
    assert!(first == 0 && second > 0, "{first} {second}");
}

/// A put in the handler of one robot is later than the conflict, which is over then.
#[test]
fn a_put_in_one_handler_ends_the_conflict() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        2,
        "function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) {
             if(id == 2) v.put(key, 99)
             if(local.robot < remote.robot) return local
             return remote
           })
           v.put(1, id)
         }
         function step() { log(v.get(1)) }",
    );
    swarm.steps(20);
    assert_eq!(swarm.last(), ["99", "99"]);
    assert_eq!(undecided(&swarm), [0, 0]);
}

/// The order decides, which is no choice of the handler, where it ends with a fault.
#[test]
fn a_handler_that_fails_is_not_undecided() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        2,
        "function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) { return local + remote })
           v.put(1, id)
         }
         function step() { log(v.get(1)) }",
    );
    swarm.steps(20);
    assert_eq!(swarm.last(), ["2", "2"]);
    let counters = swarm.robots[0].counters();
    assert!(counters.failed > 0);
    assert_eq!(counters.undecided, 0);
}

/// The entry that a handler has chosen is the one that its robot has put, with its digest: replicas are equal to those that have
/// seen no conflict.
#[test]
fn the_winner_is_the_entry_that_was_put() {
    fn run<P: Profile>(value: &str) {
        let script = format!(
            "function init() {{
               v = stigmergy.create(1)
               v.onconflict(function(key, local, remote) {{
                 if(local.robot > remote.robot) return local
                 return remote
               }})
               if(id < 3) v.put(-1, {value})
             }}
             function step() {{}}"
        );
        let digest = |other: u16| {
            let mut swarm: Swarm<P> = Swarm::new(2, &script);
            // The lower id is the one that loses, or puts nothing.
            swarm.robots[0].vm.set_robot_id(other, 5);
            let digest = Rc::new(Cell::new([0; 2]));
            let seen = digest.clone();
            let script = swarm.robots[0].script();
            swarm.air.observe = Box::new(move |frame| {
                if let Ok(Message::Digest { digest, .. }) =
                    Message::<P>::decode(&frame.bytes, script)
                    && let Some(from) = frame.from
                {
                    let mut both = seen.get();
                    both[from] = digest;
                    seen.set(both);
                }
            });
            swarm.steps(5);
            digest.set([0; 2]);
            swarm.steps(60);
            digest.get()
        };
        let [first, second] = digest(3);
        assert!(first == second && first != 0, "{value}: {first} {second}");
        assert_eq!(digest(1), [first; 2], "{value}, {}", P::NAME);
    }
    for value in ["id", "{.n = id}", "{.n = id, .m = {.k = 5}}"] {
        run::<Tiny>(value);
        run::<Full>(value);
    }
}

/// Values of the entries are kept while the handler gets them, whenever the memory is collected.
#[test]
fn a_handler_gets_tables_whole() {
    fn run<P: Profile, const SLOTS: usize>(is_wide: bool) {
        let mut swarm: Swarm<P, &'static [u8], SLOTS> = Swarm::with_sizes(
            2,
            "n = 0
             function init() {
               v = stigmergy.create(1)
               v.onconflict(function(key, local, remote) {
                 n = 100 * local.data.t.k + 10 * remote.data.t.k + local.timestamp
                 if(local.robot < remote.robot) return local
                 return remote
               })
               v.onconflictlost(function(key, mine) { n = n + 1000 * mine.data.t.k })
               v.put(1, {.t = {.k = id}})
             }
             function step() { log(n, \" \", v.get(1).t.k) }",
            SIZES,
        );
        for robot in &mut swarm.robots {
            robot.vm.torture.collect_always = true;
            if is_wide {
                TestRobot::pause(robot);
            }
        }
        swarm.steps(20);
        assert_eq!(swarm.last(), ["211 1", "2121 1"], "{} {SLOTS}", P::NAME);
    }
    run::<Tiny, 600>(false);
    run::<Full, 600>(false);
    run::<Full, 6000>(true);
}
