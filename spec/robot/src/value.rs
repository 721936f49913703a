//! Values that a robot keeps up to date in tables of its scripts, such as `pose.position.x` and
//! `proximity[].value`.
//!
//! Other hosts of Buzz fill such tables in every step. A value that changes is also a robot function
//! of the value's name, which the compiled script calls when it fills the tables; no script can write
//! a call of it.

use std::fmt;

use crate::sensor::SensorReading;
use crate::signature::is_identifier;

/// The most elements of a list of values.
pub const ELEMENTS_MAX: u32 = 1024;

/// A value in a table of the script.
#[derive(Debug, Clone, PartialEq)]
pub struct TableValue {
    /// The table and the keys under which scripts find it.
    pub path: ValuePath,
    /// The number of elements of the list that the path leads into; `None` for a path without one.
    pub elements: Option<u32>,
    /// What it is.
    pub source: ValueSource,
    /// Its meaning, with its unit, in one line.
    pub help: String,
}

/// What a value is.
#[derive(Debug, Clone, PartialEq)]
pub enum ValueSource {
    /// The same number at all times: one for all elements of the list, or one for each.
    Constant(Vec<ValueConstant>),
    /// Readings of sensors, which the robot function of the value's name returns. It takes the
    /// number of an element, from 0, if the path leads into a list.
    Reading(ValueReading),
}

/// A number that does not change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ValueConstant {
    Int(i32),
    Float(f64),
}

/// The place of a value: the name of a table, and keys. At most one of them stands for all elements of
/// a list.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValuePath {
    text: String,
    keys: Vec<ValueKey>,
}

/// A key of a path.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum ValueKey {
    /// A field, such as `.position`.
    Field(String),
    /// Every element, `[]`, with a number from 0.
    Elements,
}

impl ValuePath {
    /// Reads a path such as `pose.position.x` or `proximity[].value`; `None` if the text is none.
    pub fn parse(text: &str) -> Option<ValuePath> {
        let mut keys = Vec::new();
        for (place, part) in text.split('.').enumerate() {
            let name = part.strip_suffix(ELEMENTS);
            let (name, is_list) = name.map_or((part, false), |name| (name, true));
            if !is_identifier(name) {
                return None;
            }
            if place > 0 {
                keys.push(ValueKey::Field(name.to_owned()));
            }
            if is_list {
                keys.push(ValueKey::Elements);
            }
        }
        let lists = keys.iter().filter(|key| **key == ValueKey::Elements).count();
        (!keys.is_empty() && lists <= 1).then(|| ValuePath { text: text.to_owned(), keys })
    }

    /// Returns the path as the robot file has it.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the name of the table.
    pub fn table(&self) -> &str {
        table_of(&self.text)
    }

    /// Returns the keys after the name of the table; at least one.
    pub fn keys(&self) -> &[ValueKey] {
        &self.keys
    }

    /// Returns true if the path leads into a list.
    pub fn has_elements(&self) -> bool {
        self.keys.contains(&ValueKey::Elements)
    }
}

const ELEMENTS: &str = "[]";

/// Returns the name of the table that the name of a function or value begins with; the whole name if
/// it stands in no table.
pub fn table_of(name: &str) -> &str {
    let end = name.find(['.', '[']).unwrap_or(name.len());
    &name[..end]
}

impl fmt::Display for ValuePath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl fmt::Display for ValueConstant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ValueConstant::Int(value) => value.fmt(f),
            ValueConstant::Float(value) if value.fract() == 0.0 => write!(f, "{value:.1}"),
            ValueConstant::Float(value) => value.fmt(f),
        }
    }
}

/// The readings of a value that changes, and their scale.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueReading {
    /// One for all elements, or one for each.
    pub readings: Vec<SensorReading>,
    pub scale: ValueScale,
}

/// The way from a reading in its own unit to the value in the script.
#[derive(Debug, Clone, PartialEq)]
pub enum ValueScale {
    /// The reading times a factor.
    Factor(f64),
    /// Pairs of a reading and a value, by rising readings; at least two. Between them the value changes
    /// evenly, and outside of them it is that of the nearest pair.
    Curve(Vec<[f64; 2]>),
}

impl ValueScale {
    /// Returns the value for a reading.
    pub fn value(&self, reading: f64) -> f64 {
        let points = match self {
            ValueScale::Factor(factor) => return reading * factor,
            ValueScale::Curve(points) => points,
        };
        let after = points.partition_point(|[at, _]| *at <= reading);
        match (after.checked_sub(1).and_then(|before| points.get(before)), points.get(after)) {
            (Some([from, low]), Some([to, high])) => {
                low + (high - low) * (reading - from) / (to - from)
            }
            (Some([_, value]), None) | (None, Some([_, value])) => *value,
            (None, None) => reading,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths() {
        let field = |name: &str| ValueKey::Field(name.to_owned());
        let path = |text: &str| ValuePath::parse(text).map(|path| path.keys);
        assert_eq!(path("pose.position.x"), Some(vec![field("position"), field("x")]));
        assert_eq!(path("proximity[].value"), Some(vec![ValueKey::Elements, field("value")]));
        assert_eq!(
            path("a.b[].c.d"),
            Some(vec![field("b"), ValueKey::Elements, field("c"), field("d")])
        );
        assert_eq!(path("lidar[]"), Some(vec![ValueKey::Elements]));
        for wrong in
            ["", "pose", ".x", "pose.", "pose..x", "a[][]", "a[].b[]", "a[0].x", "a.1", "a b.c"]
        {
            assert_eq!(path(wrong), None, "{wrong}");
        }
        assert_eq!(ValuePath::parse("a[].b").map(|path| path.table().to_owned()), Some("a".into()));
    }

    #[test]
    fn a_curve_is_even_between_its_points_and_flat_outside() {
        let curve = ValueScale::Curve(vec![[0.0, 1.0], [10.0, 1.0], [20.0, 0.5], [100.0, 0.0]]);
        for (reading, value) in [
            (-5.0, 1.0),
            (0.0, 1.0),
            (10.0, 1.0),
            (15.0, 0.75),
            (60.0, 0.25),
            (100.0, 0.0),
            (300.0, 0.0),
        ] {
            assert_eq!(curve.value(reading), value, "{reading}");
        }
        assert_eq!(ValueScale::Factor(0.5).value(3.0), 1.5);
    }
}
