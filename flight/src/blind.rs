//! Descent of a robot that does not know its position.
//!
//! The filter goes on with the inertial sensors alone, so its height and vertical speed stay useful
//! for some seconds: an offset of 0.05 m/s² that calibration left becomes 0.1 m in 2 s. The robot
//! sinks by them, faster than it could drift upwards and slower than a landing may be.
//!
//! Its horizontal velocity stays useful for about a second, if it was right at the start. Within this
//! time the robot brakes; afterwards, and if the velocity is not trusted, it stays level.

use glam::{Quat, Vec3};

use crate::geometric::AttitudeTarget;
use crate::{FlightState, GRAVITY_M_S2};

/// Speed of the descent in m/s.
const SINK_M_S: f32 = 0.5;
/// Height in m below which the robot sinks slower, and its speed there in m/s. The height is off by
/// up to 0.1 m then, and a touch-down at 0.5 m/s has the shock of a crash.
const LOW_M: f32 = 0.2;
const LOW_SINK_M_S: f32 = 0.2;
/// Time in seconds after which an estimate that is still low has drifted, so the robot sinks fast.
const LOW_UNTIL_S: f32 = 4.0;
/// Largest distance in m between the height and its reference. Its acceleration is two thirds of
/// gravity, so a robot that stands on the ground loses its lift.
const AHEAD_M_MAX: f32 = 0.5;
/// Vertical acceleration per height error in 1/s² and per speed error in 1/s: a natural frequency of
/// 3.7 rad/s with a damping ratio of 0.94, as in the position loop.
const HEIGHT_1_S2: f32 = 14.0;
const SPEED_1_S: f32 = 7.0;
/// Largest vertical acceleration upwards in m/s²: 1.4 times the weight as thrust.
const UP_M_S2_MAX: f32 = 4.0;
/// Time in seconds for which the horizontal velocity is useful.
const BRAKE_S: f32 = 1.2;
/// Horizontal acceleration per velocity in 1/s.
const BRAKE_1_S: f32 = 2.5;
/// Largest horizontal acceleration in m/s²: a tilt of 14 degrees.
const BRAKE_M_S2_MAX: f32 = 2.5;
/// Least cosine of the tilt for which thrust makes up.
const COS_TILT_MIN: f32 = 0.7;

/// A descent by the inertial sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlindDescent {
    height_m: f32,
    ground_m: f32,
    elapsed_s: f32,
    brakes: bool,
}

impl BlindDescent {
    /// Returns the descent of a robot in this state.
    ///
    /// # Parameters
    /// `ground_m`: height of the robot in m once it stands on the ground. `brakes`: the estimated
    /// horizontal velocity is right at the start.
    pub fn new(state: &FlightState, ground_m: f32, brakes: bool) -> Self {
        BlindDescent { height_m: state.position_m.z, ground_m, elapsed_s: 0.0, brakes }
    }

