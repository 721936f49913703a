//! Values of parameters, and ranges of them.

use std::fmt;

use toml::de::DeValue;

/// A value of a parameter, with the type that it has in the scenario.
#[derive(Debug, Clone, PartialEq)]
pub enum ParameterValue {
    Integer(i64),
    /// A finite float.
    Float(f64),
    /// A string.
    Text(String),
    /// Any other value, as TOML: a truth value, a list, a table.
    Other(String),
}

impl ParameterValue {
    /// Parses a value of `--set`: TOML, or a word without quotes.
    pub fn parse(text: &str) -> ParameterValue {
        let text = text.trim();
        let Ok(value) = DeValue::parse(text) else { return ParameterValue::Text(text.to_owned()) };
        let other = || ParameterValue::Other(text.to_owned());
        match value.get_ref() {
            DeValue::Integer(number) => i64::from_str_radix(number.as_str(), number.radix())
                .map_or_else(|_| other(), ParameterValue::Integer),
            DeValue::Float(number) => match number.as_str().parse::<f64>() {
                Ok(number) if number.is_finite() => ParameterValue::Float(number),
                _ => other(),
            },
            DeValue::String(text) => ParameterValue::Text(text.to_string()),
            _ => other(),
        }
    }

    /// Returns the value as `--set` takes it.
    pub fn to_toml(&self) -> String {
        match self {
            // A text that would be read as another type, or be cut, needs quotes.
            ParameterValue::Text(text) => match ParameterValue::parse(text) {
                ParameterValue::Text(same) if same == *text => text.clone(),
                _ => quoted(text),
            },
            other => other.to_string(),
        }
    }
}

/// Returns a text as a TOML string.
fn quoted(text: &str) -> String {
    let mut quoted = "\"".to_owned();
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted += &format!("\\u{:04x}", u32::from(c)),
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

impl fmt::Display for ParameterValue {
    /// The value as a cell of a table. A float has a point or an exponent.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ParameterValue::Integer(number) => number.fmt(f),
            ParameterValue::Float(number) => write!(f, "{number:?}"),
            ParameterValue::Text(text) | ParameterValue::Other(text) => f.write_str(text),
        }
    }
}

/// The most values of a range.
const VALUES_MAX: i128 = 1_000_000;

/// The most decimals of a number of a range: an f64 has no more.
const DECIMALS_MAX: usize = 17;

/// A reason why a range has no values.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RangeError {
    #[error("the range `{0}` has a step of 0")]
    NoStep(String),
    #[error("the range `{0}` steps away from its end")]
    Away(String),
    #[error("the range `{0}` has more than 1000000 values")]
    TooLong(String),
}

/// Returns the values of a text: those of a range `FIRST:LAST` or `FIRST:LAST:STEP`, or a single
/// value. The last value of a range is LAST if the steps meet it. The values of a range are integers
/// if all its numbers are, else floats.
pub fn expand(text: &str) -> Result<Vec<ParameterValue>, RangeError> {
    let Some([first, last, step]) = range(text) else {
        return Ok(vec![ParameterValue::parse(text)]);
    };
    let text = || text.trim().to_owned();
    let is_integer = [&first, &last, &step].iter().all(|number| number.decimals.is_none());
    let decimals = [&first, &last, &step].iter().filter_map(|number| number.decimals).max();
    let decimals = decimals.unwrap_or(0);
    let [first, last, step] = [first, last, step].map(|number| number.scaled(decimals));
    if step == 0 {
        return Err(RangeError::NoStep(text()));
    }
    let steps = (last - first) / step;
    if steps < 0 || (steps == 0 && last != first && (last > first) != (step > 0)) {
        return Err(RangeError::Away(text()));
    }
    if steps >= VALUES_MAX {
        return Err(RangeError::TooLong(text()));
    }
    let values = (0..=steps).map(|number| first + number * step);
    Ok(values.map(|scaled| value(scaled, decimals, is_integer)).collect())
}

/// Returns the value of an integer and a power of ten by which it is to be divided. The decimal
/// text gives the nearest float, which a sum of floats does not.
fn value(scaled: i128, decimals: usize, is_integer: bool) -> ParameterValue {
    match i64::try_from(scaled) {
        Ok(number) if is_integer => ParameterValue::Integer(number),
        _ => {
            let sign = if scaled < 0 { "-" } else { "" };
            let digits = format!("{:0>1$}", scaled.unsigned_abs(), decimals + 1);
            let (whole, part) = digits.split_at(digits.len() - decimals);
            let number = format!("{sign}{whole}.{part}0").parse::<f64>();
            number.map_or_else(|_| ParameterValue::Other(digits.clone()), ParameterValue::Float)
        }
    }
}

/// A decimal number.
struct Decimal {
    /// The digits without the point.
    digits: i128,
    /// The number of digits after the point; `None` without a point.
    decimals: Option<usize>,
}

