//! Commands to a planner, and its answers.

use glam::Vec3;

/// A point to fly to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Destination {
    /// A point in the world frame.
    Absolute {
        /// Position in m.
        position_m: Vec3,
        /// Yaw in radians, or `None` to keep it.
        yaw_rad: Option<f32>,
    },
    /// A point relative to the reference of this moment, along the axes of the world frame.
    Relative {
        /// Displacement in m.
        displacement_m: Vec3,
        /// Turn in radians; it is flown on the short way.
        turn_rad: f32,
    },
}

/// The answer to an accepted command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanReport {
    /// Duration until the reference is at rest, in seconds: exact, or an estimate if
    /// `brakes_first`. 0 for a velocity, which has no end.
    pub duration_s: f32,
    /// True if the fence or the limits changed the goal or the velocity.
    pub is_clamped: bool,
    /// True if the reference brakes before it turns to its goal.
    pub brakes_first: bool,
}
