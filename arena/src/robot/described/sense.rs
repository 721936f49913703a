//! Sensors of described robots.

use std::sync::Arc;

use bittybuzz_robot_spec::{Sensor, SensorKind, SensorReading, SensorValue, ValueReading};

use crate::engine::{Io, Stream};
use crate::robot::call::{Autopilot, Done, RobotCall};

use super::body::Actuators;

/// The largest reading of light and ground sensors.
const READING_MAX: f32 = 1023.0;

/// The sensors of one robot, with their last values.
#[derive(Debug, Clone)]
pub struct Senses {
    sensors: Arc<[Sensor]>,
    radius: f32,
    /// The last values of each sensor, and the number of the period in which they were measured.
    measured: Vec<Option<(u64, Vec<f32>)>>,
}

impl Senses {
    pub fn new(sensors: Arc<[Sensor]>, radius_mm: f32) -> Self {
        let measured = sensors.iter().map(|_| None).collect();
        Senses { sensors, radius: radius_mm, measured }
    }

    /// Returns a value of a sensor: the last one, or a new one if the sensor's period is over.
    /// `None` stands for a beam that the sensor does not have.
    fn value(
        &mut self,
        place: usize,
        index: usize,
        io: &Io<'_>,
        chance: &mut Stream,
    ) -> Option<f32> {
        let sensor = &self.sensors[place];
        let seconds = io.milliseconds() as f64 / 1000.0;
        let period = sensor.rate_hz.map_or(io.now, |rate| (seconds * rate) as u64);
        let known = self.measured[place].take().filter(|(then, _)| *then == period);
        let measure = || (period, measure(&self.sensors, place, self.radius, io, chance));
        let (_, values) = self.measured[place].insert(known.unwrap_or_else(measure));
        values.get(index).copied()
    }

    /// Returns true if the battery is empty.
    fn is_empty(&self, io: &Io<'_>) -> bool {
        self.sensors.iter().any(|sensor| match sensor.kind {
            SensorKind::Battery { minutes, .. } => io.milliseconds() as f64 >= minutes * 60_000.0,
            _ => false,
        })
    }
}

impl Autopilot for Senses {
    fn copy(&self) -> Box<dyn Autopilot> {
        Box::new(self.clone())
    }

    fn battery_mv(&self, milliseconds: u64) -> Option<u16> {
        self.sensors.iter().find_map(|sensor| match sensor.kind {
            SensorKind::Battery { full_mv, empty_mv, minutes } => {
                Some(voltage([full_mv, empty_mv], minutes, milliseconds) as u16)
            }
            _ => None,
        })
    }

    fn battery_charge(&self, milliseconds: u64) -> Option<f32> {
        self.sensors.iter().find_map(|sensor| match sensor.kind {
            SensorKind::Battery { minutes, .. } => {
                let used = milliseconds as f64 / (minutes * 60_000.0);
                Some((1.0 - used).max(0.0) as f32)
            }
            _ => None,
        })
    }

    /// Stops a robot whose battery is empty; a flying robot falls.
    fn tick(&mut self, io: &mut Io<'_>, _: Option<u16>) {
        if self.is_empty(io) {
            io.halt();
            *io.led = 0;
        }
    }

    /// Stops the motors; a flying robot descends.
    fn give_up(&mut self, io: &mut Io<'_>) {
        let actuators = io.controls().expect("a described robot has a described body");
        *actuators = Actuators::LANDING;
    }

    fn start(&mut self) {}
}

