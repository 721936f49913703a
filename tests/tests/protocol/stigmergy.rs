//! The stigmergy in hard times: stores that are too small, robots that lose their memory, clocks that are forged.

use bittybuzz_testkit::{Program, Queues, SIZES, Swarm, TestRobot};
use bittybuzz_vm_core::message::{CLOCK_MAX, FrameKind, Message, StigmergyEntry};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};
use bittybuzz_vm_core::{Entry as EntryPoint, Value};
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// Steps after which a robot takes back its key once more.
const RECLAIM_STEPS: usize = 256;

/// Robots with the queues of a Kilobot and the periods of all shipped robots.
pub fn kilobots(count: u16, script: &str) -> Swarm<Tiny> {
    let program = Program::new::<Tiny>(script);
    let symbols = Rc::new(program.symbols.clone());
    let image = program.leak();
    let robots = (1..=count).map(|id| {
        let mut robot = TestRobot::new(image, id, SIZES);
        robot.host.symbols = Some(symbols.clone());
        robot
    });
    Swarm::of(robots.collect()).with_links(Queues::<Tiny, 10, 10>::default)
}

/// Frames by kind that a swarm sends while it runs.
pub fn count_kinds<P: Profile, const SLOTS: usize>(
    swarm: &mut Swarm<P, &'static [u8], SLOTS>,
    steps: usize,
) -> BTreeMap<&'static str, usize> {
    let counts = Rc::new(RefCell::new(BTreeMap::new()));
    let seen = counts.clone();
    swarm.air.observe = Box::new(move |frame| {
        let name = match FrameKind::of(frame.bytes[0]) {
            Some(FrameKind::Entry) => "entry",
            Some(FrameKind::Digest) => "digest",
            Some(FrameKind::Beacon) => "beacon",
            _ => "other",
        };
        *seen.borrow_mut().entry(name).or_default() += 1;
    });
    swarm.steps(steps);
    swarm.air.observe = Box::new(|_| {});
    counts.take()
}

