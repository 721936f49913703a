//! `stigmergy`: puts, questions, conflicts and full stores.

use super::{Full, Swarm, Tiny, last};
use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::{Message, StigmergyEntry};

#[test]
fn a_put_reaches_all_robots() {
    last(
        3,
        4,
        "function init() { v = stigmergy.create(1)  if(id == 2) { v.put(\"a\", 5)  v.put(7, 2.5) } }
         function step() { log(v.get(\"a\"), \" \", v.get(7), \" \", v.size(), \" \", v.id) }",
        &["5 2.5 2 1"; 3],
    );
}

#[test]
fn the_later_put_wins_and_a_put_of_nil_deletes() {
    last(
        3,
        9,
        "t = 0
         function init() { v = stigmergy.create(2) }
         function step() {
           t = t + 1
           if(t == 1 and id == 1) v.put(\"a\", 1)
           if(t == 3 and id == 3) v.put(\"a\", v.get(\"a\") + 10)
           if(t == 3 and id == 2) v.put(\"b\", 1)
           if(t == 6 and id == 1) v.put(\"b\", nil)
           log(v.get(\"a\"), \" \", v.get(\"b\"), \" \", v.size())
         }",
        &["11 nil 1"; 3],
    );
}

#[test]
fn at_equal_clocks_the_higher_robot_wins_and_the_loser_is_notified() {
    last(
        3,
        6,
        "lost = 0
         function init() {
           v = stigmergy.create(1)
           v.onconflictlost(function(key, mine) {
             lost = key * 1000 + mine.robot * 100 + mine.data * 10 + mine.timestamp
           })
           v.put(7, id)
         }
         function step() { log(v.get(7), \" \", lost) }",
        &["3 7111", "3 7221", "3 0"],
    );
}

#[test]
fn a_handler_decides_a_conflict() {
    last(
        3,
        8,
        "function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) {
             if(local.data < remote.data) return local
             return remote
           })
           v.put(\"k\", 50 - id * id)
           w = stigmergy.create(2)
           w.put(\"k\", id)
         }
         function step() { log(v.get(\"k\"), \" \", w.get(\"k\")) }",
        &["41 3"; 3],
    );
}

/// A conflict is two puts at one clock; a put over a known one is none.
#[test]
fn handlers_are_called_for_conflicts_only() {
    last(
        2,
        40,
        "t = 0
         calls = 0
         function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) {
             calls = calls + 1
             if(local.data > remote.data) return local
             return remote
           })
         }
         function step() {
           t = t + 1
           if(t == id * 10) v.put(1, id)
           if(t == 30) v.put(2, id)
           log(v.get(1), \" \", calls)
         }",
        &["2 1", "2 1"],
    );
}

#[test]
fn a_handler_that_decides_nothing_is_counted() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        2,
        "function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) { return 5 })
           v.put(1, id)
         }
         function step() { log(v.get(1)) }",
    );
    swarm.steps(5);
    // The order of stamps decides, as without a handler.
    assert_eq!(swarm.last(), ["2", "2"]);
    for robot in &mut swarm.robots {
        assert!(robot.counters().undecided > 0);
    }
}

/// A choice that the order of stamps would not make is made again with the entries exchanged.
#[test]
fn an_unexpected_choice_is_asked_for_again() {
    last(
        2,
        8,
        "calls = 0
         values = 0
         function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) {
             calls = calls + 1
             if(calls <= 2) values = 100 * values + 10 * local.data + remote.data
             if(local.data < remote.data) return local
             return remote
           })
           v.put(\"k\", id)
         }
         function step() { log(v.get(\"k\"), \" \", values) }",
        &["1 1221", "1 2112"],
    );
}

/// A merged value is a put of its own, with a later clock: it ends the conflict where it arrives.
#[test]
fn a_merged_value_is_a_later_put() {
    last(
        2,
        20,
        "clock = 0
         function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) {
             clock = local.timestamp
             local.data = (local.data + remote.data) / 2
             return local
           })
           v.put(\"k\", 10 * id)
         }
         function step() { log(v.get(\"k\"), \" \", clock < 3) }",
        &["15 1", "15 1"],
    );
}

/// Tables are compared as values, not as the same table.
#[test]
fn a_chosen_table_is_not_a_merged_one() {
    last(
        2,
        20,
        "function init() {
           v = stigmergy.create(1)
           v.onconflict(function(key, local, remote) {
             if(local.data.n < remote.data.n) return local
             return remote
           })
           v.put(\"k\", { .n = 7 - id, .m = 1 })
         }
         function step() {
           v.foreach(function(key, value, robot) { log(value.n, \" \", robot) })
         }",
        &["5 2", "5 2"],
    );
}

#[test]
fn foreach_map_and_reduce() {
    last(
        2,
        3,
        "function init() {
           v = stigmergy.create(1)
           v.put(\"a\" , 10)
           v.put(id, id)
         }
         function step() {
           var t = {.n = 0}
           v.foreach(function(key, value, robot) { t.n = t.n + value * robot })
           var m = v.map(function(key, value, robot) { return value + robot })
           log(t.n, \" \", m[1], m[2], m.a, size(m), \" \", v.reduce(function(k, x, r, a) { return a + x }, 0))
         }",
        &["25 24123 13"; 2],
    );
}

/// Deleted keys are remembered for a while, and the keys of all stigmergies are stored next to each other.
#[test]
fn foreach_iterates_over_keys_with_values_of_one_stigmergy() {
    last(
        2,
        3,
        "function init() {
           v = stigmergy.create(1)
           w = stigmergy.create(2)
           w.put(1, 40)
           v.put(2, 5)
           v.put(3, 6)
           v.put(2, nil)
         }
         function step() {
           var t = {.n = 0, .m = 0}
           v.foreach(function(key, value, robot) { t.n = t.n * 10 + value })
           w.foreach(function(key, value, robot) { t.m = t.m * 10 + value })
           log(t.n, \" \", t.m)
         }",
        &["6 40"; 2],
    );
}

/// Keys and stigmergies that no frame of an entry has room for travel in fragments.
#[test]
fn keys_and_stigmergies_of_all_kinds_travel() {
    last(
        2,
        30,
        "function init() {
           v = stigmergy.create(1)
           w = stigmergy.create(300)
           if(id == 1) {
             v.put(1.5, 7)
             v.put(2.5, {.a = 8})
             w.put(1, 9)
           }
         }
         function step() {
           var t = v.get(2.5)
           if(not isnil(t)) log(v.get(1.5), \" \", t.a, \" \", w.get(1))
         }",
        &["7 8 9"; 2],
    );
}

#[test]
fn a_second_create_removes_entries_and_keeps_handlers() {
    last(
        2,
        12,
        "t = 0
         lost = 0
         function init() {
           v = stigmergy.create(1)
           v.onconflictlost(function(k, mine) { lost = 1 })
           if(id == 2) v.put(\"a\", 1)
         }
         function step() {
           t = t + 1
           if(t == 4 and id == 1) { w = stigmergy.create(1)  now = w.size() }
           if(t == 8) v.put(\"z\", id)
           log(v.size(), \" \", now, \" \", lost)
         }",
        &["2 0 1", "2 nil 0"],
    );
}

#[test]
fn a_query_is_answered() {
    use std::cell::Cell;
    use std::rc::Rc;
    let mut swarm: Swarm<Full> = Swarm::new(
        2,
        "function init() { v = stigmergy.create(1)  if(id == 2) v.put(\"a\", 5) }
         function step() { log(v.get(\"a\")) }",
    );
    let open = Rc::new(Cell::new(false));
    let is_open = open.clone();
    swarm.air.reaches = Box::new(move |_, _| is_open.get());
    swarm.steps(100);
    assert_eq!(swarm.last(), ["nil", "5"]);
    open.set(true);
    // The question in the first step, the answer in the second, and there it is in the third.
    swarm.steps(3);
    assert_eq!(swarm.last(), ["5", "5"]);
}

#[test]
fn a_full_store_relays_entries() {
    // Robot 2, between the others, is full with keys of a stigmergy that only it has.
    let mut swarm: Swarm<Tiny> = Swarm::new(
        3,
        "function init() {
           v = stigmergy.create(1)
           if(id == 2) {
             w = stigmergy.create(2)
             w.put(1, 1)  w.put(2, 1)  w.put(3, 1)  w.put(4, 1)
           }
           if(id == 1) v.put(\"far\", 9)
         }
         function step() { if(id == 3) log(v.get(\"far\")) else log(v.size()) }",
    );
    swarm.air.reaches = Box::new(|from, to| from.abs_diff(to) == 1);
    swarm.steps(40);
    assert_eq!(swarm.last()[2], "9");
    assert!(swarm.robots[1].counters().not_kept > 0);
}

#[test]
fn a_put_into_a_full_store_is_a_fault() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        1,
        "function init() { v = stigmergy.create(1) }
         i = 0
         function step() { i = i + 1  v.put(i, i)  log(i) }",
    );
    for _ in 0..4 {
        assert!(swarm.robots[0].step().is_ok());
    }
    let fault = swarm.robots[0].step().expect_err("there is no room");
    assert_eq!(fault.code, bittybuzz_vm_core::FaultCode::StoreFull);
    assert_eq!(swarm.last(), ["4"]);
}

#[test]
fn a_partition_heals() {
    use std::cell::Cell;
    use std::rc::Rc;
    let mut swarm: Swarm<Tiny> = Swarm::new(
        4,
        "t = 0
         function init() { v = stigmergy.create(1) }
         function step() {
           t = t + 1
           if(t == 5) v.put(\"k\", id)
           if(t == 8 and id == 1) v.put(\"k\", 100)
           log(v.get(\"k\"))
         }",
    );
    let healed = Rc::new(Cell::new(false));
    let is_healed = healed.clone();
    swarm.air.reaches = Box::new(move |from, to| is_healed.get() || (from < 2) == (to < 2));
    swarm.steps(60);
    assert_eq!(swarm.last(), ["100", "100", "4", "4"]);
    healed.set(true);
    swarm.steps(30);
    assert_eq!(swarm.last(), ["100"; 4]);
}

/// Two groups that both lack entries would wait for each other for ever.
#[test]
fn a_robot_that_may_lack_a_key_takes_it_though_the_floors_stay_different() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        1,
        "t = 0
         function init() { v = stigmergy.create(1) v.put(0, 1) v.put(0, nil) }
         function step() {
           t = t + 1
           if(t == 700) { v.put(1, 1) v.put(2, 1) v.put(3, 1) }
           if(t == 701) v.put(4, 1)
           if(t == 702) { v.put(3, nil) v.put(4, nil) }
           log(v.get(7))
         }",
    );
    swarm.steps(1400);
    let robot = &swarm.robots[0];
    let digest = Message::Digest { robot: 2, digest: 77, floor: 100 };
    let (key, value) = (Value::int(7), Value::int(5));
    // Not later than the deletion of key 0, whose place key 4 has taken.
    let entry = Message::Entry(StigmergyEntry { stigmergy: 1, owner: 2, clock: 2, key, value });
    let frames = [robot.frame(&digest), robot.frame(&entry)];
    let known = |swarm: &mut Swarm<Tiny>, rounds| {
        for _ in 0..rounds {
            frames.iter().for_each(|frame| swarm.inject(frame, [0]));
            swarm.steps(10);
        }
        swarm.last()
    };
    assert_eq!(known(&mut swarm, 5), ["nil"]);
    assert_eq!(known(&mut swarm, 50), ["5"]);
}
