//! Parameters of the collision avoidance.

use glam::Vec3;

/// Parameters of the collision avoidance.
///
/// All robots of a swarm use the same ellipsoid. The proof in [`super`] needs a velocity that
/// follows the command as a first-order lag: the largest change of the command, twice the speed,
/// divided by the lag must be an acceleration that the robot can reach (for the Crazyflie 1 m/s /
/// 0.3 s = 3.3 m/s², below the 3.6 m/s² of a tilt of 20 degrees).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AvoidanceSettings {
    /// Horizontal half-axis of the ellipsoid that belongs to one robot, in m. Two robots at the
    /// same height keep twice this distance.
    pub radius_m: f32,
    /// Vertical half-axis of the ellipsoid in m, larger because of the air flow below a robot.
    pub height_m: f32,
    /// Largest speed in m/s.
    pub speed_m_s: f32,
    /// Time in seconds in which a robot may use up the distance to the boundary of its cell; at
    /// least the time between two commands. Longer times brake earlier.
    pub horizon_s: f32,
    /// Time constant in seconds with which the velocity follows the command, or 0.
    pub lag_s: f32,
    /// Age in seconds at which the report of another robot is dropped.
    pub peer_age_s: f32,
    /// Corner of the space with the least coordinates, in m; may be infinite.
    pub lowest_m: Vec3,
    /// Corner of the space with the largest coordinates, in m; may be infinite.
    pub highest_m: Vec3,
}

impl AvoidanceSettings {
    /// The Crazyflie in a space without walls.
    ///
    /// Ellipsoid, speed and age are Bitcraze's (crazyflie-firmware 2a18fc29,
    /// `collision_avoidance.c`). The horizon is half of Bitcraze's: among ten robots in 3 m × 3 m ×
    /// 1.5 m more reach their goals within a minute, and the least separation stays.
    pub const CRAZYFLIE: Self = AvoidanceSettings {
        radius_m: 0.3,
        height_m: 0.9,
        speed_m_s: 0.5,
        horizon_s: 0.5,
        lag_s: 0.3,
        peer_age_s: 5.0,
        lowest_m: Vec3::NEG_INFINITY,
        highest_m: Vec3::INFINITY,
    };

    pub(super) fn is_valid(&self) -> bool {
        let is_positive = |value: f32| value.is_finite() && value > 0.0;
        is_positive(self.radius_m)
            && is_positive(self.height_m)
            && is_positive(self.speed_m_s)
            && is_positive(self.horizon_s)
            && (self.lag_s == 0.0 || is_positive(self.lag_s))
            && is_positive(self.peer_age_s)
            && self.lowest_m.cmplt(self.highest_m).all()
    }

    /// Returns the time in ms after which a report is dropped, less than half the range of the
    /// clock.
    pub(super) fn peer_age_ms(&self) -> u32 {
        // A conversion from f32 saturates.
        ((self.peer_age_s * 1e3) as u32).min(u32::MAX / 2)
    }
}
