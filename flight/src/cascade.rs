//! The cascade of PID controllers: position, velocity, attitude, rate.
//!
//! It is the baseline that the Crazyflie's users know, with the gains of its firmware
//! (crazyflie-firmware 2a18fc29, `platform_defaults_cf2.h`): [`CascadeSettings::CRAZYFLIE`] gives
//! the same commands as that firmware. [`CascadeSettings::TRACKING`] corrects three of its limits:
//! it feeds the velocity of the reference forward, it bounds the integrals of the vertical loops,
//! and it starts nearer to the thrust of hover.
//!
//! # Units and signs
//! Angles are in degrees and commands in counts: 65535 counts of thrust stand for the largest
//! thrust of all motors. The firmware counts pitch and the yaw command in the opposite
//! sense. Every loop is odd in its inputs, so this cascade works in the frames of this crate and
//! turns no sign: `pitch_counts` is the firmware's pitch command times −1, `yaw_counts` its yaw
//! command times −1.
//!
//! # Rates
//! [`Cascade::update`] runs at 500 Hz; it runs the loops of position and velocity in every fifth
//! step, beginning with the first.

use glam::{Quat, Vec3};

use crate::pid::{Pid, PidGains, wrap_deg};
use crate::{FlightState, Reference, Vehicle, Wrench};

/// Period in seconds of the loops of attitude and rate.
pub const ATTITUDE_PERIOD_S: f32 = 0.002;

/// Steps of the attitude loop in one step of the position loop.
const STEPS_PER_POSITION: u8 = 5;

/// Period in seconds of the loops of position and velocity.
const POSITION_PERIOD_S: f32 = 0.01;

/// Counts of the largest thrust.
const MOST_COUNTS: f32 = 65535.0;

/// Largest magnitude of a torque command in counts.
const MOST_TORQUE_COUNTS: f32 = 32767.0;

/// Counts of thrust per unit that the vertical velocity loop gives.
const THRUST_SCALE_COUNTS: f32 = 1000.0;

/// Gains and limits of all loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CascadeSettings {
    /// From position in m to velocity in m/s, for x and y alike.
    pub position_xy: PidGains,
    /// From height in m to vertical velocity in m/s.
    pub position_z: PidGains,
    /// From velocity in m/s to roll or pitch in degrees.
    pub velocity_xy: PidGains,
    /// From vertical velocity in m/s to thousands of counts.
    pub velocity_z: PidGains,
    /// From roll or pitch in degrees to its rate in degrees per second.
    pub tilt: PidGains,
    /// From yaw in degrees to its rate in degrees per second.
    pub yaw: PidGains,
    /// From the rate of roll or pitch in degrees per second to counts.
    pub tilt_rate: PidGains,
    /// From the rate of yaw in degrees per second to counts.
    pub yaw_rate: PidGains,
    /// Largest roll and pitch in degrees.
    pub most_tilt_deg: f32,
    /// Thrust of hover in counts.
    pub thrust_base_counts: f32,
    /// Least thrust in counts.
    pub least_thrust_counts: f32,
    /// The velocity of the reference is added to the output of the position loops.
    pub feeds_velocity_forward: bool,
}

impl CascadeSettings {
    /// The values of the Crazyflie 2.1's firmware.
    pub const CRAZYFLIE: Self = CascadeSettings {
        // Limit of 1 m/s with 10 % of room.
        position_xy: PidGains::new(2.0, 0.0, 0.0).with_output_limit(1.1),
        position_z: PidGains::new(2.0, 0.5, 0.0).with_output_limit(1.1),
        velocity_xy: PidGains::new(25.0, 1.0, 0.0).with_output_limit(22.0),
        velocity_z: PidGains::new(25.0, 15.0, 0.0).with_output_limit(32.767),
        tilt: PidGains::new(6.0, 3.0, 0.0).with_integral_limit(20.0),
        yaw: PidGains::new(6.0, 1.0, 0.35).with_integral_limit(360.0),
        tilt_rate: PidGains::new(250.0, 500.0, 2.5).with_integral_limit(33.3),
        yaw_rate: PidGains::new(120.0, 16.7, 0.0).with_integral_limit(166.7),
        most_tilt_deg: 20.0,
        thrust_base_counts: 36_000.0,
        least_thrust_counts: 20_000.0,
        feeds_velocity_forward: false,
    };

    /// The values of the Crazyflie Brushless's firmware.
    pub const CRAZYFLIE_BRUSHLESS: Self = CascadeSettings {
        tilt_rate: PidGains::new(200.0, 400.0, 2.5).with_integral_limit(33.3),
        thrust_base_counts: 30_000.0,
        ..Self::CRAZYFLIE
    };

