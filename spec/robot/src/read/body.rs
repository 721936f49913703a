//! Reads `[body]` and `[[sensor]]`.

use std::collections::HashMap;
use std::ops::RangeInclusive;

use bittybuzz_toml_reader::TomlError;

use super::{Entry, Section, given, one_line};
use crate::body::{BodySpec, DriveSpec, Steering};
use crate::error::RobotFileCause;
use crate::sensor::{DistanceUnit, Sensor, SensorKind};
use crate::signature;

pub const BODY: &str = "[body]";
pub const SENSOR: &str = "this [[sensor]]";
pub const STEERING: &str = "[body.steering]";

/// The keys of `[body.steering]`.
pub const STEERING_KEYS: [&str; 4] =
    ["hard_turn_deg", "soft_turn_deg", "no_turn_deg", "speed_mm_s"];

/// The keys of `[body]` for every drive.
const COMMON_BODY_KEYS: [&str; 5] = ["drive", "radius_mm", "height_mm", "gain_error", "noise"];

/// The drives, and the additional keys of each.
const DRIVES: [(&str, &[&str]); 4] = [
    ("differential", &["wheel_distance_mm", "speed_mm_s", "steering"]),
    ("unicycle", &["speed_mm_s", "turn_deg_s"]),
    ("slip-stick", &["speed_mm_s", "turn_deg_s"]),
    ("quadrotor", &["speed_mm_s", "climb_mm_s", "turn_deg_s", "lag_s", "crash_speed_mm_s"]),
];

/// The keys of `[[sensor]]` for every kind.
const COMMON_SENSOR_KEYS: [&str; 4] = ["name", "kind", "noise", "rate_hz"];

/// The kinds of sensors, and the additional keys of each.
const SENSOR_KINDS: [(&str, &[&str]); 6] = [
    ("proximity", &["range_mm", "nothing", "direction_deg", "directions_deg", "count"]),
    ("light", &["direction_deg", "directions_deg", "count"]),
    ("ground", &["at_mm"]),
    ("range-and-bearing", &["range_mm", "bearing_noise_deg", "unit"]),
    ("positioning", &["heading_noise_deg"]),
    ("battery", &["full_mv", "empty_mv", "minutes"]),
];

const SIZE: RangeInclusive<f64> = 1.0..=10_000.0;
/// The places of sensors on a body, in mm.
const PLACE: RangeInclusive<f64> = -10_000.0..=10_000.0;
const PLACE_FORM: &str = "two numbers as [ahead, left]";
const SPEED: RangeInclusive<f64> = 0.0..=100_000.0;
const TURN: RangeInclusive<f64> = 0.0..=5000.0;
const SHARE: RangeInclusive<f64> = 0.0..=1.0;
const DIRECTION: RangeInclusive<f64> = -360.0..=360.0;
const RANGE: RangeInclusive<f64> = 1.0..=100_000.0;
const NOISE: RangeInclusive<f64> = 0.0..=100_000.0;
const VOLTAGE: RangeInclusive<f64> = 0.0..=32_767.0;
/// The range of a sensor value that fits the integers of the tiny profile.
const VALUE: RangeInclusive<f64> = -32_768.0..=32_767.0;
const BEAMS_MAX: u32 = 360;

/// Returns all keys of a section that has a word on which further keys depend, each key once.
fn all_keys(
    common: &[&'static str],
    words: &[(&'static str, &'static [&'static str])],
) -> Vec<&'static str> {
    let mut keys = common.to_vec();
    for key in words.iter().flat_map(|(_, keys)| *keys) {
        if !keys.contains(key) {
            keys.push(key);
        }
    }
    keys
}

pub fn body_keys() -> Vec<&'static str> {
    all_keys(&COMMON_BODY_KEYS, &DRIVES)
}

pub fn sensor_keys() -> Vec<&'static str> {
    all_keys(&COMMON_SENSOR_KEYS, &SENSOR_KINDS)
}

/// Returns the words for drives and kinds of sensors.
#[cfg(test)]
pub fn words() -> impl Iterator<Item = &'static str> {
    DRIVES.iter().chain(&SENSOR_KINDS).map(|(word, _)| *word)
}

