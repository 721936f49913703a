//! Every function of `neighbors`, `swarm` and `stigmergy`, between two and more robots.

use bittybuzz_testkit::Swarm;
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

/// Runs a script on robots with ids 1, 2, ..., in both profiles, and compares what each printed last.
fn last(robots: usize, steps: usize, script: &str, expected: &[&str]) {
    fn run<P: Profile>(robots: usize, steps: usize, script: &str, expected: &[&str]) {
        let mut swarm: Swarm<P> = Swarm::new(robots, script);
        swarm.steps(steps);
        assert_eq!(swarm.last(), expected, "{}: {script}", P::NAME);
    }
    run::<Tiny>(robots, steps, script, expected);
    run::<Full>(robots, steps, script, expected);
}

mod neighbors {
    use super::last;

    #[test]
    fn a_broadcast_reaches_the_listeners_of_all_others() {
        last(
            3,
            2,
            "heard = 0
             function init() { neighbors.listen(\"x\", function(topic, value, id) { heard = heard + value + id }) }
             function step() { log(heard)  if(id == 2) neighbors.broadcast(\"x\", 40) }",
            &["42", "0", "42"],
        );
    }

    #[test]
    fn topic_and_value_keep_their_types() {
        last(
            2,
            2,
            "function init() { neighbors.listen(\"t\", function(topic, value, id) {
                 log(topic, \" \", type(value), \" \", value, \" \", id)
             }) }
             function step() { if(id == 2) neighbors.broadcast(\"t\", \"word\") else log(\"silent\") }",
            &["silent", ""],
        );
        last(
            2,
            2,
            "function init() { neighbors.listen(\"t\", function(topic, value, id) {
                 log(topic, \" \", type(value), \" \", value, \" \", id)
             }) }
             function step() {
               if(id == 2) {
                 neighbors.broadcast(\"t\", 0 - 7)
                 neighbors.broadcast(\"t\", 2.5)
                 neighbors.broadcast(\"t\", nil)
                 neighbors.broadcast(\"t\", \"word\")
               }
             }",
            &["t string word 2", ""],
        );
    }

    #[test]
    fn ignore_ends_listening() {
        last(
            2,
            4,
            "heard = 0
             t = 0
             function init() { neighbors.listen(\"x\", function(t, v, r) { heard = heard + 1 }) }
             function step() {
               t = t + 1
               neighbors.broadcast(\"x\", 1)
               log(heard)
               if(t == 3) neighbors.ignore(\"x\")
             }",
            &["2", "2"],
        );
    }

    #[test]
    fn a_robot_that_says_nothing_is_a_neighbour_by_its_beacons() {
        last(3, 7, "function step() { log(neighbors.count()) }", &["2", "2", "2"]);
    }

    #[test]
    fn who_is_not_heard_any_more_is_forgotten() {
        use super::{Swarm, Tiny};
        let mut swarm: Swarm<Tiny> = Swarm::new(2, "function step() { log(neighbors.count()) }");
        swarm.steps(20);
        assert_eq!(swarm.last(), ["1", "1"]);
        swarm.air.reaches = Box::new(|_, _| false);
        swarm.steps(4);
        assert_eq!(swarm.last(), ["1", "1"]);
        swarm.steps(11);
        assert_eq!(swarm.last(), ["0", "0"]);
        swarm.air.reaches = Box::new(|_, _| true);
        swarm.steps(7);
        assert_eq!(swarm.last(), ["1", "1"]);
    }

    /// The robots stand in a row, 10 mm from one to the next.
    const TELL: &str = "function step() {
        neighbors.broadcast(\"here\", 1)
        report()
    }\n";

    fn reported(function: &str, expected: &[&str]) {
        last(3, 3, &format!("{TELL}function report() {{ {function} }}"), expected);
    }

    #[test]
    fn get_tells_where_a_neighbour_is() {
        reported(
            "var n = neighbors.get(3)
             if(isnil(n)) log(\"nobody\")
             else log(n.distance, \" \", n.azimuth, \" \", n.elevation, \" \", size(n))",
            &["20.0 0.0 0.0 3", "10.0 0.0 0.0 3", "nobody"],
        );
    }

    #[test]
    fn foreach_goes_by_ascending_id() {
        reported(
            "var all = {.text = 0}
             neighbors.foreach(function(id, data) { all.text = all.text * 10 + id })
             log(all.text)",
            &["23", "13", "12"],
        );
    }

    #[test]
    fn reduce_folds() {
        reported(
            "log(neighbors.reduce(function(id, data, sum) { return sum + data.distance }, 0.5))",
            &["30.5", "20.5", "30.5"],
        );
    }

    #[test]
    fn map_keeps_what_the_function_returns() {
        reported(
            "var m = neighbors.map(function(id, data) { return id * 2 })
             log(m.count(), \" \", m.get(1), \" \", m.get(2), \" \", m.reduce(function(id, v, a) { return a + v }, 0))",
            &["2 nil 4 10", "2 2 nil 8", "2 2 4 6"],
        );
    }

    #[test]
    fn filter_keeps_those_for_which_it_is_true() {
        reported(
            "var near = neighbors.filter(function(id, data) { return data.distance < 15 })
             var s = near.map(function(id, data) { return id + 0.5 })
             log(near.count(), \" \", s.reduce(function(id, v, a) { return a + v }, 0.0))",
            &["1 2.5", "2 5.0", "1 2.5"],
        );
    }

    #[test]
    fn snapshots_last_and_know_all_their_functions() {
        reported(
            "if(isnil(kept)) {
               if(neighbors.count() == 2) kept = neighbors.filter(function(id, data) { return 1 })
               return
             }
             var seen = {.n = 0}
             kept.foreach(function(id, data) { seen.n = seen.n * 10 + id })
             var far = kept.filter(function(id, data) { return data.distance > 15 })
             log(type(kept), size(kept), \" \", seen.n, \" \", far.count())",
            &["table2 23 1", "table2 13 0", "table2 12 1"],
        );
    }

    #[test]
    fn outside_of_swarms_all_are_kin() {
        reported(
            "log(neighbors.kin().count(), \" \", neighbors.nonkin().count())",
            &["2 0", "2 0", "2 0"],
        );
    }

    #[test]
    fn functions_are_values() {
        last(
            2,
            2,
            "heard = 0
             function init() {
               n = neighbors
               hear = n.listen
               hear(\"x\", function(t, v, r) { heard = v })
               tell = neighbors.broadcast
             }
             function step() {
               tell(\"x\", 10 + id)
               var count = n.count
               var all = n.filter(function(i, d) { return 1 })
               var size_of = all.count
               log(heard, \" \", count(), \" \", size_of())
             }",
            &["12 1 1", "11 1 1"],
        );
    }

    #[test]
    fn inside_a_listener_the_sender_is_a_neighbour() {
        last(
            2,
            2,
            "function init() { neighbors.listen(\"x\", function(t, v, r) {
               log(neighbors.get(r).distance)
             }) }
             function step() { if(id == 2) neighbors.broadcast(\"x\", 1) }",
            &["10.0", ""],
        );
    }
}

mod swarms {
    use super::last;

    #[test]
    fn membership_is_heard_by_others() {
        last(
            3,
            4,
            "function init() {
               s = swarm.create(7)
               s.select(id != 2)
             }
             function step() {
               neighbors.broadcast(\"here\", 1)
               s.exec(function() { log(neighbors.kin().count(), \" \", neighbors.nonkin().count(), \" \", swarm.id()) })
               if(not s.in()) log(\"out \", swarm.id())
             }",
            &["1 1 7", "out nil", "1 1 7"],
        );
    }

    #[test]
    fn leaving_is_heard_too() {
        last(
            2,
            8,
            "t = 0
             function init() { s = swarm.create(1)  s.join() }
             function step() {
               t = t + 1
               neighbors.broadcast(\"here\", 1)
               if(t == 5 and id == 2) s.leave()
               s.exec(function() { log(neighbors.kin().count()) })
             }",
            &["0", "1"],
        );
    }

    #[test]
    fn sets_of_swarms() {
        last(
            4,
            1,
            "function init() {
               a = swarm.create(1)  a.select(id <= 2)
               b = swarm.create(2)  b.select(id == 2 or id == 3)
               u = swarm.union(3, a, b)
               i = swarm.intersection(4, a, b)
               d = swarm.difference(5, a, b)
               o = a.others(6)
             }
             function step() { log(u.in(), i.in(), d.in(), o.in(), \" \", u.id, i.id, d.id, o.id) }",
            &["1010 3456", "1100 3456", "1001 3456", "0001 3456"],
        );
    }

    #[test]
    fn exec_returns_the_value_and_nests() {
        last(
            1,
            1,
            "function step() {
               var a = swarm.create(1)
               var b = swarm.create(2)
               a.join()  b.join()
               var x = a.exec(function() {
                 return b.exec(function() { return swarm.id() * 100 + swarm.id(1) * 10 })
               })
               b.unselect(0)
               var still = b.in()
               b.unselect(1)
               log(x, \" \", isnil(b.exec(function() { return 1 })), still, b.in(), isnil(swarm.id()))
             }",
            &["210 1101"],
        );
    }

    #[test]
    fn methods_are_values_bound_to_their_swarm() {
        last(
            1,
            1,
            "function step() {
               var a = swarm.create(1)
               var b = swarm.create(2)
               var t = {}
               t.join = a.join
               t.join()
               var is_in = b.in
               foreach({.1 = 1}, b.select)
               log(a.in(), is_in(), swarm.create(1).in())
             }",
            &["111"],
        );
    }
}

mod stigmergy {
    use super::last;
    use super::{Full, Swarm, Tiny};

    #[test]
    fn what_one_puts_all_get() {
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
    fn at_equal_clocks_the_higher_robot_wins_and_the_other_is_told() {
        last(
            3,
            6,
            "lost = 0
             function init() {
               v = stigmergy.create(1)
               v.onconflictlost(function(key, mine) { lost = mine.robot * 100 + mine.data * 10 + mine.timestamp })
               v.put(\"k\", id)
             }
             function step() { log(v.get(\"k\"), \" \", lost) }",
            &["3 111", "3 221", "3 0"],
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
        assert_eq!(swarm.last(), ["1", "2"]);
        for robot in &mut swarm.robots {
            assert!(robot.counters().undecided > 0);
        }
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

    #[test]
    fn create_again_empties_and_keeps_handlers() {
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
    fn a_question_is_answered() {
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
    fn a_full_store_passes_on() {
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
    fn an_own_key_too_many_is_a_fault() {
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
}

mod long {
    use super::{Full, Profile, Swarm, Tiny, last};

    #[test]
    fn a_table_is_broadcast_in_fragments() {
        // In tiny these are 48 bytes, the most that there are.
        last(
            2,
            3,
            "function init() { neighbors.listen(\"t\", function(topic, v, r) {
               log(topic, v.a, \" \", v[0], v[1], \" \", v.deep.er[5], \" \", v.none, \" \", size(v), \" \", v.f(3))
             }) }
             function twice(x) { return 2 * x }
             function step() {
               if(id == 1) { return }
               neighbors.broadcast(\"t\", {.a = 1, .0 = 10, .1 = \"word\", .deep = {.er = {.5 = 7}}, .f = twice})
             }",
            &["t1 10word 7 nil 5 6", ""],
        );
    }

    #[test]
    fn a_stigmergy_keeps_a_copy() {
        last(
            3,
            8,
            "t = {.x = 1}
             n = 0
             function init() { v = stigmergy.create(70)  if(id == 1) v.put(2.5, t) }
             function step() {
               n = n + 1
               if(id == 1) t.x = 5
               if(n == 4 and id == 3) v.put(2.5, {.x = v.get(2.5).x + 1})
               if(not isnil(v.get(2.5))) log(v.get(2.5).x, \" \", v.size())
             }",
            &["2 1"; 3],
        );
    }

    /// With the tables in it, and in its order: at the robot that put it, and at one that has received it. A change of the
    /// copy is none of the entry.
    #[test]
    fn a_copy_has_everything_in_its_order() {
        fn run<P: Profile>() {
            let mut swarm: Swarm<P> = Swarm::new(
                2,
                "function show(k, e) { if(type(e) == \"table\") foreach(e, show) else log(k, \" \", e) }
                 t = {.c = {.d = {.e = 2}}, .8 = 3}
                 function init() {
                   v = stigmergy.create(1)
                   for(i = 0, i < 9, i = i + 1) t[i] = i + 10
                   for(i = 1, i < 8, i = i + 1) t[i] = nil
                   foreach(t, show)
                   if(id == 1) v.put(1, t)
                 }
                 function step() {
                   var copy = v.get(1)
                   if(isnil(copy)) { return }
                   foreach(copy, show)
                   copy.c.d.e = 7
                   copy.c.d.f = {}
                   copy[0] = nil
                 }",
            );
            swarm.steps(8);
            for log in swarm.logs() {
                assert!(log.len() > 12, "{log:?}");
                for entries in log.chunks(3) {
                    assert_eq!(entries, ["0 10", "e 2", "8 18"], "{}: {log:?}", P::NAME);
                }
            }
        }
        run::<Tiny>();
        run::<Full>();
    }

    #[test]
    fn a_lost_fragment_is_made_up_for_by_the_next_advertisement() {
        let mut swarm: Swarm<Tiny> = Swarm::new(
            2,
            "function init() { v = stigmergy.create(1)  if(id == 1) v.put(1, {.a = 1, .b = 2, .c = 3}) }
             function step() { if(isnil(v.get(1))) log(\"nothing\") else log(v.get(1).a + v.get(1).b + v.get(1).c) }",
        );
        // At random: where every other frame is lost, it may be the same fragment each time.
        swarm.air.loss = 0.5;
        swarm.steps(3);
        assert_eq!(swarm.last(), ["6", "nothing"]);
        swarm.steps(80);
        assert_eq!(swarm.last(), ["6", "6"]);
    }

    #[test]
    fn a_message_arrives_whatever_the_order_of_its_fragments() {
        let script = "function init() { neighbors.listen(\"x\", function(t, value, r) { log(value.a + value.b) }) }
             function step() { if(id == 2) neighbors.broadcast(\"x\", {.a = 1, .b = 2}) }";
        let mut sender: Swarm<Tiny> = Swarm::new(2, script);
        sender.robots[1].step().expect("it sends");
        let fragments = sender.robots[1].take_sent();
        assert_eq!(fragments.len(), 4);
        for order in 0..24 {
            let mut left = fragments.clone();
            let mut receiver: Swarm<Tiny> = Swarm::new(1, script);
            receiver.step();
            // One fragment per step, so that an early end is seen.
            for (count, logs) in [(4, 0), (3, 0), (2, 0), (1, 1)] {
                let next = left.remove(order / [0, 1, 1, 2, 6][count] % count);
                receiver.inject(&next, [0]);
                receiver.step();
                let expected = vec!["3".to_owned(); logs];
                assert_eq!(receiver.logs()[0], expected, "order {order}, {count} left");
            }
            assert_eq!(receiver.robots[0].counters().incomplete, 0, "order {order}");
        }
    }

    #[test]
    fn what_cannot_be_sent_is_a_fault_at_the_sender() {
        use bittybuzz_vm_core::FaultCode::{NotSendable, TooLong};
        for (value, expected) in [
            ("math", NotSendable),
            ("{.m = {.f = led}}", NotSendable),
            ("function() { return n }", NotSendable),
            ("{.a = {.a = {.a = {.a = 1, .b = 2, .c = 3, .d = 4, .e = 5, .f = 6, .g = 7, .h = 8, .i = 9, .j = 10,
              .k = 11, .l = 12, .m = 13, .n = 14, .o = 15, .p = 16, .q = 17, .r = 18, .s = 19, .t = 20}}}}", TooLong),
            ("endless", TooLong),
            // 49 bytes.
            ("{.a = 1, .b = 2, .c = 3, .d = 4, .e = 5, .f = 6, .g = {}}", TooLong),
        ] {
            let script = format!(
                "endless = {{}}
                 endless.self = endless
                 function step() {{ go(3) }}
                 function go(n) {{ neighbors.broadcast(\"t\", {value}) }}"
            );
            let mut swarm: Swarm<Tiny> = Swarm::new(1, &script);
            let fault = swarm.robots[0].step().expect_err(value);
            assert_eq!(fault.code, expected, "{value}");
        }
    }

    #[test]
    fn text_made_at_run_time_travels() {
        let mut swarm: Swarm<Full> = Swarm::new(
            2,
            "function init() {
               neighbors.listen(\"topic\", function(t, v, r) { log(t, \" \", v, \" \", v == \"known\") })
               v = stigmergy.create(1)
             }
             function step() {
               if(id == 1) { return }
               neighbors.broadcast(string.concat(\"to\", \"pic\"), string.concat(\"kn\", \"own\"))
               neighbors.broadcast(string.concat(\"to\", \"pic\"), string.concat(\"un\", \"heard of\"))
             }",
        );
        swarm.steps(2);
        assert_eq!(swarm.logs()[0], ["topic known 1", "topic unheard of 0"]);
    }

    #[test]
    fn a_message_for_which_there_is_no_memory_is_dropped() {
        let mut swarm: Swarm<Tiny> = Swarm::new(
            2,
            "kept = {}
             n = 0
             function init() { neighbors.listen(\"t\", function(t, v, r) { kept[n] = v  n = n + 1 }) }
             function step() { if(id == 2) neighbors.broadcast(\"t\", {.a = 1, .b = 2, .c = 3, .d = 4}) log(n) }",
        );
        swarm.steps(200);
        assert!(swarm.robots[0].counters().incomplete > 100);
    }
}

#[test]
fn duplicates_and_foreign_frames_do_no_harm() {
    let script = "heard = 0
        function init() { v = stigmergy.create(1)  neighbors.listen(\"x\", function(t, x, r) { heard = heard + 1 }) }
        function step() { v.put(\"k\", id)  neighbors.broadcast(\"x\", 1)  log(heard) }";
    let mut swarm: Swarm<Tiny> = Swarm::new(2, script);
    let mut other: Swarm<Tiny> = Swarm::new(2, &format!("{script}\nlog(\"other\")"));
    swarm.air.duplication = 1.0;
    swarm.step();
    assert_eq!(other.robots[1].step(), Ok(()));
    let frames = other.robots[1].take_sent();
    assert!(!frames.is_empty());
    let count = frames.len();
    for frame in frames {
        swarm.inject(&frame, [0]);
    }
    // Too short, of no type, nothing at all.
    for bad in [vec![0x20, 1], vec![0xff; 10], vec![]] {
        swarm.inject(&bad, [0]);
    }
    swarm.step();
    assert_eq!(swarm.last(), ["2", "2"]);
    let counters = swarm.robots[0].counters();
    assert_eq!(usize::from(counters.foreign), count);
    assert_eq!(counters.malformed, 3);
}
