//! `[[expect]]`: conditions on a run, so that a scenario is a test.

use std::collections::{BTreeMap, btree_map};

use bittybuzz_toml_reader::{Place, TomlError, number_text};
use toml::de::DeValue;

use super::error::ScenarioCause;
use super::keys::EXPECT;
use super::read::{Entry, Section};
use super::select::{RobotIndex, Selection};
use super::time::{check_ticks, seconds};
use super::value::{Quantity, is_identifier};

/// A condition on robots, and the time at which it must hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Expect {
    /// The name, unique in the scenario.
    pub name: Option<String>,
    /// The time at which, or for which, it must hold.
    pub when: When,
    /// The robots that the condition is about.
    pub robots: Selection,
    /// These robots in the words of the file, such as `robots 0, 2`; `None` for all robots.
    pub named_robots: Option<String>,
    /// The quantity of these robots.
    pub value: Quantity,
    /// The rule that combines the robots' values.
    pub of: Of,
    /// The comparison of each value, or of the combined one. [`Of::Agree`] needs none.
    pub test: Option<Test>,
    /// Numbers that differ by no more than this are equal.
    pub tolerance: f64,
    /// The place of the condition in the file.
    pub place: Place,
    /// The place of its quantity in the file.
    pub value_place: Place,
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

/// The rule that combines the values of several robots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// Every robot's value passes the test.
    All,
    /// At least one robot's value passes.
    Any,
    /// Exactly one robot's value passes.
    One,
    /// No robot's value passes the test. Every robot must have a value, unless the test is for
    /// existence.
    None,
    /// At least this number of robots pass.
    AtLeast(u32),
    /// All values are equal and pass the test, if there is one.
    Agree,
    /// One number computed from all values passes the test.
    Reduced(Reduction),
}

/// A computation of one number from many values. Values other than numbers are ignored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reduction {
    /// The arithmetic mean.
    Mean,
    /// The sum.
    Sum,
    /// The smallest number.
    Min,
    /// The largest number.
    Max,
    /// The largest number minus the smallest.
    Spread,
    /// The number of different values, including values other than numbers, but not nil.
    Different,
}

/// A comparison of a value.
#[derive(Debug, Clone, PartialEq)]
pub enum Test {
    /// The value is equal to this one.
    Equals(ExpectedValue),
    /// The value exists and is not equal to this one.
    Differs(ExpectedValue),
    /// The value is less than this number.
    Below(f64),
    /// The value is greater than this number.
    Above(f64),
    /// The value is in this closed range.
    Between(f64, f64),
    /// The value is not nil (true), or is nil (false).
    Exists(bool),
}

/// A value to compare with.
#[derive(Debug, Clone, PartialEq)]
pub enum ExpectedValue {
    /// A number.
    Number(f64),
    /// A string.
    Text(String),
}

/// The words of `of`.
pub const WORDS: [(&str, Of); 11] = [
    ("all", Of::All),
    ("any", Of::Any),
    ("one", Of::One),
    ("none", Of::None),
    ("agree", Of::Agree),
    ("mean", Of::Reduced(Reduction::Mean)),
    ("sum", Of::Reduced(Reduction::Sum)),
    ("min", Of::Reduced(Reduction::Min)),
    ("max", Of::Reduced(Reduction::Max)),
    ("spread", Of::Reduced(Reduction::Spread)),
    ("different", Of::Reduced(Reduction::Different)),
];

const TIMES: &[&str] = &["at", "within", "always"];
const TESTS: &[&str] = &["equals", "differs", "below", "above", "between", "exists"];

/// The range of all finite numbers.
const FINITE: std::ops::RangeInclusive<f64> = f64::MIN..=f64::MAX;

/// Reads the expectations of a file.
pub fn read_all(root: &Section<'_>, robot_index: &RobotIndex, duration: f64) -> Vec<Expect> {
    let sections = root.sections("expect", EXPECT);
    let mut lines = BTreeMap::new();
    let names: Vec<Option<String>> =
        sections.iter().map(|section| name(section, &mut lines)).collect();
    let expects = sections.iter().zip(names);
    expects.filter_map(|(section, name)| read(section, name, robot_index, duration)).collect()
}

/// Returns the name of an expectation, if it has one. `lines` holds the lines of the names before
/// it.
fn name(section: &Section<'_>, lines: &mut BTreeMap<String, usize>) -> Option<String> {
    let entry = section.get("name")?;
    let name = entry.string()?.to_owned();
    if !is_identifier(&name) {
        entry.fail(ScenarioCause::BadExpectationName { name });
        return None;
    }
    match lines.entry(name.clone()) {
        btree_map::Entry::Occupied(line) => {
            entry.fail(ScenarioCause::DuplicateExpectation {
                name: name.clone(),
                line: *line.get(),
            });
        }
        btree_map::Entry::Vacant(free) => {
            free.insert(entry.place().line);
        }
    }
    Some(name)
}

