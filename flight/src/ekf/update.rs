//! Updates of the Kalman filter by the sensors of the robot.

use glam::{Mat3, Vec2, Vec3};

use super::covariance::{SparseRow, dot, entry};
use super::gate::{GATE_1, Gate};
use super::health::HealthMonitor;
use super::history::Placement;
use super::measurement::{EkfOutcome, EkfRefusal, FlowMeasurement, check_age, check_sigma};
use super::states::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, POSITION, STATES, VELOCITY};
use super::{Ekf, renormalized, rotation};

/// Error of flow that any gate lets pass: that of the velocity in m/s, and a whole count for the
/// rounding.
const FLOW_FLOOR_M_S: f32 = 0.3;
const FLOW_FLOOR_COUNTS: f32 = 1.0;
/// Counts of the flow sensor per radian: ten counts per pixel, 35 pixels in 0.716 74 rad.
const COUNTS_PER_RAD: f32 = 10.0 * 35.0 / 0.71674;
/// Variance of the rounding to whole counts.
const QUANTIZATION_VARIANCE: f32 = 1.0 / 12.0;
/// Least height that the model of flow uses, in m.
const FLOW_HEIGHT_MIN_M: f32 = 0.1;
/// Least cosine of the tilt at which sensors below the robot see the ground.
const COS_TILT_MIN: f32 = 0.1;
/// Longest range that the range sensor reports, in m.
const RANGE_MAX_M: f32 = 5.0;
/// Cosine and sine of half the cone of the range sensor, 7.5 degrees.
const CONE: (f32, f32) = (0.991_444_9, 0.130_526_2);
/// Smallest cosine of the pitch at which yaw has a meaning.
const COS_PITCH_MIN: f32 = 0.1;

/// The error that the scalars of one measurement have estimated so far.
pub(super) struct EstimatedError(pub [f32; STATES]);

impl EstimatedError {
    fn vector(&self, first: usize) -> Vec3 {
        Vec3::new(entry(&self.0, first), entry(&self.0, first + 1), entry(&self.0, first + 2))
    }
}

impl Ekf {
    /// Corrects the estimate by a height in the world frame, in m, with its standard deviation.
    pub fn update_height(&mut self, height_m: f32, sigma_m: f32) -> EkfOutcome {
        if let Err(refusal) = check_sigma(sigma_m) {
            return EkfOutcome::Refused(refusal);
        }
        self.predict_covariance();
        let innovation = height_m - self.position_m.z;
        let row = [(POSITION + 2, 1.0)];
        self.update_scalar(&row, innovation, sigma_m * sigma_m, HealthMonitor::accept_height)
    }

    /// Corrects the estimate by the distance to the level floor along the body's −z axis, in m, above 0
    /// and at most 5, with its standard deviation.
    ///
    /// The floor has the height 0 at first. A step of it that three ranges show moves the floor and
    /// not the robot, see [`Ekf::floor_m`]; these ranges count as rejected.
    ///
    /// The sensor reports the nearest point in a cone of ±7.5 degrees, so it sees the ground as if
    /// the robot tilted 7.5 degrees less.
    pub fn update_range(&mut self, range_m: f32, sigma_m: f32) -> EkfOutcome {
        self.update_late_range(range_m, sigma_m, 0.0)
    }

