//! The conditions that the supervisor reacts to, recognized in measurements.
//!
//! A number that is not finite counts as the dangerous one: the robot is upside down, off the
//! ground, lifted, outside the fence and without a position. An IMU sample that is not finite is a
//! fault.

use super::effort::MotorEffort;
use crate::calibration::ImuFault;
use crate::{GRAVITY_M_S2, ImuSample, Vehicle};

/// Age of a set-point in ms from which it is not followed.
pub const SETPOINT_LATE_MS: u32 = 500;
/// Age of a set-point in ms from which motors stop in a robot without a position.
pub const SETPOINT_LOST_MS: u32 = 2000;
/// Distance outside the fence in m from which the robot lands.
pub const FENCE_MARGIN_M: f32 = 0.3;

/// Least z of the body's z axis in the world of a robot that stands upright: 30 degrees.
const UPRIGHT_Z: f32 = 0.866;
/// Height in m under which a robot may stand on the ground.
const GROUND_HEIGHT_M: f32 = 0.1;
/// Height in m under which an upright robot with the shock of a crash has landed hard: the estimate is
/// off by up to 0.1 m after a descent without a position.
const HARD_LANDING_M: f32 = 0.15;
/// Vertical speed in m/s under which a robot may stand on the ground.
const GROUND_SPEED_M_S: f32 = 0.1;
/// Share of the robot's weight from which thrust counts as lift. A descent with less would gain
/// 4.9 m/s per second, so no controller flies for two seconds without lift.
const LIFT_SHARE: f32 = 0.5;
/// Specific force in g from which a sample counts as an impact: a stop from 1 m/s within 9 mm.
/// Flight reaches 2 g at most (thrust is less than twice the weight), vibration adds 0.5 to 2 g.
const IMPACT_G: f32 = 6.0;
/// Specific force in g of every axis below which the robot falls freely.
const FREE_FALL_G: f32 = 0.1;
/// Specific force in g along z below which weight acts sideways, or upwards.
const SIDEWAYS_G: f32 = 0.5;
const UPWARDS_G: f32 = -0.2;
/// Largest rate in rad/s, and difference of the specific force from 1 g in g, of a robot at rest.
/// The BMI088's offsets are at most 0.017 rad/s and 0.02 g.
const STILL_RAD_S: f32 = 0.1;
const STILL_G: f32 = 0.1;

/// Requests of a person. A request lasts for one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct PilotRequests {
    /// Arm. Only the first step of a request that lasts longer counts.
    pub arm: bool,
    /// Stop the motors, in flight too.
    pub disarm: bool,
    /// Confirm that a robot that crashed is whole.
    pub recover: bool,
    /// Stop the motors until the next power-on.
    pub emergency_stop: bool,
    /// Continue a flight that ends for want of set-points, since there are some again.
    pub resume: bool,
}

/// The last set-point of the script or the pilot.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct SetpointStatus {
    /// Time since the set-point was renewed, in ms.
    pub age_ms: u32,
    /// A controller needs a position to follow the set-point.
    pub needs_position: bool,
}

/// State of the rotors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum RotorStatus {
    /// The board does not measure rotors; they count as turning.
    NotMeasured,
    /// All rotors turn within the limits of idling, or faster.
    Turning,
    /// A rotor turns slower than when idling, because motors are off or start.
    Slow,
    /// A rotor is driven and is slower than a rotor that is free.
    Blocked,
}

/// Measurements and commands of one step of the flight controller.
#[derive(Clone, Copy, Debug)]
pub struct SupervisorInput {
    pub requests: PilotRequests,
    pub imu: Result<ImuSample, ImuFault>,
    pub is_calibrated: bool,
    /// z of the body's z axis in the world, 1 for a level robot.
    pub up_z: f32,
    /// Height above the ground in m.
    pub height_m: f32,
    /// Upward speed in m/s.
    pub vertical_speed_m_s: f32,
    pub is_position_valid: bool,
    /// Distance outside the fence in m by the last valid position; `None` without a fence, or if
    /// there never was a position.
    pub fence_excursion_m: Option<f32>,
    /// `None` if there never was a set-point.
    pub setpoint: Option<SetpointStatus>,
    /// The script ended by a fault and has not restarted.
    pub has_script_fault: bool,
    /// Thrust of all motors that the controller demands, in N.
    pub thrust_n: f32,
    pub effort: MotorEffort,
    pub rotors: RotorStatus,
    pub battery_mv: u16,
}

