//! Expectations in words, for summaries and tables.

use std::fmt;

use super::expect::{Expect, ExpectedValue, Of, Test, WORDS, When};
use super::value::Quantity;

impl fmt::Display for Expect {
    /// `all: led equals 4, within 10 s`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.of {
            _ if matches!(self.value, Quantity::Swarm(_)) => self.value.fmt(f)?,
            Of::AtLeast(count) => write!(f, "{count} or more: {}", self.value)?,
            of => {
                let word = WORDS.iter().find(|(_, known)| *known == of);
                let (word, _) = word.expect("each rule without a number has a word");
                match of {
                    Of::Reduced(_) => write!(f, "{word} of {}", self.value)?,
                    _ => write!(f, "{word}: {}", self.value)?,
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
        match self.when {
            When::At(time) => write!(f, ", at {time} s"),
            When::Within(time) => write!(f, ", within {time} s"),
            When::Always(from, to) => write!(f, ", always from {from} to {to} s"),
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
