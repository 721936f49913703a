//! `[output]`: the results of a run that are kept.

use bittybuzz_toml_reader::Place;

use super::condition::quantity;
use super::error::ScenarioCause;
use super::keys::OUTPUT;
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
}

pub fn read(root: &Section<'_>, robot_index: &RobotIndex, duration: f64) -> OutputSection {
    let mut output = OutputSection { every: 1.0, plot: Vec::new() };
    let Some(section) = root.section("output", OUTPUT) else { return output };
    if let Some(every) = section.get("every").and_then(|entry| seconds(&entry, 0.1..=3600.0)) {
        output.every = every;
    }
    let items = section.get("plot").and_then(|entry| entry.list()).unwrap_or_default();
    let quantities =
        items.iter().filter_map(|item| Some((quantity(item, duration)?, item.place())));
    output.plot = quantities.collect();
    for (quantity, place) in &output.plot {
        if robot_index.none_provides(quantity) {
            root.reader.fail_at(place, ScenarioCause::Unseen { quantity: quantity.to_string() });
        }
    }
    output
}