/// Reads the word on which the other keys of a section depend, and reports the keys that the
/// section does not have with this word.
fn determining_word(
    section: &Section<'_>,
    key: &'static str,
    common: &[&'static str],
    words: &[(&'static str, &'static [&'static str])],
) -> Option<&'static str> {
    let choices: Vec<_> = words.iter().map(|(word, keys)| (*word, (*word, *keys))).collect();
    let (word, own) = section.required(key)?.word(&choices)?;
    for other in all_keys(&[], words) {
        if own.contains(&other) || common.contains(&other) {
            continue;
        }
        if let Some(entry) = section.get(other) {
            let known = [common, own].concat();
            entry.fail(RobotFileCause::KeyOfAnother { key: other, word, known });
        }
    }
    Some(word)
}

fn number(section: &Section<'_>, key: &'static str, range: RangeInclusive<f64>) -> Option<f64> {
    section.required(key)?.number(range)
}

/// Reads a number that may be left out. Returns `None` only for a mistake.
fn number_or(
    section: &Section<'_>,
    key: &str,
    range: RangeInclusive<f64>,
    usual: f64,
) -> Option<f64> {
    section.get(key).map_or(Some(usual), |entry| entry.number(range))
}

pub fn drive(section: &Section<'_>) -> Option<DriveSpec> {
    let word = determining_word(section, "drive", &COMMON_BODY_KEYS, &DRIVES)?;
    drive_of(section, word)
}

/// Reads a body whose drive is already read.
pub fn body(section: &Section<'_>, drive: Option<DriveSpec>) -> Option<BodySpec> {
    let radius_mm = number(section, "radius_mm", SIZE);
    let height_mm = number_or(section, "height_mm", SIZE, 2.0 * radius_mm.unwrap_or(1.0));
    let gain_error = number_or(section, "gain_error", SHARE, 0.0);
    let noise = number_or(section, "noise", SHARE, 0.0);
    Some(BodySpec {
        drive: drive?,
        radius_mm: radius_mm?,
        height_mm: height_mm?,
        gain_error: gain_error?,
        noise: noise?,
    })
}

fn drive_of(section: &Section<'_>, word: &str) -> Option<DriveSpec> {
    let speed_mm_s = number(section, "speed_mm_s", SPEED);
    if word == "differential" {
        let wheel_distance_mm = number(section, "wheel_distance_mm", SIZE);
        let steering = section.get("steering");
        let steering = steering.map(|entry| steering_of(&entry.section(STEERING)?));
        return Some(DriveSpec::Differential {
            wheel_distance_mm: wheel_distance_mm?,
            speed_mm_s: speed_mm_s?,
            steering: given(steering)?,
        });
    }
    let turn_deg_s = number(section, "turn_deg_s", TURN);
    if word == "quadrotor" {
        let climb_mm_s = number(section, "climb_mm_s", SPEED);
        let lag_s = number_or(section, "lag_s", 0.0..=10.0, 0.2);
        let crash_speed_mm_s = number_or(section, "crash_speed_mm_s", SPEED, 0.0);
        return Some(DriveSpec::Quadrotor {
            speed_mm_s: speed_mm_s?,
            climb_mm_s: climb_mm_s?,
            turn_deg_s: turn_deg_s?,
            lag_s: lag_s?,
            crash_speed_mm_s: crash_speed_mm_s?,
        });
    }
    let (speed_mm_s, turn_deg_s) = (speed_mm_s?, turn_deg_s?);
    Some(match word {
        "unicycle" => DriveSpec::Unicycle { speed_mm_s, turn_deg_s },
        _ => DriveSpec::SlipStick { speed_mm_s, turn_deg_s },
    })
}

fn steering_of(section: &Section<'_>) -> Option<Steering> {
    // A turn on the spot ends before it begins again, and a curve is wider than no turn.
    let no_turn_deg = number(section, "no_turn_deg", 0.0..=180.0);
    let least = no_turn_deg.unwrap_or(0.0);
    let soft_turn_deg = number(section, "soft_turn_deg", least..=180.0);
    let least = soft_turn_deg.unwrap_or(least).max(1.0);
    let hard_turn_deg = number(section, "hard_turn_deg", least..=180.0);
    let speed_mm_s = number(section, "speed_mm_s", SPEED);
    Some(Steering {
        hard_turn_deg: hard_turn_deg?,
        soft_turn_deg: soft_turn_deg?,
        no_turn_deg: no_turn_deg?,
        speed_mm_s: speed_mm_s?,
    })
}

/// The sensors that the file has defined up to here.
#[derive(Default)]
pub struct SensorNames {
    /// The line of each name.
    lines: HashMap<String, usize>,
    /// The line of the link.
    link: Option<usize>,
}

pub fn sensor(section: &Section<'_>, names: &mut SensorNames) -> Option<Sensor> {
    let name = section.required("name").and_then(|entry| sensor_name(&entry, names));
    let kind = determining_word(section, "kind", &COMMON_SENSOR_KEYS, &SENSOR_KINDS);
    if kind == Some("range-and-bearing") {
        let line = section.place().line;
        match names.link {
            Some(line) => section.get("kind")?.fail(RobotFileCause::SecondLink { line }),
            None => names.link = Some(line),
        }
    }
    let kind = kind.and_then(|word| sensor_kind(section, word));
    let noise = number_or(section, "noise", NOISE, 0.0);
    let rate_hz = section.get("rate_hz").map(|entry| entry.number(0.01..=1000.0));
    Some(Sensor { name: name?, kind: kind?, noise: noise?, rate_hz: given(rate_hz)? })
}

fn sensor_name(entry: &Entry<'_>, names: &mut SensorNames) -> Option<String> {
    let name = one_line(entry)?;
    if !signature::is_identifier(&name) {
        entry.fail(RobotFileCause::BadIdentifier { name });
        return None;
    }
    if let Some(line) = names.lines.get(&name) {
        entry.fail(RobotFileCause::DuplicateName { name, line: *line });
        return None;
    }
    names.lines.insert(name.clone(), entry.place().line);
    Some(name)
}

fn sensor_kind(section: &Section<'_>, word: &str) -> Option<SensorKind> {
    match word {
        "proximity" => {
            let directions_deg = beams(section);
            let range_mm = number(section, "range_mm", RANGE);
            let nothing = number_or(section, "nothing", VALUE, range_mm.unwrap_or(0.0));
            Some(SensorKind::Proximity {
                directions_deg: directions_deg?,
                range_mm: range_mm?,
                nothing: nothing?,
            })
        }
        "light" => {
            let has = |key| section.get(key).is_some();
            let is_directed = ["direction_deg", "directions_deg", "count"].into_iter().any(has);
            let directions_deg = if is_directed { beams(section)? } else { Vec::new() };
            Some(SensorKind::Light { directions_deg })
        }
        "range-and-bearing" => {
            let range_mm = number(section, "range_mm", RANGE);
            let bearing_noise_deg = number_or(section, "bearing_noise_deg", 0.0..=180.0, 0.0);
            let unit = section.get("unit").map(|entry| entry.word(&DistanceUnit::WORDS));
            Some(SensorKind::RangeAndBearing {
                range_mm: range_mm?,
                bearing_noise_deg: bearing_noise_deg?,
                unit: given(unit)?.unwrap_or_default(),
            })
        }
        "positioning" => {
            let heading_noise_deg = number_or(section, "heading_noise_deg", 0.0..=180.0, 0.0);
            Some(SensorKind::Positioning { heading_noise_deg: heading_noise_deg? })
        }
        "battery" => {
            let full_mv = number(section, "full_mv", VOLTAGE);
            let empty_mv = number(section, "empty_mv", 0.0..=full_mv.unwrap_or(*VOLTAGE.end()));
            let minutes = number(section, "minutes", 0.01..=100_000.0);
            Some(SensorKind::Battery { full_mv: full_mv?, empty_mv: empty_mv?, minutes: minutes? })
        }
        _ => {
            let at = section.get("at_mm").map(|entry| entry.numbers(PLACE_FORM, PLACE));
            Some(SensorKind::Ground { at_mm: given(at)?.unwrap_or_default() })
        }
    }
}

/// Reads the directions of the beams of a sensor: a list, or a first direction and a number of
/// evenly spaced beams.
fn beams(section: &Section<'_>) -> Option<Vec<f64>> {
    let Some(list) = section.get("directions_deg") else {
        let first = number_or(section, "direction_deg", DIRECTION, 0.0);
        let count = section.get("count").map_or(Some(1), |entry| entry.integer(1..=BEAMS_MAX));
        let (first, count) = (first?, count?);
        let step = 360.0 / f64::from(count);
        return Some((0..count).map(|beam| first + f64::from(beam) * step).collect());
    };
    for key in ["direction_deg", "count"] {
        if let Some(entry) = section.get(key) {
            entry.fail(TomlError::Both { key, other: "directions_deg" });
        }
    }
    let items = list.list()?;
    if items.is_empty() || items.len() > BEAMS_MAX as usize {
        list.fail(RobotFileCause::NumberOfBeams { count: items.len(), most: BEAMS_MAX });
        return None;
    }
    let directions: Vec<_> = items.iter().map(|item| item.number(DIRECTION)).collect();
    directions.into_iter().collect()
}
