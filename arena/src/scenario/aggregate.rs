//! Aggregates: one number from the values of several robots, such as
//! `share(global.opinion == 1 where running)`.
//!
//! An aggregate has the form `WORD(QUANTITY)`, or `WORD(QUANTITY TEST)` for the words that count
//! robots; `where CONDITION` at its end leaves out the robots for which the condition is false.
//! Tests are written as in Buzz: `== 1`, `!= 1`, `< 1`, `<= 1`, `> 1`, `>= 1`, `== 'text'`. A
//! condition without a test is that the value is not 0.

use std::fmt;

use super::condition::{ExpectedValue, Of, Reduction, Test, WORDS};
use super::value::Quantity;

/// One number from the values of several robots.
#[derive(Debug, Clone, PartialEq)]
pub struct Aggregate {
    /// The rule that makes one number of the values.
    pub rule: AggregateRule,
    /// The quantity of each robot.
    pub value: Quantity,
    /// The robots that count; `None` for all that have a value.
    pub among: Option<Filter>,
}

/// A rule that makes one number of several values. Robots whose value is nil are left out.
#[derive(Debug, Clone, PartialEq)]
pub enum AggregateRule {
    /// The share of the robots whose value passes the test, 0 to 1. No robots have no share.
    Share(Test),
    /// The number of the robots whose value passes the test.
    Count(Test),
    /// A number computed from the values.
    Reduced(Reduction),
}

/// A condition that a robot fulfills or not.
#[derive(Debug, Clone, PartialEq)]
pub struct Filter {
    pub value: Quantity,
    pub test: Test,
}

/// The written forms of aggregates.
pub const FORMS: &[&str] = &[
    "share(CONDITION)",
    "count(CONDITION)",
    "mean(QUANTITY)",
    "sum(QUANTITY)",
    "min(QUANTITY)",
    "max(QUANTITY)",
    "spread(QUANTITY)",
    "different(QUANTITY)",
    "median(QUANTITY)",
    "lower_quartile(QUANTITY)",
    "upper_quartile(QUANTITY)",
    "quantile(SHARE, QUANTITY)",
    "sd(QUANTITY)",
    "mean_square(QUANTITY)",
];

/// The comparisons. Those of two characters come first, because the others are their beginnings.
const OPERATORS: [&str; 6] = ["==", "!=", "<=", ">=", "<", ">"];

impl Aggregate {
    /// Parses an aggregate; `None` if the text is not one.
    pub(super) fn parse(text: &str) -> Option<Aggregate> {
        let (word, inner) = text.strip_suffix(')')?.split_once('(')?;
        let (inner, among) = match split_outside(inner, " where ") {
            Some((inner, condition)) => (inner, Some(Filter::parse(condition)?)),
            None => (inner, None),
        };
        let (rule, value) = match word {
            "share" | "count" => {
                let Filter { value, test } = Filter::parse(inner)?;
                let rule =
                    if word == "share" { AggregateRule::Share } else { AggregateRule::Count };
                (rule(test), value)
            }
            "quantile" => {
                let (share, value) = inner.split_once(',')?;
                let share = share.trim().parse::<f64>().ok()?;
                let reduction = Reduction::Quantile(share);
                ((0.0..=1.0).contains(&share).then_some(reduction)?.into(), of_robot(value)?)
            }
            word => {
                let (_, of) = WORDS.iter().find(|(known, _)| *known == word)?;
                let Of::Reduced(reduction) = of else { return None };
                ((*reduction).into(), of_robot(inner)?)
            }
        };
        Some(Aggregate { rule, value, among })
    }

    /// Returns the unit; `None` for numbers without one.
    pub(super) fn unit(&self) -> Option<&'static str> {
        let unit = self.value.unit()?;
        match self.rule {
            AggregateRule::Share(_) | AggregateRule::Count(_) => None,
            AggregateRule::Reduced(Reduction::Different) => None,
            AggregateRule::Reduced(Reduction::MeanSquare) => Some(match unit {
                "mm" => "mm²",
                _ => "°²",
            }),
            AggregateRule::Reduced(_) => Some(unit),
        }
    }
}

