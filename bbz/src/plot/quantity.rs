//! Names and units of columns.

use bittybuzz_arena::scenario::Quantity;

/// Ends of the names of columns, with the unit of their numbers.
const ENDS: [(&str, &str); 2] = [("_tenths_mm", "mm"), ("_tenths_deg", "°")];

/// A column of numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct PlotQuantity {
    /// The name of the column in the table.
    pub column: String,
    /// The name without a unit, as scenarios have it.
    pub name: String,
    unit: Option<&'static str>,
    /// The factor from the numbers of the table to the unit.
    pub factor: f64,
}

impl PlotQuantity {
    /// Returns the quantity of a column.
    pub fn of_column(column: &str) -> Self {
        for (end, unit) in ENDS {
            if let Some(name) = column.strip_suffix(end) {
                let (column, name) = (column.to_owned(), name.to_owned());
                return PlotQuantity { column, name, unit: Some(unit), factor: 0.1 };
            }
        }
        PlotQuantity {
            column: column.to_owned(),
            name: column.to_owned(),
            unit: unit(column),
            factor: 1.0,
        }
    }

    /// Returns true for the name of the quantity or of its column.
    pub fn is(&self, name: &str) -> bool {
        name == self.name || name == self.column
    }

    /// Returns the name with the unit.
    pub fn label(&self) -> String {
        match self.unit {
            Some(unit) => format!("{} in {unit}", self.name),
            None => self.name.clone(),
        }
    }
}

/// Returns the unit of a column whose name has none.
fn unit(column: &str) -> Option<&'static str> {
    let is_time = ["first.", "since."].iter().any(|start| column.starts_with(start));
    if is_time || column == "first_crash" {
        return Some("s");
    }
    // The numbers of runs have the mean and the extremes of quantities of `plot`.
    let starts = ["mean ", "min ", "max "];
    let quantity = starts.iter().find_map(|start| column.strip_prefix(start)).unwrap_or(column);
    Quantity::parse(quantity)?.unit()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_have_units() {
        for (column, label) in [
            ("x_tenths_mm", "x in mm"),
            ("distance(0, 0)_tenths_mm", "distance(0, 0) in mm"),
            ("heading_tenths_deg", "heading in °"),
            ("swarm.spread", "swarm.spread in mm"),
            ("mean x", "mean x in mm"),
            ("since.far", "since.far in s"),
            ("first_crash", "first_crash in s"),
            ("global.x", "global.x"),
            ("share(led == 4)", "share(led == 4)"),
        ] {
            assert_eq!(PlotQuantity::of_column(column).label(), label);
        }
    }
}
