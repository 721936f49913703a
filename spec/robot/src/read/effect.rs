//! Reads `sets`, `steers`, `reads` and `logs` of a `[[function]]`.

use bittybuzz_toml_reader::TomlError;

use super::{Entry, Section, given};
use crate::body::DriveSpec;
use crate::effect::{
    ActuatorQuantity, Amount, Dimension, EffectAssignment, FunctionEffect, SteeringVector,
};
use crate::error::RobotFileCause;
use crate::sensor::{Sensor, SensorKind, SensorReading, SensorValue};
use crate::{Parameter, RobotFunction, SignatureType};

pub const SETS: &str = "`sets`";
pub const STEERS: &str = "`steers`";

/// The keys of effects.
const EFFECT_KEYS: [&str; 4] = ["sets", "steers", "reads", "logs"];

/// The keys of `steers`: the parts of a vector, or its length and direction.
pub const STEERS_KEYS: [&str; 4] = ["forward", "leftward", "speed", "direction"];

/// The sensors of the file, in its order. A sensor with a mistake, which is already reported, is
/// `None`.
pub type Sensors = [Option<Sensor>];

pub fn sets_keys() -> Vec<&'static str> {
    ActuatorQuantity::ALL.map(ActuatorQuantity::name).to_vec()
}

/// Reports the effects of a function of a robot without a body.
pub fn refuse(section: &Section<'_>) {
    for key in EFFECT_KEYS {
        if let Some(entry) = section.get(key) {
            entry.fail(RobotFileCause::NoBody { key });
        }
    }
}

/// Reads the effect of a function on a body. A function of a robot with a body must have one. A
/// drive of `None` has a mistake that is already reported.
pub fn effect(
    section: &Section<'_>,
    function: &RobotFunction,
    drive: Option<DriveSpec>,
    sensors: &Sensors,
) -> Option<FunctionEffect> {
    if EFFECT_KEYS.iter().all(|key| section.get(key).is_none()) {
        section.fail(RobotFileCause::NoEffect { name: function.name.clone() });
        return None;
    }
    let sets = section.get("sets").map(|entry| {
        let sets = entry.section(SETS)?;
        assignments(&sets, function, drive?)
    });
    let steers = section.get("steers").map(|entry| {
        if drive?.steering().is_none() {
            entry.fail(RobotFileCause::NoSteering);
            return None;
        }
        vector(&entry.section(STEERS)?, function)
    });
    let logs = section.get("logs").map_or(Some(false), |entry| entry.boolean());
    let reads = section.get("reads").map(|entry| reading(&entry, function, sensors));
    if reads.is_none() && logs == Some(false) && function.returns.is_some() {
        section
            .get("returns")?
            .fail(RobotFileCause::ReturnsNothingRead { name: function.name.clone() });
        return None;
    }
    Some(FunctionEffect {
        sets: given(sets)?.unwrap_or_default(),
        steers: given(steers)?,
        logs: logs?,
        reads: given(reads)?,
        fills: None,
    })
}

fn assignments(
    section: &Section<'_>,
    function: &RobotFunction,
    drive: DriveSpec,
) -> Option<Vec<EffectAssignment>> {
    let mut assignments = Some(Vec::new());
    let mut count = 0;
    for quantity in ActuatorQuantity::ALL {
        let Some(entry) = section.get(quantity.name()) else { continue };
        count += 1;
        let amount = quantity_amount(&entry, quantity, function, drive);
        match (amount, &mut assignments) {
            (Some(amount), Some(list)) => list.push(EffectAssignment { quantity, amount }),
            (None, _) => assignments = None,
            (Some(_), None) => {}
        }
    }
    let assignments = assignments?;
    if count == 0 {
        section.fail(RobotFileCause::SetsNothing);
        return None;
    }
    let is_set =
        |list: &[Parameter]| assignments.iter().any(|assignment| assignment.amount.has_value(list));
    all_lists(section, function, is_set)?;
    Some(assignments)
}

/// Reports the first argument list of a function that has no effect.
fn all_lists(
    section: &Section<'_>,
    function: &RobotFunction,
    has_effect: impl Fn(&[Parameter]) -> bool,
) -> Option<()> {
    let Some(idle) = function.accepts.iter().find(|list| !has_effect(list)) else {
        return Some(());
    };
    let list: Vec<String> = idle.iter().map(Parameter::to_string).collect();
    section.fail(RobotFileCause::ListSetsNothing { list: list.join(", ") });
    None
}

