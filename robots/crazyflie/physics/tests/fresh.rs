//! Flights with other numbers than those with which limits were chosen. `cargo xtask soak flights`
//! gives the numbers, and keeps the worst value of each figure with its flight.

use std::env;
use std::ops::Range;

/// The variable with the numbers of the flights, such as `20000..20500`.
const NUMBERS: &str = "BITTYBUZZ_FLIGHTS";

/// Returns the numbers of the flights.
pub fn numbers() -> Range<usize> {
    let text = env::var(NUMBERS).expect("`cargo xtask soak flights` sets the numbers");
    let (first, end) = text.split_once("..").expect("FIRST..END");
    let [first, end] = [first, end].map(|number| number.parse().expect("a number"));
    first..end
}

/// Prints the largest value of a figure with the number of its flight. Flights without the figure
/// have no value.
pub fn print_worst(figure: &str, values: impl Iterator<Item = (usize, Option<f64>)>) {
    let values = values.filter_map(|(number, value)| Some((number, value?)));
    if let Some((number, value)) = values.max_by(|(_, one), (_, other)| one.total_cmp(other)) {
        println!("worst: {figure} = {value} in flight {number}");
    }
}

/// Prints the number of flights of a kind.
pub fn print_count(name: &str, count: usize) {
    println!("count: {name} = {count}");
}
