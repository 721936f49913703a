//! Designs that draw points: random ones, and Latin hypercubes.

use bittybuzz_random::Random;

use super::{Axis, ParameterValue};

/// A parameter whose values are drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Dimension {
    pub key: String,
    pub range: Range,
}

/// The values that a parameter can have.
#[derive(Debug, Clone, PartialEq)]
pub enum Range {
    /// All integers from the first to the second, both included.
    Integers(i64, i64),
    /// All floats from the first to the second.
    Floats(f64, f64),
    /// One of these; at least one.
    Choice(Vec<ParameterValue>),
}

/// A way to draw points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Draw {
    /// Each point is independent of the others. A longer list begins with the shorter one.
    Random,
    /// Latin hypercube sampling (McKay, Beckman and Conover 1979): each parameter's range is
    /// divided into as many equal parts as there are points, and each part has one point.
    LatinHypercube,
}

impl Range {
    /// Returns the value at a share of the range, 0 (inclusive) to 1 (exclusive).
    fn at(&self, share: f64) -> ParameterValue {
        match self {
            Range::Integers(first, last) => {
                let count = (i128::from(*last) - i128::from(*first) + 1) as f64;
                let number = i128::from(*first) + (share * count) as i128;
                ParameterValue::Integer(number.clamp((*first).into(), (*last).into()) as i64)
            }
            Range::Floats(first, last) => ParameterValue::Float(first + share * (last - first)),
            Range::Choice(values) => {
                let index = (share * values.len() as f64) as usize;
                values[index.min(values.len() - 1)].clone()
            }
        }
    }
}

/// Draws points, which are the same for equal seeds.
pub fn draw(draw: Draw, dimensions: &[Dimension], points: u32, seed: u32) -> Axis {
    let columns: Vec<Vec<f64>> = (0..dimensions.len() as u64)
        .map(|number| {
            let mut random = Random::for_purpose(seed.into(), number);
            match draw {
                Draw::Random => (0..points).map(|_| random.unit()).collect(),
                Draw::LatinHypercube => strata(points, &mut random),
            }
        })
        .collect();
    let row = |index: usize| {
        let shares = columns.iter().map(|column| column[index]);
        dimensions.iter().zip(shares).map(|(dimension, share)| dimension.range.at(share)).collect()
    };
    let keys = dimensions.iter().map(|dimension| dimension.key.clone()).collect();
    Axis { keys, rows: (0..points as usize).map(row).collect() }
}

/// Returns a number in each of `count` equal parts of 0 to 1, in random order.
fn strata(count: u32, random: &mut Random) -> Vec<f64> {
    let mut parts: Vec<u32> = (0..count).collect();
    for last in (1..parts.len()).rev() {
        parts.swap(last, random.below(last as u32 + 1) as usize);
    }
    parts.iter().map(|part| (f64::from(*part) + random.unit()) / f64::from(count)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dimensions() -> Vec<Dimension> {
        let words = ["p", "q", "r"].map(|word| ParameterValue::Text(word.to_owned()));
        let of = |key: &str, range| Dimension { key: key.to_owned(), range };
        vec![
            of("a", Range::Floats(-1.0, 3.0)),
            of("b", Range::Integers(1, 20)),
            of("c", Range::Choice(words.to_vec())),
        ]
    }

    #[test]
    fn each_part_of_a_latin_hypercube_has_one_point() {
        let axis = draw(Draw::LatinHypercube, &dimensions(), 60, 5);
        assert_eq!(axis.rows.len(), 60);
        let mut parts: Vec<usize> = axis
            .rows
            .iter()
            .map(|row| match row[0] {
                ParameterValue::Float(number) => ((number + 1.0) / 4.0 * 60.0) as usize,
                _ => panic!("{row:?}"),
            })
            .collect();
        parts.sort_unstable();
        assert_eq!(parts, (0..60).collect::<Vec<usize>>());
        let count = |value: &ParameterValue, column: usize| {
            axis.rows.iter().filter(|row| row[column] == *value).count()
        };
        // Sixty points have each of twenty integers three times, and each of three words twenty times.
        assert!((1..=20).all(|number| count(&ParameterValue::Integer(number), 1) == 3));
        assert_eq!(count(&ParameterValue::Text("q".to_owned()), 2), 20);
    }

    #[test]
    fn random_points_are_in_their_ranges_and_can_grow() {
        let few = draw(Draw::Random, &dimensions(), 50, 5);
        let many = draw(Draw::Random, &dimensions(), 500, 5);
        assert_eq!(many.rows[..50], few.rows);
        assert_ne!(draw(Draw::Random, &dimensions(), 50, 6), few);
        let floats = many.rows.iter().map(|row| match row[0] {
            ParameterValue::Float(number) => number,
            _ => panic!("{row:?}"),
        });
        let floats: Vec<f64> = floats.collect();
        assert!(floats.iter().all(|number| (-1.0..3.0).contains(number)));
        let mean = floats.iter().sum::<f64>() / 500.0;
        // The standard error of the mean of 500 uniform numbers of a range of 4 is 0.052.
        assert!((mean - 1.0).abs() < 0.21, "{mean}");
        assert_eq!(Range::Integers(i64::MIN, i64::MAX).at(0.0), ParameterValue::Integer(i64::MIN));
    }
}
