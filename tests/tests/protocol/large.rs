//! Robots with much memory: an index finds their entries, they send changes in slices, advertise several entries in a turn, and
//! leave out those that neighbors have sent.

use bittybuzz_testkit::{LARGE_SIZES, LARGE_SLOTS, Swarm};
use bittybuzz_vm_core::message::Message;
use bittybuzz_vm_core::number::Full;
use bittybuzz_vm_core::{Entry, Outcome};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::rc::Rc;

type Large = Swarm<Full, &'static [u8], LARGE_SLOTS>;

/// Robots whose slices are longer than those of other tests, so that many entries take little time.
fn large(count: usize, script: &str) -> Large {
    let mut swarm = Large::with_sizes(count, script, LARGE_SIZES);
    swarm.robots.iter_mut().for_each(|robot| robot.budget = 1000);
    swarm
}

/// Entries that robots sent, each with the step and the robot's number.
type Sent = Rc<RefCell<Vec<(u32, usize, i32)>>>;

/// Records all entries with integers as keys.
fn record(swarm: &mut Large) -> Sent {
    let sent = Sent::default();
    let all = sent.clone();
    let script = swarm.robots[0].script();
    swarm.air.observe = Box::new(move |frame| {
        if let Ok(Message::<Full>::Entry(entry)) = Message::decode(&frame.bytes, script)
            && let Some(from) = frame.from
            && let Some(key) = entry.key.as_int()
        {
            all.borrow_mut().push((frame.step, from, key));
        }
    });
    sent
}

/// Four keys of each of 30 numbers, more than the index has chains: some are deleted, and their places taken by others.
#[test]
fn the_index_finds_every_key() {
    let mut swarm = large(
        2,
        "t = 0
         deleted = 0
         function init() {
           v = stigmergy.create(1)
           w = stigmergy.create(2)
           swarms = {}
           for(i = 0, i < 8, i = i + 1) swarms[i] = swarm.create(i + 50)
           if(id == 1) {
             for(i = 0, i < 30, i = i + 1) {
               v.put(i, i * 3)
               w.put(i, i + 1000)
               w.put(i + 0.5, i)
               v.put(string.concat(\"k\", string.tostring(i)), i)
             }
           }
         }
         function right() {
           var n = 0
           for(i = 0, i < 30, i = i + 1) {
             if(v.get(i) == i * 3) n = n + 1
             if(w.get(i) == i + 1000) n = n + 1
             if(w.get(i + 0.5) == i) n = n + 1
             var text = v.get(string.concat(\"k\", string.tostring(i)))
             if(i % 3 < deleted) { if(isnil(text)) n = n + 1 }
             else if(text == i) n = n + 1
           }
           # The memory of the index follows that of the swarms.
           for(i = 0, i < 8, i = i + 1) if(swarms[i].id != i + 50) n = 0
           return n
         }
         function renewed() {
           var n = 0
           for(i = 0, i < 10, i = i + 1) if(v.get(string.concat(\"n\", string.tostring(i))) == i) n = n + 1
           return n
         }
         function step() {
           t = t + 1
           if(t == 300) {
             deleted = 1
             if(id == 2) for(i = 0, i < 30, i = i + 3) v.put(string.concat(\"k\", string.tostring(i)), nil)
           }
           if(t == 1100 and id == 2) for(i = 0, i < 10, i = i + 1) v.put(string.concat(\"n\", string.tostring(i)), i)
           if(t == 299 or t == 999 or t == 1299) log(right(), \" \", renewed(), \" \", v.size(), \" \", w.size())
         }",
    );
    swarm.steps(299);
    assert_eq!(swarm.last(), ["120 0 60 60"; 2]);
    swarm.steps(700);
    assert_eq!(swarm.last(), ["120 0 50 60"; 2]);
    swarm.steps(300);
    assert_eq!(swarm.last(), ["120 10 60 60"; 2]);
}

/// A robot that has put ten entries sends them when its next steps end, four each time; if it pauses, each in a slice.
#[test]
fn changes_are_sent_four_at_a_time() {
    for pauses in [false, true] {
        let mut swarm = large(
            1,
            "t = 0
             function init() { v = stigmergy.create(1)  s = swarm.create(3) }
             function step() {
               t = t + 1
               if(t == 5) { for(i = 0, i < 10, i = i + 1) v.put(i, 1)  s.join() }
             }",
        );
        if pauses {
            swarm.robots[0].pause();
        }
        check_four_at_a_time(&mut swarm);
    }
}

fn check_four_at_a_time(swarm: &mut Large) {
    let sent = record(swarm);
    swarm.steps(12);
    let mut seen = BTreeSet::new();
    let mut first: Vec<(u32, i32)> = sent
        .borrow()
        .iter()
        .filter(|(_, _, key)| seen.insert(*key))
        .map(|(step, _, key)| (*step, *key))
        .collect();
    // The newest entry is also advertised.
    first.sort_unstable();
    let steps = [4, 4, 4, 4, 5, 5, 5, 5, 6, 6];
    assert_eq!(first, steps.into_iter().zip(0..10).collect::<Vec<_>>());
}

/// A host that begins the next step while the changes of the last one are sent interrupts that. They are sent with the next ones.
#[test]
fn an_interrupted_sending_goes_on() {
    let mut swarm = large(
        1,
        "t = 0
         function init() { v = stigmergy.create(1) }
         function step() { t = t + 1  if(t == 2) for(i = 0, i < 4, i = i + 1) v.put(i, 1) }",
    );
    swarm.robots[0].pause();
    swarm.step();
    let robot = &mut swarm.robots[0];
    assert!(robot.vm.begin(Entry::Step));
    while robot.take_sent().is_empty() {
        assert_eq!(robot.vm.run(&mut robot.host, robot.budget), Outcome::Pending);
    }
    let sent = record(&mut swarm);
    swarm.steps(2);
    let mut keys: Vec<i32> = sent.borrow().iter().map(|(_, _, key)| *key).collect();
    keys.sort_unstable();
    keys.dedup();
    assert!(keys.len() >= 3, "{keys:?}");
}

/// Two robots with 256 equal entries meet a third one that has none. A turn advertises one entry, and one more for each 64 that
/// are still to be advertised. Of the entries that the other robot has sent, one in four is sent again.
#[test]
fn many_entries_are_advertised_in_bursts_and_not_by_all() {
    let mut swarm = large(
        3,
        "t = 0
         function create() {
           v = stigmergy.create(1)
           if(id == 1) for(i = 0, i < 256, i = i + 1) v.put(i, i)
         }
         function init() { if(id < 3) create() }
         function step() {
           t = t + 1
           if(id == 3 and t == 150) create()
           if(id < 3 or t >= 150) log(v.size())
         }",
    );
    swarm.steps(149);
    assert_eq!(swarm.last()[..2], ["256", "256"]);
    let sent = record(&mut swarm);
    let mut steps = 149;
    while swarm.last()[2] != "256" {
        swarm.step();
        steps += 1;
        assert!(steps < 700, "{:?} after {steps} steps", swarm.last());
    }
    let sent = sent.borrow();
    let of = |robot, step| sent.iter().filter(|one| (one.0, one.1) == (step, robot)).count();
    let most = (149..steps).map(|step| of(0, step).max(of(1, step))).max();
    assert_eq!(most, Some(5));
    let of_both = sent.iter().filter(|(_, robot, _)| *robot < 2).count();
    assert!((290..400).contains(&of_both), "{of_both}");
}
