//! The extended Kalman filter of position, velocity and attitude.
//!
//! # State
//! The filter follows Mueller, Hamer and D'Andrea 2015 ("Fusing ultra-wideband range measurements
//! with accelerometers and rate gyroscopes for quadrocopter state estimation", ICRA). The estimate
//! has a position p (world frame), a velocity v (body frame), an attitude q (body to world) and the
//! biases of the gyroscope and of the accelerometer along z. Its error has 13 states: errors of p and
//! v, a rotation vector d in the body frame with true attitude q·exp(d), and errors of the biases.
//! After an update d moves into q, and the covariance turns by −d/2 (Mueller, Hehn and D'Andrea
//! 2017, doi 10.2514/1.G000848).
//!
//! # Prediction
//! The estimate advances with each inertial sample. In flight the accelerometer along z counts,
//! because thrust and drag act along it; along x and y the model expects linear drag, and the
//! accelerometer counts as far as it shows an outer force (`outer.rs`). On the ground the whole
//! specific force counts. The covariance follows every 10 ms, or before an update.
//!
//! # Updates
//! Scalars are processed one after the other against one linearization, which equals a joint update.
//! A gate with the χ² quantile of 0.9999 protects each group: the three axes of a position, the three
//! axes of an attitude, each axis of flow, a height, a range and a yaw. One failed gate rejects the
//! whole measurement. An effect that persists is no noise: it passes up to a floor (`gate.rs`).
//!
//! Range and flow are about the floor below the robot, whose height is no state: a step that
//! several ranges show moves it (`terrain.rs`).
//!
//! # Late measurements
//! A position or pose that is up to 100 ms old is compared with the estimate at its own time. The
//! difference corrects the present: this neglects the growth of the error in between, which is
//! age · (error of the velocity), or 0.2 mm for 10 ms and 2 cm/s. The filter estimates by how much
//! poses are older than it assumes (`pose_age.rs`).
//!
//! # Cost
//! The filter takes 1.8 KB, of which the covariance takes 676 bytes. A scalar update needs about
//! 13² multiplications, a prediction about 22·50, since the Jacobian is applied as blocks to 22 rows
//! and columns.

mod config;
mod covariance;
mod gate;
mod health;
mod history;
mod measurement;
mod outer;
mod pose;
mod pose_age;
mod states;
mod terrain;
mod transition;
mod update;

use glam::{Mat3, Quat, Vec2, Vec3, Vec3Swizzles};

pub use config::{EkfConfig, EkfNoise, EkfSigma, Linearization};
pub use health::EkfHealth;
pub use measurement::{
    EkfOutcome, EkfRefusal, FlowMeasurement, FlowSurface, PoseMeasurement, PositionMeasurement,
};

use crate::{FlightState, GRAVITY_M_S2, ImuSample};
use covariance::StateCovariance;
use gate::Deviation;
use health::{HealthMonitor, HealthVariances};
use history::{PastPlacements, Placement};
use outer::OuterForce;
use pose_age::PoseAge;
use states::{ATTITUDE, POSITION, VELOCITY};
use terrain::Terrain;
use transition::{Motion, Transition};

/// Time after which the covariance follows the estimate, in seconds. The margin lets ten samples of
/// 1 ms reach it in spite of rounding.
const PREDICTION_S: f32 = 0.0095;
/// Longest time between two inertial samples, in seconds.
const SAMPLE_MAX_S: f32 = 0.1;
/// Largest rate of a usable sample, above the range of common sensors, in rad/s.
const RATE_MAX_RAD_S: f32 = 100.0;
/// Largest specific force of a usable sample, above the range of common sensors, in m/s².
const ACCEL_MAX_M_S2: f32 = 1000.0;
/// Largest magnitude of a position before the filter starts anew, in m.
const POSITION_MAX_M: f32 = 100.0;
/// Largest speed before the filter starts anew, in m/s.
const SPEED_MAX_M_S: f32 = 10.0;
/// Standard deviation of the position after divergence, in m.
const DIVERGED_POSITION_SIGMA_M: Vec3 = Vec3::splat(10.0);
/// Standard deviation of the velocity after divergence, in m/s.
const DIVERGED_VELOCITY_SIGMA_M_S: Vec3 = Vec3::splat(1.0);
/// Standard deviation of the attitude after divergence, in rad.
const DIVERGED_ATTITUDE_SIGMA_RAD: Vec3 = Vec3::splat(0.3);

