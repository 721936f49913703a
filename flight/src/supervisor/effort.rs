//! Signs that the motors push and the robot does not move as it would in the air.
//!
//! A hand, a net, a cable, a wall or the ground holds the robot then. More thrust does no good, and
//! hurts who holds it.
//!
//! Wind, a load or a weak motor must not end a flight, so each sign needs more than these explain.
//! A load of 10 g on a Crazyflie 2.1+ takes 3.1 m/s² from its thrust, the effect of the ground adds at
//! most 2.6 m/s², and wind of 3 m/s pushes with 1.5 m/s².

use glam::Vec3;

/// Share of the weight from which the thrust is an effort.
const EFFORT_SHARE: f32 = 0.8;
/// Acceleration in m/s² that is missing from a robot which something holds with force.
const RESTRAINED_M_S2: f32 = 6.0;
/// Accelerations in m/s², sideways and along the thrust, that are missing from a robot which a hand holds
/// in the air, the distance from the reference in m of the second, and its largest speed in m/s. The position loop asks for 2.1 to 3.6 m/s² sideways, and for
/// 4.2 upwards, at a distance of 0.3 m from the reference. A load of 10 g takes as much in a climb, but
/// such a robot stays near its reference.
const HELD_SIDEWAYS_M_S2: f32 = 3.2;
const HELD_UPWARDS_M_S2: f32 = 3.7;
const HELD_UPWARDS_M: f32 = 0.1;
const HELD_SPEED_M_S: f32 = 0.4;
/// Acceleration in m/s² sideways and distance from the reference in m that together are such a sign: wind
/// that displaces the robot as much pushes with 3.1 m/s².
const DISPLACED_M_S2: f32 = 2.2;
const DISPLACED_M: f32 = 0.23;
/// Height in m that a take-off reaches in time, and height in m of the reference that asks for it.
const RISEN_M: f32 = 0.01;
const SENT_UP_M: f32 = 0.02;
/// Largest cosine between the robot's z axis and the thrust that the controller wants of a robot that
/// does not turn as it should: 60 degrees.
const ASTRAY_COSINE: f32 = 0.5;

/// The effort of the motors, and the motion of the robot meanwhile.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotorEffort {
    /// Specific force of the present thrust minus the measured one, in m/s² in the robot's frame, averaged
    /// over some tenths of a second.
    pub missing_m_s2: Vec3,
    /// Distance from the reference in m; 0 without a reference.
    pub offset_m: f32,
    pub speed_m_s: f32,
    /// Height of the reference above the ground in m; 0 without a reference.
    pub reference_height_m: f32,
    /// Cosine between the robot's z axis and the thrust that the controller wants; 1 without one.
    pub cosine: f32,
}

impl MotorEffort {
    /// The motors do all that is wanted.
    pub const NONE: Self = MotorEffort {
        missing_m_s2: Vec3::ZERO,
        offset_m: 0.0,
        speed_m_s: 0.0,
        reference_height_m: 0.0,
        cosine: 1.0,
    };

    /// Returns true if thrust has no effect on a robot at this height above the ground in m, whose
    /// motors have to push with `thrust_n`. A number that is not finite counts as no effect.
    pub(super) fn is_vain(&self, thrust_n: f32, weight_n: f32, height_m: f32) -> bool {
        if thrust_n < EFFORT_SHARE * weight_n {
            return false;
        }
        let missing_m_s2 = self.missing_m_s2;
        let sideways_m_s2 = missing_m_s2.truncate().length();
        let is_pulled = sideways_m_s2 >= HELD_SIDEWAYS_M_S2
            || sideways_m_s2 >= DISPLACED_M_S2 && self.offset_m >= DISPLACED_M
            || missing_m_s2.z >= HELD_UPWARDS_M_S2 && self.offset_m >= HELD_UPWARDS_M;
        let is_held = is_pulled && self.speed_m_s < HELD_SPEED_M_S;
        let is_stuck = height_m < RISEN_M && self.reference_height_m > SENT_UP_M;
        let is_free = missing_m_s2.length() < RESTRAINED_M_S2 && self.cosine > ASTRAY_COSINE;
        !is_free || is_held || is_stuck
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WEIGHT_N: f32 = 0.312;

    fn is_vain(thrust_share: f32, height_m: f32, effort: MotorEffort) -> bool {
        effort.is_vain(thrust_share * WEIGHT_N, WEIGHT_N, height_m)
    }

    fn missing(missing_m_s2: [f32; 3], speed_m_s: f32) -> MotorEffort {
        let missing_m_s2 = Vec3::from_array(missing_m_s2);
        MotorEffort { missing_m_s2, speed_m_s, ..MotorEffort::NONE }
    }

    #[test]
    fn each_sign_needs_an_effort() {
        let signs = [
            missing([0.0, 0.0, -6.1], 1.0),
            missing([2.3, 2.3, 0.0], 0.2),
            MotorEffort { offset_m: 0.11, ..missing([0.0, 0.0, 3.8], 0.2) },
            missing([f32::NAN, 0.0, 0.0], 0.0),
            MotorEffort { offset_m: 0.24, ..missing([2.3, 0.0, 0.0], 0.2) },
            MotorEffort { reference_height_m: 0.03, ..MotorEffort::NONE },
            MotorEffort { cosine: 0.49, ..MotorEffort::NONE },
        ];
        for sign in signs {
            assert!(is_vain(0.81, 0.0, sign), "{sign:?}");
            assert!(!is_vain(0.79, 0.0, sign), "{sign:?}");
        }
    }

    #[test]
    fn loads_wind_and_flight_are_no_sign() {
        let flights = [
            // 10 g of load in hover, and at 1.4 times the weight of the robot alone.
            missing([0.0, 0.0, 3.1], 0.0),
            missing([0.0, 0.0, 4.6], 0.5),
            MotorEffort { offset_m: 0.09, ..missing([0.0, 0.0, 3.8], 0.2) },
            // Wind that the controller has met, a gust until it has, and the ceiling.
            missing([3.0, 0.0, 0.0], 0.0),
            MotorEffort { offset_m: 0.22, ..missing([3.0, 0.0, 0.0], 0.0) },
            MotorEffort { offset_m: 0.3, ..missing([2.1, 0.0, 0.0], 0.0) },
            missing([4.0, 0.0, 0.0], 0.5),
            missing([0.0, 0.0, -4.0], 0.0),
        ];
        for flight in flights {
            assert!(!is_vain(1.4, 1.0, flight), "{flight:?}");
        }
        assert!(!is_vain(1.4, 0.02, MotorEffort { reference_height_m: 1.0, ..MotorEffort::NONE }));
        assert!(!is_vain(1.4, 0.0, MotorEffort { reference_height_m: 0.01, ..MotorEffort::NONE }));
    }
}