impl From<Reduction> for AggregateRule {
    fn from(reduction: Reduction) -> Self {
        AggregateRule::Reduced(reduction)
    }
}

impl Filter {
    /// Parses a condition: a quantity of a robot, and a test unless the value is only not to be 0.
    fn parse(text: &str) -> Option<Filter> {
        let operators = OPERATORS.iter().filter_map(|operator| {
            let (value, wanted) = split_outside(text, operator)?;
            Some((value, *operator, wanted))
        });
        // The operator that begins first; of two that begin at one place, the longer one.
        let Some((value, operator, wanted)) = operators.min_by_key(|(value, ..)| value.len())
        else {
            return Some(Filter { value: of_robot(text)?, test: Test::NONZERO });
        };
        let value = of_robot(value)?;
        let wanted = wanted_value(wanted.trim())?;
        let test = match (operator, wanted) {
            ("==", wanted) => Test::Equals(wanted),
            ("!=", wanted) => Test::Differs(wanted),
            (_, ExpectedValue::Text(_)) => return None,
            ("<", ExpectedValue::Number(number)) => Test::Below(number),
            (">", ExpectedValue::Number(number)) => Test::Above(number),
            ("<=", ExpectedValue::Number(number)) => Test::Between(f64::NEG_INFINITY, number),
            (_, ExpectedValue::Number(number)) => Test::Between(number, f64::INFINITY),
        };
        Some(Filter { value, test })
    }
}

/// Parses a quantity that each robot has.
fn of_robot(text: &str) -> Option<Quantity> {
    Quantity::parse(text.trim()).filter(|quantity| !quantity.is_of_swarm())
}

/// Parses a finite number, or a text in quotes.
fn wanted_value(text: &str) -> Option<ExpectedValue> {
    for quote in ['\'', '"'] {
        if let Some(text) = text.strip_prefix(quote) {
            let text = text.strip_suffix(quote).filter(|text| !text.contains(quote))?;
            return Some(ExpectedValue::Text(text.to_owned()));
        }
    }
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite())?;
    Some(ExpectedValue::Number(number))
}

/// Splits a text at the first occurrence of a separator outside of parentheses and quotes.
fn split_outside<'t>(text: &'t str, separator: &str) -> Option<(&'t str, &'t str)> {
    let (mut depth, mut quote) = (0, None);
    for (at, c) in text.char_indices() {
        if depth == 0 && quote.is_none() && text[at..].starts_with(separator) {
            return Some((&text[..at], &text[at + separator.len()..]));
        }
        match (c, quote) {
            (_, Some(open)) if c == open => quote = None,
            (_, Some(_)) => {}
            ('\'' | '"', None) => quote = Some(c),
            ('(', None) => depth += 1,
            (')', None) => depth -= 1,
            _ => {}
        }
    }
    None
}

/// Returns the correction of a text that begins as an aggregate; `None` for any other text.
pub(super) fn help(text: &str) -> Option<String> {
    let (word, _) = text.split_once('(')?;
    let form = FORMS.iter().find(|form| form.split('(').next() == Some(word))?;
    let example = match word {
        "share" | "count" => format!("{word}(global.opinion == 1 where running)"),
        "quantile" => "quantile(0.9, x where running)".to_owned(),
        _ => format!("{word}(x where running)"),
    };
    Some(format!(
        "write it as `{form}`, for example `{example}`; comparisons are ==, !=, <, <=, > and >= with a number, or == 'text'"
    ))
}

