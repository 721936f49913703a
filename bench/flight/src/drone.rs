//! A simulated quadrotor that is only good enough to close the loop of its flight controller.
//!
//! The model is a rigid body with a first-order lag of the rotors and without drag. It integrates
//! in steps of 1 ms. [robots/crazyflie/physics](../../../robots/crazyflie/physics) is the model for
//! statements about flight; it does not run on a chip.

use bittybuzz_flight::ekf::{FlowMeasurement, PoseMeasurement};
use bittybuzz_flight::motor::steady_thrust_n;
use bittybuzz_flight::{
    FlightState, GRAVITY_M_S2, ImuSample, MotorDuties, Quat, Vec2, Vec3, Vehicle,
};

/// Time of a step in seconds.
const STEP_S: f32 = 0.001;
/// Height of the center of mass on the ground in m.
const STANDING_M: f32 = 0.02;
/// Counts of the flow sensor per radian (the PMW3901 has 35 pixels in 0.71674 rad, and counts tenths
/// of them).
const COUNTS_PER_RAD: f32 = 350.0 / 0.716_74;
/// Time over which the flow sensor counts, in seconds.
const FLOW_S: f32 = 0.01;
/// Standard deviations of the noise.
const GYRO_NOISE_RAD_S: f32 = 0.003;
const ACCEL_NOISE_M_S2: f32 = 0.02;
const POSITION_NOISE_M: f32 = 0.001;
const FLOW_NOISE_COUNTS: f32 = 2.0;
const RANGE_NOISE_M: f32 = 0.0025;

/// A simulated quadrotor.
#[derive(Clone, Debug)]
pub(crate) struct SimpleDrone {
    vehicle: Vehicle,
    state: FlightState,
    /// Specific force in the body frame in m/s².
    force_m_s2: Vec3,
    thrust_n: [f32; 4],
    /// Counts of the flow sensor since its last reading.
    flow_counts: Vec2,
    /// The pose of 10 steps ago, which arrives now.
    late_pose: PoseMeasurement,
    /// The distance to the ground of 25 steps ago in m, which arrives now.
    late_range_m: f32,
    random: u32,
}

impl SimpleDrone {
    /// Creates a quadrotor that stands on the ground.
    pub(crate) fn new(vehicle: Vehicle) -> Self {
        let position_m = Vec3::new(0.0, 0.0, STANDING_M);
        SimpleDrone {
            vehicle,
            state: FlightState { position_m, ..FlightState::default() },
            force_m_s2: Vec3::Z * GRAVITY_M_S2,
            thrust_n: [0.0; 4],
            flow_counts: Vec2::ZERO,
            late_pose: PoseMeasurement {
                position_m,
                attitude: Quat::IDENTITY,
                sigma_m: POSITION_NOISE_M,
                sigma_rad: 0.01,
                age_s: FLOW_S,
            },
            late_range_m: STANDING_M,
            random: 1,
        }
    }

    pub(crate) fn state(&self) -> FlightState {
        self.state
    }

    pub(crate) fn is_airborne(&self) -> bool {
        self.state.position_m.z > STANDING_M
    }