/// The extended Kalman filter of position, velocity and attitude.
#[derive(Clone, Copy, Debug)]
pub struct Ekf {
    config: EkfConfig,
    is_flying: bool,
    position_m: Vec3,
    /// Velocity in the body frame.
    velocity_m_s: Vec3,
    attitude: Quat,
    gyro_bias_rad_s: Vec3,
    accel_bias_m_s2: f32,
    /// Rate of the last sample without the bias.
    rate_rad_s: Vec3,
    covariance: StateCovariance,
    outer: OuterForce,
    /// Motion that the covariance has not followed yet.
    pending: Motion,
    past: PastPlacements,
    pose_age: PoseAge,
    terrain: Terrain,
    position_deviation: Deviation,
    attitude_deviation: Deviation,
    position_persists: bool,
    /// Difference between the last flow or range and the estimate before it counted.
    flow_deviation_counts: Vec2,
    range_deviation_m: f32,
    monitor: HealthMonitor,
}

/// Returns exp(angle) as a quaternion.
fn rotation(angle: Vec3) -> Quat {
    let square = angle.length_squared();
    let (half_sinc, cos) = if square < 0.01 {
        // The series to the fourth order leaves less than 1e-9 below 0.1 rad.
        (
            0.5 - square * (1.0 / 48.0 - square * (1.0 / 3840.0)),
            1.0 - square * (1.0 / 8.0 - square * (1.0 / 384.0)),
        )
    } else {
        let length = libm::sqrtf(square);
        (libm::sinf(0.5 * length) / length, libm::cosf(0.5 * length))
    };
    let axis = angle * half_sinc;
    Quat::from_xyzw(axis.x, axis.y, axis.z, cos)
}

fn check_sample(imu: &ImuSample) -> Result<(), EkfRefusal> {
    let is_below = |vector: Vec3, limit: f32| vector.length_squared() <= limit * limit;
    if !imu.gyro_rad_s.is_finite() || !imu.accel_m_s2.is_finite() {
        Err(EkfRefusal::NotFinite)
    } else if !is_below(imu.gyro_rad_s, RATE_MAX_RAD_S) || !is_below(imu.accel_m_s2, ACCEL_MAX_M_S2)
    {
        Err(EkfRefusal::OutOfRange)
    } else {
        Ok(())
    }
}

/// Returns a quaternion of length 1, for one whose length is already close to 1.
fn renormalized(q: Quat) -> Quat {
    q * (1.5 - 0.5 * q.length_squared())
}

impl Ekf {
    /// Creates a filter that stands on the ground at the start that `at` gives.
    pub fn new(config: EkfConfig, at: &FlightState) -> Self {
        let placement = Placement { position_m: at.position_m, attitude: at.attitude };
        let mut filter = Ekf {
            config,
            is_flying: false,
            position_m: Vec3::ZERO,
            velocity_m_s: Vec3::ZERO,
            attitude: Quat::IDENTITY,
            gyro_bias_rad_s: Vec3::ZERO,
            accel_bias_m_s2: 0.0,
            rate_rad_s: Vec3::ZERO,
            covariance: StateCovariance::diagonal(&config.initial_sigma),
            outer: OuterForce::default(),
            pending: Motion {
                rotation: Mat3::IDENTITY,
                velocity_m_s: Vec3::ZERO,
                turn_rad: Vec3::ZERO,
                impulse_m_s: Vec3::ZERO,
                drag_per_s: Vec3::ZERO,
                seconds: 0.0,
            },
            past: PastPlacements::new(placement),
            pose_age: PoseAge::default(),
            terrain: Terrain::default(),
            position_deviation: Deviation::default(),
            attitude_deviation: Deviation::default(),
            position_persists: false,
            flow_deviation_counts: Vec2::ZERO,
            range_deviation_m: 0.0,
            monitor: HealthMonitor::new(),
        };
        filter.reset(at);
        filter
    }

    /// Starts anew at a known state, with the initial standard deviations and without biases.
    ///
    /// A state that is not finite, or whose attitude is no rotation, is replaced by rest at the origin.
    pub fn reset(&mut self, at: &FlightState) {
        let is_usable = at.position_m.is_finite()
            && at.velocity_m_s.is_finite()
            && measurement::check_attitude(at.attitude).is_ok();
        let at = if is_usable { *at } else { FlightState::default() };
        self.position_m = at.position_m;
        self.attitude = at.attitude.normalize();
        self.velocity_m_s = self.attitude.conjugate() * at.velocity_m_s;
        self.gyro_bias_rad_s = Vec3::ZERO;
        self.accel_bias_m_s2 = 0.0;
        self.rate_rad_s = Vec3::ZERO;
        self.covariance = StateCovariance::diagonal(&self.config.initial_sigma);
        self.covariance.limit(self.config.variance_floor);
        self.outer = OuterForce::default();
        self.past = PastPlacements::new(self.placement());
        self.pose_age = PoseAge::default();
        self.terrain = Terrain::default();
        self.monitor.restart();
        self.begin_motion();
    }

