//! Lamps and ambient light, and the readings of a robot's light sensor.

use super::geometry::Pose;
use super::shadow::Shadows;

/// A lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// mm
    pub x: f32,
    /// mm
    pub y: f32,
    /// The reading of the sensor when it is at the lamp and faces it; 1023 saturates the sensor.
    pub intensity: f32,
}

/// The number of a lamp in its world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightId(pub(crate) usize);

/// The largest reading, at which the sensor's converter saturates.
const READING_MAX: f32 = 1023.0;

/// A lamp adds nothing beyond this distance in mm (the Kilobot plugin of ARGoS).
const REACH_MM: f32 = 2500.0;

/// The light of a place: ambient light, lamps, and the things that cast shadows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lighting<'a> {
    pub(crate) ambient: f32,
    pub(crate) lamps: &'a [Lamp],
    pub(crate) shadows: Shadows<'a>,
}

/// Returns the reading of a robot's sensor at the height `height_mm`, 0 to 1023.
///
/// A lamp adds `intensity * exp(-2 d) * (1 - angle / pi)` at a distance of `d` meters, where
/// `angle` is the angle between the robot's heading and the lamp. This is the law of ARGoS' Kilobot
/// sensor, with the sensor facing ahead. As there, a lamp in the shadow of an obstacle adds
/// nothing. A lamp has no height of its own, so an obstacle below the sensor casts no shadow on it,
/// which is a choice.
pub(crate) fn reading(pose: &Pose, height_mm: f32, lighting: Lighting<'_>) -> u16 {
    brightness(pose, height_mm, Some(pose.heading), lighting) as u16
}

/// Returns the reading of a sensor that faces a direction of the world. With `None`, the sensor is
/// equally sensitive in all directions.
pub(crate) fn brightness(
    pose: &Pose,
    height_mm: f32,
    direction_rad: Option<f32>,
    Lighting { ambient, lamps, shadows }: Lighting<'_>,
) -> f32 {
    let mut sum = ambient;
    for light in lamps {
        let (dx, dy) = (light.x - pose.x, light.y - pose.y);
        let distance = (dx * dx + dy * dy).sqrt();
        let is_dark = || shadows.separate((pose.x, pose.y), (light.x, light.y), height_mm);
        if distance < REACH_MM && !is_dark() {
            let facing = direction_rad.map_or(1.0, |direction_rad| {
                let angle = super::wrap(libm::atan2f(dy, dx) - direction_rad).abs();
                1.0 - angle / core::f32::consts::PI
            });
            sum += light.intensity * libm::expf(-0.002 * distance) * facing;
        }
    }
    sum.clamp(0.0, READING_MAX)
}
