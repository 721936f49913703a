//! Flights of the whole flight controller in the physics, each with one fault.

mod fault;
mod flight;
mod pilot;
mod report;

use report::Report;

#[test]
fn fifty_flights_with_a_fault() {
    Report::of((0..50).map(|number| number * 10 + number / 19)).check();
}

#[test]
#[ignore = "takes a minute: cargo test --release -p bittybuzz-crazyflie-physics --test faults -- --ignored"]
fn five_hundred_flights_with_a_fault() {
    Report::of(0..500).check();
}
