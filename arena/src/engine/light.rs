//! Lamps and daylight, as a robot's light sensor sees them.

use super::geometry::Pose;

/// A lamp.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// mm
    pub x: f32,
    /// mm
    pub y: f32,
    /// Readings of the sensor when it is at the lamp and looks at it; 1023 saturates it.
    pub intensity: f32,
}

/// Which lamp.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LightId(pub(crate) usize);

/// Readings end where the sensor's converter does.
const SATURATED: f32 = 1023.0;

/// Beyond this distance in mm a lamp adds nothing (the Kilobot plugin of ARGoS).
const REACH: f32 = 2500.0;

/// Returns the reading of a robot's sensor, 0 to 1023.
///
/// A lamp adds `intensity * exp(-2 d) * (1 - angle / pi)` at d metres, angle between the robot's
/// heading and the lamp:
/// the law of ARGoS' Kilobot sensor, with the sensor looking ahead.
pub(crate) fn reading(pose: &Pose, ambient: f32, lights: &[Light]) -> u16 {
    brightness(pose, Some(pose.heading), ambient, lights) as u16
}

/// Returns the brightness for a sensor that looks in a direction of the world; `None`: it sees all directions alike.
pub(crate) fn brightness(pose: &Pose, look: Option<f32>, ambient: f32, lights: &[Light]) -> f32 {
    let mut sum = ambient;
    for light in lights {
        let (dx, dy) = (light.x - pose.x, light.y - pose.y);
        let distance = (dx * dx + dy * dy).sqrt();
        if distance < REACH {
            let facing = look.map_or(1.0, |look| {
                let angle = super::wrap(libm::atan2f(dy, dx) - look).abs();
                1.0 - angle / core::f32::consts::PI
            });
            sum += light.intensity * libm::expf(-0.002 * distance) * facing;
        }
    }
    sum.clamp(0.0, SATURATED)
}