/// Inclination of the robot by its estimated attitude.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Inclination {
    /// At most 30 degrees.
    Upright,
    /// More than 30 degrees and at most 90.
    Tilted,
    /// More than 90 degrees.
    UpsideDown,
}

/// Direction of the specific force by the accelerometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Acceleration {
    /// At least 0.5 g along z.
    Normal,
    /// Less than 0.5 g along z.
    Sideways,
    /// Less than -0.2 g along z.
    Upwards,
    /// Less than 0.1 g along every axis.
    FreeFall,
}

/// Age of the set-point, in classes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SetpointFreshness {
    /// At most [`SETPOINT_LATE_MS`] old, and the controller can follow.
    Fresh,
    /// Older, or impossible to follow without a position.
    Late,
    /// More than [`SETPOINT_LOST_MS`] old, or there never was one.
    Lost,
}

/// Charge of the battery.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BatteryLevel {
    Good,
    /// Too low to take off.
    Low,
    /// Too low to fly on.
    Empty,
}

/// Conditions of one step: all that the supervisor's state machine reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Conditions {
    pub requests: PilotRequests,
    pub imu_fault: Option<ImuFault>,
    pub is_calibrated: bool,
    pub inclination: Inclination,
    pub acceleration: Acceleration,
    pub is_still: bool,
    pub has_impact: bool,
    pub has_position: bool,
    pub setpoint: SetpointFreshness,
    pub has_script_fault: bool,
    pub is_outside_fence: bool,
    /// The robot demands more thrust than half its weight.
    pub has_lift: bool,
    /// Motors push with most of the robot's weight and have no effect.
    pub is_vain: bool,
    /// The robot is near the ground and neither rises nor sinks.
    pub is_at_ground: bool,
    /// The robot is near the ground.
    pub is_low: bool,
    pub rotors: RotorStatus,
    pub battery: BatteryLevel,
}

impl Conditions {
    /// A robot that stands on the ground, ready to be armed.
    pub const AT_REST: Self = Conditions {
        requests: PilotRequests {
            arm: false,
            disarm: false,
            recover: false,
            emergency_stop: false,
            resume: false,
        },
        imu_fault: None,
        is_calibrated: true,
        inclination: Inclination::Upright,
        acceleration: Acceleration::Normal,
        is_still: true,
        has_impact: false,
        has_position: true,
        setpoint: SetpointFreshness::Fresh,
        has_script_fault: false,
        is_outside_fence: false,
        has_lift: false,
        is_vain: false,
        is_at_ground: true,
        is_low: true,
        rotors: RotorStatus::NotMeasured,
        battery: BatteryLevel::Good,
    };

    /// Returns true for a robot that nobody moves and that stands on its feet.
    pub(super) fn is_calm(&self) -> bool {
        self.is_still && self.inclination == Inclination::Upright
    }
}

/// Limits that differ between vehicles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupervisorLimits {
    /// Voltage in mV below which the robot does not take off.
    pub battery_low_mv: u16,
    /// Voltage in mV below which the robot lands.
    pub battery_empty_mv: u16,
    /// The robot's weight in N.
    pub weight_n: f32,
}

impl SupervisorLimits {
    /// Limits of a Crazyflie 2.1+ (voltages: crazyflie-firmware 2a18fc29,
    /// `platform_defaults_cf2.h`).
    pub const CRAZYFLIE_2_1_PLUS: Self = Self::new(&Vehicle::CRAZYFLIE_2_1_PLUS, 3200, 3000);
    /// Limits of a Crazyflie 2.1 Brushless (`platform_defaults_cf21bl.h`).
    pub const CRAZYFLIE_BRUSHLESS: Self = Self::new(&Vehicle::CRAZYFLIE_BRUSHLESS, 3350, 3000);

    /// Returns the limits of a vehicle with a battery that is low and empty at these voltages in
    /// mV.
    pub const fn new(vehicle: &Vehicle, battery_low_mv: u16, battery_empty_mv: u16) -> Self {
        let weight_n = vehicle.mass_kg * GRAVITY_M_S2;
        SupervisorLimits { battery_low_mv, battery_empty_mv, weight_n }
    }