    /// Advances by 1 ms.
    pub(crate) fn step(&mut self, duties: &MotorDuties, battery_v: f32) {
        for (thrust_n, duty) in self.thrust_n.iter_mut().zip(duties.0) {
            let steady_n = steady_thrust_n(&self.vehicle, duty * battery_v);
            *thrust_n += (steady_n - *thrust_n) * (STEP_S / self.vehicle.spin_up_s);
        }
        let vehicle = &self.vehicle;
        let [ahead_right, behind_right, behind_left, ahead_left] = self.thrust_n;
        let thrust_n = ahead_right + behind_right + behind_left + ahead_left;
        let torque_n_m = Vec3::new(
            vehicle.arm_m * (ahead_left + behind_left - ahead_right - behind_right),
            vehicle.arm_m * (behind_left + behind_right - ahead_left - ahead_right),
            vehicle.torque_per_thrust_m * (behind_right + ahead_left - ahead_right - behind_left),
        );
        let state = &mut self.state;
        if state.position_m.z <= STANDING_M && thrust_n < vehicle.mass_kg * GRAVITY_M_S2 {
            state.position_m.z = STANDING_M;
            state.velocity_m_s = Vec3::ZERO;
            state.rate_rad_s = Vec3::ZERO;
            state.attitude = Quat::IDENTITY;
            self.force_m_s2 = Vec3::Z * GRAVITY_M_S2;
            return;
        }
        let spin = vehicle.inertia_kg_m2 * state.rate_rad_s;
        let turning = torque_n_m - state.rate_rad_s.cross(spin);
        state.rate_rad_s += turning / vehicle.inertia_kg_m2 * STEP_S;
        let turn = state.rate_rad_s * (0.5 * STEP_S);
        let small = Quat::from_xyzw(turn.x, turn.y, turn.z, 1.0);
        state.attitude = (state.attitude * small).normalize();
        self.force_m_s2 = Vec3::Z * (thrust_n / vehicle.mass_kg);
        let acceleration = state.attitude * self.force_m_s2 - Vec3::Z * GRAVITY_M_S2;
        state.velocity_m_s += acceleration * STEP_S;
        state.position_m += state.velocity_m_s * STEP_S;
        let body_m_s = state.attitude.conjugate() * state.velocity_m_s;
        let turning_rad_s = Vec2::new(-state.rate_rad_s.y, state.rate_rad_s.x);
        let seen_rad_s = body_m_s.truncate() / self.range() + turning_rad_s;
        self.flow_counts += seen_rad_s * (COUNTS_PER_RAD * STEP_S);
    }

    /// Returns the sample of the inertial sensors.
    pub(crate) fn imu(&mut self) -> ImuSample {
        ImuSample {
            gyro_rad_s: self.state.rate_rad_s + self.noise() * GYRO_NOISE_RAD_S,
            accel_m_s2: self.force_m_s2 + self.noise() * ACCEL_NOISE_M_S2,
        }
    }

    /// Returns the pose of the last call of this function, which is late by 10 ms.
    pub(crate) fn pose(&mut self) -> PoseMeasurement {
        let position_m = self.state.position_m + self.noise() * POSITION_NOISE_M;
        let pose = PoseMeasurement { position_m, attitude: self.state.attitude, ..self.late_pose };
        core::mem::replace(&mut self.late_pose, pose)
    }

    /// Returns the counts of the flow sensor, which looks straight down.
    pub(crate) fn flow(&mut self) -> FlowMeasurement {
        let noise = self.noise() * FLOW_NOISE_COUNTS;
        let counts = core::mem::take(&mut self.flow_counts) + noise.truncate();
        FlowMeasurement {
            counts_x: counts.x,
            counts_y: counts.y,
            sigma_counts: FLOW_NOISE_COUNTS,
            seconds: FLOW_S,
        }
    }

    /// Returns the distance to the ground in m, as the sensor measured it at the last call.
    pub(crate) fn range_m(&mut self) -> f32 {
        let measured_m = self.range() + self.noise().x * RANGE_NOISE_M;
        core::mem::replace(&mut self.late_range_m, measured_m)
    }

    fn range(&self) -> f32 {
        self.state.position_m.z / (self.state.attitude * Vec3::Z).z.max(0.1)
    }

    /// Returns a vector of independent numbers with mean 0 and variance 1: each is a sum of three
    /// uniform ones, which have the variance 1/12 · 2².
    fn noise(&mut self) -> Vec3 {
        Vec3::new(self.uniform_sum(), self.uniform_sum(), self.uniform_sum())
    }

    fn uniform_sum(&mut self) -> f32 {
        (0..3).map(|_| self.uniform()).sum()
    }

    /// Returns a number from -1 to 1 (xorshift of Marsaglia 2003, "Xorshift RNGs").
    fn uniform(&mut self) -> f32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        self.random as i32 as f32 / 2_147_483_648.0
    }
}

/// Returns sine and cosine of an angle in rad.
pub(crate) fn sine_and_cosine(angle: f32) -> (f32, f32) {
    let half = Quat::from_rotation_z(angle) * Vec3::X;
    (half.y, half.x)
}