impl fmt::Display for Aggregate {
    /// `share(global.opinion == 1 where running)`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Aggregate { rule, value, among } = self;
        match rule {
            AggregateRule::Share(test) => write!(f, "share({}", Tested(value, test))?,
            AggregateRule::Count(test) => write!(f, "count({}", Tested(value, test))?,
            AggregateRule::Reduced(Reduction::Quantile(share))
                if reduction_word(rule).is_none() =>
            {
                write!(f, "quantile({share}, {value}")?;
            }
            AggregateRule::Reduced(_) => {
                let word = reduction_word(rule).expect("each reduction but a quantile has a word");
                write!(f, "{word}({value}")?;
            }
        }
        match among {
            Some(Filter { value, test }) => write!(f, " where {})", Tested(value, test)),
            None => f.write_str(")"),
        }
    }
}

fn reduction_word(rule: &AggregateRule) -> Option<&'static str> {
    let AggregateRule::Reduced(reduction) = rule else { return None };
    let word = WORDS.iter().find(|(_, of)| *of == Of::Reduced(*reduction));
    word.map(|(word, _)| *word)
}

/// A quantity with a test, as a condition is written.
struct Tested<'a>(&'a Quantity, &'a Test);

impl fmt::Display for Tested<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Tested(value, test) = self;
        write!(f, "{value}")?;
        let wanted = |wanted: &ExpectedValue| match wanted {
            ExpectedValue::Number(number) => number.to_string(),
            ExpectedValue::Text(text) if text.contains('\'') => format!("\"{text}\""),
            ExpectedValue::Text(text) => format!("'{text}'"),
        };
        match test {
            test if **test == Test::NONZERO => Ok(()),
            Test::Equals(value) => write!(f, " == {}", wanted(value)),
            Test::Differs(value) => write!(f, " != {}", wanted(value)),
            Test::Below(limit) => write!(f, " < {limit}"),
            Test::Above(limit) => write!(f, " > {limit}"),
            Test::Between(low, high) if *low == f64::NEG_INFINITY => write!(f, " <= {high}"),
            Test::Between(low, _) => write!(f, " >= {low}"),
            // The text has no form of this test.
            Test::Exists(_) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_what_is_read() {
        for text in [
            "share(global.opinion == 1 where running)",
            "share(running)",
            "count(inside(0, -20.5, 100) where global.state.name != 'search')",
            "count(led >= 2 where x < -3)",
            "mean(distance(3, 4) where y <= 7)",
            "mean_square(displacement(300))",
            "quantile(0.9, x where led > 2)",
            "median(x)",
            "lower_quartile(y)",
            "sd(global.n)",
            "different(global.leader)",
        ] {
            let quantity = Quantity::parse(text).unwrap_or_else(|| panic!("{text}"));
            assert!(quantity.is_of_swarm());
            assert_eq!(quantity.to_string(), text);
        }
        let median = Quantity::parse("quantile(0.5, x)").unwrap();
        assert_eq!(median.to_string(), "median(x)");
        assert_eq!(Quantity::parse("share(led != 0)").unwrap().to_string(), "share(led)");
    }

    #[test]
    fn what_is_no_aggregate_is_refused() {
        for text in [
            "share()",
            "share(x",
            "share(x = 1)",
            "share(x == )",
            "share(x == one)",
            "share(x < 'a')",
            "share(x == nan)",
            "share(swarm.nearest > 3)",
            "share(share(x > 1) > 2)",
            "mean(x > 3)",
            "mean(mean(x))",
            "mean()",
            "agree(x)",
            "all(x)",
            "quantile(x)",
            "quantile(1.5, x)",
            "mean(x where )",
            "mean(x where running where led)",
            "middle(x)",
            "inside(0, 0, -3)",
            "inside(0, 0)",
            "swarm.cluster()",
            "swarm.cluster(-1)",
            "displacement(-1)",
            "displacement(inf)",
        ] {
            assert_eq!(Quantity::parse(text), None, "{text}");
        }
    }

    #[test]
    fn a_form_is_explained() {
        for form in FORMS {
            let word = form.split('(').next().unwrap();
            let help = help(&format!("{word}(")).unwrap();
            let (_, example) = help.split_once("example `").unwrap();
            let (example, _) = example.split_once('`').unwrap();
            assert!(Quantity::parse(example).is_some(), "{example}");
        }
    }
}
