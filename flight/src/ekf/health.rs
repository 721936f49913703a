//! The health of the estimate.

use glam::Vec3;

/// Longest time without a measurement after which a part of the state still counts as valid.
const MEASUREMENT_TIMEOUT_S: f32 = 0.5;
/// Largest valid standard deviation of the position along x or y, in m.
const POSITION_SIGMA_MAX_M: f32 = 1.0;
/// Largest valid standard deviation of the height, in m.
const HEIGHT_SIGMA_MAX_M: f32 = 0.3;
/// Largest valid standard deviation of a velocity, in m/s.
const VELOCITY_SIGMA_MAX_M_S: f32 = 0.5;
/// Largest valid standard deviation of the attitude about body x or y, in rad.
const TILT_SIGMA_MAX_RAD: f32 = 0.2;
/// Time during which positions contradict the estimate but not each other, after which the filter
/// counts as lost, in seconds.
const LOST_AFTER_S: f32 = 0.5;
/// Time during which positions contradict the estimate by the same displacement, after which they
/// count as displaced, in seconds.
const DISPLACED_AFTER_S: f32 = 0.3;
/// Largest change of that displacement, in m: the inertial sensors alone drift by less in that time.
const DISPLACED_SPREAD_M: f32 = 0.08;
/// Least number of such positions.
const LOST_AFTER_REJECTIONS: u32 = 5;
/// Largest change of the innovation between two positions that agree with each other, in m.
const AGREEMENT_M: f32 = 0.2;

/// The health of the estimate.
///
/// The limits are choices for flight in a room: 0.5 s without a measurement; standard deviations of
/// 1 m (x, y), 0.3 m (z), 0.5 m/s and 0.2 rad (tilt).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct EkfHealth {
    /// True when positions or flow were accepted lately and x and y are known well enough.
    pub is_position_valid: bool,
    /// True when positions, heights or ranges were accepted lately and z is known well enough.
    pub is_height_valid: bool,
    /// True when positions or flow were accepted lately and the velocity is known well enough.
    pub is_velocity_valid: bool,
    /// True when the tilt is known well enough.
    pub is_attitude_valid: bool,
    /// True when positions or poses contradicted the estimate for 0.5 s while they agreed with each
    /// other. The caller decides: land, or start again with [`adopt_pose`](super::Ekf::adopt_pose).
    pub is_lost: bool,
    /// True when positions or poses contradicted the estimate for 0.3 s by the same displacement, so
    /// that they agree with each other and with the inertial sensors. The caller decides as for
    /// [`is_lost`](Self::is_lost).
    pub is_displaced: bool,
    /// Number of measurements that the gates rejected since the filter was created.
    pub rejections: u32,
    /// Number of resets since the filter was created because the estimate diverged.
    pub divergences: u32,
}

/// Standard deviations that [`EkfHealth`] judges.
#[derive(Clone, Copy, Debug)]
pub(super) struct HealthVariances {
    pub position: Vec3,
    pub velocity: Vec3,
    pub attitude: Vec3,
}

/// Times and counts from which the health follows.
#[derive(Clone, Copy, Debug)]
pub(super) struct HealthMonitor {
    since_horizontal_s: f32,
    since_vertical_s: f32,
    dispute_s: f32,
    dispute_rejections: u32,
    dispute_innovation_m: Vec3,
    /// Displacement at the start of the last time in which it stayed the same, and that time.
    displacement_m: Vec3,
    displaced_s: f32,
    rejections: u32,
    divergences: u32,
}

impl HealthMonitor {
    /// Creates a monitor that saw no measurement yet.
    pub fn new() -> Self {
        HealthMonitor {
            since_horizontal_s: f32::INFINITY,
            since_vertical_s: f32::INFINITY,
            dispute_s: 0.0,
            dispute_rejections: 0,
            dispute_innovation_m: Vec3::ZERO,
            displacement_m: Vec3::ZERO,
            displaced_s: 0.0,
            rejections: 0,
            divergences: 0,
        }
    }

    /// Forgets the times, keeps the counts.
    pub fn restart(&mut self) {
        *self = HealthMonitor {
            rejections: self.rejections,
            divergences: self.divergences,
            ..Self::new()
        };
    }

    /// Lets time pass.
    pub fn advance(&mut self, seconds: f32) {
        self.since_horizontal_s += seconds;
        self.since_vertical_s += seconds;
        self.dispute_s += seconds;
        self.displaced_s += seconds;
    }

    /// Notes an accepted position or pose.
    pub fn accept_position(&mut self) {
        self.since_horizontal_s = 0.0;
        self.since_vertical_s = 0.0;
        self.dispute_rejections = 0;
    }

    /// Notes accepted flow.
    pub fn accept_flow(&mut self) {
        self.since_horizontal_s = 0.0;
    }

    /// Notes an accepted height or range.
    pub fn accept_height(&mut self) {
        self.since_vertical_s = 0.0;
    }

    /// Notes a rejected measurement.
    pub fn reject(&mut self) {
        self.rejections = self.rejections.saturating_add(1);
    }

    /// Notes a rejected position or pose, with the innovation of the position. `persists`: it agrees
    /// with the last one to the noise of the sensor.
    pub fn reject_position(&mut self, innovation_m: Vec3, persists: bool) {
        self.reject();
        let change = innovation_m.distance_squared(self.dispute_innovation_m);
        if self.dispute_rejections == 0 || change > AGREEMENT_M * AGREEMENT_M {
            self.dispute_rejections = 0;
            self.dispute_s = 0.0;
        }
        let spread = innovation_m.distance_squared(self.displacement_m);
        let is_new = self.dispute_rejections == 0 || !persists;
        if is_new || spread > DISPLACED_SPREAD_M * DISPLACED_SPREAD_M {
            self.displacement_m = innovation_m;
            self.displaced_s = 0.0;
        }
        self.dispute_rejections = self.dispute_rejections.saturating_add(1);
        self.dispute_innovation_m = innovation_m;
    }

    /// Notes a reset after divergence.
    pub fn diverge(&mut self) {
        self.divergences = self.divergences.saturating_add(1);
        self.restart();
    }

    /// Judges the estimate.
    pub fn judge(&self, variances: &HealthVariances) -> EkfHealth {
        let is_below = |variance: f32, sigma: f32| variance < sigma * sigma;
        let horizontal = self.since_horizontal_s < MEASUREMENT_TIMEOUT_S;
        let vertical = self.since_vertical_s < MEASUREMENT_TIMEOUT_S;
        let position = variances.position;
        let tilt = variances.attitude.x.max(variances.attitude.y);
        EkfHealth {
            is_position_valid: horizontal
                && is_below(position.x.max(position.y), POSITION_SIGMA_MAX_M),
            is_height_valid: vertical && is_below(position.z, HEIGHT_SIGMA_MAX_M),
            is_velocity_valid: horizontal
                && is_below(variances.velocity.max_element(), VELOCITY_SIGMA_MAX_M_S),
            is_attitude_valid: is_below(tilt, TILT_SIGMA_MAX_RAD),
            is_lost: self.dispute_rejections >= LOST_AFTER_REJECTIONS
                && self.dispute_s >= LOST_AFTER_S,
            is_displaced: self.dispute_rejections >= LOST_AFTER_REJECTIONS
                && self.displaced_s >= DISPLACED_AFTER_S,
            rejections: self.rejections,
            divergences: self.divergences,
        }
    }
}