    /// Values for a Crazyflie 2.1+ that follows planned paths.
    ///
    /// The base is the thrust of hover of [`Vehicle::CRAZYFLIE_2_1_PLUS`]. The position loop has no
    /// integral in z, because the velocity loop's integral already removes the error of the
    /// thrust; that one is bounded to 20 % of the hover thrust.
    pub const TRACKING: Self = CascadeSettings {
        position_z: PidGains::new(2.0, 0.0, 0.0).with_output_limit(1.1),
        velocity_z: PidGains::new(25.0, 15.0, 0.0)
            .with_integral_limit(0.57)
            .with_output_limit(32.767),
        thrust_base_counts: 42_600.0,
        feeds_velocity_forward: true,
        ..Self::CRAZYFLIE
    };
}

/// The output of the cascade in counts, with the signs of this crate's body frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CascadeCommand {
    /// Torque about x, within ±32767.
    pub roll_counts: f32,
    /// Torque about y, within ±32767.
    pub pitch_counts: f32,
    /// Torque about z, within ±32767.
    pub yaw_counts: f32,
    /// Thrust, 0 to 65535.
    pub thrust_counts: f32,
}

impl CascadeCommand {
    /// Returns the thrust and torque that the firmware's mixer would ask of the motors.
    ///
    /// Its mixer adds to each motor the thrust, ± half the roll and pitch commands, and ± the whole
    /// yaw command.
    pub fn wrench(&self, vehicle: &Vehicle) -> Wrench {
        let force_per_count_n = vehicle.most_thrust_n / MOST_COUNTS;
        let arm_m_n = 4.0 * force_per_count_n * vehicle.arm_m / 2.0;
        let yaw_m_n = 4.0 * force_per_count_n * vehicle.torque_per_thrust_m;
        Wrench {
            thrust_n: 4.0 * force_per_count_n * self.thrust_counts,
            torque_n_m: Vec3::new(
                arm_m_n * self.roll_counts,
                arm_m_n * self.pitch_counts,
                yaw_m_n * self.yaw_counts,
            ),
        }
    }
}

/// The state of all loops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cascade {
    settings: CascadeSettings,
    position: [Pid; 3],
    velocity: [Pid; 3],
    attitude: [Pid; 3],
    rate: [Pid; 3],
    steps_to_position: u8,
    tilt_deg: [f32; 2],
    thrust_counts: f32,
}

impl Cascade {
    /// Creates a cascade with empty integrals.
    pub const fn new(settings: CascadeSettings) -> Self {
        let s = settings;
        Cascade {
            settings,
            position: [Pid::new(s.position_xy), Pid::new(s.position_xy), Pid::new(s.position_z)],
            velocity: [Pid::new(s.velocity_xy), Pid::new(s.velocity_xy), Pid::new(s.velocity_z)],
            attitude: [Pid::new(s.tilt), Pid::new(s.tilt), Pid::new(s.yaw)],
            rate: [Pid::new(s.tilt_rate), Pid::new(s.tilt_rate), Pid::new(s.yaw_rate)],
            steps_to_position: 0,
            tilt_deg: [0.0; 2],
            thrust_counts: 0.0,
        }
    }

    /// Empties all integrals, as after a change of the mode or while the motors stand still.
    pub fn reset(&mut self) {
        *self = Cascade::new(self.settings);
    }

    /// Returns the command of one step; call it every [`ATTITUDE_PERIOD_S`].
    ///
    /// Acceleration, jerk, snap and the rate of yaw of the reference are not used.
    pub fn update(&mut self, state: &FlightState, reference: &Reference) -> CascadeCommand {
        let [roll_deg, pitch_deg, yaw_deg] = angles_deg(state.attitude);
        if self.steps_to_position == 0 {
            self.steps_to_position = STEPS_PER_POSITION;
            self.update_position(state, reference, yaw_deg);
        }
        self.steps_to_position -= 1;
        let [desired_roll, desired_pitch] = self.tilt_deg;
        self.update_attitude(
            state.rate_rad_s,
            [roll_deg, pitch_deg, yaw_deg],
            [desired_roll, desired_pitch, wrap_deg(reference.yaw_rad.to_degrees())],
        )
    }

    /// Returns the command that holds roll and pitch with a given thrust, without the outer loops.
    ///
    /// Angles are in degrees in the order roll, pitch, yaw; the thrust is in counts. The next call
    /// of [`Self::update`] starts with the outer loops.
    pub fn hold_attitude(
        &mut self,
        state: &FlightState,
        desired_deg: [f32; 3],
        thrust_counts: f32,
    ) -> CascadeCommand {
        self.steps_to_position = 0;
        self.thrust_counts = cut(thrust_counts, 0.0, MOST_COUNTS);
        self.update_attitude(state.rate_rad_s, angles_deg(state.attitude), desired_deg)
    }