/// Measures all values of the sensor at an index.
fn measure(
    sensors: &[Sensor],
    place: usize,
    radius_mm: f32,
    io: &Io<'_>,
    chance: &mut Stream,
) -> Vec<f32> {
    let sensor = &sensors[place];
    let sigma = sensor.noise as f32;
    let mut noisy = |value: f32| {
        let error = if sigma > 0.0 { sigma * chance.normal() } else { 0.0 };
        value + error
    };
    match &sensor.kind {
        SensorKind::Proximity { directions_deg, range_mm, nothing } => {
            let range_mm = *range_mm as f32;
            let beam = |direction: &f64| {
                let along = (*direction as f32).to_radians();
                match io.sensors.beam(along, radius_mm + range_mm) {
                    Some(distance) => noisy(distance - radius_mm).clamp(0.0, range_mm),
                    None => *nothing as f32,
                }
            };
            directions_deg.iter().map(beam).collect()
        }
        SensorKind::Light { directions_deg } => {
            let mut value =
                |along: Option<f32>| noisy(io.sensors.brightness(along)).clamp(0.0, READING_MAX);
            if directions_deg.is_empty() {
                return vec![value(None)];
            }
            let along = |direction: &f64| Some((*direction as f32).to_radians());
            directions_deg.iter().map(|direction| value(along(direction))).collect()
        }
        SensorKind::Ground { .. } => {
            let is_ground = |sensor: &&Sensor| matches!(sensor.kind, SensorKind::Ground { .. });
            let brightness = io.sensors.ground(sensors[..place].iter().filter(is_ground).count());
            vec![noisy(READING_MAX * brightness).clamp(0.0, READING_MAX)]
        }
        SensorKind::RangeAndBearing { range_mm, bearing_noise_deg, .. } => {
            let range_mm = *range_mm as f32;
            let (count, nearest) = io.sensors.neighbors(range_mm);
            let (distance, bearing) = nearest.map_or((range_mm, 0.0), |[distance, bearing]| {
                (noisy(distance).clamp(0.0, range_mm), bearing.to_degrees())
            });
            let error = match *bearing_noise_deg as f32 {
                sigma if sigma > 0.0 && nearest.is_some() => sigma * chance.normal(),
                _ => 0.0,
            };
            vec![distance, wrap_degrees(bearing + error), count as f32]
        }
        SensorKind::Positioning { heading_noise_deg } => {
            let pose = io.sensors.pose();
            let [x, y, z] = [pose.x, pose.y, pose.z].map(&mut noisy);
            let error = match *heading_noise_deg as f32 {
                sigma if sigma > 0.0 => sigma * chance.normal(),
                _ => 0.0,
            };
            vec![x, y, z, wrap_degrees(pose.heading.to_degrees() + error)]
        }
        SensorKind::Battery { full_mv, empty_mv, minutes } => {
            vec![noisy(voltage([*full_mv, *empty_mv], *minutes, io.milliseconds())).max(0.0)]
        }
    }
}

/// Returns the voltage of a battery in mV at a time of the run in ms. It falls evenly from full to empty.
fn voltage([full, empty]: [f64; 2], minutes: f64, milliseconds: u64) -> f32 {
    let share = (milliseconds as f64 / (minutes * 60_000.0)).min(1.0);
    (full - (full - empty) * share) as f32
}

/// Returns the same direction in (-180, 180].
fn wrap_degrees(angle: f32) -> f32 {
    crate::engine::wrap(angle.to_radians()).to_degrees()
}

/// Reads a sensor value for a robot function, rounded to an integer if `is_integer` is set.
pub fn read(call: &mut RobotCall<'_, '_>, reading: SensorReading, is_integer: bool) -> Done {
    done(reading_of(call, reading), is_integer)
}

/// Reads a value for a table of the script. The argument, if there is one, is the number of an
/// element.
pub fn fill(call: &mut RobotCall<'_, '_>, value: &ValueReading, is_integer: bool) -> Done {
    let element = usize::try_from(call.numbers.int(0)).ok();
    let readings = &value.readings;
    let chosen = match readings.as_slice() {
        [only] => Some(only),
        _ => element.and_then(|element| readings.get(element)),
    };
    let reading = chosen.and_then(|chosen| reading_of(call, *chosen));
    done(reading.map(|reading| value.scale.value(f64::from(reading)) as f32), is_integer)
}

fn done(value: Option<f32>, is_integer: bool) -> Done {
    match value {
        None => Done::OutOfRange,
        Some(value) if is_integer => Done::Int(value.round() as i32),
        Some(value) => Done::Float(value),
    }
}

/// Returns a reading in its own unit; `None` for a beam that the sensor does not have.
fn reading_of(call: &mut RobotCall<'_, '_>, reading: SensorReading) -> Option<f32> {
    let index = match reading.value {
        SensorValue::Only | SensorValue::NearestDistance => 0,
        SensorValue::NearestBearing => 1,
        SensorValue::Count => 2,
        SensorValue::Coordinate(axis) => axis,
        SensorValue::Heading => 3,
        SensorValue::Beam(beam) => beam,
        SensorValue::BeamOfArgument => usize::try_from(call.numbers.int(0)).ok()?,
    };
    let is_battery =
        |senses: &Senses| matches!(senses.sensors[reading.sensor].kind, SensorKind::Battery { .. });
    let memory = &mut *call.memory;
    let autopilot = memory.autopilot.as_mut().expect("a described robot has an autopilot");
    let any: &mut dyn std::any::Any = &mut **autopilot;
    let senses = any.downcast_mut::<Senses>().expect("its autopilot has its sensors");
    let set = memory.battery_mv.filter(|_| is_battery(senses)).map(f32::from);
    set.or_else(|| senses.value(reading.sensor, index, call.io, &mut memory.chance))
}
