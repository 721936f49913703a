//! `[[expect]]`: conditions on a run, so that a scenario is a test.

use bittybuzz_toml_reader::{TomlError, number_text};
use toml::de::DeValue;

use super::column::ColumnNames;
use super::condition::{self, Condition};
use super::error::ScenarioCause;
use super::keys::EXPECT;
use super::read::{Entry, Section};
use super::select::RobotIndex;
use super::time::{check_ticks, seconds};

/// A condition on robots, and the time at which it must hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Expect {
    /// The name, unique in the scenario.
    pub name: Option<String>,
    /// The time at which, or for which, it must hold.
    pub when: When,
    /// The condition.
    pub condition: Condition,
}

/// The time at which an expectation must hold, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum When {
    /// At this time.
    At(f64),
    /// At some time from the start to this one.
    Within(f64),
    /// Throughout the time from the first to the second.
    Always(f64, f64),
}

const TIMES: &[&str] = &["at", "within", "always"];

/// Reads the expectations of a file.
pub fn read_all(root: &Section<'_>, robot_index: &RobotIndex, duration: f64) -> Vec<Expect> {
    let sections = root.sections("expect", EXPECT);
    let mut names = ColumnNames::new("an expectation");
    let names: Vec<Option<String>> = sections.iter().map(|section| names.read(section)).collect();
    let expects = sections.iter().zip(names);
    expects.filter_map(|(section, name)| read(section, name, robot_index, duration)).collect()
}

fn read(
    section: &Section<'_>,
    name: Option<String>,
    robot_index: &RobotIndex,
    duration: f64,
) -> Option<Expect> {
    let when = when(section, duration);
    let condition = condition::read(section, robot_index, duration, true);
    Some(Expect { name, when: when?, condition: condition? })
}

fn when(section: &Section<'_>, duration: f64) -> Option<When> {
    let (key, entry) = section.one_of(TIMES)?;
    if key == "always" && matches!(entry.value, DeValue::Array(_)) {
        let [from, to] = entry.numbers("a time or two as [from, to]", 0.0..=f64::MAX)?;
        for (item, time) in entry.list()?.iter().zip([from, to]) {
            check_ticks(item, time)?;
        }
        not_after_end(&entry, key, to.max(from), duration)?;
        if to < from {
            let range = "the second time comes after the first".to_owned();
            let value = format!("[{}, {}]", number_text(from), number_text(to));
            entry.fail(TomlError::OutOfRange { key: entry.key.clone(), value, range });
            return None;
        }
        return Some(When::Always(from, to));
    }
    let time = seconds(&entry, 0.0..=f64::MAX)?;
    not_after_end(&entry, key, time, duration)?;
    Some(match key {
        "at" => When::At(time),
        "within" => When::Within(time),
        _ => When::Always(time, duration),
    })
}

/// Reports a time after the end of the run.
pub fn not_after_end(entry: &Entry<'_>, key: &'static str, time: f64, duration: f64) -> Option<()> {
    if time > duration {
        entry.fail(ScenarioCause::AfterEnd { key, duration: duration.to_string() });
        return None;
    }
    Some(())
}