    /// Corrects the estimate by a distance to the ground as [`Self::update_range`] does, which was true
    /// `age_s` seconds ago, 0 to 0.1.
    pub fn update_late_range(&mut self, range_m: f32, sigma_m: f32, age_s: f32) -> EkfOutcome {
        let past = match self.past_at(age_s, sigma_m) {
            Ok(past) => past,
            Err(refusal) => return EkfOutcome::Refused(refusal),
        };
        if !range_m.is_finite() {
            return EkfOutcome::Refused(EkfRefusal::NotFinite);
        }
        if range_m <= 0.0 || range_m > RANGE_MAX_M {
            return EkfOutcome::Refused(EkfRefusal::OutOfRange);
        }
        let cos_tilt = (past.attitude * Vec3::Z).z;
        if cos_tilt <= COS_TILT_MIN {
            return EkfOutcome::Refused(EkfRefusal::TooTilted);
        }
        self.predict_covariance();
        let slant = 1.0 / cos_outside_cone(cos_tilt);
        let innovation = range_m - (past.position_m.z - self.terrain.height_m()) * slant;
        self.range_deviation_m = innovation;
        let row = [(POSITION + 2, slant)];
        let variance = sigma_m * sigma_m;
        let outcome = self.update_scalar(&row, innovation, variance, HealthMonitor::accept_height);
        match outcome {
            EkfOutcome::Accepted => self.terrain.agree(),
            EkfOutcome::Rejected { .. } => {
                if self.terrain.dispute(-innovation / slant) {
                    // The mean of three ranges has an error of its own.
                    self.covariance.add_variance(POSITION + 2, variance);
                    self.monitor.accept_height();
                }
            }
            EkfOutcome::Refused(_) => {}
        }
        outcome
    }

    /// Corrects the estimate by flow over the level floor below the robot.
    ///
    /// The expected counts are k·(v·R₃₃/z ∓ ω), with k = seconds · 488.3 and ω the mean rate over
    /// the sensor's time. The model neglects that R₃₃ depends on the attitude error.
    pub fn update_flow(&mut self, measured: &FlowMeasurement) -> EkfOutcome {
        if let Err(refusal) = check_sigma(measured.sigma_counts) {
            return EkfOutcome::Refused(refusal);
        }
        let sum = measured.counts_x + measured.counts_y + measured.seconds;
        if !sum.is_finite() {
            return EkfOutcome::Refused(EkfRefusal::NotFinite);
        }
        if measured.seconds <= 0.0 {
            return EkfOutcome::Refused(EkfRefusal::OutOfRange);
        }
        let cos_tilt = self.up().z;
        if cos_tilt <= COS_TILT_MIN {
            return EkfOutcome::Refused(EkfRefusal::TooTilted);
        }
        let Some(rate) = self.mean_rate(measured.seconds) else {
            return EkfOutcome::Refused(EkfRefusal::TooOld);
        };
        self.predict_covariance();
        let scale = COUNTS_PER_RAD * measured.seconds;
        let height_m = self.height_above_floor_m();
        let height = height_m.max(FLOW_HEIGHT_MIN_M);
        let per_velocity = scale * cos_tilt / height;
        let velocity = self.velocity_m_s;
        let slope = if height_m > FLOW_HEIGHT_MIN_M { -per_velocity / height } else { 0.0 };
        let row_x =
            [(POSITION + 2, slope * velocity.x), (VELOCITY, per_velocity), (GYRO_BIAS + 1, scale)];
        let row_y =
            [(POSITION + 2, slope * velocity.y), (VELOCITY + 1, per_velocity), (GYRO_BIAS, -scale)];
        let innovation_x = measured.counts_x - (per_velocity * velocity.x - scale * rate.y);
        let innovation_y = measured.counts_y - (per_velocity * velocity.y + scale * rate.x);
        self.flow_deviation_counts = Vec2::new(innovation_x, innovation_y);
        let variance = measured.sigma_counts * measured.sigma_counts + QUANTIZATION_VARIANCE;
        let gate = Gate { limit: GATE_1, floor: FLOW_FLOOR_COUNTS + FLOW_FLOOR_M_S * per_velocity };
        let projection_x = self.covariance.project(&row_x);
        let distance_x = scalar_distance(&projection_x, innovation_x, variance);
        let judged = gate.judge(distance_x, innovation_x * innovation_x, variance);
        let judged = judged.and_then(|variance_x| {
            let projection_y = self.covariance.project(&row_y);
            let distance_y = scalar_distance(&projection_y, innovation_y, variance);
            let variance_y = gate.judge(distance_y, innovation_y * innovation_y, variance)?;
            Ok((variance_x, variance_y))
        });
        match judged {
            Ok((variance_x, variance_y)) => {
                self.monitor.accept_flow();
                let mut error = EstimatedError([0.0; STATES]);
                let horizontal = self.covariance.horizontal();
                self.fuse_projected(&mut error, &row_x, &projection_x, innovation_x, variance_x);
                self.fuse(&mut error, &row_y, innovation_y, variance_y);
                if !self.config.flow_moves_position {
                    error.0[POSITION] = 0.0;
                    error.0[POSITION + 1] = 0.0;
                    self.covariance.restore_horizontal(horizontal);
                }
                self.inject(&error);
                EkfOutcome::Accepted
            }
            Err(outcome) => {
                self.note_rejection(&outcome);
                outcome
            }
        }
    }