    /// Chooses the model: with `is_flying` that of flight, else that of standing on the ground.
    pub fn set_flying(&mut self, is_flying: bool) {
        self.is_flying = is_flying;
    }

    /// Advances the estimate by one inertial sample that stands for `seconds`.
    ///
    /// # Errors
    /// [`EkfRefusal::NotFinite`] for a sample that is not finite and [`EkfRefusal::OutOfRange`] for
    /// one above 100 rad/s or 1000 m/s²; the estimate then advances with the last rate and without
    /// acceleration. [`EkfRefusal::OutOfRange`] when `seconds` is not above 0 and at most 0.1; then
    /// nothing changes.
    pub fn propagate(&mut self, imu: &ImuSample, seconds: f32) -> Result<(), EkfRefusal> {
        if !(seconds > 0.0 && seconds <= SAMPLE_MAX_S) {
            return Err(EkfRefusal::OutOfRange);
        }
        let matrix = Mat3::from_quat(self.attitude);
        let up = Vec3::new(matrix.x_axis.z, matrix.y_axis.z, matrix.z_axis.z);
        let checked = check_sample(imu);
        let mut accel_m_s2 = up * GRAVITY_M_S2;
        if checked.is_ok() {
            self.rate_rad_s = imu.gyro_rad_s - self.gyro_bias_rad_s;
            accel_m_s2 = imu.accel_m_s2;
            accel_m_s2.z -= self.accel_bias_m_s2;
        }
        let mut drag_per_s = Vec3::ZERO;
        if self.is_flying {
            drag_per_s = self.config.drag_per_s;
            let measured = if checked.is_ok() { accel_m_s2.xy() } else { Vec2::ZERO };
            let unexplained = measured + (drag_per_s * self.velocity_m_s).xy();
            let outer = self.outer.update(unexplained, self.config.least_outer_m_s2, seconds);
            accel_m_s2 = outer.extend(accel_m_s2.z);
        }
        let turn_rad = self.rate_rad_s * seconds;
        let impulse_m_s = accel_m_s2 * seconds;
        let velocity = self.velocity_m_s;
        self.position_m += matrix * ((velocity + impulse_m_s * 0.5) * seconds);
        self.position_m.z -= 0.5 * GRAVITY_M_S2 * seconds * seconds;
        let mut turned = velocity.cross(turn_rad);
        if self.config.linearization == Linearization::WholeAngle {
            turned += turned.cross(turn_rad) * 0.5;
        }
        self.velocity_m_s +=
            impulse_m_s + turned - up * (GRAVITY_M_S2 * seconds) - drag_per_s * velocity * seconds;
        self.attitude = renormalized(self.attitude * rotation(turn_rad));
        self.pending.turn_rad += turn_rad;
        self.pending.impulse_m_s += impulse_m_s;
        self.pending.drag_per_s = drag_per_s;
        self.pending.seconds += seconds;
        self.past.advance(seconds, self.placement());
        self.monitor.advance(seconds);
        if self.pending.seconds >= PREDICTION_S {
            self.predict_covariance();
            self.reset_if_diverged();
        }
        checked
    }

    /// Lets the covariance follow the estimate. Half of the noise acts before and half after the
    /// prediction, which is exact to the second order in time; see [`Linearization`] for the other
    /// choice.
    fn predict_covariance(&mut self) {
        let motion = self.pending;
        if motion.seconds <= 0.0 {
            return;
        }
        let noise = self.config.noise;
        let before_s = match self.config.linearization {
            Linearization::WholeAngle => 0.5 * motion.seconds,
            Linearization::HalfAngle => 0.0,
        };
        self.covariance.add_noise(&noise, before_s);
        self.covariance.propagate(&Transition::new(&motion, self.config.linearization));
        self.covariance.add_noise(&noise, motion.seconds - before_s);
        let outer_variance = self.outer.noise() * motion.seconds;
        self.covariance.add_variance(VELOCITY, outer_variance);
        self.covariance.add_variance(VELOCITY + 1, outer_variance);
        self.covariance.add_gyro_noise(noise.gyro, self.velocity_m_s, motion.seconds);
        self.covariance.limit(self.config.variance_floor);
        self.begin_motion();
    }