    /// Returns the attitude and thrust of the next `dt_s` seconds.
    ///
    /// # Parameters
    /// `hover_thrust_n`: thrust in N that keeps the height. `mass_kg`: mass of the robot.
    pub fn target(
        &mut self,
        state: &FlightState,
        hover_thrust_n: f32,
        mass_kg: f32,
        dt_s: f32,
    ) -> AttitudeTarget {
        self.elapsed_s += dt_s;
        let height_m = state.position_m.z;
        let is_low = height_m - self.ground_m < LOW_M && self.elapsed_s < LOW_UNTIL_S;
        let sink_m_s = if is_low { LOW_SINK_M_S } else { SINK_M_S };
        self.height_m = (self.height_m - sink_m_s * dt_s)
            .max(height_m - AHEAD_M_MAX)
            .min(height_m + AHEAD_M_MAX);
        let rise_m_s2 = HEIGHT_1_S2 * (self.height_m - height_m)
            + SPEED_1_S * (-sink_m_s - state.velocity_m_s.z);
        let cos_tilt = (state.attitude * Vec3::Z).z.max(COS_TILT_MIN);
        let lift_n = hover_thrust_n + mass_kg * rise_m_s2.min(UP_M_S2_MAX);
        let level = AttitudeTarget::level(state, (lift_n / cos_tilt).max(0.0));
        if !self.brakes || self.elapsed_s > BRAKE_S {
            return level;
        }
        let velocity = state.velocity_m_s.with_z(0.0);
        let brake_m_s2 = (velocity * -BRAKE_1_S).clamp_length_max(BRAKE_M_S2_MAX);
        let lift_m_s2 = brake_m_s2 + Vec3::Z * GRAVITY_M_S2;
        let tilt = Quat::from_rotation_arc(Vec3::Z, lift_m_s2.normalize());
        AttitudeTarget { attitude: tilt * level.attitude, ..level }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MASS_KG: f32 = 0.03;
    const HOVER_N: f32 = MASS_KG * GRAVITY_M_S2;

    /// Flies a point mass whose thrust follows the target at once, and returns its states every 2 ms.
    fn fly(start: FlightState, brakes: bool, seconds: f32) -> std::vec::Vec<FlightState> {
        let mut descent = BlindDescent::new(&start, -1.0, brakes);
        let mut state = start;
        let mut states = std::vec::Vec::new();
        for _ in 0..(seconds / 0.002) as usize {
            let target = descent.target(&state, HOVER_N, MASS_KG, 0.002);
            state.attitude = target.attitude;
            let force = target.attitude * Vec3::Z * target.thrust_n;
            let acceleration = force / MASS_KG - Vec3::Z * GRAVITY_M_S2;
            state.velocity_m_s += acceleration * 0.002;
            state.position_m += state.velocity_m_s * 0.002;
            states.push(state);
        }
        states
    }

    fn moving(x_m_s: f32, z_m_s: f32) -> FlightState {
        let velocity_m_s = Vec3::new(x_m_s, 0.0, z_m_s);
        FlightState { position_m: Vec3::Z, velocity_m_s, ..FlightState::default() }
    }

    #[test]
    fn sinks_at_its_speed() {
        for climb in [-0.7, 0.0, 0.7] {
            let states = fly(moving(0.0, climb), false, 2.0);
            let end = states.last().unwrap();
            assert!((end.velocity_m_s.z + SINK_M_S).abs() < 0.01, "{end:?}");
            assert!(end.position_m.z.abs() < 0.05, "{end:?}");
            assert!(states.iter().all(|state| state.velocity_m_s.z > -1.0));
        }
    }

    #[test]
    fn touches_down_slowly() {
        let mut descent = BlindDescent::new(&moving(0.0, 0.0), 0.0, true);
        let mut state = moving(0.0, 0.0);
        while state.position_m.z > 0.0 {
            let target = descent.target(&state, HOVER_N, MASS_KG, 0.002);
            state.velocity_m_s.z += (target.thrust_n / MASS_KG - GRAVITY_M_S2) * 0.002;
            state.position_m.z += state.velocity_m_s.z * 0.002;
        }
        assert!(state.velocity_m_s.z > -1.2 * LOW_SINK_M_S, "{state:?}");
    }

    #[test]
    fn brakes_only_if_the_velocity_is_right() {
        let braked = fly(moving(1.0, 0.0), true, 1.2).last().unwrap().velocity_m_s;
        assert!(braked.x.abs() < 0.1, "{braked}");
        let level = fly(moving(1.0, 0.0), false, 1.2);
        assert!(level.iter().all(|state| state.velocity_m_s.x == 1.0));
    }

    /// A robot on the ground does not sink further, so its thrust ends.
    #[test]
    fn loses_lift_on_the_ground() {
        let state = FlightState::default();
        let mut descent = BlindDescent::new(&state, 0.0, true);
        let mut thrusts = (0..).map(|_| descent.target(&state, HOVER_N, MASS_KG, 0.002).thrust_n);
        let below_half = thrusts.position(|thrust| thrust < 0.5 * HOVER_N).unwrap();
        assert!(below_half < 700, "{below_half}");
    }
}
