//! Robots that are described by their file alone: `[body]`, `[[sensor]]`, and functions that set
//! quantities and read sensors.

mod body;
mod sense;
mod steering;

use std::sync::Arc;

use bittybuzz_robot_spec::{
    self as spec, ActuatorQuantity, DriveSpec, Parameter, Robot, RobotFunction, Sensor, SensorKind,
    SignatureType, SteeringVector,
};

use crate::engine::{
    Bodies, BodyBlock, BodyModel, BodySize, LinkSettings, Loss, Media, Medium, RangeAndBearing,
    SettingsError,
};
use crate::scenario::Section;
use crate::scenario::keys::SectionKeys;

use super::call::{Autopilot, Done, Effect, RobotCall};
use super::model::{Glyph, ModelKeys, RobotModel};
use body::{Actuators, DescribedBody, Numbers};
use sense::Senses;

/// The model of a robot that its file describes.
#[derive(Debug, Clone)]
pub struct DescribedRobot {
    body: spec::BodySpec,
    sensors: Arc<[Sensor]>,
}

/// The name of the `link` of a group in messages.
pub const LINK: &str = "the `link` of these robots";

/// The sections of a described robot in scenarios. They have no keys, because all parameters come
/// from the robot file.
const KEYS: ModelKeys = ModelKeys {
    body: SectionKeys { name: "the body of these robots", keys: &[] },
    robots: "robots that their file describes",
    model: "the `model` of these robots",
    world_only: &[],
    link: LINK,
};

impl DescribedRobot {
    /// Returns the model of a robot; `None` if its file does not describe it.
    pub fn new(robot: &Robot) -> Option<Self> {
        Some(DescribedRobot { body: robot.body.clone()?, sensors: robot.sensors.clone().into() })
    }

    fn numbers(&self) -> Numbers {
        let spec::BodySpec { drive, gain_error, noise, .. } = self.body;
        Numbers { drive, gain_error: gain_error as f32, noise: noise as f32 }
    }
}

impl BodyModel for DescribedRobot {
    fn shape(&self) -> BodySize {
        let spec::BodySpec { radius_mm, height_mm, .. } = self.body;
        BodySize { radius_mm: radius_mm as f32, height_mm: height_mm as f32 }
    }

    /// Returns the top speed with the largest gain and noise, which end at three deviations each.
    fn top_speed_mm_s(&self) -> f32 {
        let speed = match self.body.drive {
            DriveSpec::Differential { speed_mm_s, .. }
            | DriveSpec::Unicycle { speed_mm_s, .. }
            | DriveSpec::SlipStick { speed_mm_s, .. }
            | DriveSpec::Quadrotor { speed_mm_s, .. } => speed_mm_s as f32,
        };
        let Numbers { gain_error, noise, .. } = self.numbers();
        speed * (1.0 + 3.0 * gain_error) * (1.0 + 3.0 * noise)
    }

    fn medium(&self) -> Medium {
        Medium::RangeAndBearing
    }

    fn crash_speed_mm_s(&self) -> Option<f32> {
        match self.body.drive {
            DriveSpec::Quadrotor { crash_speed_mm_s, .. } => Some(crash_speed_mm_s as f32),
            _ => None,
        }
    }

    fn has_positioning(&self) -> bool {
        false
    }

    fn ground_sensors(&self) -> Vec<[f32; 2]> {
        let places = self.sensors.iter().filter_map(|sensor| match sensor.kind {
            SensorKind::Ground { at_mm } => Some(at_mm.map(|mm| mm as f32)),
            _ => None,
        });
        places.collect()
    }

    /// Always succeeds, because robot files are checked when they are read.
    fn check(&self) -> Result<(), SettingsError> {
        Ok(())
    }

    fn block(&self, substep_s: f32) -> Box<dyn BodyBlock> {
        Box::new(Bodies::<DescribedBody>::new(self.numbers(), substep_s))
    }
}