    /// Corrects the estimate by a yaw in rad, with its standard deviation.
    ///
    /// It is refused as too tilted when the pitch is within 6 degrees of the vertical.
    pub fn update_yaw(&mut self, yaw_rad: f32, sigma_rad: f32) -> EkfOutcome {
        if let Err(refusal) = check_sigma(sigma_rad) {
            return EkfOutcome::Refused(refusal);
        }
        let matrix = Mat3::from_quat(self.attitude);
        let ahead = matrix.x_axis;
        let cos_pitch_squared = ahead.x * ahead.x + ahead.y * ahead.y;
        if cos_pitch_squared < COS_PITCH_MIN * COS_PITCH_MIN {
            return EkfOutcome::Refused(EkfRefusal::TooTilted);
        }
        if !yaw_rad.is_finite() {
            return EkfOutcome::Refused(EkfRefusal::NotFinite);
        }
        self.predict_covariance();
        // The error of the yaw is the angle from the projected x axis to the measured direction.
        let (sin, cos) = (libm::sinf(yaw_rad), libm::cosf(yaw_rad));
        let innovation = libm::atan2f(ahead.x * sin - ahead.y * cos, ahead.x * cos + ahead.y * sin);
        // A turn d moves the x axis by R·(d×e₁) = R·(0, d_z, −d_y).
        let along = |axis: Vec3| (ahead.x * axis.y - ahead.y * axis.x) / cos_pitch_squared;
        let row = [(ATTITUDE + 1, -along(matrix.z_axis)), (ATTITUDE + 2, along(matrix.y_axis))];
        self.update_scalar(&row, innovation, sigma_rad * sigma_rad, |_| {})
    }

    /// Returns the difference in counts between the last flow and the estimate before it counted.
    pub fn flow_deviation_counts(&self) -> Vec2 {
        self.flow_deviation_counts
    }

    /// Returns the difference in m between the last range and the estimate before it counted.
    pub fn range_deviation_m(&self) -> f32 {
        self.range_deviation_m
    }

    /// Returns the third row of the rotation matrix: world z in the body frame.
    fn up(&self) -> Vec3 {
        self.attitude.conjugate() * Vec3::Z
    }

    pub(super) fn past_at(&self, age_s: f32, sigma_m: f32) -> Result<Placement, EkfRefusal> {
        check_sigma(sigma_m)?;
        check_age(age_s)?;
        self.past.at(age_s, self.placement()).ok_or(EkfRefusal::TooOld)
    }

    /// Returns the mean rate over the last `seconds` without the bias, from the turn since then.
    fn mean_rate(&self, seconds: f32) -> Option<Vec3> {
        let past = self.past.at(seconds, self.placement())?;
        let turn = past.attitude.conjugate() * self.attitude;
        let turn = if turn.w < 0.0 { -turn } else { turn };
        // To the third order, the angle of 2·sin(angle/2) is that times 1 + sin²(angle/2)/6.
        let half = turn.xyz();
        Some(half * (2.0 * (1.0 + half.length_squared() / 6.0) / seconds))
    }

