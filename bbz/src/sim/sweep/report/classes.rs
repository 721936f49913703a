//! The values of a parameter as classes: few values each alone, many numbers in intervals.

use std::collections::BTreeSet;

use bittybuzz_arena::output::CELLS_MAX;
use bittybuzz_arena::sweep::{ParameterValue, Plan};

/// Intervals of a parameter that has more values than a picture has room for.
const INTERVALS: usize = 12;

/// The classes of the values of a parameter, in their order.
#[derive(Debug, Clone, PartialEq)]
pub struct Classes {
    /// The parameter's column, with the number of intervals if there are any.
    pub name: String,
    pub names: Vec<String>,
    /// The place of each class on an axis; `None` if not all values are numbers.
    pub places: Option<Vec<f64>>,
    /// The class of each point.
    pub of_points: Vec<usize>,
}

impl Classes {
    /// Returns the classes of a parameter of a plan; `None` if it has one value, or too many texts.
    pub fn of(plan: &Plan, parameter: usize) -> Option<Classes> {
        let name = plan.parameters[parameter].name.clone();
        let values = || plan.points.iter().map(|point| &point[parameter]);
        let numbers: Option<Vec<f64>> = values().map(number).collect();
        match numbers {
            Some(numbers) => of_numbers(name, &numbers, values().map(ToString::to_string)),
            None => of_texts(name, values().map(ToString::to_string).collect()),
        }
    }
}

/// Returns the number of a value.
fn number(value: &ParameterValue) -> Option<f64> {
    match value {
        ParameterValue::Integer(number) => Some(*number as f64),
        ParameterValue::Float(number) => Some(*number),
        ParameterValue::Text(_) | ParameterValue::Other(_) => None,
    }
}

fn of_numbers(
    name: String,
    numbers: &[f64],
    texts: impl Iterator<Item = String>,
) -> Option<Classes> {
    let mut places = numbers.to_vec();
    places.sort_by(f64::total_cmp);
    // Zero has two signs.
    places.dedup_by(|one, other| one == other);
    let [low, high] = [*places.first()?, *places.last()?];
    if places.len() == 1 {
        return None;
    }
    if places.len() <= CELLS_MAX {
        let class = |number: &f64| places.partition_point(|place| place < number);
        let of_points: Vec<usize> = numbers.iter().map(class).collect();
        let mut names = vec![String::new(); places.len()];
        for (class, text) in of_points.iter().zip(texts) {
            names[*class] = text;
        }
        return Some(Classes { name, names, places: Some(places), of_points });
    }
    let width = (high - low) / INTERVALS as f64;
    let class = |number: &f64| (((number - low) / width) as usize).min(INTERVALS - 1);
    let of_points = numbers.iter().map(class).collect();
    let places: Vec<f64> = (0..INTERVALS).map(|at| low + (at as f64 + 0.5) * width).collect();
    // Enough digits for the middles of the intervals to differ.
    let decimals = (1.0 - width.log10()).ceil().clamp(0.0, 12.0) as usize;
    let names = places.iter().map(|place| format!("{place:.decimals$}")).collect();
    let name = format!("{name} (middles of {INTERVALS} intervals)");
    Some(Classes { name, names, places: Some(places), of_points })
}

fn of_texts(name: String, texts: Vec<String>) -> Option<Classes> {
    let names: BTreeSet<&String> = texts.iter().collect();
    if names.len() < 2 || names.len() > CELLS_MAX {
        return None;
    }
    let names: Vec<String> = names.into_iter().cloned().collect();
    let class = |text: &String| names.binary_search(text).expect("each text is one of the names");
    let of_points = texts.iter().map(class).collect();
    Some(Classes { name, names, places: None, of_points })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_arena::sweep::{Chance, Parameter, cross, parse_set};

    fn classes(set: &str) -> Option<Classes> {
        let axis = parse_set(set).unwrap();
        let parameter = Parameter { key: "a".to_owned(), name: "a".to_owned(), place: None };
        let points = cross(&[axis], 1, 1000).unwrap();
        let plan =
            Plan { parameters: vec![parameter], points, replicates: 1, chance: Chance::Common };
        Classes::of(&plan, 0)
    }

    #[test]
    fn few_values_are_classes_of_their_own() {
        let found = classes("a=10,2.5,0.0,-0.0").unwrap();
        assert_eq!(found.places, Some(vec![0.0, 2.5, 10.0]));
        assert_eq!(found.of_points, [2, 1, 0, 0]);
        assert_eq!(found.names[2], "10");
        let found = classes("a=red,blue,red").unwrap();
        assert_eq!((found.places, found.of_points), (None, vec![1, 0, 1]));
    }

    #[test]
    fn many_numbers_are_in_intervals() {
        let found = classes("a=0:120").unwrap();
        assert_eq!(found.names.len(), INTERVALS);
        assert_eq!((found.of_points[0], found.of_points[120]), (0, INTERVALS - 1));
        assert_eq!((&*found.names[0], &*found.names[11]), ("5", "115"));
        let small = classes("a=0.0:0.012:0.0001").unwrap();
        assert_eq!(small.names[0], "0.0005");
        assert_eq!(small.names.iter().collect::<BTreeSet<_>>().len(), INTERVALS);
    }

    #[test]
    fn one_value_and_many_texts_have_no_picture() {
        assert_eq!(classes("a=7"), None);
        let texts: Vec<String> = (0..=CELLS_MAX).map(|number| format!("t{number}")).collect();
        assert_eq!(classes(&format!("a={}", texts.join(","))), None);
    }
}
