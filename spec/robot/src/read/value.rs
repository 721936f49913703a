//! Reads `[[value]]`, a value in a table that the robot keeps up to date.

use std::collections::HashMap;

use bittybuzz_toml_reader::TomlError;

use super::effect::{Sensors, find_sensor};
use super::{Entry, Names, Section, line};
use crate::RobotFunction;
use crate::effect::FunctionEffect;
use crate::error::RobotFileCause;
use crate::sensor::{Sensor, SensorReading, SensorValue, unit_factor};
use crate::signature::{Parameter, SignatureType};
use crate::value::{
    ELEMENTS_MAX, TableValue, ValueConstant, ValuePath, ValueReading, ValueScale, ValueSource,
};

/// A value, and the function that reads it if it changes.
pub type ReadValue = (TableValue, Option<RobotFunction>);

/// The largest magnitude of a constant and of a point of a curve.
const NUMBER: std::ops::RangeInclusive<f64> = -1e9..=1e9;

/// The lists of values that were read up to here, with their numbers of elements and their lines.
#[derive(Default)]
pub struct Lists(HashMap<String, (u32, usize)>);

pub fn value(
    section: &Section<'_>,
    names: &mut Names,
    lists: &mut Lists,
    sensors: &Sensors,
) -> Option<ReadValue> {
    let path = section.required("name").and_then(|entry| {
        let text = entry.string()?;
        let Some(path) = ValuePath::parse(text) else {
            entry.fail(RobotFileCause::BadPath { text: text.to_owned() });
            return None;
        };
        let changes = section.get("reads").is_some();
        names.add_value(&entry, &path, changes).then_some(path)
    });
    let help = line(section, "help");
    let is_integer = section.get("returns").map(|entry| {
        entry.word(&[(SignatureType::Int.name(), true), (SignatureType::Number.name(), false)])
    });
    let is_integer = super::given(is_integer).map(|given| given.unwrap_or(false));
    let given_count = section.get("count").map(|entry| entry.integer(1..=ELEMENTS_MAX));
    let given_count = super::given(given_count);
    let source = match (section.get("is"), section.get("reads")) {
        (Some(entry), None) => {
            for key in ["returns", "curve"] {
                if let Some(other) = section.get(key) {
                    other.fail(TomlError::Both { key, other: "is" });
                }
            }
            constants(&entry).map(Source::Constants)
        }
        (None, Some(entry)) => {
            let path = path.as_ref()?;
            readings(&entry, path, sensors).map(|found| Source::Readings(found, entry))
        }
        (Some(_), Some(entry)) => {
            entry.fail(TomlError::Both { key: "reads", other: "is" });
            None
        }
        (None, None) => {
            section.fail(RobotFileCause::NoValue { name: path.as_ref()?.text().to_owned() });
            None
        }
    };
    let (path, help, is_integer, given_count, source) =
        (path?, help?, is_integer?, given_count?, source?);
    let known = match &source {
        Source::Constants(all) => (all.len() > 1).then_some(all.len()),
        Source::Readings(Readings { counts, .. }, _) => *counts,
    };
    let elements = elements(section, &path, given_count, known, lists)?;
    let (source, reading) = match source {
        Source::Constants(all) => (ValueSource::Constant(all), None),
        Source::Readings(readings, entry) => {
            let curve = section.get("curve").map(|entry| curve(&entry));
            let scale = match curve {
                None => ValueScale::Factor(readings.factor),
                Some(curve) if readings.has_unit => {
                    curve?;
                    entry.fail(RobotFileCause::CurveWithUnit);
                    return None;
                }
                Some(curve) => ValueScale::Curve(curve?),
            };
            let reading = ValueReading { readings: readings.all, scale };
            (ValueSource::Reading(reading.clone()), Some(reading))
        }
    };
    let function = reading.map(|reading| function(&path, &help, is_integer, reading));
    Some((TableValue { path, elements, source, help }, function))
}

enum Source<'a> {
    Constants(Vec<ValueConstant>),
    Readings(Readings, Entry<'a>),
}

/// Returns the function that returns a value to the script.
fn function(
    path: &ValuePath,
    help: &str,
    is_integer: bool,
    reading: ValueReading,
) -> RobotFunction {
    let element = Parameter {
        name: "element".to_owned(),
        kind: SignatureType::Int,
        range: None,
        is_repeated: false,
    };
    RobotFunction {
        name: path.text().to_owned(),
        accepts: vec![path.has_elements().then_some(element).into_iter().collect()],
        returns: Some(if is_integer { SignatureType::Int } else { SignatureType::Number }),
        waits: false,
        help: help.to_owned(),
        effect: Some(FunctionEffect { fills: Some(reading), ..FunctionEffect::default() }),
    }
}

/// Returns the number of elements of the list that a path leads into. All values of a list have one
/// number of elements.
fn elements(
    section: &Section<'_>,
    path: &ValuePath,
    given: Option<u32>,
    known: Option<usize>,
    lists: &mut Lists,
) -> Option<Option<u32>> {
    let name = || path.text().to_owned();
    if !path.has_elements() {
        if known.is_some() || given.is_some() {
            section.fail(RobotFileCause::NotAList { name: name() });
            return None;
        }
        return Some(None);
    }
    let (list, _) = path.text().split_once("[]").expect("the path has elements");
    let before = lists.0.get(list).copied();
    let known = known.and_then(|count| u32::try_from(count).ok());
    let Some(count) = known.or(given).or(before.map(|(count, _)| count)) else {
        section.fail(RobotFileCause::NoCount { name: name() });
        return None;
    };
    let other = match before {
        Some((before, line)) if before != count => Some((before, Some(line))),
        _ => given.filter(|given| *given != count).map(|given| (given, None)),
    };
    if let Some((other, line)) = other {
        section.fail(RobotFileCause::OtherCount { name: name(), count, other, line });
        return None;
    }
    lists.0.entry(list.to_owned()).or_insert((count, section.place().line));
    Some(Some(count))
}