    fn note_rejection(&mut self, outcome: &EkfOutcome) {
        if matches!(outcome, EkfOutcome::Rejected { .. }) {
            self.monitor.reject();
        }
    }

    fn update_scalar<const N: usize>(
        &mut self,
        row: &SparseRow<N>,
        innovation: f32,
        variance: f32,
        note: fn(&mut HealthMonitor),
    ) -> EkfOutcome {
        let projection = self.covariance.project(row);
        let distance = scalar_distance(&projection, innovation, variance);
        let gate = Gate { limit: GATE_1, floor: 0.0 };
        match gate.judge(distance, innovation * innovation, variance) {
            Ok(variance) => {
                note(&mut self.monitor);
                let mut error = EstimatedError([0.0; STATES]);
                self.fuse_projected(&mut error, row, &projection, innovation, variance);
                self.inject(&error);
                EkfOutcome::Accepted
            }
            Err(outcome) => {
                self.note_rejection(&outcome);
                outcome
            }
        }
    }

    /// Processes three measured states from `first` on.
    pub(super) fn fuse_vector(
        &mut self,
        error: &mut EstimatedError,
        first: usize,
        innovation: Vec3,
        variance: f32,
    ) {
        for (axis, innovation) in innovation.to_array().into_iter().enumerate() {
            self.fuse(error, &[(first + axis, 1.0)], innovation, variance);
        }
    }

    /// Processes one scalar; `innovation` is that before the first scalar of the measurement.
    fn fuse<const N: usize>(
        &mut self,
        error: &mut EstimatedError,
        row: &SparseRow<N>,
        innovation: f32,
        variance: f32,
    ) {
        let projection = self.covariance.project(row);
        self.fuse_projected(error, row, &projection, innovation, variance);
    }

    fn fuse_projected<const N: usize>(
        &mut self,
        error: &mut EstimatedError,
        row: &SparseRow<N>,
        (product, predicted): &([f32; STATES], f32),
        innovation: f32,
        variance: f32,
    ) {
        let gain = self.covariance.reduce(row, product, *predicted, variance);
        let known = dot(row, &error.0);
        for (value, gain) in error.0.iter_mut().zip(gain) {
            *value += gain * (innovation - known);
        }
    }

    /// Moves the estimated error into the estimate.
    pub(super) fn inject(&mut self, error: &EstimatedError) {
        let before = self.placement();
        self.position_m += error.vector(POSITION);
        self.velocity_m_s += error.vector(VELOCITY);
        let angle = error.vector(ATTITUDE);
        self.attitude = renormalized(self.attitude * rotation(angle));
        self.gyro_bias_rad_s += error.vector(GYRO_BIAS);
        self.rate_rad_s -= error.vector(GYRO_BIAS);
        self.accel_bias_m_s2 += entry(&error.0, ACCEL_BIAS);
        self.past.correct(before, self.placement());
        if angle.length_squared() > 1e-8 {
            self.covariance.turn_attitude(angle);
        }
        self.covariance.limit(self.config.variance_floor);
        self.begin_motion();
        self.reset_if_diverged();
    }
}

/// Returns the squared innovation, divided by its variance, or `None` when that is not positive.
fn scalar_distance(
    (_, predicted): &([f32; STATES], f32),
    innovation: f32,
    variance: f32,
) -> Option<f32> {
    let total = predicted + variance;
    let distance = innovation * innovation / total;
    (total > 0.0 && distance.is_finite()).then_some(distance)
}

/// Returns the cosine of the part of the tilt that the cone of the range sensor leaves.
fn cos_outside_cone(cos_tilt: f32) -> f32 {
    let (cos_cone, sin_cone) = CONE;
    if cos_tilt >= cos_cone {
        return 1.0;
    }
    // cos(a − b) = cos a · cos b + sin a · sin b
    cos_tilt * cos_cone + libm::sqrtf(1.0 - cos_tilt * cos_tilt) * sin_cone
}