    fn begin_motion(&mut self) {
        self.pending = Motion {
            rotation: Mat3::from_quat(self.attitude),
            velocity_m_s: self.velocity_m_s,
            turn_rad: Vec3::ZERO,
            impulse_m_s: Vec3::ZERO,
            drag_per_s: Vec3::ZERO,
            seconds: 0.0,
        };
    }

    /// Starts anew when the estimate is not finite or outside its bounds. The attitude survives when
    /// it is finite, all else is unknown, which [`Ekf::health`] reports.
    fn reset_if_diverged(&mut self) {
        let is_sane = self.position_m.length_squared() <= POSITION_MAX_M * POSITION_MAX_M
            && self.velocity_m_s.length_squared() <= SPEED_MAX_M_S * SPEED_MAX_M_S
            && self.attitude.is_finite()
            && self.gyro_bias_rad_s.is_finite()
            && self.accel_bias_m_s2.is_finite()
            && self.covariance.is_finite();
        if !is_sane {
            let attitude = if self.attitude.is_finite() { self.attitude } else { Quat::IDENTITY };
            self.reset(&FlightState { attitude, ..FlightState::default() });
            self.covariance.isolate(POSITION, DIVERGED_POSITION_SIGMA_M);
            self.covariance.isolate(VELOCITY, DIVERGED_VELOCITY_SIGMA_M_S);
            self.covariance.isolate(ATTITUDE, DIVERGED_ATTITUDE_SIGMA_RAD);
            self.monitor.diverge();
        }
    }

    fn placement(&self) -> Placement {
        Placement { position_m: self.position_m, attitude: self.attitude }
    }

    /// Returns the estimate, with the rate of the last sample without its bias.
    pub fn state(&self) -> FlightState {
        FlightState {
            position_m: self.position_m,
            velocity_m_s: self.attitude * self.velocity_m_s,
            attitude: self.attitude,
            rate_rad_s: self.rate_rad_s,
        }
    }

    /// Returns the height in m above the floor that the sensors below the robot see.
    pub fn height_above_floor_m(&self) -> f32 {
        self.position_m.z - self.terrain.height_m()
    }

    /// Returns the height in m of the floor below the robot in the world, 0 at the start.
    pub fn floor_m(&self) -> f32 {
        self.terrain.height_m()
    }

    /// Returns the velocity in the body frame, in m/s.
    pub fn body_velocity_m_s(&self) -> Vec3 {
        self.velocity_m_s
    }

    /// Returns the bias of the gyroscope in rad/s.
    pub fn gyro_bias_rad_s(&self) -> Vec3 {
        self.gyro_bias_rad_s
    }

    /// Returns the bias of the accelerometer along z, in m/s².
    pub fn accel_bias_m_s2(&self) -> f32 {
        self.accel_bias_m_s2
    }

    /// Returns the covariance of the error as of the last prediction or update, at most 10 ms ago.
    ///
    /// The order of the states is position (m), velocity in the body frame (m/s), attitude (rad),
    /// bias of the gyroscope (rad/s), bias of the accelerometer (m/s²).
    pub fn covariance(&self) -> [[f32; 13]; 13] {
        self.covariance.full()
    }

    /// Replaces the covariance of the error, in the order of [`Ekf::covariance`]; the estimate stays.
    /// This is for a caller that knows it, such as from another filter.
    ///
    /// Entries below the diagonal are ignored. Limits of the variances hold.
    ///
    /// # Errors
    /// [`EkfRefusal::NotFinite`], and [`EkfRefusal::OutOfRange`] for a variance below 0; then nothing
    /// changes.
    pub fn adopt_covariance(&mut self, covariance: &[[f32; 13]; 13]) -> Result<(), EkfRefusal> {
        self.covariance = StateCovariance::from_upper(covariance)?;
        self.covariance.limit(self.config.variance_floor);
        self.begin_motion();
        Ok(())
    }

    /// Returns the health of the estimate.
    pub fn health(&self) -> EkfHealth {
        self.monitor.judge(&HealthVariances {
            position: self.covariance.variances(POSITION),
            velocity: self.covariance.variances(VELOCITY),
            attitude: self.covariance.variances(ATTITUDE),
        })
    }
}