/// Reads a number, or a list with one for each element.
fn constants(entry: &Entry<'_>) -> Option<Vec<ValueConstant>> {
    let constant = |entry: &Entry<'_>| {
        let number = entry.number(NUMBER)?;
        match entry.value.is_integer() {
            true => Some(ValueConstant::Int(number as i32)),
            false => Some(ValueConstant::Float(number)),
        }
    };
    if !entry.value.is_array() {
        return Some(vec![constant(entry)?]);
    }
    let items = entry.list()?;
    if items.is_empty() || items.len() > ELEMENTS_MAX as usize {
        let (count, most) = (items.len(), ELEMENTS_MAX);
        entry.fail(RobotFileCause::NumberOfElements { count, most });
        return None;
    }
    let all: Vec<_> = items.iter().map(constant).collect();
    all.into_iter().collect()
}

struct Readings {
    all: Vec<SensorReading>,
    /// The number of elements that the readings are for, if they are for several.
    counts: Option<usize>,
    factor: f64,
    has_unit: bool,
}

/// Reads `"SENSOR.VALUE unit"`, or a list of them, one for each element.
fn readings(entry: &Entry<'_>, path: &ValuePath, sensors: &Sensors) -> Option<Readings> {
    if entry.value.is_array() {
        let items = entry.list()?;
        if items.is_empty() || items.len() > ELEMENTS_MAX as usize {
            let (count, most) = (items.len(), ELEMENTS_MAX);
            entry.fail(RobotFileCause::NumberOfElements { count, most });
            return None;
        }
        let each: Vec<_> = items.iter().map(|item| reading(item, false, sensors)).collect();
        let each: Vec<Readings> = each.into_iter().collect::<Option<_>>()?;
        let first = each.first()?;
        let (factor, has_unit) = (first.factor, first.has_unit);
        if let Some(place) = each.iter().position(|other| other.factor != factor) {
            items.get(place)?.fail(RobotFileCause::UnlikeUnits);
            return None;
        }
        let all: Vec<SensorReading> = each.into_iter().flat_map(|each| each.all).collect();
        return Some(Readings { counts: Some(all.len()), all, factor, has_unit });
    }
    reading(entry, path.has_elements(), sensors)
}

/// Reads one text. `in_list` is true if a sensor with several beams may give one for each element.
fn reading(entry: &Entry<'_>, in_list: bool, sensors: &Sensors) -> Option<Readings> {
    let text = entry.string()?;
    let (text, unit) = match text.trim().split_once(' ') {
        Some((text, unit)) => (text, Some(unit.trim())),
        None => (text.trim(), None),
    };
    let (place, sensor, value) = find_sensor(entry, text, sensors)?;
    let (value, counts) = match (&sensor.kind, value) {
        (kind, None) if in_list && !kind.beams_deg().is_empty() => {
            (SensorValue::BeamOfArgument, Some(kind.beams_deg().len()))
        }
        (_, value) => (sensor_value(entry, sensor, value)?, None),
    };
    let own = value.unit(&sensor.kind);
    let factor = match unit {
        None => 1.0,
        Some(unit) => match unit_factor(own, unit) {
            Ok(factor) => factor,
            Err(known) => {
                let (unit, key) = (unit.to_owned(), "reads");
                entry.fail(RobotFileCause::UnknownUnit { unit, key, known });
                return None;
            }
        },
    };
    let all = vec![SensorReading { sensor: place, value }];
    Some(Readings { all, counts, factor, has_unit: unit.is_some() })
}

fn sensor_value(entry: &Entry<'_>, sensor: &Sensor, value: Option<&str>) -> Option<SensorValue> {
    let values = sensor.kind.values();
    let found = values.iter().find(|known| known.name() == value.unwrap_or(""));
    // The only beam needs no number.
    let only = (value.is_none() && values.len() == 1).then(|| values.first()).flatten();
    let found = found.or(only).copied();
    if found.is_none() {
        let known = values.iter().map(|known| known.name()).filter(|name| !name.is_empty());
        let known = known.collect();
        let (sensor, value) = (sensor.name.clone(), value.map(str::to_owned));
        entry.fail(RobotFileCause::UnknownSensorValue { sensor, value, known });
    }
    found
}

/// Reads pairs of a reading and a value, by rising readings.
fn curve(entry: &Entry<'_>) -> Option<Vec<[f64; 2]>> {
    let pairs = entry.list()?;
    let pairs: Vec<Option<[f64; 2]>> =
        pairs.iter().map(|pair| pair.numbers("a reading and a value", NUMBER)).collect();
    let points: Vec<[f64; 2]> = pairs.into_iter().collect::<Option<_>>()?;
    let rises = points.windows(2).all(|pair| pair[0][0] < pair[1][0]);
    if points.len() < 2 || !rises {
        entry.fail(RobotFileCause::BadCurve);
        return None;
    }
    Some(points)
}
