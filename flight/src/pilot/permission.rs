//! The permission of a person to start the motors.

use super::settings::PERMISSION_MS;

/// A reason why a permission ended before its time, or at it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PermissionEnd {
    /// A fault stopped the script.
    ScriptFault,
    /// The supervisor ended a flight or locked the robot.
    Fault,
    /// The robot tumbled or crashed.
    Crash,
    /// The battery was low or empty.
    Battery,
    /// Half an hour has passed since a person armed the robot.
    Time,
    /// A person disarmed the robot.
    Person,
}

/// The permission of a person to start the motors. A landing by the script keeps it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Permission {
    /// No person has armed the robot since power-on.
    #[default]
    Absent,
    /// A person armed the robot.
    Given {
        /// Time in ms at which the permission ends.
        until_ms: u64,
    },
    /// The permission ended. A person has to arm again.
    Ended(PermissionEnd),
}

impl Permission {
    /// Returns the permission that a person gives at this time in ms.
    pub fn given_at(now_ms: u64) -> Self {
        Permission::Given { until_ms: now_ms + PERMISSION_MS }
    }

    /// Ends a permission. The first reason stays.
    pub fn end(&mut self, reason: PermissionEnd) {
        if let Permission::Given { .. } = self {
            *self = Permission::Ended(reason);
        }
    }

    /// Ends a permission whose time is over.
    pub fn expire(&mut self, now_ms: u64) {
        if let Permission::Given { until_ms } = *self
            && now_ms >= until_ms
        {
            *self = Permission::Ended(PermissionEnd::Time);
        }
    }
}
