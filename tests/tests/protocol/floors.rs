//! Entries from before a deletion that was forgotten: a robot that knows all keys deletes them again, and one that may lack some
//! takes them.

use bittybuzz_testkit::Swarm;
use bittybuzz_vm_core::Value;
use bittybuzz_vm_core::message::{Message, StigmergyEntry};
use bittybuzz_vm_core::number::Full;

/// The step in which a robot forgets that it has deleted a text in step 20: the age of a deletion grows 40 times, whenever the number
/// of steps is a multiple of 16.
const FORGOTTEN: usize = 32 + 39 * 16;

/// Two robots that know the same keys until the other one is gone. Robot 1 forgets a deletion after [`FORGOTTEN`] steps.
fn swarm() -> Swarm<Full> {
    let mut swarm: Swarm<Full> = Swarm::new(
        2,
        "t = 0
         function init() {
           v = stigmergy.create(1)
           text = string.concat(\"a\", string.tostring(1))
           if(id == 1) { v.put(1, 1) v.put(text, 1) }
         }
         function step() {
           t = t + 1
           if(t == 20 and id == 1) v.put(text, nil)
           log(v.size())
         }",
    );
    swarm.steps(FORGOTTEN - 400);
    assert_eq!(swarm.last(), ["1"; 2]);
    swarm.air.reaches = Box::new(|_, _| false);
    swarm
}

/// Runs steps in which a neighbor with other entries, and a floor of zero, sends that digest in each fifth one.
fn meet(swarm: &mut Swarm<Full>, steps: usize, digest: u32) {
    let frame = swarm.robots[0].frame(&Message::Digest { robot: 9, digest, floor: 0 });
    for step in 0..steps {
        if step % 5 == 0 {
            swarm.inject(&frame, [0]);
        }
        swarm.step();
    }
}

/// Sends entries from before the deletion. Returns true if the robot takes one, and the number of deletions with which it answers.
fn old_entries(swarm: &mut Swarm<Full>, keys: impl IntoIterator<Item = i32>) -> (bool, usize) {
    let size = swarm.last().remove(0);
    for key in keys {
        let (key, value) = (Value::int(key), Value::int(5));
        let entry = StigmergyEntry { stigmergy: 1, owner: 9, clock: 2, key, value };
        let frame = swarm.robots[0].frame(&Message::Entry(entry));
        swarm.inject(&frame, [0]);
    }
    let script = swarm.robots[0].script();
    swarm.robots[0].step().expect("the script goes on");
    let answers = swarm.robots[0].take_sent();
    let deletions = answers.iter().filter(|frame| match Message::<Full>::decode(frame, script) {
        Ok(Message::Entry(entry)) => entry.value.is_nil() && entry.owner == 9,
        _ => false,
    });
    let deletions = deletions.count();
    (swarm.last()[0] != size, deletions)
}

/// A robot whose neighbors had the same keys until it forgot the deletion deletes an old entry again, alone or not.
#[test]
fn a_robot_that_knows_all_keys_deletes_an_old_entry_again() {
    // The digest of the others may differ for 250 steps, as long as their entries travel.
    for steps in [0, 100, 240] {
        let mut swarm = swarm();
        swarm.steps(400 - steps);
        meet(&mut swarm, steps, 77);
        assert_eq!(old_entries(&mut swarm, [7]), (false, 1), "others differ for {steps} steps");
    }
}

/// A robot whose neighbors had other keys for long when it forgot the deletion may lack keys: it takes an old entry, unless the clock
/// floor of a neighbor has been another one in the last 50 steps.
#[test]
fn a_robot_that_may_lack_keys_takes_an_old_entry() {
    let mut swarm = swarm();
    swarm.steps(100);
    meet(&mut swarm, 300, 77);
    assert_eq!(old_entries(&mut swarm, [7]), (true, 0), "after a long difference");
    // The neighbor's entries change. The pause between two rounds for it doubles from 4 to 64, and from then on the robot no longer
    // heeds its floor.
    meet(&mut swarm, 20, 78);
    assert_eq!(old_entries(&mut swarm, [8]), (false, 0), "a new neighbor");
    meet(&mut swarm, 40, 78);
    assert_eq!(old_entries(&mut swarm, [8]), (false, 0), "the floor is heeded for 50 steps more");
    meet(&mut swarm, 30, 78);
    assert_eq!(old_entries(&mut swarm, [8]), (true, 0), "it is no longer heeded");
}

/// A robot deletes four entries again at once, and one more each two steps. If it has used up all answers, it waits for 16 steps.
#[test]
fn deletions_are_repeated_at_a_limited_rate() {
    let mut swarm = swarm();
    swarm.steps(401);
    assert_eq!(old_entries(&mut swarm, 10..16), (false, 4));
    swarm.steps(100);
    let answered: Vec<usize> = (0..96).filter(|_| old_entries(&mut swarm, [20]).1 == 1).collect();
    let at_once = answered.iter().zip(0..).take_while(|(step, number)| *step == number).count();
    assert!((6..=8).contains(&at_once), "{answered:?}");
    let later = &answered[at_once..];
    let pauses: Vec<usize> = later.windows(2).map(|two| two[1] - two[0]).collect();
    assert!(pauses.len() >= 3 && pauses.iter().all(|pause| *pause == 16), "{answered:?}");
}

/// A robot remembers a deletion whose key takes memory until it has the age of 64 s, and not longer.
#[test]
fn a_deletion_is_forgotten_in_time() {
    for (steps, expected) in [(399, 1), (400, 0)] {
        let mut swarm = swarm();
        swarm.steps(steps);
        let entries = swarm.robots[0].vm.stored_entries();
        let deleted = entries.filter(|entry| entry.value.is_nil()).count();
        assert_eq!(deleted, expected, "{steps}");
    }
}
