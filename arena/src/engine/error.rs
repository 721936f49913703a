//! The errors of the engine.

use core::fmt;

use super::id::RobotId;

/// An invalid value in [`WorldSettings`](super::WorldSettings) or in the parameters of a body or a link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SettingsError {
    /// Path of the field, such as `infrared.link.range`.
    pub field: &'static str,
    /// The condition that the value must meet, such as `0 or more`.
    pub must: &'static str,
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} must be {}", self.field, self.must)
    }
}

impl core::error::Error for SettingsError {}

/// A reason why a robot cannot be placed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AddError {
    /// All ids are in use: they have 16 bits.
    TooMany,
    /// The place is outside of the world or not finite.
    Outside,
    /// The herd belongs to another world.
    UnknownHerd,
}

impl fmt::Display for AddError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            AddError::TooMany => "a world has at most 65,536 robots",
            AddError::Outside => "the place is outside of the world",
            AddError::UnknownHerd => "the herd is one of another world",
        })
    }
}

impl core::error::Error for AddError {}

/// There is no robot with that id.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct UnknownRobot(pub RobotId);

impl fmt::Display for UnknownRobot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "there is no robot {}", self.0.0)
    }
}

impl core::error::Error for UnknownRobot {}
