//! Values that need more than a frame.

use super::{Full, Profile, Swarm, Tiny, last};
use bittybuzz_testkit::{Program, Received, SIZES, TestRobot};
use bittybuzz_vm_core::message::FrameKind;
use bittybuzz_vm_core::{Entry, FaultCode, Outcome};
use std::cell::RefCell;
use std::rc::Rc;

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
fn the_next_advertisement_replaces_a_lost_fragment() {
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
fn sending_an_unsendable_value_is_a_fault() {
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
fn a_message_without_memory_for_it_is_dropped() {
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

/// A text takes a cell for each 20 bytes. Where only so many are free as the script keeps, the message is dropped and the
/// script goes on.
#[test]
fn a_text_without_memory_for_it_is_dropped() {
    let mut swarm: Swarm<Full> = Swarm::new(
        2,
        "kept = {}
         n = 0
         function init() { neighbors.listen(\"t\", function(t, v, r) { kept[n] = v  n = n + 1 }) }
         function step() {
           if(id == 2) neighbors.broadcast(\"t\", string.concat(\"a text of many, many, many, many, many bytes, \",
             \"so that it takes several cells of memory, number \", string.tostring(n)))
           n = n + (id - 1)
           log(n)
         }",
    );
    swarm.steps(300);
    let counters = swarm.robots[0].counters();
    assert!(counters.incomplete > 100, "{counters:?}");
    assert_eq!(swarm.faults(), [None, None]);
}

/// However much memory is free, a table or a text arrives whole or is dropped, and neither harms the script.
#[test]
fn a_message_allocates_completely_or_not_at_all() {
    let values = [
        "{.a = {.b = 1, .c = {.d = 2, .e = 3}}, .f = 4}",
        "{.a = 1, .b = 2, .c = 3, .d = 4, .e = 5, .f = 6, .g = 7, .h = 8, .i = 9, .j = 10, .k = 11, .l = 12}",
        "string.concat(\"one two three four\", \"five six seven eight nine ten eleven twelve\")",
        // Of 120 bytes.
        "string.concat(\"one two three four five six seven eight nine ten eleven twelve\",
            \" thirteen fourteen fifteen sixteen seventeen eighteen, ...\")",
    ];
    for value in values {
        // A robot fills its memory with as many elements as its id says.
        let script = format!(
            "fill = {{}}
             n = 0
             function init() {{
               neighbors.listen(\"t\", function(t, v, r) {{ n = n + 1 }})
               var i = 0
               while(i < id) {{ fill[i] = 1 i = i + 1 }}
             }}
             function deep(a, b, c, d, e, f, g) {{ if(a > 0) deep(a - 1, 0, 0, 0, 0, 0, 0) }}
             function step() {{ deep(0, 0, 0, 0, 0, 0, 0) if(id == 2) neighbors.broadcast(\"t\", {value}) log(n) }}"
        );
        let image = Program::new::<Full>(&script).leak();
        let (mut received, mut dropped) = (0, 0);
        for fill in 3.. {
            let robots = [fill, 2].map(|id| TestRobot::<Full>::new(image, id, SIZES));
            let mut swarm = Swarm::of(robots.into());
            // A step takes more memory than the listener.
            if swarm.robots[0].step().is_err() {
                break;
            }
            swarm.try_step();
            swarm.try_step();
            let robot = &swarm.robots[0];
            assert_eq!(robot.fault, None, "{value}, {fill} elements");
            assert!(robot.host.contained.is_empty(), "{value}, {fill} elements");
            let incomplete = usize::from(robot.counters().incomplete);
            let came = usize::from(robot.host.last_log() == Some("1".to_owned()));
            assert_eq!(came + incomplete, 1, "{value}, {fill} elements");
            received += came;
            dropped += incomplete;
        }
        assert!(received > 0 && dropped > 0, "{value}: {received} received, {dropped} dropped");
    }
}

/// What a listener has thrown away makes room for the next message of the same step.
#[test]
fn garbage_is_collected_for_a_message() {
    // What robots print that have filled their memory with 3, 4, ... elements: the number of messages received.
    let received = |garbage: usize| -> Vec<String> {
        let script = format!(
            "fill = {{}}
             n = 0
             function init() {{
               var i = 0
               while(i < id) {{ fill[i] = 1 i = i + 1 }}
               neighbors.listen(\"t\", function(t, v, r) {{
                 n = n + v.a
                 var left = {garbage}
                 while(left > 0) {{ var thrown_away = {{.a = 1}} left = left - 1 }}
               }})
             }}
             function step() {{
               log(n)
               var i = 0
               if(id == 2) while(i < 8) {{ neighbors.broadcast(\"t\", {{.a = 1, .b = {{}}}}) i = i + 1 }}
             }}"
        );
        let image = Program::new::<Tiny>(&script).leak();
        let mut sender = TestRobot::<Tiny>::new(image, 2, SIZES);
        sender.step().expect("it sends");
        let frames = sender.take_sent();
        let count = |fill| {
            let mut robot = TestRobot::<Tiny>::new(image, fill, SIZES);
            robot.begin().ok()?;
            frames.iter().for_each(|frame| robot.host.link.push(Received::new(frame)));
            // The test kit would collect after each message.
            assert!(robot.vm.begin(Entry::Step));
            while robot.vm.run(&mut robot.host, 1000) == Outcome::Pending {}
            assert!(robot.host.contained.is_empty());
            robot.host.last_log()
        };
        (3..).map_while(count).collect()
    };
    let counts = received(0);
    assert!(["0", "8"].map(String::from).iter().all(|count| counts.contains(count)), "{counts:?}");
    assert_eq!(received(3), counts);
}

/// Each value of a message is reachable while the next ones are made.
#[test]
fn a_collection_at_every_allocation_does_not_change_a_message() {
    let mut swarm: Swarm<Full> = Swarm::new(
        2,
        "text = \"\"
         function init() {
           v = stigmergy.create(1)
           neighbors.listen(\"t\", function(t, v, r) {
             log(size(v), \" \", v.a.b, v.a.c[0], v.a.c[1].d, \" \", v.e, \" \", v.f.g)
           })
         }
         function step() {
           var t = {.a = {.b = 1, .c = {.0 = 2, .1 = {.d = 3}}}, .e = string.concat(\"four \", \"five\"), .f = {.g = 6}}
           if(id == 2) neighbors.broadcast(\"t\", t)
           if(id == 2) v.put(1, t)
           t = v.get(1)
           if(not isnil(t)) log(size(t), \" \", t.a.b, t.a.c[0], t.a.c[1].d, \" \", t.e, \" \", t.f.g)
         }",
    );
    swarm.robots.iter_mut().for_each(|robot| robot.vm.torture.collect_always = true);
    swarm.steps(5);
    let logs = swarm.logs().remove(0);
    assert!(logs.len() >= 6 && logs.iter().all(|line| line == "3 123 four five 6"), "{logs:?}");
}

/// A table within another one is visited again each time that it is met. All visits together may see as many places as the memory has:
/// a table with much room takes time for nothing.
#[test]
fn tables_with_much_room_are_met_a_limited_number_of_times() {
    fn run<P: Profile>(inner: &str, times: i32, is_sent: bool) {
        let script = format!(
            "function init() {{
               wide = {{}}
               for(i = 0, i < 110, i = i + 1) wide[i + 0.5] = 1
               for(i = 0, i < 110, i = i + 1) wide[i + 0.5] = nil
               small = {{}}
               many = {{}}
               for(i = 0, i < {times}, i = i + 1) many[i] = {inner}
               neighbors.listen(\"t\", function(topic, value, robot) {{ log(size(value)) }})
             }}
             function step() {{ if(id == 1) neighbors.broadcast(\"t\", many) }}"
        );
        let mut swarm: Swarm<P> = Swarm::new(2, &script);
        swarm.try_step();
        swarm.try_step();
        let code = swarm.robots[0].fault.map(|fault| fault.code);
        let expected = (!is_sent).then_some(FaultCode::TooLong);
        assert_eq!(code, expected, "{}: {inner}, {times} times", P::NAME);
        // Forty tables have no room at the other robot.
        if is_sent && times < 40 {
            assert_eq!(swarm.last()[1], times.to_string());
        }
    }
    for (inner, times, is_sent) in [("small", 6, true), ("wide", 3, true), ("wide", 6, false)] {
        run::<Tiny>(inner, times, is_sent);
        run::<Full>(inner, times, is_sent);
    }
    run::<Full>("small", 40, true);
}

/// A robot that has received a long entry does not repeat it at once: all neighbors of the sender have received it, too.
#[test]
fn long_entries_of_others_are_no_news() {
    let mut swarm: Swarm<Full> = Swarm::new(
        2,
        "t = 0
         function init() { v = stigmergy.create(1) }
         function step() { t = t + 1  if(id == 1 and t % 40 == 0) v.put(1, {.n = t, .m = {.k = 5}}) }",
    );
    let fragments = Rc::new(RefCell::new(Vec::new()));
    let all = fragments.clone();
    swarm.air.observe = Box::new(move |frame| {
        if FrameKind::of(frame.bytes[0]) == Some(FrameKind::Fragment) {
            all.borrow_mut().push((frame.step, frame.from));
        }
    });
    swarm.steps(20 * 40 + 20);
    // A put in step 39 is received in step 40, where an advertisement may be due by chance.
    let has = |step, from| fragments.borrow().contains(&(step, Some(from)));
    let puts: Vec<u32> = (1..=20).map(|number| 40 * number - 1).collect();
    assert!(puts.iter().all(|step| has(*step, 0)));
    let at_once = puts.iter().filter(|step| has(**step + 1, 1)).count();
    let soon = puts.iter().filter(|step| (2..10).any(|later| has(**step + later, 1))).count();
    assert!(at_once <= 5 && soon >= 15, "{at_once} at once, {soon} soon");
}