/// Reads `steers`.
fn vector(section: &Section<'_>, function: &RobotFunction) -> Option<SteeringVector> {
    let part = |key, dimension| {
        amount(&section.required(key)?, Measure { key, dimension, most: None }, function)
    };
    let [forward, leftward, speed, direction] = STEERS_KEYS;
    let vector = if section.get(speed).is_some() || section.get(direction).is_some() {
        for key in [forward, leftward] {
            if let Some(entry) = section.get(key) {
                entry.fail(TomlError::Both { key, other: direction });
            }
        }
        let (speed, direction) = (part(speed, Dimension::Speed), part(direction, Dimension::Angle));
        SteeringVector::Polar { speed: speed?, direction: direction? }
    } else {
        let [forward, leftward] = [forward, leftward].map(|key| part(key, Dimension::Speed));
        SteeringVector::Cartesian { forward: forward?, leftward: leftward? }
    };
    let is_whole = |list: &[Parameter]| vector.amounts().iter().all(|part| part.has_value(list));
    all_lists(section, function, is_whole)?;
    Some(vector)
}

/// A quantity that a value can be read for.
struct Measure {
    /// Its key in the file.
    key: &'static str,
    dimension: Dimension,
    /// The largest value; `None` if it has no limit.
    most: Option<f64>,
}

/// Reads the value of a quantity of the drive.
fn quantity_amount(
    entry: &Entry<'_>,
    quantity: ActuatorQuantity,
    function: &RobotFunction,
    drive: DriveSpec,
) -> Option<Amount> {
    if !drive.quantities().contains(&quantity)
        && !ActuatorQuantity::OF_EVERY_BODY.contains(&quantity)
    {
        let known = drive.quantities().iter().chain(&ActuatorQuantity::OF_EVERY_BODY);
        let known = known.map(|known| known.name()).collect();
        let (key, drive) = (quantity.name(), drive.name());
        entry.fail(RobotFileCause::NotOfDrive { key, drive, known });
        return None;
    }
    let (key, dimension, most) = (quantity.name(), quantity.dimension(), drive.most(quantity));
    amount(entry, Measure { key, dimension, most }, function)
}

/// Reads a number, or a text such as `"speed"`, `"-rate rad/s"`, `"50 %"` and `"duty of 255"`.
fn amount(entry: &Entry<'_>, measure: Measure, function: &RobotFunction) -> Option<Amount> {
    if entry.value.as_str().is_none() {
        return entry.number(f64::MIN..=f64::MAX).map(Amount::Constant);
    }
    let text = entry.string()?.trim();
    let is_in_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '+' | '-');
    let (word, unit) = text.split_at(text.find(|c| !is_in_word(c)).unwrap_or(text.len()));
    let factor = factor(entry, unit.trim(), measure)?;
    if let Some(number) = word.parse().ok().filter(|number: &f64| number.is_finite()) {
        return Some(Amount::Constant(number * factor));
    }
    let (name, sign) = word.strip_prefix('-').map_or((word, 1.0), |name| (name, -1.0));
    if !crate::signature::is_identifier(name) {
        entry.fail(RobotFileCause::BadAmount { text: text.to_owned() });
        return None;
    }
    let mut same_name = function.accepts.iter().flatten().filter(|known| known.name == name);
    let Some(first) = same_name.next() else {
        let mut known: Vec<String> = Vec::new();
        for parameter in function.accepts.iter().flatten() {
            if !known.contains(&parameter.name) {
                known.push(parameter.name.clone());
            }
        }
        entry.fail(RobotFileCause::UnknownParameter { name: name.to_owned(), known });
        return None;
    };
    let is_number = |parameter: &&Parameter| {
        matches!(parameter.kind, SignatureType::Int | SignatureType::Number)
            && !parameter.is_repeated
    };
    if let Some(other) = [first].into_iter().chain(same_name).find(|known| !is_number(known)) {
        entry.fail(RobotFileCause::NoNumber { parameter: other.to_string() });
        return None;
    }
    Some(Amount::Parameter { name: name.to_owned(), factor: sign * factor })
}

