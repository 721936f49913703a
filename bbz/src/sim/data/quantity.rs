//! A quantity of a robot as a column of integers or numbers.

use bittybuzz_arena::run::QuantityProbe;
use bittybuzz_arena::scenario::Quantity;
use bittybuzz_tables::{Cells, Column, Kind};

use crate::data::{Cell, optional_integer};

/// The form of the values of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Values {
    /// Tenths of a unit: of a millimeter, or of a degree.
    Tenths,
    /// Whole numbers.
    Whole,
    /// Any numbers.
    Any,
}

/// A quantity that becomes a column.
pub struct QuantityColumn {
    pub probe: QuantityProbe,
    pub name: String,
    values: Values,
}

impl QuantityColumn {
    /// Returns the column of a quantity.
    pub fn new(quantity: &Quantity, probe: QuantityProbe) -> Self {
        let (unit, values) = match quantity {
            Quantity::X
            | Quantity::Y
            | Quantity::Z
            | Quantity::Distance(_)
            | Quantity::Displacement(_) => ("_tenths_mm", Values::Tenths),
            Quantity::Heading => ("_tenths_deg", Values::Tenths),
            Quantity::Inside(_)
            | Quantity::Led
            | Quantity::Neighbors
            | Quantity::Free
            | Quantity::Running
            | Quantity::Steps
            | Quantity::Faults
            | Quantity::Restarts
            | Quantity::HandlerFaults
            | Quantity::Overruns
            | Quantity::Crashes => ("", Values::Whole),
            Quantity::Global { .. }
            | Quantity::Stigmergy { .. }
            | Quantity::Swarm(_)
            | Quantity::Aggregate(_) => ("", Values::Any),
        };
        QuantityColumn { probe, name: format!("{quantity}{unit}"), values }
    }

    /// Returns the column in the table.
    pub fn column(&self) -> Column {
        match self.values {
            Values::Tenths | Values::Whole => optional_integer(&self.name),
            Values::Any => Column::new(&self.name, Kind::OptionalNumber),
        }
    }

    /// Adds the numbers of one robot after the other to the cells of the column.
    pub fn extend(&self, cells: &mut Cells, numbers: impl Iterator<Item = Option<f64>>) {
        match (self.values, cells) {
            (Values::Tenths, Cells::OptionalIntegers(cells)) => {
                cells.extend(numbers.map(|number| number.and_then(|mm| integer(mm * 10.0))));
            }
            (Values::Whole, Cells::OptionalIntegers(cells)) => {
                cells.extend(numbers.map(|number| number.and_then(integer)));
            }
            (Values::Any, Cells::OptionalNumbers(cells)) => cells.extend(numbers),
            (_, cells) => unreachable!("{cells:?} are no cells of the column {}", self.name),
        }
    }

    /// Returns the cell of a number.
    pub fn cell(&self, number: Option<f64>) -> Cell {
        match self.values {
            Values::Tenths => Cell::OptionalInteger(number.and_then(|mm| integer(mm * 10.0))),
            Values::Whole => Cell::OptionalInteger(number.and_then(integer)),
            Values::Any => Cell::OptionalNumber(number),
        }
    }
}

/// Rounds a number; `None` if it is outside of 32-bit integers.
fn integer(number: f64) -> Option<i32> {
    let rounded = number.round();
    let fits = (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&rounded);
    fits.then_some(rounded as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_rounded_and_never_wrap() {
        assert_eq!(integer(1234.5), Some(1235));
        assert_eq!(integer(-0.4), Some(0));
        assert_eq!(integer(2_147_483_647.4), Some(i32::MAX));
        assert_eq!(integer(2_147_483_648.0), None);
        assert_eq!(integer(f64::NAN), None);
        assert_eq!(integer(f64::NEG_INFINITY), None);
    }
}
