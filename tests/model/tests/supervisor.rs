//! All flights within bounds that are explored in seconds.

use bittybuzz_flight::supervisor::Supervisor;
use bittybuzz_model::supervisor::{ALWAYS, FALLS, FlightBounds, LOSSES, OTHERS, REQUESTS};
use stateright::{Checker, Model};

/// Explores all states. Returns the checker, as properties that ask for a state need all
/// conditions.
fn explore(bounds: FlightBounds<Supervisor>) -> impl Checker<FlightBounds<Supervisor>> {
    let checker = bounds.checker().spawn_bfs().join();
    println!("{} states, {} steps", checker.unique_state_count(), checker.state_count());
    for property in ALWAYS {
        checker.assert_no_discovery(property);
    }
    checker
}

/// Steps of a second pass the short timers at once and let the long ones end.
#[test]
fn any_two_conditions() {
    let bounds = FlightBounds::new(&[1000], &[REQUESTS, FALLS, LOSSES, OTHERS]);
    explore(bounds).assert_properties();
}

#[test]
fn falls_in_short_steps() {
    explore(FlightBounds::new(&[100], &[REQUESTS, FALLS]));
}

#[test]
fn losses_in_short_steps() {
    explore(FlightBounds::new(&[250], &[REQUESTS, LOSSES]));
}
