//! The generators of `<distribute>`. They give positions in meters and orientations in degrees.

use bittybuzz_random::Random;

use super::document::Element;
use super::mistake::{Allowed, Mistake};

/// A generator of vectors (`CreateGenerator` in ARGoS's space.cpp).
#[derive(Debug, Clone, PartialEq)]
pub enum Generator {
    Uniform { min: [f64; 3], max: [f64; 3] },
    Gaussian { mean: [f64; 3], deviation: [f64; 3] },
    Constant([f64; 3]),
    Grid { center: [f64; 3], distances: [f64; 3], layout: [u32; 3] },
}

impl Generator {
    pub fn read(element: Element<'_>) -> Option<Self> {
        let vector = |attribute| element.required_vector(attribute, Allowed::Any);
        match element.required_name("method")? {
            "uniform" => {
                let (min, max) = (vector("min"), vector("max"));
                let (min, max) = (min?, max?);
                if min.iter().zip(&max).any(|(min, max)| min > max) {
                    element.fail_at("min", Mistake::MinAboveMax);
                    return None;
                }
                Some(Generator::Uniform { min, max })
            }
            "gaussian" => {
                let deviation = element.required_vector("std_dev", Allowed::NotNegative);
                Some(Generator::Gaussian { mean: vector("mean")?, deviation: deviation? })
            }
            "constant" => vector("values").map(Generator::Constant),
            "grid" => {
                let layout = element.required_vector("layout", Allowed::Count(u32::MAX));
                let (center, distances) = (vector("center"), vector("distances"));
                // The allowed numbers are those of 32 bits.
                let layout = layout?.map(|number| number as u32);
                Some(Generator::Grid { center: center?, distances: distances?, layout })
            }
            name => {
                element.fail_at("method", Mistake::NoMethod { name: name.to_owned() });
                None
            }
        }
    }

    /// Returns the vector of entity `number`.
    pub fn draw(&self, number: u32, random: &mut Random) -> [f64; 3] {
        let axes = [0, 1, 2];
        match self {
            Generator::Uniform { min, max } => {
                axes.map(|axis| min[axis] + (max[axis] - min[axis]) * random.unit())
            }
            Generator::Gaussian { mean, deviation } => {
                axes.map(|axis| mean[axis] + deviation[axis] * random.normal())
            }
            Generator::Constant(values) => *values,
            Generator::Grid { center, distances, layout: [columns, rows, layers] } => {
                let place =
                    [number % columns, number / columns % rows, number / columns / rows % layers];
                let counts = [columns, rows, layers];
                // The first entity stands at the end of each axis.
                axes.map(|axis| {
                    let last = f64::from(counts[axis] - 1) * 0.5;
                    center[axis] + (last - f64::from(place[axis])) * distances[axis]
                })
            }
        }
    }

    /// Returns true if another draw for the same entity can give another vector.
    pub fn is_random(&self) -> bool {
        matches!(self, Generator::Uniform { .. } | Generator::Gaussian { .. })
    }

    /// Returns the number of entities that the generator can place: a grid has an end.
    pub fn places(&self) -> u64 {
        match self {
            Generator::Grid { layout, .. } => {
                layout.iter().map(|count| u64::from(*count)).fold(1, u64::saturating_mul)
            }
            _ => u64::MAX,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three columns 1 m apart and two rows 2 m apart around (10, 20).
    #[test]
    fn a_grid_begins_at_its_last_corner() {
        let grid = Generator::Grid {
            center: [10.0, 20.0, 0.0],
            distances: [1.0, 2.0, 0.0],
            layout: [3, 2, 1],
        };
        let mut random = Random::new(1);
        let places: Vec<[f64; 3]> = (0..6).map(|number| grid.draw(number, &mut random)).collect();
        let expected = [
            [11.0, 21.0, 0.0],
            [10.0, 21.0, 0.0],
            [9.0, 21.0, 0.0],
            [11.0, 19.0, 0.0],
            [10.0, 19.0, 0.0],
            [9.0, 19.0, 0.0],
        ];
        assert_eq!(places, expected);
        assert_eq!(grid.places(), 6);
    }
}