impl RobotModel for DescribedRobot {
    fn name(&self) -> &'static str {
        "described"
    }

    fn robots(&self) -> &'static [&'static str] {
        &[]
    }

    fn keys(&self) -> &'static ModelKeys {
        &KEYS
    }

    fn read(&self, _: &Section<'_>) -> Arc<dyn RobotModel> {
        Arc::new(self.clone())
    }

    /// Takes the link from the sensor for range and bearing. Without such a sensor, nothing is
    /// within reach.
    fn set_own_media(&self, media: &mut Media) {
        let link = self.sensors.iter().find_map(|sensor| match sensor.kind {
            SensorKind::RangeAndBearing { range_mm, bearing_noise_deg, .. } => {
                Some((range_mm, sensor.noise, bearing_noise_deg))
            }
            _ => None,
        });
        let (range, distance, bearing) = link.unwrap_or_default();
        let loss = Loss::even(0.0);
        media.range_and_bearing = RangeAndBearing {
            link: LinkSettings {
                range: Some(range as f32),
                edge: 0.0,
                loss,
                duplicate: 0.0,
                reorder: 0.0,
            },
            distance_sigma: distance as f32,
            bearing_sigma: (bearing as f32).to_radians(),
            ..RangeAndBearing::STANDARD
        };
    }

    fn effect(&self, function: &RobotFunction) -> Option<Effect> {
        let effect = function.effect.clone()?;
        let (drive, accepts) = (self.body.drive, function.accepts.clone());
        let name = function.name.clone();
        let is_integer = function.returns == Some(SignatureType::Int);
        Some(Box::new(move |call| {
            let count = call.numbers.count();
            let list = accepts.iter().find(|list| list.len() == count).or(accepts.first());
            let arguments: Vec<f64> =
                (0..count).map(|index| f64::from(call.numbers.float(index))).collect();
            for (quantity, value) in list.iter().flat_map(|list| effect.values(list, &arguments)) {
                set(call, drive, quantity, value as f32);
            }
            let steers = effect.steers.as_ref().zip(list);
            if let Some(along) = steers.and_then(|(steers, list)| vector(steers, list, &arguments))
            {
                actuators(call).steer(drive, along);
            }
            if effect.logs {
                log(call, &name, list);
            }
            match (&effect.fills, effect.reads) {
                (Some(value), _) => sense::fill(call, value, is_integer),
                (None, Some(reading)) => sense::read(call, reading, is_integer),
                (None, None) => Done::Idle,
            }
        }))
    }

    fn glyph(&self) -> Glyph {
        match self.body.drive {
            DriveSpec::Differential { .. } => Glyph::Wheels,
            DriveSpec::Unicycle { .. } => Glyph::Disc,
            DriveSpec::SlipStick { .. } => Glyph::Legs,
            DriveSpec::Quadrotor { .. } => Glyph::Rotors,
        }
    }

    fn autopilot(&self) -> Option<Box<dyn Autopilot>> {
        let radius_mm = self.shape().radius_mm;
        Some(Box::new(Senses::new(self.sensors.clone(), radius_mm)))
    }
}

/// Returns the vector that a call gives: ahead and to the left, in mm/s.
fn vector(steers: &SteeringVector, list: &[Parameter], arguments: &[f64]) -> Option<[f64; 2]> {
    let [first, second] = steers.amounts().map(|amount| amount.value(list, arguments));
    let (first, second) = (first?, second?);
    Some(match steers {
        SteeringVector::Cartesian { .. } => [first, second],
        SteeringVector::Polar { .. } => {
            let (sin, cos) = libm::sincos(second.to_radians());
            [first * cos, first * sin]
        }
    })
}

/// Logs a call. If the function takes any number of arguments, they are logged as `log` does; else
/// the line is the call, because its arguments alone would not say what was called.
fn log(call: &mut RobotCall<'_, '_>, name: &str, list: Option<&Vec<Parameter>>) {
    let is_like_log = list.and_then(|list| list.last()).is_some_and(|last| last.is_repeated);
    if is_like_log { call.log(Vec::new()) } else { call.log_call(name) }
}

fn actuators<'a>(call: &'a mut RobotCall<'_, '_>) -> &'a mut Actuators {
    call.io.controls().expect("a described robot has a described body")
}

/// Sets a quantity of an actuator.
fn set(call: &mut RobotCall<'_, '_>, drive: DriveSpec, quantity: ActuatorQuantity, value: f32) {
    let bit = match quantity {
        ActuatorQuantity::Color => {
            *call.io.led = (value as i64 & 7) as u8;
            return;
        }
        ActuatorQuantity::Red => 1,
        ActuatorQuantity::Green => 2,
        ActuatorQuantity::Blue => 4,
        _ => {
            actuators(call).set(drive, quantity, value);
            return;
        }
    };
    let led = &mut *call.io.led;
    *led = if value > 0.0 { *led | bit } else { *led & !bit };
}
