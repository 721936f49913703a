//! Places, directions and the rectangle that is the world.

use core::f32::consts::{PI, TAU};

/// The position and heading of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose {
    /// mm, to the right of the middle of the world.
    pub x: f32,
    /// mm, up from the middle of the world.
    pub y: f32,
    /// mm over the ground.
    pub z: f32,
    /// Radians in (-pi, pi], 0 along x, anticlockwise positive.
    pub heading: f32,
}

impl Pose {
    /// Returns a pose on the ground.
    #[must_use]
    pub fn new(x: f32, y: f32, heading: f32) -> Self {
        Pose { x, y, z: 0.0, heading: wrap(heading) }
    }

    pub(crate) fn is_finite(&self) -> bool {
        self.x.is_finite() && self.y.is_finite() && self.z.is_finite() && self.heading.is_finite()
    }
}

/// The world: a rectangle with the origin in its middle, and walls around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// mm along x.
    pub width: f32,
    /// mm along y.
    pub height: f32,
}

impl Area {
    /// Returns true if a point is inside.
    #[must_use]
    pub fn contains(&self, x: f32, y: f32) -> bool {
        x.abs() <= self.width / 2.0 && y.abs() <= self.height / 2.0
    }
}

/// Returns the vector of length 1 in the same direction; `None` if there is none.
pub(crate) fn direction((x, y): (f32, f32)) -> Option<(f32, f32)> {
    let length = (x * x + y * y).sqrt();
    (length > 0.0 && length.is_finite()).then(|| (x / length, y / length))
}

/// Turns a vector so that one along the x axis points along `along`, a vector of length 1.
pub(crate) fn turned((x, y): (f32, f32), along: (f32, f32)) -> (f32, f32) {
    (x * along.0 - y * along.1, x * along.1 + y * along.0)
}

/// Undoes [`turned`].
pub(crate) fn turned_back(vector: (f32, f32), along: (f32, f32)) -> (f32, f32) {
    turned(vector, (along.0, -along.1))
}

/// Returns the angle of the same direction in (-pi, pi].
#[must_use]
pub fn wrap(angle: f32) -> f32 {
    if angle > -PI && angle <= PI {
        return angle;
    }
    let turned = angle - TAU * libm::floorf((angle + PI) / TAU);
    if turned <= -PI { PI } else { turned.min(PI) }
}
