//! Reads `sets`, `reads` and `logs` of a `[[function]]`.

use super::{Entry, Section, given};
use crate::body::DriveSpec;
use crate::effect::{ActuatorQuantity, Amount, EffectAssignment, FunctionEffect};
use crate::error::RobotFileCause;
use crate::sensor::{Sensor, SensorKind, SensorReading, SensorValue};
use crate::{Parameter, RobotFunction, SignatureType};

pub const SETS: &str = "`sets`";

/// The keys of effects.
const EFFECT_KEYS: [&str; 3] = ["sets", "reads", "logs"];

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
        logs: logs?,
        reads: given(reads)?,
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
        let amount = amount(&entry, quantity, function, drive);
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
    let is_set_by = |list: &Vec<Parameter>, assignment: &EffectAssignment| match &assignment.amount
    {
        Amount::Constant(_) => true,
        Amount::Parameter { name, .. } => list.iter().any(|parameter| parameter.name == *name),
    };
    let idle = function
        .accepts
        .iter()
        .find(|list| !assignments.iter().any(|assignment| is_set_by(list, assignment)));
    if let Some(list) = idle {
        let list: Vec<String> = list.iter().map(Parameter::to_string).collect();
        section.fail(RobotFileCause::ListSetsNothing { list: list.join(", ") });
        return None;
    }
    Some(assignments)
}

/// Reads a number, or a text such as `"speed"`, `"-rate rad/s"`, `"50 %"` and `"duty of 255"`.
fn amount(
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
    if entry.value.as_str().is_none() {
        return entry.number(f64::MIN..=f64::MAX).map(Amount::Constant);
    }
    let text = entry.string()?.trim();
    let is_in_word = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '+' | '-');
    let (word, unit) = text.split_at(text.find(|c| !is_in_word(c)).unwrap_or(text.len()));
    let factor = factor(entry, unit.trim(), quantity, drive)?;
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
fn factor(
    entry: &Entry<'_>,
    unit: &str,
    quantity: ActuatorQuantity,
    drive: DriveSpec,
) -> Option<f64> {
    if unit.is_empty() {
        return Some(1.0);
    }
    let dimension = quantity.dimension();
    let whole = match unit {
        "%" => Some(100.0),
        _ => unit.strip_prefix("of ").and_then(|whole| whole.trim().parse().ok()),
    };
    if let (Some(whole), Some(most)) = (whole, drive.most(quantity))
        && whole > 0.0
        && f64::is_finite(whole)
    {
        return Some(most / whole);
    }
    let found = dimension.units().iter().find(|(name, _)| *name == unit);
    if found.is_none() {
        let mut known: Vec<&str> = dimension.units().iter().map(|(name, _)| *name).collect();
        if drive.most(quantity).is_some() {
            known.extend(["%", "of NUMBER"]);
        }
        entry.fail(RobotFileCause::UnknownUnit {
            unit: unit.to_owned(),
            key: quantity.name(),
            known,
        });
    }
    found.map(|(_, factor)| *factor)
}

/// Reads `"SENSOR"` or `"SENSOR.VALUE"`.
fn reading(
    entry: &Entry<'_>,
    function: &RobotFunction,
    sensors: &Sensors,
) -> Option<SensorReading> {
    let text = entry.string()?;
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
    let sensor = sensors.get(place)?.as_ref()?;
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
        let SensorKind::Proximity { directions_deg, .. } = &sensor.kind else { return None };
        let (sensor, count) = (sensor.name.clone(), directions_deg.len());
        entry.fail(RobotFileCause::WhichBeam { sensor, count, most: count - 1 });
        return None;
    }
    Some(SensorReading { sensor: place, value })
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
    match &sensor.kind {
        SensorKind::Proximity { directions_deg, .. } => {
            let count = directions_deg.len();
            match value {
                None if count > 1 => Some(SensorValue::BeamOfArgument),
                None if function.accepts.iter().any(|list| !list.is_empty()) => {
                    Some(SensorValue::BeamOfArgument)
                }
                None => Some(SensorValue::Beam(0)),
                Some(beam) => match beam.parse() {
                    Ok(beam) if beam < count => Some(SensorValue::Beam(beam)),
                    _ => unknown((0..count).map(|beam| beam.to_string()).collect()),
                },
            }
        }
        SensorKind::RangeAndBearing { .. } => match value {
            Some("distance") => Some(SensorValue::NearestDistance),
            Some("bearing") => Some(SensorValue::NearestBearing),
            Some("count") => Some(SensorValue::Count),
            _ => unknown(["distance", "bearing", "count"].map(str::to_owned).to_vec()),
        },
        SensorKind::Light { .. } | SensorKind::Ground { .. } | SensorKind::Battery { .. } => {
            match value {
                None => Some(SensorValue::Only),
                Some(_) => unknown(Vec::new()),
            }
        }
    }
}
