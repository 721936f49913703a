//! Conditions on the values of robots, and the computations of one number from them.

use bittybuzz_toml_reader::{Place, TomlError, number_text};
use toml::de::DeValue;

use super::error::ScenarioCause;
use super::expect::not_after_end;
use super::read::{Entry, Section};
use super::select::{RobotIndex, Selection};
use super::time::check_ticks;
use super::value::Quantity;

/// A condition on robots. Without a test, and with a rule that computes a number or a quantity of
/// the swarm, it is this number.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
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

/// The rule that combines the values of several robots.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// A computation of one number from many values. Values other than numbers are ignored; NaN is no
/// number.
#[derive(Debug, Clone, Copy, PartialEq)]
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
    /// The quantile of which this share, 0 to 1, is below it ([`quantile`](crate::statistics::quantile)).
    Quantile(f64),
    /// The standard deviation of a sample: with n numbers, the root of the sum of squared
    /// deviations over n - 1. A single number has none.
    Sd,
    /// The mean of the squares.
    MeanSquare,
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

impl Test {
    /// The test that a value is there, and not 0.
    pub const NONZERO: Test = Test::Differs(ExpectedValue::Number(0.0));
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
pub const WORDS: [(&str, Of); 16] = [
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
    ("median", Of::Reduced(Reduction::Quantile(0.5))),
    ("lower_quartile", Of::Reduced(Reduction::Quantile(0.25))),
    ("upper_quartile", Of::Reduced(Reduction::Quantile(0.75))),
    ("sd", Of::Reduced(Reduction::Sd)),
    ("mean_square", Of::Reduced(Reduction::MeanSquare)),
];

const TESTS: &[&str] = &["equals", "differs", "below", "above", "between", "exists"];

/// The range of all finite numbers.
const FINITE: std::ops::RangeInclusive<f64> = f64::MIN..=f64::MAX;

/// Returns true if a section compares values.
pub fn compares(section: &Section<'_>) -> bool {
    agrees(section) || TESTS.iter().any(|key| section.get(key).is_some())
}

fn agrees(section: &Section<'_>) -> bool {
    section.get("of").is_some_and(|of| of.value.as_str() == Some("agree"))
}

/// Reads a condition of a run of `duration` seconds. Without `needs_test`, a section that compares
/// nothing is a number.
pub fn read(
    section: &Section<'_>,
    robot_index: &RobotIndex,
    duration: f64,
    needs_test: bool,
) -> Option<Condition> {
    let robots = robot_index.selection(section, "robots");
    let named_robots = section.get("robots").filter(|_| robots.is_some());
    let named_robots = named_robots.and_then(|entry| robot_index.words(&entry));
    let of = robots_of_test(section);
    let is_compared = TESTS.iter().any(|key| section.get(key).is_some());
    let test = match of {
        Some(Of::Agree) if !is_compared => Some(None),
        _ if !needs_test && !is_compared => Some(None),
        _ => test(section).map(Some),
    };
    let value = section.required("value").and_then(|entry| {
        let quantity = quantity(&entry, duration)?;
        Some((quantity, entry.place()))
    });
    let tolerance = tolerance(section);
    if let (Some((value, _)), Some(entry)) = (&value, section.get("of"))
        && value.is_of_swarm()
    {
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
    let (value, value_place) = value?;
    if let (Of::Reduced(reduction), Some(test)) = (of, &test)
        && !is_of_numbers(test)
    {
        let named = WORDS.iter().find(|(_, of)| *of == Of::Reduced(reduction));
        let entry = section.get("of").expect("only the key `of` names a reduction");
        let (word, _) = named.expect("each reduction has a word");
        entry.fail(ScenarioCause::NotANumber { of: word });
        return None;
    }
    let is_number = matches!(of, Of::Reduced(_)) || value.is_of_swarm();
    if test.is_none() && of != Of::Agree && !is_number {
        let place = section.get("of").map_or_else(|| value_place.clone(), |entry| entry.place());
        section.reader.fail_at(&place, ScenarioCause::NoNumber { value: value.to_string() });
        return None;
    }
    if robots.as_ref().is_some_and(|robots| !robot_index.all_provide(&value, robots)) {
        section.reader.fail_at(&value_place, ScenarioCause::Unseen { quantity: value.to_string() });
        return None;
    }
    let place = section.place();
    Some(Condition {
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

/// Returns true if a test compares numbers.
fn is_of_numbers(test: &Test) -> bool {
    matches!(
        test,
        Test::Equals(ExpectedValue::Number(_))
            | Test::Differs(ExpectedValue::Number(_))
            | Test::Below(_)
            | Test::Above(_)
            | Test::Between(..)
    )
}

/// Reads a quantity in a run of `duration` seconds.
pub fn quantity(entry: &Entry<'_>, duration: f64) -> Option<Quantity> {
    let text = entry.string()?;
    let Some(quantity) = Quantity::parse(text) else {
        entry.fail(ScenarioCause::UnknownQuantity { text: text.to_owned() });
        return None;
    };
    for time in quantity.times_of_places() {
        check_ticks(entry, time)?;
        not_after_end(entry, "displacement", time, duration)?;
    }
    Some(quantity)
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
    let is_used =
        agrees(section) || section.get("equals").is_some() || section.get("differs").is_some();
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