    /// Returns the conditions that the input shows.
    pub fn recognize(&self, input: &SupervisorInput) -> Conditions {
        let is_finite =
            |sample: &ImuSample| sample.accel_m_s2.is_finite() && sample.gyro_rad_s.is_finite();
        let imu = match input.imu {
            Ok(sample) if is_finite(&sample) => Ok(sample),
            Ok(_) => Err(ImuFault::NotFinite),
            Err(fault) => Err(fault),
        };
        let sample = imu.unwrap_or_default();
        let accel_g = sample.accel_m_s2 / GRAVITY_M_S2;
        let force_g = accel_g.length();
        let has_position = input.is_position_valid && input.height_m.is_finite();
        Conditions {
            requests: input.requests,
            imu_fault: imu.err(),
            is_calibrated: input.is_calibrated,
            inclination: if input.up_z >= UPRIGHT_Z {
                Inclination::Upright
            } else if input.up_z >= 0.0 {
                Inclination::Tilted
            } else {
                Inclination::UpsideDown
            },
            acceleration: if accel_g.abs().max_element() < FREE_FALL_G {
                Acceleration::FreeFall
            } else if accel_g.z < UPWARDS_G {
                Acceleration::Upwards
            } else if accel_g.z < SIDEWAYS_G {
                Acceleration::Sideways
            } else {
                Acceleration::Normal
            },
            is_still: sample.gyro_rad_s.length() <= STILL_RAD_S && (force_g - 1.0).abs() <= STILL_G,
            has_impact: force_g > IMPACT_G,
            has_position,
            setpoint: freshness(input.setpoint, has_position),
            has_script_fault: input.has_script_fault,
            is_outside_fence: input
                .fence_excursion_m
                .is_some_and(|m| !m.is_finite() || m > FENCE_MARGIN_M),
            has_lift: !input.thrust_n.is_finite() || input.thrust_n >= LIFT_SHARE * self.weight_n,
            is_vain: input.effort.is_vain(input.thrust_n, self.weight_n, input.height_m),
            is_at_ground: input.height_m < GROUND_HEIGHT_M
                && input.vertical_speed_m_s.abs() < GROUND_SPEED_M_S,
            is_low: input.height_m < HARD_LANDING_M,
            rotors: input.rotors,
            battery: if input.battery_mv < self.battery_empty_mv {
                BatteryLevel::Empty
            } else if input.battery_mv < self.battery_low_mv {
                BatteryLevel::Low
            } else {
                BatteryLevel::Good
            },
        }
    }
}

