//! Flights of the whole flight controller in the physics, each with one fault.

mod fault;
mod flight;
mod pilot;
mod report;

use report::Report;

#[test]
fn five_hundred_flights_with_a_fault() {
    Report::of(0..500).check();
}
