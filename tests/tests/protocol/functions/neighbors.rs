//! `neighbors`: broadcasts, the table of neighbors, and its functions.

use super::{Full, Profile, Swarm, Tiny, last};
use bittybuzz_testkit::{Program, SIZES, TestRobot};
use bittybuzz_vm_core::message::{Message, topic_of};
use bittybuzz_vm_core::{FaultCode, Sighting, Sizes, Value};

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

/// Topics are equal if their texts are, however these were made: as a constant, or at run time with or without an equal
/// constant.
#[test]
fn equal_topics_are_equal_however_they_were_made() {
    let made = ["\"topic\"", "string.concat(\"to\", \"pic\")", "string.sub(\"a topic\", 2, 7)"];
    // Without the first, no constant of the script is equal.
    let only_made = ["string.concat(\"to\", \"pic\")", "string.concat(\"t\", \"opic\")"];
    let long = ["string.concat(a, a)", "string.concat(string.concat(a, \"\"), a)"];
    let pairs = |topics: &[&'static str]| {
        let all = topics.iter().flat_map(|one| topics.iter().map(move |other| [*one, *other]));
        all.collect::<Vec<[&str; 2]>>()
    };
    for [listened, sent] in [pairs(&made), pairs(&only_made), pairs(&long)].concat() {
        let script = format!(
            "a = \"a part of a topic that is longer than a cell\"
             t = 0
             function init() {{
               neighbors.listen({listened}, function(topic, value, r) {{ log(value, topic == {sent}) }})
             }}
             function step() {{
               t = t + 1
               # The collector runs before anything arrives.
               var waste = {{.x = {{}}}}
               waste.x = {{}}
               if(id == 2) neighbors.broadcast({sent}, t)
               if(t == 4) neighbors.ignore({sent})
             }}"
        );
        let mut swarm: Swarm<Full> = Swarm::new(2, &script);
        swarm.steps(8);
        assert_eq!(swarm.logs()[0], ["11", "21", "31"], "{listened} and {sent}");
    }
}

/// Another text is another topic, and a number is no topic.
#[test]
fn unequal_topics_are_unequal() {
    for [listened, sent] in [
        ["\"topic\"", "string.concat(\"to\", \"pics\")"],
        ["string.concat(\"to\", \"pics\")", "\"topic\""],
        ["string.tostring(id)", "string.concat(\"0\", string.tostring(id))"],
    ] {
        let script = format!(
            "function init() {{ neighbors.listen({listened}, function(topic, value, r) {{ log(value) }}) }}
             function step() {{ neighbors.broadcast({sent}, 1) }}"
        );
        let mut swarm: Swarm<Full> = Swarm::new(2, &script);
        swarm.steps(5);
        assert_eq!(swarm.logs(), [[""; 0]; 2], "{listened} and {sent}");
    }
    fn run<P: Profile>() {
        for topic in ["1", "1.5", "t", "nil"] {
            for call in ["broadcast(x, 1)", "listen(x, step)", "ignore(x)"] {
                let script = format!("t = {{}} x = {topic} function step() {{ neighbors.{call} }}");
                let mut swarm: Swarm<P> = Swarm::new(1, &script);
                swarm.try_step();
                let code = swarm.robots[0].fault.map(|fault| fault.code);
                assert_eq!(code, Some(FaultCode::WrongType), "{}: {script}", P::NAME);
            }
        }
    }
    run::<Tiny>();
    run::<Full>();
}

/// The topic of a private message is the number of its receiver as a text.
#[test]
fn a_number_as_text_is_a_topic() {
    let mut swarm: Swarm<Full> = Swarm::new(
        4,
        "function init() { neighbors.listen(string.tostring(id), function(t, v, r) { log(t, \" \", v, \" \", r) }) }
         function step() { neighbors.broadcast(string.tostring(id + 1), 10 * id) }",
    );
    swarm.steps(2);
    assert_eq!(swarm.last(), ["", "2 10 1", "3 20 2", "4 30 3"]);
}