#[test]
fn equal_replicas_send_no_entries() {
    let mut swarm = kilobots(
        6,
        "function init() { s = stigmergy.create(1) if(id < 5) s.put(id, id) }
         function step() { log(s.size(), \" \", neighbors.count()) }",
    );
    swarm.steps(300);
    let counts = count_kinds(&mut swarm, 1000);
    assert_eq!(counts.get("entry"), None, "{counts:?}");
    assert_eq!(swarm.last(), ["4 5"; 6]);
    // Nothing but a beacon in nine or ten steps, with a digest.
    assert_eq!(counts.keys().copied().collect::<Vec<_>>(), ["digest"]);
    assert!((600..=667).contains(&counts["digest"]), "{counts:?}");
}

/// A robot without memory may put other values at the same clock, as may two robots with one id. Which of them lasts does
/// not depend on which comes first, whatever frames they travel in.
#[test]
fn values_of_one_stamp_are_ordered() {
    for (key, values) in [
        ("1", ["7", "8"]),
        ("1.5", ["7", "8"]),
        ("1.5", ["{.a = 1}", "{.a = 2}"]),
        ("\"k\"", ["{.a = 1}", "{.a = 2}"]),
        ("\"k\"", ["7", "{.a = 2}"]),
    ] {
        let [first, second] = values;
        let script = format!(
            "function init() {{ s = stigmergy.create(1) }}
             function step() {{
               var v = s.get({key})
               if(isnil(v)) log(\"nothing\")
               else if(type(v) == \"table\") log(v.a)
               else log(\"plain \", v)
             }}
             function reset() {{ s.put({key}, {first}) }}
             function destroy() {{ s.put({key}, {second}) }}"
        );
        let image = Program::new::<Tiny>(&script).leak();
        let frames = |entry| {
            let mut robot: TestRobot<Tiny> = TestRobot::new(image, 1, SIZES);
            robot.begin().expect("no fault");
            robot.enter(entry).expect("no fault");
            (0..3).for_each(|_| robot.step().expect("no fault"));
            robot.take_sent()
        };
        let both = [frames(EntryPoint::Reset), frames(EntryPoint::Destroy)];
        let last = |order: [usize; 2]| {
            let mut swarm = Swarm::of(vec![TestRobot::<Tiny>::new(image, 2, SIZES)]);
            swarm.step();
            for number in order {
                both[number].iter().for_each(|frame| swarm.inject(frame, [0]));
                swarm.step();
            }
            swarm.last().remove(0)
        };
        let lasts = last([0, 1]);
        assert_ne!(lasts, "nothing");
        assert_eq!(lasts, last([1, 0]), "{key}: {values:?}");
    }
}

/// A robot puts its value again over one of its own id that others send, 16 times and then once in a while: two robots
/// with one id must not do so for ever.
#[test]
fn a_robot_reclaims_its_key_a_limited_number_of_times() {
    let mut swarm: Swarm<Tiny> = Swarm::new(
        1,
        "function init() { s = stigmergy.create(1) s.put(1, 5) }
         function step() { log(s.get(1)) }
         function reset() { s.put(1, 5) }",
    );
    swarm.step();
    let mut clock = 0;
    let mut keeps = |swarm: &mut Swarm<Tiny>| {
        clock += 1000;
        let (key, value) = (Value::int(1), Value::int(6));
        let other = StigmergyEntry { stigmergy: 1, owner: 1, clock, key, value };
        // The sender of a frame is no part of an entry, so the own id does not keep it out.
        let frame = swarm.robots[0].frame(&Message::Entry(other));
        swarm.inject(&frame, [0]);
        swarm.step();
        swarm.last() == ["5"]
    };
    let kept = (0..20).take_while(|_| keeps(&mut swarm)).count();
    assert_eq!(kept, 16);
    swarm.robots[0].enter(EntryPoint::Reset).expect("no fault");
    assert!(!keeps(&mut swarm));
    // Two more after so many steps.
    swarm.steps(2 * RECLAIM_STEPS);
    swarm.robots[0].enter(EntryPoint::Reset).expect("no fault");
    let kept = (0..20).take_while(|_| keeps(&mut swarm)).count();
    assert_eq!(kept, 2);
}

/// The digest of a robot that executes these puts, of the stigmergies `s`, `t`, `u` and `w`.
fn digest_after(puts: &str) -> u32 {
    let script = format!(
        "function init() {{
           s = stigmergy.create(0)
           t = stigmergy.create(1)
           u = stigmergy.create(2)
           w = stigmergy.create(3)
         }}
         function step() {{ if(id == 7) {{ s.put(1, 1) s.put(2, 1) s.put(3, 1) }} }}
         function reset() {{ {puts} }}"
    );
    let image = Program::new::<Tiny>(&script).leak();
    let mut robot: TestRobot<Tiny> = TestRobot::new(image, 1, SIZES);
    robot.begin().expect("no fault");
    robot.enter(EntryPoint::Reset).expect("no fault");
    (0..30).for_each(|_| robot.step().expect("no fault"));
    let (sent, script) = (robot.take_sent(), robot.script());
    let mut digests =
        sent.iter().filter_map(|frame| match Message::<Tiny>::decode(frame, script) {
            Ok(Message::Digest { digest, .. }) => Some(digest),
            _ => None,
        });
    digests.next_back().expect("a robot with a stigmergy sends digests")
}

/// Robots forget deleted keys at different times.
#[test]
fn a_deleted_key_does_not_change_the_digest() {
    let of_one = digest_after("s.put(1, 1)");
    assert_eq!(digest_after("s.put(1, 1) s.put(2, 1) s.put(2, nil)"), of_one);
    assert_ne!(digest_after("s.put(1, 1) s.put(2, 1)"), of_one);
    assert_ne!(digest_after("s.put(1, 1) s.put(1, nil)"), of_one);
}

/// Replicas that differ in a stigmergy, a key or a value have different digests, whether the entries fit a frame or not.
#[test]
fn the_digest_is_of_stigmergy_key_and_value() {
    let mut puts = Vec::new();
    for stigmergy in ["s", "t", "u", "w"] {
        for key in ["1", "2", "1.5", "2.5", "\"k\""] {
            for value in ["1", "2", "1.5", "\"k\"", "{.a = 1}", "{.a = 2}"] {
                puts.push(format!("{stigmergy}.put({key}, {value})"));
            }
        }
    }
    let mut seen = BTreeMap::new();
    for one in puts {
        if let Some(other) = seen.insert(digest_after(&one), one.clone()) {
            panic!("{one} and {other} have one digest");
        }
    }
}

/// An entry that neighbors repeat is less urgent, as in Trickle (RFC 6206).
#[test]
fn an_entry_that_neighbors_send_is_sent_less_often() {
    let frames = |robots| {
        let mut swarm = kilobots(
            robots,
            "t = 0
             function init() { s = stigmergy.create(1) }
             function step() { t = t + 1 if(id == 1) { if(t == 100) s.put(1, t) } log(s.size()) }",
        );
        swarm.steps(99);
        let counts = count_kinds(&mut swarm, 200);
        assert_eq!(swarm.last(), vec!["1"; usize::from(robots)]);
        counts["entry"] as f64 / f64::from(robots)
    };
    let (alone, together) = (frames(1), frames(10));
    assert!(together < 0.5 * alone, "{together} frames of each of ten robots, {alone} of one");
}

#[test]
fn a_differing_digest_makes_neighbors_resend_entries() {
    for rate in [1, 8] {
        let mut swarm = kilobots(
            4,
            "t = 0
             function init() { s = stigmergy.create(1) s.put(id % 2, id) }
             function step() { t = t + 1 if(t == 50) { if(id == 1) s.put(2, 77) } log(s.get(2)) }",
        );
        swarm.air.frames_per_step = rate;
        // Robot 4 receives nothing for a minute.
        let is_open = Rc::new(RefCell::new(false));
        let open = is_open.clone();
        swarm.air.reaches = Box::new(move |_, to| to != 3 || *open.borrow());
        swarm.steps(600);
        assert_eq!(swarm.last(), ["77", "77", "77", "nil"]);
        *is_open.borrow_mut() = true;
        swarm.steps(40);
        assert_eq!(swarm.last(), ["77"; 4]);
    }
}

/// A robot between two others lacks a key that one of them has. Nothing but entries and digests is on the air: the script
/// has no neighbors, so there are no beacons.
#[test]
fn a_robot_with_new_entries_receives_its_missing_ones() {
    let script = "t = 0
         function init() { s = stigmergy.create(1) }
         function step() {
           t = t + 1
           if(id == 3) { if(t == 5) s.put(2, 1) }
           if(id == 1) { if(t == 9) s.put(1, 2)  if(t == 13) s.put(2, 3) }
           log(s.size())
         }";
    for opening in 16..26 {
        let mut swarm = kilobots(3, script);
        let is_open = Rc::new(RefCell::new(false));
        let open = is_open.clone();
        swarm.air.reaches = Box::new(move |from, to| *open.borrow() && from.abs_diff(to) == 1);
        swarm.steps(opening);
        *is_open.borrow_mut() = true;
        swarm.steps(300);
        assert_eq!(swarm.last(), ["2"; 3], "open from step {opening}");
    }
}

/// Robot 1 deletes a key while the others know it; then there is room for another one.
#[test]
fn a_deleted_key_frees_its_place_after_a_timeout() {
    let mut swarm = kilobots(
        3,
        "t = 0
         function init() { s = stigmergy.create(1) if(id == 1) { s.put(1, 1) s.put(2, 2) s.put(3, 3) s.put(4, 4) } }
         function step() {
           t = t + 1
           if(id == 1) { if(t == 50) s.put(4, nil)  if(t == 900) s.put(5, 5) }
           log(s.get(4), \" \", s.get(5), \" \", s.size())
         }",
    );
    swarm.steps(40);
    assert_eq!(swarm.last(), ["4 nil 4"; 3]);
    swarm.steps(60);
    assert_eq!(swarm.last(), ["nil nil 3"; 3]);
    swarm.steps(900);
    assert_eq!(swarm.last(), ["nil 5 4"; 3]);
}

/// A key that is put again after its deletion was forgotten here, but not yet elsewhere, must win there.
#[test]
fn a_new_put_exceeds_a_deletion_that_others_still_remember() {
    let script = "t = 0
         function init() { s = stigmergy.create(1) if(id == 1) { s.put(1, 1) s.put(1, 2) s.put(1, 3) } }
         function step() {
           t = t + 1
           if(t == 30 and id == 1) s.put(1, nil)
           if(t == 700 and id == 3) s.put(1, 9)
           log(s.get(1))
         }";
    let mut swarm = kilobots(3, script);
    // Robot 2 learns of the deletion 300 steps later, and remembers it for that much longer.
    let is_open = Rc::new(RefCell::new(true));
    let open = is_open.clone();
    swarm.air.reaches = Box::new(move |from, to| *open.borrow() || (from != 1 && to != 1));
    swarm.steps(25);
    assert_eq!(swarm.last(), ["3"; 3]);
    *is_open.borrow_mut() = false;
    swarm.steps(300);
    *is_open.borrow_mut() = true;
    swarm.steps(60);
    assert_eq!(swarm.last(), ["nil"; 3]);
    swarm.steps(400);
    assert_eq!(swarm.last(), ["9"; 3]);
}

fn entry(owner: u16, clock: u32, value: i32) -> Message<'static, Tiny> {
    let (key, value) = (Value::int(1), Value::int(value));
    Message::Entry(StigmergyEntry { stigmergy: 1, owner, clock, key, value })
}

/// One forged frame with the greatest clock, or any other, rules until the next put and no longer.
#[test]
fn a_forged_clock_wins_only_until_the_next_put() {
    for clock in [1000, CLOCK_MAX / 2, CLOCK_MAX - 1, CLOCK_MAX] {
        let mut swarm = kilobots(
            4,
            "t = 0
             function init() { s = stigmergy.create(1) }
             function step() { t = t + 1 if(id == 2) { if(t % 50 == 0) s.put(1, t) } log(s.get(1)) }",
        );
        swarm.steps(120);
        assert_eq!(swarm.last(), ["100"; 4]);
        let forged = swarm.robots[0].frame(&entry(65535, clock, -5));
        swarm.inject(&forged, [0, 1, 2, 3]);
        swarm.steps(10);
        // Beyond half the circle a clock is an old one.
        let reigns = if clock > CLOCK_MAX / 2 + 2 { "100" } else { "-5" };
        assert_eq!(swarm.last(), [reigns; 4], "{clock}");
        swarm.steps(100);
        assert_eq!(swarm.last(), ["200"; 4], "{clock}");
    }
}

/// Three clocks, a third of the circle apart, are each later than the one before, without an end. In a ring they run around for
/// ever where no frame is ever lost; where one in ten is, a single one is left after some time.
#[test]
fn cyclic_clocks_converge() {
    for count in [8, 28] {
        let mut swarm = kilobots(
            count,
            "t = 0
             function init() { s = stigmergy.create(1) }
             function step() { t = t + 1 if(id == 2) { if(t == 2100) s.put(1, 7) } log(s.get(1)) }",
        );
        swarm.air.loss = 0.1;
        let robots = usize::from(count);
        swarm.air.reaches =
            Box::new(move |from, to| (from + 1) % robots == to || (to + 1) % robots == from);
        swarm.steps(10);
        for robot in 0..robots {
            let third = (robot * 3 / robots) as u32;
            let forged = entry(65535, 100 + third * (CLOCK_MAX / 3), third as i32);
            let frame = swarm.robots[robot].frame(&forged);
            swarm.inject(&frame, [robot]);
        }
        swarm.step();
        let values: BTreeSet<String> = swarm.last().into_iter().collect();
        assert_eq!(values.len(), 3, "{values:?}");
        swarm.steps(2000);
        let values: BTreeSet<String> = swarm.last().into_iter().collect();
        assert_eq!(values.len(), 1, "{values:?}");
        swarm.steps(300);
        assert_eq!(swarm.last(), vec!["7"; robots]);
    }
}

/// What a robot has put since it was switched on is later than what others know from its former life.
#[test]
fn a_robot_without_memory_does_not_lose_its_new_put_to_its_old_one() {
    let mut swarm = kilobots(
        3,
        "t = 0
         function init() { s = stigmergy.create(1) }
         function step() {
           t = t + 1
           if(id == 1) { if(t % 7 == 3) s.put(1, t) if(t > 60) s.put(1, 1000 + t) }
           log(s.get(1))
         }",
    );
    swarm.steps(70);
    assert_eq!(swarm.last()[1..], ["1069", "1069"]);
    // After its third step it puts 3 with clock 1; the others hold a clock near 20.
    swarm.robots[0].restart();
    swarm.steps(8);
    assert_eq!(swarm.last(), ["3"; 3]);
    swarm.steps(5);
    assert_eq!(swarm.last()[0], "10");
}

/// Two robots with one id each take the other's puts for those of a former life: that must not fill the air.
#[test]
fn two_robots_with_one_id_do_not_saturate_the_channel() {
    let mut swarm = kilobots(
        3,
        "function init() { s = stigmergy.create(1) s.put(1, rand() % 100) }
         function step() { log(neighbors.count()) }",
    );
    for robot in &mut swarm.robots[..2] {
        robot.vm.set_robot_id(7, u32::from(robot.id));
    }
    swarm.steps(300);
    let counts = count_kinds(&mut swarm, 1000);
    let entries = counts.get("entry").copied().unwrap_or(0);
    assert_eq!(entries, 0, "{counts:?}");
}

#[test]
fn changing_a_table_does_not_change_the_entry() {
    let script = "function init() {
           s = stigmergy.create(1)
           mine = {.a = 1}
           if(id == 1) s.put(\"t\", mine)
           mine.a = 2
         }
         function step() {
           var got = s.get(\"t\")
           if(not isnil(got)) {
             log(got.a)
             got.a = 3
             s.foreach(function(key, value, robot) { log(value.a)  value.a = 4 })
           }
         }";
    let mut swarm: Swarm<Full> = Swarm::new(2, script);
    swarm.steps(20);
    for robot in swarm.logs() {
        assert!(robot.len() > 20 && robot.iter().all(|line| line == "1"), "{robot:?}");
    }
}
