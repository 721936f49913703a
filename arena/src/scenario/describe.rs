//! Conditions, expectations and measures in words, for summaries and tables.

use std::fmt;

use super::condition::{Condition, ExpectedValue, Of, Test, WORDS};
use super::expect::{Expect, When};
use super::measure::{Measure, MeasureTime};

impl fmt::Display for Condition {
    /// `all: led equals 4`, and `all of robots 0, 2: led equals 4` about some of the robots
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Condition { value, named_robots, .. } = self;
        let of_robots = named_robots.as_ref().map_or(String::new(), |named| format!(" of {named}"));
        match (self.of, named_robots) {
            _ if value.is_of_swarm() => write!(f, "{value}{of_robots}")?,
            // One robot that is named is neither all nor any of several.
            (Of::All | Of::Any | Of::One, Some(named)) if self.robots.count() == 1 => {
                write!(f, "{named}: {value}")?;
            }
            (Of::AtLeast(count), _) => write!(f, "{count} or more{of_robots}: {value}")?,
            (Of::Agree, Some(named)) => write!(f, "agree, {named}: {value}")?,
            (of, _) => {
                let word = WORDS.iter().find(|(_, known)| *known == of);
                let (word, _) = word.expect("each rule without a number has a word");
                match of {
                    Of::Reduced(_) => write!(f, "{word} of {value}{of_robots}")?,
                    _ => write!(f, "{word}{of_robots}: {value}")?,
                }
            }
        }
        match &self.test {
            Some(Test::Equals(wanted)) => write!(f, " equals {wanted}")?,
            Some(Test::Differs(wanted)) => write!(f, " differs from {wanted}")?,
            Some(Test::Below(limit)) => write!(f, " below {limit}")?,
            Some(Test::Above(limit)) => write!(f, " above {limit}")?,
            Some(Test::Between(low, high)) => write!(f, " from {low} to {high}")?,
            Some(Test::Exists(true)) => f.write_str(" exists")?,
            Some(Test::Exists(false)) => f.write_str(" does not exist")?,
            None => {}
        }
        Ok(())
    }
}

impl fmt::Display for Expect {
    /// `all: led equals 4, within 10 s`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.condition.fmt(f)?;
        match self.when {
            When::At(time) => write!(f, ", at {time} s"),
            When::Within(time) => write!(f, ", within {time} s"),
            When::Always(from, to) => write!(f, ", always from {from} to {to} s"),
        }
    }
}

impl fmt::Display for Measure {
    /// `mean of x, at 10 s`, or `first time of all: led equals 4`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Measure { condition, time, .. } = self;
        match time {
            MeasureTime::First => write!(f, "first time of {condition}"),
            MeasureTime::At(time) => write!(f, "{condition}, at {time} s"),
            MeasureTime::End => write!(f, "{condition}, at the end"),
        }
    }
}

impl fmt::Display for ExpectedValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ExpectedValue::Number(number) => number.fmt(f),
            ExpectedValue::Text(text) => write!(f, "\"{text}\""),
        }
    }
}