fn read(
    section: &Section<'_>,
    name: Option<String>,
    robot_index: &RobotIndex,
    duration: f64,
) -> Option<Expect> {
    let when = when(section, duration);
    let robots = robot_index.selection(section, "robots");
    let named_robots = section.get("robots").filter(|_| robots.is_some());
    let named_robots = named_robots.and_then(|entry| robot_index.words(&entry));
    let of = robots_of_test(section);
    let test = match of {
        Some(Of::Agree) if TESTS.iter().all(|key| section.get(key).is_none()) => Some(None),
        _ => test(section).map(Some),
    };
    let value = section.required("value").and_then(|entry| {
        let quantity = quantity(&entry)?;
        Some((quantity, entry.place()))
    });
    let tolerance = tolerance(section);
    if let (Some((Quantity::Swarm(_), _)), Some(entry)) = (&value, section.get("of")) {
        entry.fail(ScenarioCause::OneNumber { key: "of" });
        return None;
    }
    let (of, test) = (of?, test?);
    if let (Of::AtLeast(count), Some(robots), Some(entry)) = (of, &robots, section.get("of"))
        && count as usize > robots.count()
    {
        let range = format!("{} robots are looked at", robots.count());
        entry.fail(TomlError::OutOfRange {
            key: entry.key.clone(),
            value: count.to_string(),
            range,
        });
        return None;
    }
    if let (Of::Reduced(reduction), Some(test)) = (of, &test)
        && !matches!(
            test,
            Test::Equals(ExpectedValue::Number(_))
                | Test::Differs(ExpectedValue::Number(_))
                | Test::Below(_)
                | Test::Above(_)
                | Test::Between(..)
        )
    {
        let named = WORDS.iter().find(|(_, of)| *of == Of::Reduced(reduction));
        let entry = section.get("of").expect("only the key `of` names a reduction");
        let (word, _) = named.expect("each reduction has a word");
        entry.fail(ScenarioCause::NotANumber { of: word });
        return None;
    }
    let (value, value_place) = value?;
    if robots.as_ref().is_some_and(|robots| !robot_index.all_provide(&value, robots)) {
        section.reader.fail_at(&value_place, ScenarioCause::Unseen { quantity: value.to_string() });
        return None;
    }
    let place = section.place();
    Some(Expect {
        name,
        when: when?,
        robots: robots?,
        named_robots,
        value,
        of,
        test,
        tolerance,
        place,
        value_place,
    })
}

/// Reads a quantity.
pub fn quantity(entry: &Entry<'_>) -> Option<Quantity> {
    let text = entry.string()?;
    let quantity = Quantity::parse(text);
    if quantity.is_none() {
        entry.fail(ScenarioCause::UnknownQuantity { text: text.to_owned() });
    }
    quantity
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

fn robots_of_test(section: &Section<'_>) -> Option<Of> {
    let Some(entry) = section.get("of") else { return Some(Of::All) };
    match entry.value {
        DeValue::Integer(_) => entry.integer(1..=0x1_0000).map(Of::AtLeast),
        DeValue::String(_) => section.word("of", &WORDS),
        _ => {
            entry.wrong_type("a word or a number of robots");
            None
        }
    }
}

fn test(section: &Section<'_>) -> Option<Test> {
    let (key, entry) = section.one_of(TESTS)?;
    Some(match key {
        "equals" => Test::Equals(wanted(&entry)?),
        "differs" => Test::Differs(wanted(&entry)?),
        "below" => Test::Below(entry.number(FINITE)?),
        "above" => Test::Above(entry.number(FINITE)?),
        "between" => {
            let [low, high] = entry.numbers("two numbers as [low, high]", FINITE)?;
            if high < low {
                let range = "the second number is the larger one".to_owned();
                let value = format!("[{}, {}]", number_text(low), number_text(high));
                entry.fail(TomlError::OutOfRange { key: entry.key.clone(), value, range });
                return None;
            }
            Test::Between(low, high)
        }
        _ => Test::Exists(section.boolean(key)?),
    })
}

/// Reads the tolerance, and reports one that no test uses.
fn tolerance(section: &Section<'_>) -> f64 {
    let Some(entry) = section.get("tolerance") else { return 0.0 };
    let is_agree = section.get("of").is_some_and(|of| of.value.as_str() == Some("agree"));
    let is_used = is_agree || section.get("equals").is_some() || section.get("differs").is_some();
    if !is_used {
        entry.fail(ScenarioCause::Without { key: "tolerance", needs: "equals" });
    }
    entry.number(0.0..=f64::MAX).unwrap_or(0.0)
}

fn wanted(entry: &Entry<'_>) -> Option<ExpectedValue> {
    match entry.value {
        DeValue::String(text) => Some(ExpectedValue::Text(text.to_string())),
        DeValue::Integer(_) | DeValue::Float(_) => entry.number(FINITE).map(ExpectedValue::Number),
        _ => {
            entry.wrong_type("a number or a string");
            None
        }
    }
}
