//! All states within bounds that are explored in seconds.

use bittybuzz_model::replica::Rule;
use bittybuzz_model::world::Bounds;
use stateright::{Checker, Model};

fn check(bounds: Bounds) {
    let checker = bounds.checker().spawn_bfs().join();
    println!("{bounds:?}: {} states", checker.unique_state_count());
    checker.assert_properties();
}

const BOUNDS: Bounds = Bounds { rule: Rule::Default, puts: 3, forgets: 0, gets: 0 };

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
    check(Bounds { forgets: 1, ..BOUNDS });
}

#[test]
fn questions_change_nothing() {
    check(Bounds { puts: 2, gets: 1, ..BOUNDS });
}

#[test]
#[ignore = "a minute without optimisation"]
fn four_puts() {
    check(Bounds { puts: 4, ..BOUNDS });
}
