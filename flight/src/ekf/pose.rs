//! Updates of the Kalman filter by positions and poses from outside.

use glam::Vec3;

use super::Ekf;
use super::gate::{GATE_3, Gate};
use super::history::Placement;
use super::measurement::{
    EkfOutcome, EkfRefusal, PoseMeasurement, PositionMeasurement, check_age, check_attitude,
    check_sigma,
};
use super::states::{ATTITUDE, POSITION, STATES};
use super::update::EstimatedError;

/// Largest error in m of a position that any gate lets pass, and the time in seconds by which speed
/// widens it: a gust or a touch moves the robot by 20 mm before the filter knows, and poses may be
/// 60 ms older than assumed.
const POSITION_FLOOR_M: f32 = 0.02;
const POSITION_FLOOR_S: f32 = 0.06;
/// Largest change in m of such an error between two positions, besides their noise. What persists
/// changes slowly, and noise does not.
const POSITION_CHANGE_M: f32 = 0.005;
/// The same of an attitude: markers may be off by 3 degrees.
const ATTITUDE_FLOOR_RAD: f32 = 0.06;
const ATTITUDE_FLOOR_S: f32 = 0.06;
const ATTITUDE_CHANGE_RAD: f32 = 0.01;
const ATTITUDE_CHANGE_S: f32 = 0.005;
/// Standard deviation of a delay that the filter does not assume, as a share of the delay: it changes.
const DELAY_SIGMA_SHARE: f32 = 0.5;
/// Half of the time in seconds over which the rate of a past moment is taken.
const PAST_RATE_S: f32 = 0.005;

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
        let persists = self.position_deviation.persists(innovation, variance, POSITION_CHANGE_M);
        let judged = self.judge_position(innovation, variance, persists);
        let outcome = self.note_position(&judged, innovation, persists);
        if let Ok(variance) = judged {
            let mut error = EstimatedError([0.0; STATES]);
            self.fuse_vector(&mut error, POSITION, innovation, variance);
            self.inject(&error);
        }
        outcome
    }

    /// Corrects the estimate by a position and an attitude.
    ///
    /// A filter that [estimates the age](super::EkfConfig::estimates_pose_age) of poses takes the
    /// assumed one as a first guess.
    pub fn update_pose(&mut self, measured: &PoseMeasurement) -> EkfOutcome {
        let (past, age_s) = match self.past_of_pose(measured) {
            Ok(found) => found,
            Err(refusal) => return EkfOutcome::Refused(refusal),
        };
        self.predict_covariance();
        let innovation = measured.position_m - past.position_m;
        // The error turns with the robot, so it is taken in the world frame and brought to the
        // present body frame.
        let turn = measured.attitude.normalize() * past.attitude.conjugate();
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let angle = self.attitude.conjugate() * (turn.xyz() * (2.0 / turn.w.max(0.01)));
        let delay_s = age_s - measured.age_s;
        let variance_rad2 = measured.sigma_rad * measured.sigma_rad;
        if self.config.estimates_pose_age
            && let Some(rate) = self.past_rate(age_s)
        {
            let known = self.covariance.variance(ATTITUDE);
            let gain = known / (known + variance_rad2);
            self.pose_age.note(angle, rate, delay_s, gain);
        }
        let way_m = self.velocity_m_s.length() * DELAY_SIGMA_SHARE * delay_s;
        let variance = measured.sigma_m * measured.sigma_m + way_m * way_m;
        let rate_rad_s = self.rate_rad_s.length();
        let change = ATTITUDE_CHANGE_RAD + ATTITUDE_CHANGE_S * rate_rad_s;
        let persists = self.position_deviation.persists(innovation, variance, POSITION_CHANGE_M)
            & self.attitude_deviation.persists(angle, variance_rad2, change);
        let turn_floor =
            if persists { ATTITUDE_FLOOR_RAD + ATTITUDE_FLOOR_S * rate_rad_s } else { 0.0 };
        let judged = self.judge_position(innovation, variance, persists).and_then(|variance| {
            let distance = self.covariance.distance_squared(ATTITUDE, variance_rad2, angle);
            let gate = Gate { limit: GATE_3, floor: turn_floor };
            let variance_rad2 = gate.judge(distance, angle.length_squared(), variance_rad2)?;
            Ok((variance, variance_rad2))
        });
        let outcome = self.note_position(&judged, innovation, persists);
        if let Ok((variance, variance_rad2)) = judged {
            let mut error = EstimatedError([0.0; STATES]);
            self.fuse_vector(&mut error, POSITION, innovation, variance);
            self.fuse_vector(&mut error, ATTITUDE, angle, variance_rad2);
            self.inject(&error);
        }
        outcome
    }

    fn judge_position(
        &self,
        innovation: Vec3,
        variance: f32,
        persists: bool,
    ) -> Result<f32, EkfOutcome> {
        let floor = POSITION_FLOOR_M + POSITION_FLOOR_S * self.velocity_m_s.length();
        let gate = Gate { limit: GATE_3, floor: if persists { floor } else { 0.0 } };
        let distance = self.covariance.distance_squared(POSITION, variance, innovation);
        gate.judge(distance, innovation.length_squared(), variance)
    }

    /// Returns the placement to which a pose belongs, and its likely age in seconds.
    fn past_of_pose(&self, measured: &PoseMeasurement) -> Result<(Placement, f32), EkfRefusal> {
        check_sigma(measured.sigma_m)?;
        check_sigma(measured.sigma_rad)?;
        check_age(measured.age_s)?;
        check_attitude(measured.attitude)?;
        if !measured.position_m.is_finite() {
            return Err(EkfRefusal::NotFinite);
        }
        let age_s = if self.config.estimates_pose_age {
            self.pose_age.estimate_s(measured.age_s, self.past.reach_s())
        } else {
            measured.age_s
        };
        let past = self.past.at(age_s, self.placement()).ok_or(EkfRefusal::TooOld)?;
        Ok((past, age_s))
    }

    /// Returns the rate at a past moment, without the bias; `None` before the filter remembers.
    fn past_rate(&self, age_s: f32) -> Option<Vec3> {
        let younger_s = (age_s - PAST_RATE_S).max(0.0);
        let older = self.past.at(younger_s + 2.0 * PAST_RATE_S, self.placement())?;
        let younger = self.past.at(younger_s, self.placement())?;
        let turn = older.attitude.conjugate() * younger.attitude;
        let turn = if turn.w < 0.0 { -turn } else { turn };
        Some(turn.xyz() * (1.0 / PAST_RATE_S))
    }

    /// Returns true if the last positions or poses showed the same difference from the estimate, to the
    /// noise of the sensor.
    pub fn position_persists(&self) -> bool {
        self.position_persists
    }

    /// Returns the distance in m and the turn in rad between the last position or pose and the estimate
    /// at its time. A position has no turn of its own.
    pub fn displacement(&self) -> (f32, f32) {
        (self.position_deviation.last().length(), self.attitude_deviation.last().length())
    }

    /// Moves position and attitude by the difference between a measurement and the estimate at its
    /// time, whatever it is; velocity and biases stay. This is for the caller that decided so, such as
    /// after [`is_lost`](super::EkfHealth::is_lost).
    ///
    /// # Errors
    /// The reasons of [`EkfRefusal`], except that a pose that is too old counts as present.
    pub fn adopt_pose(&mut self, measured: &PoseMeasurement) -> Result<(), EkfRefusal> {
        let past = match self.past_of_pose(measured) {
            Ok((past, _)) => past,
            Err(EkfRefusal::TooOld) => self.placement(),
            Err(refusal) => return Err(refusal),
        };
        self.adopt_position(&PositionMeasurement {
            position_m: measured.position_m - past.position_m + self.position_m,
            sigma_m: measured.sigma_m,
            age_s: 0.0,
        })?;
        let before = self.placement();
        let turn = measured.attitude.normalize() * past.attitude.conjugate();
        self.attitude = (turn * self.attitude).normalize();
        self.past.correct(before, self.placement());
        self.covariance.isolate(ATTITUDE, Vec3::splat(measured.sigma_rad));
        self.covariance.limit(self.config.variance_floor);
        self.begin_motion();
        Ok(())
    }

    /// Moves the position by the difference between a measurement and the estimate at its time,
    /// whatever it is; the rest stays.
    ///
    /// # Errors
    /// The reasons of [`EkfRefusal`], except that a position that is too old counts as present.
    pub fn adopt_position(&mut self, measured: &PositionMeasurement) -> Result<(), EkfRefusal> {
        let past = match self.past_at(measured.age_s, measured.sigma_m) {
            Ok(past) => past,
            Err(EkfRefusal::TooOld) => self.placement(),
            Err(refusal) => return Err(refusal),
        };
        if !measured.position_m.is_finite() {
            return Err(EkfRefusal::NotFinite);
        }
        self.predict_covariance();
        let before = self.placement();
        self.position_m += measured.position_m - past.position_m;
        self.past.correct(before, self.placement());
        self.covariance.isolate(POSITION, Vec3::splat(measured.sigma_m));
        self.covariance.limit(self.config.variance_floor);
        self.monitor.accept_position();
        Ok(())
    }

    fn note_position<T>(
        &mut self,
        judged: &Result<T, EkfOutcome>,
        innovation_m: Vec3,
        persists: bool,
    ) -> EkfOutcome {
        self.position_persists = persists;
        match judged {
            Ok(_) => {
                self.monitor.accept_position();
                EkfOutcome::Accepted
            }
            Err(outcome) => {
                if matches!(outcome, EkfOutcome::Rejected { .. }) {
                    self.monitor.reject_position(innovation_m, persists);
                }
                *outcome
            }
        }
    }
}