    /// Runs the loops of position and velocity, in a frame that is turned by the yaw only.
    fn update_position(&mut self, state: &FlightState, reference: &Reference, yaw_deg: f32) {
        let (sin, cos) = libm::sincosf(yaw_deg.to_radians());
        let turn = |v: Vec3| Vec3::new(v.x * cos + v.y * sin, v.y * cos - v.x * sin, v.z);
        let (desired, measured) = (turn(reference.position_m), turn(state.position_m));
        let dt = POSITION_PERIOD_S;
        let [x, y, z] = &mut self.position;
        let mut wanted = Vec3::new(
            x.update(desired.x, measured.x, dt),
            y.update(desired.y, measured.y, dt),
            z.update(desired.z, measured.z, dt),
        );
        if self.settings.feeds_velocity_forward {
            wanted += turn(reference.velocity_m_s);
        }
        let velocity = turn(state.velocity_m_s);
        let [x, y, z] = &mut self.velocity;
        let ahead = x.update(wanted.x, velocity.x, dt);
        let left = y.update(wanted.y, velocity.y, dt);
        let up = z.update(wanted.z, velocity.z, dt);
        let most = self.settings.most_tilt_deg;
        // A positive pitch accelerates ahead, a positive roll to the right.
        self.tilt_deg = [cut(-left, -most, most), cut(ahead, -most, most)];
        let thrust = up * THRUST_SCALE_COUNTS + self.settings.thrust_base_counts;
        self.thrust_counts = cut(thrust, self.settings.least_thrust_counts, MOST_COUNTS);
    }

    /// Runs the loops of attitude and rate.
    fn update_attitude(
        &mut self,
        rate_rad_s: Vec3,
        measured_deg: [f32; 3],
        desired_deg: [f32; 3],
    ) -> CascadeCommand {
        let [roll, pitch, yaw] = &mut self.attitude;
        let [desired_roll, desired_pitch, desired_yaw] = desired_deg;
        let [measured_roll, measured_pitch, measured_yaw] = measured_deg;
        let dt = ATTITUDE_PERIOD_S;
        let roll_rate = roll.update(desired_roll, measured_roll, dt);
        let pitch_rate = pitch.update(desired_pitch, measured_pitch, dt);
        let yaw_rate = yaw.update_angle_deg(desired_yaw, measured_yaw, dt);

        let [roll, pitch, yaw] = &mut self.rate;
        let torque = |pid: &mut Pid, desired: f32, measured_rad_s: f32| {
            let output = pid.update(desired, measured_rad_s.to_degrees(), dt);
            cut(output, -MOST_TORQUE_COUNTS, MOST_TORQUE_COUNTS)
        };
        CascadeCommand {
            roll_counts: torque(roll, roll_rate, rate_rad_s.x),
            pitch_counts: torque(pitch, pitch_rate, rate_rad_s.y),
            yaw_counts: torque(yaw, yaw_rate, rate_rad_s.z),
            thrust_counts: self.thrust_counts,
        }
    }
}

/// Returns roll, pitch and yaw in degrees of the rotation Rz(yaw)·Ry(pitch)·Rx(roll).
fn angles_deg(attitude: Quat) -> [f32; 3] {
    let Quat { x, y, z, w } = attitude;
    let roll = libm::atan2f(2.0 * (y * z + w * x), w * w - x * x - y * y + z * z);
    let pitch = libm::asinf((2.0 * (w * y - x * z)).clamp(-1.0, 1.0));
    let yaw = libm::atan2f(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z);
    [roll.to_degrees(), pitch.to_degrees(), yaw.to_degrees()]
}

