//! One robot that does not keep the rules: it begins long messages and never ends them.

use bittybuzz_testkit::Swarm;
use bittybuzz_vm_core::message::{Fragment, Message};
use bittybuzz_vm_core::number::Tiny;

/// Robot 2 sends a table in each step, which needs fragments; robot 1 counts those it receives in the last 100 steps.
const TABLES: &str = "n = 0
    t = 0
    function init() { neighbors.listen(\"x\", function(topic, value, robot) { if(t >= 500) n = n + 1 }) }
    function step() {
        t = t + 1
        if(id == 2) neighbors.broadcast(\"x\", {.a = t, .b = 2})
        log(n)
    }";

/// Runs 600 steps, in which a third robot sends the fragment that `babble` returns, if it returns one.
fn received(babble: impl Fn(usize) -> Option<(u8, u8)>) -> i32 {
    let mut swarm: Swarm<Tiny> = Swarm::new(2, TABLES);
    for step in 0..600 {
        if let Some((number, index)) = babble(step) {
            let content = &[1, 2, 3, 4, 5, 6];
            let fragment = Fragment { robot: 99, number, index, last: false, content };
            let frame = swarm.robots[0].frame(&Message::Fragment(fragment));
            swarm.inject(&frame, [0]);
        }
        swarm.step();
    }
    swarm.last()[0].parse().expect("a number")
}

#[test]
fn tables_arrive_where_all_is_well() {
    assert_eq!(received(|_| None), 100);
}

/// The fragment that begins a message, over and over, keeps the room for at most two seconds.
#[test]
fn a_fragment_that_is_repeated_does_not_keep_the_room() {
    for period in [1, 5, 15, 19] {
        let heard = received(|step| step.is_multiple_of(period).then_some((7, 0)));
        assert!(heard > 0, "a fragment every {period} steps: {heard} of 100");
    }
}

/// Neither does a robot that begins another message each time.
#[test]
fn messages_that_are_begun_again_do_not_keep_the_room() {
    for period in [1, 5, 15, 19] {
        let heard = received(|step| step.is_multiple_of(period).then_some((step as u8, 0)));
        assert!(heard > 0, "a fragment every {period} steps: {heard} of 100");
    }
}

/// A message that comes on as slowly as it can keeps the room for eight fragments, 16 s; then others have their turn.
#[test]
fn a_slow_message_keeps_the_room_for_a_while() {
    let slow = |step: usize| {
        step.is_multiple_of(19).then_some(((step / 152) as u8, (step / 19 % 8) as u8))
    };
    // The second message of the hostile robot begins at step 152, and is not let in at once.
    let heard = received(|step| if step < 440 { slow(step + 152) } else { slow(step - 440) });
    assert!(heard > 0, "{heard} of 100");
}