#[test]
fn ignore_removes_the_listener() {
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
fn beacons_make_a_silent_robot_a_neighbor() {
    // Whatever else the script uses.
    for unused in
        ["", "swarm.create(1)", "stigmergy.create(1)", "swarm.create(stigmergy.create(1))"]
    {
        let script =
            format!("function step() {{ log(neighbors.count()) }} function reset() {{ {unused} }}");
        last(3, 7, &script, &["2"; 3]);
    }
}

#[test]
fn a_neighbor_without_frames_is_removed() {
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
fn get_returns_the_place_of_a_neighbor() {
    reported(
        "var n = neighbors.get(3)
         if(isnil(n)) log(\"nobody\")
         else log(n.distance, \" \", n.azimuth, \" \", n.elevation, \" \", size(n))",
        &["20.0 0.0 0.0 3", "10.0 0.0 0.0 3", "nobody"],
    );
}

#[test]
fn foreach_iterates_by_ascending_id() {
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
fn map_stores_the_results_of_the_function() {
    reported(
        "var m = neighbors.map(function(id, data) { return id * 2 })
         log(m.count(), \" \", m.get(1), \" \", m.get(2), \" \", m.reduce(function(id, v, a) { return a + v }, 0))",
        &["2 nil 4 10", "2 2 nil 8", "2 2 4 6"],
    );
}

#[test]
fn filter_keeps_neighbors_with_a_true_result() {
    reported(
        "var near = neighbors.filter(function(id, data) { return data.distance < 15 })
         var s = near.map(function(id, data) { return id + 0.5 })
         log(near.count(), \" \", s.reduce(function(id, v, a) { return a + v }, 0.0))",
        &["1 2.5", "2 5.0", "1 2.5"],
    );
}

/// Steps are counted on a circle of 127, which a test must go around.
#[test]
fn a_neighbor_is_kept_for_the_configured_number_of_steps() {
    for forget in [1, 2, 20, 125, 126, 127, 128, 255] {
        for before in [1, 40, 100, 126, 127, 140] {
            let mut swarm: Swarm<Tiny> =
                Swarm::new(1, "function step() { log(neighbors.count()) }");
            let robot = &mut swarm.robots[0];
            robot.host.periods.forget = forget;
            let beacon = Message::Beacon { robot: 2 };
            (0..before).for_each(|_| robot.step().expect("no fault"));
            // It is known from the second message on.
            robot.receive(&beacon);
            robot.receive(&beacon);
            (0..300).for_each(|_| robot.step().expect("no fault"));
            let logs = robot.host.logs();
            let known = logs.iter().filter(|count| *count == "1").count();
            assert_eq!(known, usize::from(forget.min(126)), "{forget} steps, from step {before}");
        }
    }
}

/// A link that does not know bearings measures distances alone.
#[test]
fn neighbors_without_bearings_have_distances() {
    let script = "function step() {
        neighbors.broadcast(\"x\", 1)
        if(neighbors.count() == 2) neighbors.foreach(function(id, data) {
          log(id * 100 + data.distance)
        })
    }";
    let image = Program::new::<Tiny>(script).leak();
    let sizes = Sizes { bearings: false, ..SIZES };
    let mut swarm = Swarm::of([1, 2, 3].map(|id| TestRobot::<Tiny>::new(image, id, sizes)).into());
    swarm.steps(3);
    let logs = swarm.logs();
    assert_eq!(logs[0][..2], ["210.0", "320.0"]);
    assert_eq!(logs[2][..2], ["120.0", "210.0"]);
}

/// A host without a link says itself who is near.
#[test]
fn a_robot_that_the_host_adds_is_a_neighbor() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        1,
        "function step() { log(neighbors.count(), \" \", neighbors.get(7).distance) }",
    );
    let robot = &mut swarm.robots[0];
    robot.vm.add_neighbor(7, &Sighting::at(Value::float(30.0)), 10);
    robot.step().expect("no fault");
    assert_eq!(robot.host.last_log(), Some("1 30.0".to_owned()));
}

#[test]
fn snapshots_persist_and_have_all_functions() {
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
fn without_swarms_all_robots_are_kin() {
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
fn the_sender_is_a_neighbor_in_its_listener() {
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

/// A queue that is full drops messages on other topics first.
#[test]
fn unwanted_topics_are_those_without_a_listener() {
    use std::cell::RefCell;
    use std::rc::Rc;
    let mut swarm: Swarm<Full> = Swarm::new(
        2,
        "function init() {
           if(id == 1) {
             neighbors.listen(\"a\", function(t, x, r) { })
             neighbors.listen(string.concat(\"te\", \"xt\"), function(t, x, r) { })
             neighbors.listen(\"c\", function(t, x, r) { })
             neighbors.ignore(\"c\")
           }
         }
         function step() {
           if(id == 2) {
             neighbors.broadcast(\"a\", 1)
             neighbors.broadcast(string.concat(\"tex\", \"t\"), 1)
             neighbors.broadcast(\"c\", 1)
             neighbors.broadcast(\"d\", 1)
             neighbors.broadcast(string.concat(\"te\", \"xts\"), 1)
           }
         }",
    );
    let sent = Rc::new(RefCell::new(Vec::new()));
    let all = sent.clone();
    swarm.air.observe = Box::new(move |frame| match topic_of::<Full>(&frame.bytes) {
        0 => {}
        topic => all.borrow_mut().push(topic),
    });
    swarm.step();
    let unwanted = swarm.robots[0].vm.unwanted_topics();
    let is_unwanted: Vec<bool> = sent.borrow().iter().map(|topic| unwanted & topic != 0).collect();
    assert_eq!(is_unwanted, [false, false, false, true, true]);
    assert_eq!(unwanted.count_ones(), 32 - 3);
    assert_eq!(swarm.robots[1].vm.unwanted_topics(), u32::MAX);
}

/// Robots that are heard in another order than that of their ids.
#[test]
fn neighbors_come_by_id_and_go_together() {
    let mut swarm: Swarm<Full> = Swarm::new(
        1,
        "function step() {
           ids = \"\"
           neighbors.foreach(function(robot, data) {
             ids = string.concat(ids, \" \", string.tostring(robot))
           })
           log(neighbors.count(), ids)
         }",
    );
    swarm.step();
    for id in [9, 4, 7, 2] {
        let frame = swarm.robots[0].frame(&Message::Beacon { robot: id });
        // Twice, so that none is forgotten earlier.
        (0..2).for_each(|_| swarm.inject(&frame, [0]));
    }
    swarm.step();
    assert_eq!(swarm.last(), ["4 2 4 7 9"]);
    swarm.steps(9);
    assert_eq!(swarm.last(), ["4 2 4 7 9"]);
    swarm.steps(2);
    assert_eq!(swarm.last(), ["0"]);
}

/// The memory of entries begins where that of neighbors ends.
#[test]
fn an_entry_is_no_neighbor() {
    let script = "n = 0
        function init() { v = stigmergy.create(1)  for(i = 1, i < 4, i = i + 1) v.put(i, i + 4.5) }
        function step() {
          neighbors.foreach(function(robot, data) { n = n + 1 })
          log(n, \" \", neighbors.count(), \" \", isnil(neighbors.get(1)), \" \", v.get(1), \" \", v.get(3))
        }";
    last(1, 140, script, &["0 0 1 5.5 7.5"]);
}

/// Ids without a neighbor lie below those of neighbors, too.
#[test]
fn other_robots_have_no_place() {
    last(
        3,
        12,
        "function step() {
           var n = 0
           for(i = 0, i < 9, i = i + 1) if(not isnil(neighbors.get(i))) n = n * 10 + i
           log(n)
         }",
        &["23", "13", "12"],
    );
}

/// Slots that a call has left hold tables that are gone. A machine that collects before each allocation does not take them for its
/// own, in a listener or in a table for the place of a neighbor.
#[test]
fn slots_of_ended_calls_are_no_values() {
    fn run<P: Profile>() {
        let mut swarm: Swarm<P> = Swarm::new(
            3,
            "function leave() { var a = {} var b = {} var c = {} var d = {} var e = {} var f = {} }
             n = 0
             function init() {
               neighbors.listen(\"x\", function(topic, value, robot) { kept = {.n = n}  n = kept.n + value })
             }
             function step() {
               leave()
               leave()
               kept = {}
               kept = {}
               neighbors.broadcast(\"x\", 1)
               var place = neighbors.get(2)
               if(not isnil(place)) kept = {.d = place.distance}
               log(n)
             }",
        );
        swarm.robots.iter_mut().for_each(|robot| robot.vm.torture.collect_always = true);
        swarm.steps(6);
        assert_eq!(swarm.last(), ["10"; 3], "{}", P::NAME);
    }
    run::<Tiny>();
    run::<Full>();
}

/// The place of a neighbor takes three slots of the stack while it is made, wherever the stack ends.
#[test]
fn a_place_at_the_end_of_the_stack_is_a_fault_or_whole() {
    fn run<P: Profile>(locals: usize) {
        let all: Vec<String> = (0..locals).map(|number| format!("var l{number} = n")).collect();
        let mut swarm: Swarm<P> = Swarm::new(
            2,
            &format!(
                "t = 0
                 kept = {{}}
                 function deep(n) {{
                   {}
                   kept[n % 8] = {{.a = n}}
                   var d = neighbors.get(3 - id)
                   if(d.distance > 0) deep(n + 1)
                 }}
                 function step() {{ t = t + 1  if(t > 9) deep(0)  log(t) }}",
                all.join(" ")
            ),
        );
        swarm.steps(9);
        let fault = swarm.robots[0].step().expect_err("it calls without end");
        assert!(
            matches!(fault.code, FaultCode::StackOverflow | FaultCode::OutOfMemory),
            "{fault:?}, {locals} locals"
        );
    }
    for locals in 0..8 {
        run::<Tiny>(locals);
        run::<Full>(locals);
    }
}