/// Returns the value within the limits, or the lower one for NaN.
fn cut(value: f32, least: f32, most: f32) -> f32 {
    value.max(least).min(most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{EulerRot, Mat3};
    use proptest::prelude::*;

    fn hovering() -> FlightState {
        FlightState::default()
    }

    proptest! {
        /// Angles agree with a rotation matrix that is a product of three rotations.
        #[test]
        fn angles_invert_the_rotation(
            roll in -170.0_f32..170.0, pitch in -85.0_f32..85.0, yaw in -179.0_f32..179.0
        ) {
            let matrix = Mat3::from_rotation_z(yaw.to_radians())
                * Mat3::from_rotation_y(pitch.to_radians())
                * Mat3::from_rotation_x(roll.to_radians());
            let angles = angles_deg(Quat::from_mat3(&matrix));
            for (angle, expected) in angles.iter().zip([roll, pitch, yaw]) {
                prop_assert!((angle - expected).abs() < 0.02, "{angles:?}");
            }
        }

        #[test]
        fn commands_stay_in_range(
            position in prop::array::uniform3(any::<f32>()),
            velocity in prop::array::uniform3(any::<f32>()),
            rate in prop::array::uniform3(any::<f32>()),
            attitude in prop::array::uniform4(any::<f32>()),
        ) {
            let state = FlightState {
                position_m: position.into(),
                velocity_m_s: velocity.into(),
                attitude: Quat::from_array(attitude),
                rate_rad_s: rate.into(),
            };
            let mut cascade = Cascade::new(CascadeSettings::CRAZYFLIE);
            for _ in 0..7 {
                let command = cascade.update(&state, &Reference::default());
                let torques = [command.roll_counts, command.pitch_counts, command.yaw_counts];
                prop_assert!(torques.iter().all(|torque| torque.abs() <= MOST_TORQUE_COUNTS));
                prop_assert!((20_000.0..=65_535.0).contains(&command.thrust_counts));
            }
        }
    }

    /// The first step by hand: 0.1 m of error asks 0.2 m/s, 5.002 degrees of pitch (integral of one
    /// step included), 30.02 degrees per second, and 250 counts for each of them.
    #[test]
    fn first_step_follows_the_gains() {
        let mut cascade = Cascade::new(CascadeSettings::CRAZYFLIE);
        let reference = Reference { position_m: Vec3::new(0.1, 0.0, 0.0), ..Reference::default() };
        let command = cascade.update(&hovering(), &reference);
        let pitch = 25.0 * 0.2 + 1.0 * 0.2 * 0.01;
        let rate = 6.0 * pitch + 3.0 * pitch * 0.002;
        let counts = 250.0 * rate + 500.0 * rate * 0.002;
        assert!((command.pitch_counts - counts).abs() < 0.01, "{command:?} {counts}");
        assert_eq!(command.roll_counts, 0.0);
        assert_eq!(command.yaw_counts, 0.0);
        assert_eq!(command.thrust_counts, 36_000.0);
    }

    /// With a yaw of 90 degrees, the robot's right side points to the world's x.
    #[test]
    fn position_error_turns_with_the_yaw() {
        let mut cascade = Cascade::new(CascadeSettings::CRAZYFLIE);
        let quarter = core::f32::consts::FRAC_PI_2;
        let state = FlightState {
            attitude: Quat::from_euler(EulerRot::ZYX, quarter, 0.0, 0.0),
            ..hovering()
        };
        let reference = Reference {
            position_m: Vec3::new(0.1, 0.0, 0.0),
            yaw_rad: quarter,
            ..Reference::default()
        };
        let command = cascade.update(&state, &reference);
        assert!(command.roll_counts > 7000.0, "{command:?}");
        assert!(command.pitch_counts.abs() < 1.0 && command.yaw_counts.abs() < 1.0);
    }

    #[test]
    fn outer_loops_run_in_every_fifth_step() {
        let mut cascade = Cascade::new(CascadeSettings::CRAZYFLIE);
        let mut changes = 0;
        let mut before = f32::NAN;
        for k in 0..50 {
            let height = 0.01 * k as f32;
            let reference =
                Reference { position_m: Vec3::new(0.0, 0.0, height), ..Reference::default() };
            let thrust = cascade.update(&hovering(), &reference).thrust_counts;
            changes += usize::from(thrust != before);
            before = thrust;
        }
        assert_eq!(changes, 10);
    }

    /// The mixer of the firmware: thrust ± half of roll and pitch ± yaw, by motor.
    #[test]
    fn wrench_agrees_with_the_mixer_of_the_firmware() {
        let vehicle = Vehicle::CRAZYFLIE_2_1_PLUS;
        let command = CascadeCommand {
            roll_counts: 3000.0,
            pitch_counts: -2000.0,
            yaw_counts: 500.0,
            thrust_counts: 40_000.0,
        };
        let (t, r, y) = (40_000.0, 1500.0, -500.0);
        // The firmware's pitch and yaw have the opposite sign.
        let p = 1000.0;
        let counts = [t - r + p + y, t - r - p - y, t + r - p + y, t + r + p - y];
        let forces = counts.map(|count: f32| count / 65535.0 * vehicle.most_thrust_n);
        let outcome = crate::mixer::Mixer::new(&vehicle).mix(&command.wrench(&vehicle));
        for (mixed, force) in outcome.forces.0.iter().zip(forces) {
            assert!((mixed - force).abs() < 1e-7, "{mixed} {force}");
        }
    }

    #[test]
    fn velocity_of_the_reference_counts_only_when_asked() {
        let reference =
            Reference { velocity_m_s: Vec3::new(0.5, 0.0, 0.5), ..Reference::default() };
        let mut cascade = Cascade::new(CascadeSettings::CRAZYFLIE);
        assert_eq!(cascade.update(&hovering(), &reference).pitch_counts, 0.0);
        let mut cascade = Cascade::new(CascadeSettings::TRACKING);
        let command = cascade.update(&hovering(), &reference);
        assert!(command.pitch_counts > 0.0 && command.thrust_counts > 42_600.0);
    }
}
