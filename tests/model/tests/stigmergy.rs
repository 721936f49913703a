//! All states within bounds that are explored in seconds.

use bittybuzz_model::replica::Rule;
use bittybuzz_model::world::Bounds;
use bittybuzz_vm_core::message::CLOCK_MAX;
use stateright::{Checker, Model};

fn check(bounds: Bounds) {
    let checker = bounds.checker().spawn_bfs().join();
    println!("{bounds:?}: {} states", checker.unique_state_count());
    checker.assert_properties();
}

const BOUNDS: Bounds =
    Bounds { rule: Rule::Default, puts: 3, forgets: 0, gets: 0, start: 0, forged: 0 };

#[test]
fn replicas_converge_whatever_is_lost() {
    check(BOUNDS);
}

#[test]
fn a_handler_that_does_not_look_at_sides_converges() {
    check(Bounds { rule: Rule::LowerRobot, ..BOUNDS });
}

#[test]
fn robots_may_forget() {
    check(Bounds { puts: 2, forgets: 1, ..BOUNDS });
}

#[test]
#[ignore = "a minute without optimization"]
fn robots_may_forget_one_of_three_puts() {
    check(Bounds { forgets: 1, ..BOUNDS });
}

#[test]
fn gets_change_nothing() {
    check(Bounds { puts: 2, gets: 1, ..BOUNDS });
}

/// After the greatest clock follows 1.
#[test]
fn the_greatest_clock_is_not_the_last() {
    for start in [CLOCK_MAX - 2, CLOCK_MAX - 1, CLOCK_MAX] {
        check(Bounds { start, puts: 2, ..BOUNDS });
    }
}

#[test]
fn a_forged_entry_is_agreed_on_and_does_not_last() {
    for start in [0, CLOCK_MAX - 1] {
        check(Bounds { forged: 1, puts: 1, start, ..BOUNDS });
    }
}

#[test]
#[ignore = "a minute without optimization"]
fn two_forged_entries() {
    check(Bounds { forged: 2, puts: 1, ..BOUNDS });
}

#[test]
#[ignore = "a minute without optimization"]
fn four_puts() {
    check(Bounds { puts: 4, ..BOUNDS });
}
