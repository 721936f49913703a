//! The numbers of a curve, by their places on the horizontal axis, and their quartiles.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use bittybuzz_arena::output::CurvePoint;
use bittybuzz_arena::statistics::quartiles;

/// A place on the horizontal axis.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place(f64);

impl Eq for Place {}

impl Ord for Place {
    fn cmp(&self, other: &Self) -> Ordering {
        self.0.total_cmp(&other.0)
    }
}

impl PartialOrd for Place {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// The numbers of a curve.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    /// The numbers at each place; none where all values are missing.
    numbers: BTreeMap<Place, Vec<f64>>,
    /// The runs that have a number.
    runs: BTreeSet<u64>,
    /// The number of missing values.
    missing: usize,
}

impl Samples {
    /// Adds the value of a run; NaN for one that is missing.
    pub fn add(&mut self, place: f64, value: f64, run: u64) {
        // Zero has two signs.
        let numbers = self.numbers.entry(Place(place + 0.0)).or_default();
        if value.is_nan() {
            self.missing += 1;
        } else {
            numbers.push(value);
            self.runs.insert(run);
        }
    }

    /// Returns the points of the curve.
    pub fn points(&self) -> Vec<CurvePoint> {
        let point = |(place, numbers): (&Place, &Vec<f64>)| CurvePoint {
            x: place.0,
            quartiles: quartiles(numbers)
                .map(|[_, lower, median, upper, _]| [lower, median, upper]),
        };
        self.numbers.iter().map(point).collect()
    }
}

/// The things whose values a point has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Units {
    /// Robots, in one run or several.
    Robots,
    /// Runs, over time.
    RunsOverTime,
    /// Runs, against a parameter.
    Runs,
}

/// Returns the sentence that counts the robots or runs of the quartiles, and those that are left out.
/// `pooled` names the parameters of which each curve has all values.
pub fn caption(curves: &[Samples], units: Units, pooled: &[String]) -> String {
    let counts = curves.iter().flat_map(|curve| curve.numbers.values().map(Vec::len));
    let Some([least, most]) = extremes(counts.filter(|count| *count > 0)) else {
        return "No values".to_owned();
    };
    let each = if curves.len() > 1 || units == Units::Runs { " each" } else { "" };
    let noun = if units == Units::Robots { "robot" } else { "run" };
    if most == 1 {
        return format!("Values of one {noun}{each}");
    }
    let mut text = format!("Median and quartiles of {} {noun}s", span([least, most]));
    let runs = extremes(curves.iter().map(|curve| curve.runs.len()).filter(|count| *count > 0));
    if let Some(runs) = runs.filter(|[_, most]| units == Units::Robots && *most > 1) {
        text += &format!(" in {} runs", span(runs));
    }
    text += each;
    if !pooled.is_empty() {
        text += &format!(", of all values of {}", pooled.join(" and "));
    }
    let missing: usize = curves.iter().map(|curve| curve.missing).sum();
    match units {
        Units::Runs if missing == 1 => text += "; one run without a value is left out",
        Units::Runs if missing > 1 => {
            text += &format!("; {missing} runs without a value are left out");
        }
        Units::Robots | Units::RunsOverTime if least != most => {
            text += ": those that have a value at the time";
        }
        _ => {}
    }
    text
}

fn extremes(mut counts: impl Iterator<Item = usize>) -> Option<[usize; 2]> {
    let first = counts.next()?;
    Some(counts.fold([first; 2], |[least, most], count| [least.min(count), most.max(count)]))
}

fn span([least, most]: [usize; 2]) -> String {
    if least == most { format!("{most}") } else { format!("{least} to {most}") }
}
