//! Flights of the whole flight controller under effects that persist and on which the sensors agree:
//! wind, a touch, a mat on the floor, cameras that were calibrated again, a slow radio, a better flow
//! sensor. Each costs accuracy and none ends the flight.

mod adoption;
mod disturbance;
mod flight;
mod floor;
mod report;

use report::Report;

use crate::fresh::numbers;

/// The limits of the flight controller were chosen with numbers from 10,000 on.
#[test]
fn two_hundred_flights_under_disturbances() {
    Report::of(0..200).check();
}

#[test]
#[ignore = "`cargo xtask soak flights` runs it"]
fn fresh_flights_under_disturbances() {
    let report = Report::of(numbers());
    report.print_figures();
    report.check();
}

/// Prints the table of the numbers with which limits are chosen, and asserts nothing.
#[test]
#[ignore = "prints figures"]
fn report_disturbances() {
    Report::of(10_000..10_200).print();
}
