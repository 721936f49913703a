//! `[[measure]]`: numbers and times of a run, which become columns of tables and give no verdict.

use super::column::{ColumnNames, OWN_COLUMNS};
use super::condition::{self, Condition, Of};
use super::error::ScenarioCause;
use super::expect::not_after_end;
use super::keys::MEASURE;
use super::read::Section;
use super::select::RobotIndex;
use super::time::seconds;

/// A number or a time of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    /// The name of the column, unique in the scenario.
    pub name: String,
    /// The time of the number.
    pub time: MeasureTime,
    /// The number, or the condition of which the measure is the time or the truth.
    pub condition: Condition,
}

/// The time at which a measure is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MeasureTime {
    /// At this time in seconds: the number, or the truth of the condition as 1 or 0.
    At(f64),
    /// At the end of the run: the number, or the truth of the condition as 1 or 0.
    End,
    /// The measure is the first time in seconds at which the condition is true. A run that ends
    /// before has none.
    First,
}

impl Measure {
    /// Returns true if the measure is of a condition, and not of a number.
    pub fn is_of_condition(&self) -> bool {
        self.condition.test.is_some() || self.condition.of == Of::Agree
    }
}

/// Reads the measures of a file.
pub fn read_all(root: &Section<'_>, robot_index: &RobotIndex, duration: f64) -> Vec<Measure> {
    let sections = root.sections("measure", MEASURE);
    let mut names = ColumnNames::new("a measure");
    let measures = sections.iter().map(|section| {
        let name = section.required("name").and_then(|entry| {
            let name = names.read(section)?;
            if OWN_COLUMNS.contains(&name.as_str()) {
                entry.fail(ScenarioCause::TakenColumn { name });
                return None;
            }
            Some(name)
        });
        let time = time(section, duration);
        let condition = condition::read(section, robot_index, duration, false);
        Some(Measure { name: name?, time: time?, condition: condition? })
    });
    // All measures are read before one with a mistake is left out, so that every mistake is found.
    measures.collect::<Vec<Option<Measure>>>().into_iter().flatten().collect()
}

fn time(section: &Section<'_>, duration: f64) -> Option<MeasureTime> {
    match section.get("at") {
        None if condition::compares(section) => Some(MeasureTime::First),
        None => Some(MeasureTime::End),
        Some(entry) if entry.value.as_str().is_some() => entry.word(&[("end", MeasureTime::End)]),
        Some(entry) => {
            let time = seconds(&entry, 0.0..=f64::MAX)?;
            not_after_end(&entry, "at", time, duration)?;
            Some(MeasureTime::At(time))
        }
    }
}