impl Decimal {
    fn parse(text: &str) -> Option<Decimal> {
        let text = text.trim();
        let (whole, part) = text.split_once('.').map_or((text, None), |(a, b)| (a, Some(b)));
        let is_number =
            |digits: &str| !digits.is_empty() && digits.bytes().all(|byte| byte.is_ascii_digit());
        let unsigned = whole.strip_prefix(['-', '+']).unwrap_or(whole);
        let is_right = is_number(unsigned)
            && unsigned.len() <= 18
            && part.is_none_or(|part| is_number(part) && part.len() <= DECIMALS_MAX);
        let digits = format!("{whole}{}", part.unwrap_or_default()).parse().ok();
        is_right.then_some(Decimal { digits: digits?, decimals: part.map(str::len) })
    }

    /// Returns the number times a power of ten, whose exponent is at least the number of decimals.
    fn scaled(&self, decimals: usize) -> i128 {
        self.digits * 10_i128.pow((decimals - self.decimals.unwrap_or(0)) as u32)
    }
}

/// Returns first, last and step of a range; `None` if the text is none.
fn range(text: &str) -> Option<[Decimal; 3]> {
    let mut words = text.split(':').map(Decimal::parse);
    let (first, last) = (words.next()??, words.next()??);
    let step = match words.next() {
        Some(step) => step?,
        None => Decimal { digits: 1, decimals: None },
    };
    words.next().is_none().then_some([first, last, step])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(text: &str) -> String {
        let values = expand(text).unwrap();
        values.iter().map(ToString::to_string).collect::<Vec<String>>().join(" ")
    }

    #[test]
    fn values_have_their_types() {
        use ParameterValue::{Float, Integer, Other, Text};
        for (text, value) in [
            ("3", Integer(3)),
            ("0x10", Integer(16)),
            (" -7 ", Integer(-7)),
            ("3.0", Float(3.0)),
            ("1e3", Float(1000.0)),
            ("true", Other("true".to_owned())),
            ("nan", Other("nan".to_owned())),
            ("[900, 900]", Other("[900, 900]".to_owned())),
            ("u.bzz", Text("u.bzz".to_owned())),
            ("\"u v.bzz\"", Text("u v.bzz".to_owned())),
            ("", Text(String::new())),
        ] {
            let parsed = ParameterValue::parse(text);
            assert_eq!(parsed, value, "{text}");
            // A run reads the same value.
            assert_eq!(ParameterValue::parse(&parsed.to_toml()), value, "{text}");
        }
        let tricky = Text("3".to_owned());
        assert_eq!((tricky.to_toml().as_str(), tricky.to_string().as_str()), ("\"3\"", "3"));
        for text in ["true", " a", "a\"b\n", "\\u", "[1]"] {
            let value = Text(text.to_owned());
            assert_eq!(ParameterValue::parse(&value.to_toml()), value, "{text}");
        }
    }

    #[test]
    fn ranges_have_decimal_steps() {
        assert_eq!(texts("1:9:2"), "1 3 5 7 9");
        assert_eq!(texts("1:8:2"), "1 3 5 7");
        assert_eq!(texts("2:4"), "2 3 4");
        assert_eq!(texts("3:1:-1"), "3 2 1");
        assert_eq!(texts("-1:1"), "-1 0 1");
        assert_eq!(texts("5:5"), "5");
        // Sums of 0.1 would have 0.30000000000000004.
        assert_eq!(texts("0:0.4:0.1"), "0.0 0.1 0.2 0.3 0.4");
        assert_eq!(texts("0.5:-0.25:-0.25"), "0.5 0.25 0.0 -0.25");
        assert_eq!(texts("1:2:0.50"), "1.0 1.5 2.0");
        assert_eq!(expand("1:999999").unwrap().len(), 999_999);
    }

    #[test]
    fn ranges_that_have_no_values_are_refused() {
        let error = |text: &str| expand(text).unwrap_err().to_string();
        assert_eq!(error("1:9:0"), "the range `1:9:0` has a step of 0");
        assert_eq!(error("9:1"), "the range `9:1` steps away from its end");
        assert_eq!(error("0:0.5:-1"), "the range `0:0.5:-1` steps away from its end");
        assert_eq!(error("1:2000000"), "the range `1:2000000` has more than 1000000 values");
        let long = "0:999999999999999999:0.00000000000000001";
        assert_eq!(expand(long), Err(RangeError::TooLong(long.to_owned())));
    }

    #[test]
    fn other_colons_are_words() {
        for text in ["a:b", "1:b", "1:2:3:4", "1:", ":1", "::", "c:/x", "1e3:2e3", "1.:2"] {
            assert_eq!(expand(text), Ok(vec![ParameterValue::Text(text.to_owned())]), "{text}");
        }
    }
}
