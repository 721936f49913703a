//! `[output]`: the results of a run that are kept.

use bittybuzz_toml_reader::Place;

use super::condition::quantity;
use super::error::ScenarioCause;
use super::keys::{DATA, OUTPUT};
use super::read::Section;
use super::select::RobotIndex;
use super::time::seconds;
use super::value::Quantity;

/// The results of a run that are kept for pictures and tables.
#[derive(Debug, Clone, PartialEq)]
pub struct OutputSection {
    /// Seconds between two samples of pictures and recordings.
    pub every: f64,
    /// Quantities to show over time, with the place of each in the file.
    pub plot: Vec<(Quantity, Place)>,
    /// The tables for programs that evaluate them.
    pub data: DataSection,
}

/// The tables of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct DataSection {
    /// Seconds between two samples.
    pub every: f64,
    /// The quantities that are columns, with the place of each in the file; `None` for those that every
    /// robot has.
    pub quantities: Option<Vec<(Quantity, Place)>>,
    /// True if there is a table of messages.
    pub messages: bool,
}

impl DataSection {
    /// The quantities that are columns if the file names none.
    pub const USUAL: [Quantity; 5] =
        [Quantity::X, Quantity::Y, Quantity::Heading, Quantity::Led, Quantity::Running];
}

pub fn read(root: &Section<'_>, robot_index: &RobotIndex, duration: f64) -> OutputSection {
    let data = DataSection { every: 1.0, quantities: None, messages: false };
    let mut output = OutputSection { every: 1.0, plot: Vec::new(), data };
    let Some(section) = root.section("output", OUTPUT) else { return output };
    let every = |section: &Section<'_>| {
        section.get("every").and_then(|entry| seconds(&entry, 0.1..=3600.0))
    };
    output.every = every(&section).unwrap_or(output.every);
    output.data.every = output.every;
    output.plot = quantities(&section, "plot", robot_index, duration).unwrap_or_default();
    if let Some(section) = section.section("data", DATA) {
        output.data.every = every(&section).unwrap_or(output.data.every);
        output.data.quantities = quantities(&section, "quantities", robot_index, duration);
        output.data.messages = section.boolean("messages").unwrap_or(false);
    }
    output
}

/// Reads a list of quantities, of which each must be one of a robot.
fn quantities(
    section: &Section<'_>,
    key: &str,
    robot_index: &RobotIndex,
    duration: f64,
) -> Option<Vec<(Quantity, Place)>> {
    let items = section.get(key)?.list()?;
    let quantities: Vec<_> =
        items.iter().filter_map(|item| Some((quantity(item, duration)?, item.place()))).collect();
    for (quantity, place) in &quantities {
        if robot_index.none_provides(quantity) {
            let cause = ScenarioCause::Unseen { quantity: quantity.to_string() };
            section.reader.fail_at(place, cause);
        }
    }
    Some(quantities)
}