fn freshness(setpoint: Option<SetpointStatus>, has_position: bool) -> SetpointFreshness {
    match setpoint {
        None => SetpointFreshness::Lost,
        Some(status) if status.age_ms > SETPOINT_LOST_MS => SetpointFreshness::Lost,
        Some(status) if status.age_ms > SETPOINT_LATE_MS => SetpointFreshness::Late,
        Some(status) if status.needs_position && !has_position => SetpointFreshness::Late,
        Some(_) => SetpointFreshness::Fresh,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    const LIMITS: SupervisorLimits = SupervisorLimits::CRAZYFLIE_2_1_PLUS;

    fn at_rest() -> SupervisorInput {
        SupervisorInput {
            requests: PilotRequests::default(),
            imu: Ok(ImuSample { gyro_rad_s: Vec3::ZERO, accel_m_s2: Vec3::Z * GRAVITY_M_S2 }),
            is_calibrated: true,
            up_z: 1.0,
            height_m: 0.0,
            vertical_speed_m_s: 0.0,
            is_position_valid: true,
            fence_excursion_m: Some(-1.0),
            setpoint: Some(SetpointStatus { age_ms: 0, needs_position: true }),
            has_script_fault: false,
            thrust_n: 0.0,
            effort: MotorEffort::NONE,
            rotors: RotorStatus::NotMeasured,
            battery_mv: 3900,
        }
    }

    /// Returns the conditions of a robot at rest with one change.
    fn with(change: impl FnOnce(&mut SupervisorInput)) -> Conditions {
        let mut input = at_rest();
        change(&mut input);
        LIMITS.recognize(&input)
    }

    fn with_accel_g(x: f32, y: f32, z: f32) -> Conditions {
        with(|input| {
            input.imu = Ok(ImuSample {
                gyro_rad_s: Vec3::ZERO,
                accel_m_s2: Vec3::new(x, y, z) * GRAVITY_M_S2,
            });
        })
    }

    #[test]
    fn a_robot_at_rest_is_at_rest() {
        assert_eq!(LIMITS.recognize(&at_rest()), Conditions::AT_REST);
    }

    #[test]
    fn the_accelerometer_shows_the_direction_of_weight() {
        for (accel, expected) in [
            ((0.0, 0.0, 1.0), Acceleration::Normal),
            ((0.0, 0.0, 0.51), Acceleration::Normal),
            ((0.8, 0.0, 0.49), Acceleration::Sideways),
            ((1.0, 0.0, -0.19), Acceleration::Sideways),
            ((0.9, 0.0, -0.21), Acceleration::Upwards),
            ((0.09, -0.09, -0.09), Acceleration::FreeFall),
            ((0.11, 0.0, 0.0), Acceleration::Sideways),
        ] {
            assert_eq!(with_accel_g(accel.0, accel.1, accel.2).acceleration, expected, "{accel:?}");
        }
    }

    #[test]
    fn an_impact_is_more_than_six_g_in_any_direction() {
        assert!(!with_accel_g(0.0, 0.0, 5.9).has_impact);
        assert!(with_accel_g(-6.1, 0.0, 0.0).has_impact);
        assert!(with_accel_g(3.6, 3.6, 3.6).has_impact);
    }

    #[test]
    fn a_setpoint_is_late_after_500_ms_and_lost_after_2000() {
        let freshness_of = |age_ms| {
            with(|input| input.setpoint = Some(SetpointStatus { age_ms, needs_position: false }))
                .setpoint
        };
        assert_eq!(freshness_of(500), SetpointFreshness::Fresh);
        assert_eq!(freshness_of(501), SetpointFreshness::Late);
        assert_eq!(freshness_of(2000), SetpointFreshness::Late);
        assert_eq!(freshness_of(2001), SetpointFreshness::Lost);
        assert_eq!(freshness_of(u32::MAX), SetpointFreshness::Lost);
        assert_eq!(with(|input| input.setpoint = None).setpoint, SetpointFreshness::Lost);
    }

    #[test]
    fn a_setpoint_that_needs_a_missing_position_is_late() {
        let conditions = with(|input| input.is_position_valid = false);
        assert_eq!(conditions.setpoint, SetpointFreshness::Late);
        let conditions = with(|input| {
            input.is_position_valid = false;
            input.setpoint = Some(SetpointStatus { age_ms: 0, needs_position: false });
        });
        assert_eq!(conditions.setpoint, SetpointFreshness::Fresh);
    }

    #[test]
    fn the_battery_has_two_limits() {
        let level = |mv| with(|input| input.battery_mv = mv).battery;
        assert_eq!(level(3200), BatteryLevel::Good);
        assert_eq!(level(3199), BatteryLevel::Low);
        assert_eq!(level(3000), BatteryLevel::Low);
        assert_eq!(level(2999), BatteryLevel::Empty);
        assert_eq!(level(0), BatteryLevel::Empty);
    }

    #[test]
    fn lift_starts_at_half_the_weight() {
        // 0.0318 kg · 9.81 m/s² / 2 = 0.15598 N.
        assert!(!with(|input| input.thrust_n = 0.1559).has_lift);
        assert!(with(|input| input.thrust_n = 0.1561).has_lift);
    }

    #[test]
    fn a_robot_leaves_the_fence_after_its_margin() {
        assert!(!with(|input| input.fence_excursion_m = Some(0.3)).is_outside_fence);
        assert!(with(|input| input.fence_excursion_m = Some(0.31)).is_outside_fence);
        assert!(!with(|input| input.fence_excursion_m = None).is_outside_fence);
    }

    #[test]
    fn numbers_that_are_not_finite_are_dangerous() {
        for bad in [f32::NAN, f32::INFINITY] {
            let fault = with_accel_g(0.0, bad, 1.0).imu_fault;
            assert_eq!(fault, Some(ImuFault::NotFinite));
            assert!(with(|input| input.thrust_n = bad).has_lift);
            assert!(with(|input| input.fence_excursion_m = Some(bad)).is_outside_fence);
            assert!(!with(|input| input.vertical_speed_m_s = bad).is_at_ground);
            let conditions = with(|input| input.height_m = bad);
            assert!(!conditions.is_at_ground && !conditions.has_position);
        }
        let conditions = with(|input| input.up_z = f32::NAN);
        assert_eq!(conditions.inclination, Inclination::UpsideDown);
    }

    #[test]
    fn a_robot_that_turns_or_is_lifted_is_not_still() {
        let turns = with(|input| {
            input.imu = Ok(ImuSample {
                gyro_rad_s: Vec3::new(0.0, 0.11, 0.0),
                accel_m_s2: Vec3::Z * GRAVITY_M_S2,
            });
        });
        assert!(!turns.is_still);
        assert!(!with_accel_g(0.0, 0.0, 1.11).is_still);
        assert!(with_accel_g(0.0, 0.0, 0.95).is_still);
    }
}