/// Reads the text after a value: nothing, a unit, `%`, or `of` with the number that stands for the
/// largest value.
fn factor(entry: &Entry<'_>, unit: &str, measure: Measure) -> Option<f64> {
    if unit.is_empty() {
        return Some(1.0);
    }
    let Measure { key, dimension, most } = measure;
    let whole = match unit {
        "%" => Some(100.0),
        _ => unit.strip_prefix("of ").and_then(|whole| whole.trim().parse().ok()),
    };
    if let (Some(whole), Some(most)) = (whole, most)
        && whole > 0.0
        && f64::is_finite(whole)
    {
        return Some(most / whole);
    }
    let found = dimension.units().iter().find(|(name, _)| *name == unit);
    if found.is_none() {
        let mut known: Vec<&str> = dimension.units().iter().map(|(name, _)| *name).collect();
        if most.is_some() {
            known.extend(["%", "of NUMBER"]);
        }
        entry.fail(RobotFileCause::UnknownUnit { unit: unit.to_owned(), key, known });
    }
    found.map(|(_, factor)| *factor)
}

/// Reads `"SENSOR"` or `"SENSOR.VALUE"`.
fn reading(
    entry: &Entry<'_>,
    function: &RobotFunction,
    sensors: &Sensors,
) -> Option<SensorReading> {
    let (place, sensor, value) = find_sensor(entry, entry.string()?, sensors)?;
    let value = sensor_value(entry, sensor, value, function)?;
    if !matches!(
        function.returns,
        Some(SignatureType::Int | SignatureType::Number | SignatureType::Any)
    ) {
        entry.fail(RobotFileCause::ReadsWithoutResult { name: function.name.clone() });
        return None;
    }
    let wanted: &[SignatureType] = match value {
        SensorValue::BeamOfArgument => &[SignatureType::Int],
        _ => &[],
    };
    let takes = |list: &Vec<Parameter>| {
        list.iter().map(|parameter| parameter.kind).eq(wanted.iter().copied())
    };
    if value == SensorValue::BeamOfArgument && !function.accepts.iter().all(takes) {
        let (sensor, count) = (sensor.name.clone(), sensor.kind.beams_deg().len());
        entry.fail(RobotFileCause::WhichBeam { sensor, count, most: count - 1 });
        return None;
    }
    Some(SensorReading { sensor: place, value })
}

/// Finds the sensor of `SENSOR` or `SENSOR.VALUE`, and returns its number and the name of the value.
pub fn find_sensor<'a, 't>(
    entry: &Entry<'_>,
    text: &'t str,
    sensors: &'a Sensors,
) -> Option<(usize, &'a Sensor, Option<&'t str>)> {
    let (name, value) = match text.split_once('.') {
        Some((name, value)) => (name, Some(value)),
        None => (text, None),
    };
    let is_named = |sensor: &&Option<Sensor>| sensor.as_ref().is_some_and(|s| s.name == name);
    let Some(place) = sensors.iter().position(|sensor| is_named(&sensor)) else {
        // The name may be that of a sensor with a mistake.
        if sensors.iter().all(Option::is_some) {
            let known = sensors.iter().flatten().map(|sensor| sensor.name.clone()).collect();
            entry.fail(RobotFileCause::UnknownSensor { name: name.to_owned(), known });
        }
        return None;
    };
    Some((place, sensors.get(place)?.as_ref()?, value))
}

fn sensor_value(
    entry: &Entry<'_>,
    sensor: &Sensor,
    value: Option<&str>,
    function: &RobotFunction,
) -> Option<SensorValue> {
    let unknown = |known: Vec<String>| {
        let (sensor, value) = (sensor.name.clone(), value.map(str::to_owned));
        entry.fail(RobotFileCause::UnknownSensorValue { sensor, value, known });
        None
    };
    let count = sensor.kind.beams_deg().len();
    match &sensor.kind {
        _ if count > 0 => match value {
            None if count > 1 => Some(SensorValue::BeamOfArgument),
            None if function.accepts.iter().any(|list| !list.is_empty()) => {
                Some(SensorValue::BeamOfArgument)
            }
            None => Some(SensorValue::Beam(0)),
            Some(beam) => match beam.parse() {
                Ok(beam) if beam < count => Some(SensorValue::Beam(beam)),
                _ => unknown((0..count).map(|beam| beam.to_string()).collect()),
            },
        },
        SensorKind::RangeAndBearing { .. } | SensorKind::Positioning { .. } => {
            let values = sensor.kind.values();
            let found = values.iter().find(|known| Some(known.name().as_str()) == value);
            found.copied().or_else(|| unknown(values.iter().map(|known| known.name()).collect()))
        }
        _ => match value {
            None => Some(SensorValue::Only),
            Some(_) => unknown(Vec::new()),
        },
    }
}
