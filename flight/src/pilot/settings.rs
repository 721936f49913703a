//! Speeds, times and distances of a robot's flight functions.

use crate::planner::FlightLimits;

/// Time in ms after the end of a plan in which the robot may still arrive.
pub const ARRIVAL_MS: u64 = 1000;
/// Time in ms after the end of a plan to land in which the robot may still reach the ground: the
/// reference sinks on at 0.08 m/s until the robot stands.
pub const TOUCHDOWN_MS: u64 = 3000;
/// Time in ms in which a robot that shall take off gets ready and arms. A robot that was just
/// switched on needs 0.7 s to calibrate its sensors.
pub const READY_MS: u64 = 3000;
/// Duration of `spin` in ms.
pub const SPIN_MS: u64 = 1500;
/// Time in ms after which a battery that is empty ends the flight.
pub const EMPTY_MS: u64 = 5000;
/// Time in ms after which the permission of a person ends: longer than three flights of 7 minutes
/// (Bitcraze's data sheet of the 2.1) with changes of the battery between them, and short enough
/// that a robot left on a table does not start hours later.
pub const PERMISSION_MS: u64 = 30 * 60 * 1000;

/// Speeds, distances and limits by which a pilot flies. The robot file states them to authors of
/// scripts; a test compares the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PilotSettings {
    /// Limits of planned motion.
    pub limits: FlightLimits,
    /// Horizontal speed of `goto` in m/s.
    pub approach_m_s: f32,
    /// Speed of `forward` in m/s.
    pub cruise_m_s: f32,
    /// Rate of turn of `left` and `right` in rad/s.
    pub turn_rad_s: f32,
    /// Distance in m from which on a goal is reached.
    pub arrival_m: f32,
    /// Voltage in mV below which the robot does not take off.
    pub battery_low_mv: u16,
    /// Voltage in mV below which the robot lands after [`EMPTY_MS`].
    pub battery_empty_mv: u16,
    /// Height in m of the center of mass above the ground that the robot stands on.
    pub standing_m: f32,
}

impl PilotSettings {
    /// A Crazyflie 2.1, 2.1+ or 2.1 Brushless.
    ///
    /// 1 m/s is the limit of Bitcraze's position controller (crazyflie-firmware 2a18fc29), 3,200 mV
    /// its limit of a low battery. The rest are choices, as in the robot file.
    pub const CRAZYFLIE: Self = PilotSettings {
        limits: FlightLimits { speed_m_s: 1.0, climb_m_s: 0.5, ..FlightLimits::CRAZYFLIE },
        approach_m_s: 0.5,
        cruise_m_s: 0.2,
        turn_rad_s: core::f32::consts::FRAC_PI_4,
        arrival_m: 0.05,
        battery_low_mv: 3200,
        battery_empty_mv: 3100,
        standing_m: 0.015,
    };
}
