//! The updates of the Kalman filter by each kind of measurement.

use glam::{Mat3, Vec3};

use super::covariance::{SparseRow, dot, entry};
use super::health::HealthMonitor;
use super::history::Placement;
use super::measurement::{
    EkfOutcome, EkfRefusal, FlowMeasurement, PoseMeasurement, PositionMeasurement, check_age,
    check_attitude, check_sigma,
};
use super::states::{ACCEL_BIAS, ATTITUDE, GYRO_BIAS, POSITION, STATES, VELOCITY};
use super::{Ekf, renormalized, rotation};

/// The 0.9999 quantile of χ² with one degree of freedom.
const GATE_1: f32 = 15.14;
/// The 0.9999 quantile of χ² with three degrees of freedom.
const GATE_3: f32 = 21.11;
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
struct EstimatedError([f32; STATES]);

impl EstimatedError {
    fn vector(&self, first: usize) -> Vec3 {
        Vec3::new(entry(&self.0, first), entry(&self.0, first + 1), entry(&self.0, first + 2))
    }
}

/// Returns the outcome of a gate, from the squared distance and its limit.
fn judge(distance: Option<f32>, limit: f32) -> EkfOutcome {
    match distance {
        None => EkfOutcome::Refused(EkfRefusal::NotFinite),
        Some(distance) if distance <= limit => EkfOutcome::Accepted,
        Some(distance) => EkfOutcome::Rejected { distance_ratio: distance / limit },
    }
}

impl Ekf {
    /// Corrects the estimate by a position.
    pub fn update_position(&mut self, measured: &PositionMeasurement) -> EkfOutcome {
        let past = match self.past_at(measured.age_s, measured.sigma_m) {
            Ok(past) => past,
            Err(refusal) => return EkfOutcome::Refused(refusal),
        };
        if !measured.position_m.is_finite() {
            return EkfOutcome::Refused(EkfRefusal::NotFinite);
        }
        self.predict_covariance();
        let innovation = measured.position_m - past.position_m;
        let variance = measured.sigma_m * measured.sigma_m;
        let distance = self.covariance.distance_squared(POSITION, variance, innovation);
        let outcome = judge(distance, GATE_3);
        self.note_position(&outcome, innovation);
        if outcome.is_accepted() {
            let mut error = EstimatedError([0.0; STATES]);
            self.fuse_vector(&mut error, POSITION, innovation, variance);
            self.inject(&error);
        }
        outcome
    }

    /// Corrects the estimate by a position and an attitude.
    pub fn update_pose(&mut self, measured: &PoseMeasurement) -> EkfOutcome {
        let past = match self
            .past_at(measured.age_s, measured.sigma_m)
            .and_then(|past| check_sigma(measured.sigma_rad).map(|()| past))
            .and_then(|past| check_attitude(measured.attitude).map(|()| past))
        {
            Ok(past) => past,
            Err(refusal) => return EkfOutcome::Refused(refusal),
        };
        if !measured.position_m.is_finite() {
            return EkfOutcome::Refused(EkfRefusal::NotFinite);
        }
        self.predict_covariance();
        let innovation = measured.position_m - past.position_m;
        // The error turns with the robot, so it is taken in the world frame and brought to the
        // present body frame.
        let turn = measured.attitude.normalize() * past.attitude.conjugate();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let angle = self.attitude.conjugate() * (turn.xyz() * (2.0 / turn.w.max(0.01)));
        let variance = measured.sigma_m * measured.sigma_m;
        let variance_rad2 = measured.sigma_rad * measured.sigma_rad;
        let mut outcome =
            judge(self.covariance.distance_squared(POSITION, variance, innovation), GATE_3);
        if outcome.is_accepted() {
            outcome =
                judge(self.covariance.distance_squared(ATTITUDE, variance_rad2, angle), GATE_3);
        }
        self.note_position(&outcome, innovation);
        if outcome.is_accepted() {
            let mut error = EstimatedError([0.0; STATES]);
            self.fuse_vector(&mut error, POSITION, innovation, variance);
            self.fuse_vector(&mut error, ATTITUDE, angle, variance_rad2);
            self.inject(&error);
        }
        outcome
    }

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

    /// Corrects the estimate by the distance to level ground at height 0 along the body's −z axis,
    /// in m, above 0 and at most 5, with its standard deviation.
    ///
    /// The sensor reports the nearest point in a cone of ±7.5 degrees, so it sees the ground as if
    /// the robot tilted 7.5 degrees less.
    pub fn update_range(&mut self, range_m: f32, sigma_m: f32) -> EkfOutcome {
        self.update_late_range(range_m, sigma_m, 0.0)
    }

    /// Corrects the estimate by a distance to the ground as [`Self::update_range`] does, which was true
    /// `age_s` seconds ago, 0 to 0.04.
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
        let innovation = range_m - past.position_m.z * slant;
        let row = [(POSITION + 2, slant)];
        self.update_scalar(&row, innovation, sigma_m * sigma_m, HealthMonitor::accept_height)
    }

    /// Corrects the estimate by flow over level ground at height 0.
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
        let height = self.position_m.z.max(FLOW_HEIGHT_MIN_M);
        let per_velocity = scale * cos_tilt / height;
        let velocity = self.velocity_m_s;
        let slope =
            if self.position_m.z > FLOW_HEIGHT_MIN_M { -per_velocity / height } else { 0.0 };
        let row_x =
            [(POSITION + 2, slope * velocity.x), (VELOCITY, per_velocity), (GYRO_BIAS + 1, scale)];
        let row_y =
            [(POSITION + 2, slope * velocity.y), (VELOCITY + 1, per_velocity), (GYRO_BIAS, -scale)];
        let innovation_x = measured.counts_x - (per_velocity * velocity.x - scale * rate.y);
        let innovation_y = measured.counts_y - (per_velocity * velocity.y + scale * rate.x);
        let variance = measured.sigma_counts * measured.sigma_counts + QUANTIZATION_VARIANCE;
        let projection_x = self.covariance.project(&row_x);
        let mut outcome = judge(scalar_distance(&projection_x, innovation_x, variance), GATE_1);
        if outcome.is_accepted() {
            let projection_y = self.covariance.project(&row_y);
            outcome = judge(scalar_distance(&projection_y, innovation_y, variance), GATE_1);
        }
        match outcome {
            EkfOutcome::Accepted => {
                self.monitor.accept_flow();
                let mut error = EstimatedError([0.0; STATES]);
                let horizontal = self.covariance.horizontal();
                self.fuse_projected(&mut error, &row_x, &projection_x, innovation_x, variance);
                self.fuse(&mut error, &row_y, innovation_y, variance);
                if !self.config.flow_moves_position {
                    error.0[POSITION] = 0.0;
                    error.0[POSITION + 1] = 0.0;
                    self.covariance.restore_horizontal(horizontal);
                }
                self.inject(&error);
            }
            EkfOutcome::Rejected { .. } => self.monitor.reject(),
            EkfOutcome::Refused(_) => {}
        }
        outcome
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

    /// Replaces position and attitude by a measurement, whatever the estimate was; velocity and
    /// biases stay. This is for the caller that decided so, such as after
    /// [`is_lost`](super::EkfHealth::is_lost).
    ///
    /// # Errors
    /// The reasons of [`EkfRefusal`], except that the age is ignored.
    pub fn adopt_pose(&mut self, measured: &PoseMeasurement) -> Result<(), EkfRefusal> {
        check_sigma(measured.sigma_rad)?;
        check_attitude(measured.attitude)?;
        self.adopt_position(&PositionMeasurement {
            position_m: measured.position_m,
            sigma_m: measured.sigma_m,
            age_s: 0.0,
        })?;
        let before = self.placement();
        self.attitude = measured.attitude.normalize();
        self.past.correct(before, self.placement());
        self.covariance.isolate(ATTITUDE, Vec3::splat(measured.sigma_rad));
        self.covariance.limit(self.config.variance_floor);
        self.begin_motion();
        Ok(())
    }

    /// Replaces the position by a measurement, whatever the estimate was; the rest stays.
    ///
    /// # Errors
    /// The reasons of [`EkfRefusal`], except that the age is ignored.
    pub fn adopt_position(&mut self, measured: &PositionMeasurement) -> Result<(), EkfRefusal> {
        check_sigma(measured.sigma_m)?;
        if !measured.position_m.is_finite() {
            return Err(EkfRefusal::NotFinite);
        }
        self.predict_covariance();
        let before = self.placement();
        self.position_m = measured.position_m;
        self.past.correct(before, self.placement());
        self.covariance.isolate(POSITION, Vec3::splat(measured.sigma_m));
        self.covariance.limit(self.config.variance_floor);
        self.monitor.accept_position();
        Ok(())
    }

    /// Returns the third row of the rotation matrix: world z in the body frame.
    fn up(&self) -> Vec3 {
        self.attitude.conjugate() * Vec3::Z
    }

    fn past_at(&self, age_s: f32, sigma_m: f32) -> Result<Placement, EkfRefusal> {
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

    fn note_position(&mut self, outcome: &EkfOutcome, innovation_m: Vec3) {
        match outcome {
            EkfOutcome::Accepted => self.monitor.accept_position(),
            EkfOutcome::Rejected { .. } => self.monitor.reject_position(innovation_m),
            EkfOutcome::Refused(_) => {}
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
        let outcome = judge(scalar_distance(&projection, innovation, variance), GATE_1);
        match outcome {
            EkfOutcome::Accepted => {
                note(&mut self.monitor);
                let mut error = EstimatedError([0.0; STATES]);
                self.fuse_projected(&mut error, row, &projection, innovation, variance);
                self.inject(&error);
            }
            EkfOutcome::Rejected { .. } => self.monitor.reject(),
            EkfOutcome::Refused(_) => {}
        }
        outcome
    }

    /// Processes three measured states from `first` on.
    fn fuse_vector(
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
    fn inject(&mut self, error: &EstimatedError) {
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
