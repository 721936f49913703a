//! The whole flight controller: from samples of the sensors to duties of the motors.
//!
//! [`FlightStack`] joins the parts of this crate at the rates of a Crazyflie:
//!
//! | Part | Rate |
//! |---|---|
//! | monitor of the IMU, state of the filter, supervisor, motors | 1 kHz |
//! | controller and mixer | 500 Hz |
//! | planner | 500 Hz |
//! | covariance of the filter | 100 Hz |
//!
//! The caller calls [`FlightStack::tick`] once per sample of the IMU, and passes other measurements
//! on when they arrive. [`FlightStack::take_off`], [`FlightStack::fly`] and the other commands
//! choose the motion; each expires without a sign of life of the script.
//!
//! # On the ground
//! A robot that stands still sees no flow and may have no pose. Its filter then takes a flow of
//! zero and the known height, so the estimate does not drift before take-off. A flow sensor sees
//! nothing near the ground either, so a position that is lost below 0.15 m stays valid for 3 s
//! there.
//!
//! # In the air
//! The gates of the filter let pass what persists up to a few centimeters. Poses that are displaced
//! further are adopted, or end the flight ([`FlightStack::receive_pose`]). A step of the floor that
//! the range sensor sees moves the ground on which the robot lands.
//!
//! A landing leads to the ground at rest, and then further down at 8 cm/s until the robot stands
//! with much less thrust than it weighs.
//!
//! # Plans elsewhere
//! A plan can take longer than half the time between two samples. A robot whose ticks must not wait
//! gives its commands to a copy of the controller, in a task of lower priority, and hands them over
//! between two ticks ([`FlightStack::plan_elsewhere`]).

mod command;
mod governor;
mod guidance;
mod hand_over;
mod peers;
mod settings;
#[cfg(test)]
mod tests;

use glam::{Quat, Vec3};

pub(crate) use command::CLEARANCE_M;
pub use command::{AttitudeCommand, FlightRefusal, TRAJECTORY_PIECES};
pub use hand_over::COPY_TICKS;
pub use settings::StackSettings;

use command::Guidance;
use peers::HeardPeers;

use crate::blind::BlindDescent;
use crate::calibration::{ImuCalibrator, ImuMonitor};
use crate::ekf::{
    Ekf, EkfHealth, EkfOutcome, FlowMeasurement, PoseMeasurement, PositionMeasurement,
};
use crate::filter::Butterworth;
use crate::geometric::GeometricController;
use crate::mixer::Mixer;
use crate::motor::RotorDrive;
use crate::planner::Planner;
use crate::supervisor::{
    MotorEffort, MotorPermission, PilotRequests, RotorStatus, SetpointStatus, Supervisor,
    SupervisorInput, SupervisorStage,
};
use crate::trust::{MeasurementTrust, TrustLimits};
use crate::{FlightState, GRAVITY_M_S2, ImuSample, MotorDuties, MotorForces, Reference};

/// Time between two samples of the IMU, in seconds.
pub const TICK_S: f32 = 0.001;
/// The same in ms.
const TICK_MS: u32 = 1;
/// Ticks between two calls of the controller.
const CONTROL_TICKS: u64 = 2;
/// Samples of the IMU per second.
const SAMPLE_RATE_HZ: f32 = 1000.0;
/// Cut-off frequency in Hz of the filter of the angular rate (as in crazyflie-firmware 2a18fc29).
const GYRO_CUTOFF_HZ: f32 = 80.0;
/// Height in m below which a flow sensor may see nothing (0.08 m for the PMW3901, with a margin),
/// and time in ms for which the position then stays valid.
const BLIND_HEIGHT_M: f32 = 0.15;
const BLIND_MS: u64 = 3000;
/// Time in ms between two observations of standstill, and time without a pose from which they are
/// taken.
const STANDSTILL_PERIOD_MS: u32 = 10;
const STANDSTILL_WITHOUT_POSE_MS: u64 = 500;
/// Standard deviation of a flow of zero in counts: about 1 cm/s near the ground.
const STANDSTILL_SIGMA_COUNTS: f32 = 0.5;
/// Standard deviation in m of the height of a robot that stands, weak beside a range sensor.
const STANDSTILL_SIGMA_M: f32 = 0.02;
/// Largest rate in rad/s and difference of the specific force from gravity in m/s² of a robot that
/// stands still. The offsets of the sensor are at most 0.017 rad/s and 0.2 m/s².
const STANDSTILL_RAD_S: f32 = 0.1;
const STANDSTILL_M_S2: f32 = 0.5;
/// Standard deviation in m of the distance to the ground at less than 2 m (crazyflie-firmware
/// 2a18fc29, `zranger2.c`).
const RANGE_SIGMA_M: f32 = 0.0025;
/// Largest displacement in m, and turn in rad, of poses that a robot in flight adopts. A larger one is
/// rather another robot, or a set of markers that the cameras take for another one.
const ADOPTED_JUMP_M: f32 = 0.3;
const ADOPTED_TURN_RAD: f32 = 0.2;
/// Time constant in seconds of the average over the specific force that a robot lacks: shocks and
/// vibration are shorter.
const EFFORT_S: f32 = 0.15;
/// Age in seconds of a distance to the ground: the sensor measures for 33 ms before it reports.
const RANGE_AGE_S: f32 = 0.033;

/// The flight controller of one robot.
#[derive(Clone, Copy, Debug)]
pub struct FlightStack {
    settings: StackSettings,
    calibrator: ImuCalibrator,
    monitor: ImuMonitor,
    rate_filter: Option<Butterworth<Vec3>>,
    filter: Ekf,
    planner: Option<Planner<TRAJECTORY_PIECES>>,
    controller: GeometricController,
    mixer: Mixer,
    drive: RotorDrive,
    supervisor: Supervisor,
    permission: MotorPermission,
    requests: PilotRequests,
    has_script_fault: bool,
    guidance: Guidance,
    desk: hand_over::PlanningDesk,
    /// Time of the last command or sign of life since the last stop.
    command_ms: Option<u64>,
    pose_ms: Option<u64>,
    /// Last time when the filter knew the position.
    position_ms: Option<u64>,
    /// The robot was near the ground when it lost its position.
    was_low: bool,
    /// Distance in m that the reference has sunk after a landing.
    settle_m: f32,
    /// Time for which a landing robot has stood on the ground.
    standing_ms: u32,
    /// A landing ended, and the motors stop.
    has_touched_down: bool,
    /// The reference that the controller followed last.
    reference: Option<Reference>,
    /// The acceleration in m/s² that the last set-point of any kind asked for, with which the first of
    /// another kind goes on. Otherwise a robot that gets them in turn would never brake.
    asked_m_s2: Vec3,
    /// The descent of a robot in the air that has no reference.
    blind: Option<BlindDescent>,
    pose_trust: MeasurementTrust<(Vec3, Quat)>,
    flow_trust: MeasurementTrust<(f32, f32)>,
    range_trust: MeasurementTrust<f32>,
    peers: HeardPeers,
    forces: MotorForces,
    /// Direction in the world of the thrust that the controller wants, while it wants one.
    wanted_up: Option<Vec3>,
    /// Average of the specific force in m/s² that the robot lacks, in its frame.
    missing_m_s2: Vec3,
    last_sample: ImuSample,
    /// Height of the center of mass on the ground in m.
    ground_m: f32,
    ticks: u64,
}

impl FlightStack {
    /// Returns the flight controller of a robot that was just powered on, and that stands still in
    /// this state.
    #[must_use]
    pub fn new(settings: StackSettings, at: &FlightState) -> Self {
        FlightStack {
            calibrator: ImuCalibrator::new(),
            monitor: ImuMonitor::new(),
            rate_filter: Butterworth::new(GYRO_CUTOFF_HZ, SAMPLE_RATE_HZ, Vec3::ZERO),
            filter: Ekf::new(settings.filter, at),
            planner: Planner::new(settings.limits, settings.fence).ok(),
            controller: GeometricController::new(&settings.vehicle, settings.gains),
            mixer: Mixer::new(&settings.vehicle),
            drive: RotorDrive::new(&settings.vehicle),
            supervisor: Supervisor::new(),
            permission: MotorPermission::Off,
            requests: PilotRequests::default(),
            has_script_fault: false,
            guidance: Guidance::Absent,
            desk: hand_over::PlanningDesk::default(),
            command_ms: None,
            pose_ms: None,
            position_ms: None,
            was_low: false,
            settle_m: 0.0,
            standing_ms: 0,
            has_touched_down: false,
            reference: None,
            asked_m_s2: Vec3::ZERO,
            blind: None,
            pose_trust: MeasurementTrust::new(TrustLimits::POSE),
            flow_trust: MeasurementTrust::new(TrustLimits::FLOW),
            range_trust: MeasurementTrust::new(TrustLimits::RANGE),
            peers: HeardPeers::default(),
            forces: MotorForces::default(),
            wanted_up: None,
            missing_m_s2: Vec3::ZERO,
            last_sample: ImuSample::default(),
            ground_m: at.position_m.z,
            ticks: 0,
            settings,
        }
    }

    /// Accepts that a person carried the robot to another place, where it stands still.
    pub fn adopt(&mut self, at: &FlightState) {
        self.filter.reset(at);
        self.go_idle();
        self.ground_m = at.position_m.z;
    }

    /// Takes the place of another robot, so that poses of that one are not adopted in flight.
    pub fn hear_peer(&mut self, position_m: Vec3) {
        let now_ms = self.now_ms();
        self.peers.hear(position_m, now_ms);
    }

    /// Takes a pose from outside. A robot on the ground accepts any place. In flight, poses that are
    /// displaced by at most 0.3 m and 0.2 rad are adopted after 0.3 s; others end the flight.
    pub fn receive_pose(&mut self, pose: &PoseMeasurement) {
        self.pose_ms = Some(self.now_ms());
        if self.is_flying() && self.pose_trust.is_lost() {
            return;
        }
        let outcome = self.filter.update_pose(pose);
        let (_, turn_rad) = self.filter.displacement();
        let may_adopt = turn_rad <= ADOPTED_TURN_RAD;
        if self.adopts((pose.position_m, pose.attitude), may_adopt, &outcome) {
            // A pose that is refused leaves the filter as it is.
            let _ = self.filter.adopt_pose(pose);
            self.stand_where_adopted();
        }
    }

    /// Takes a position without attitude from outside, as [`Self::receive_pose`] takes a pose. Returns
    /// true if the estimate follows it.
    pub fn receive_position(&mut self, position: &PositionMeasurement) -> bool {
        self.pose_ms = Some(self.now_ms());
        if self.is_flying() && self.pose_trust.is_lost() {
            return false;
        }
        let outcome = self.filter.update_position(position);
        if !self.adopts((position.position_m, Quat::IDENTITY), true, &outcome) {
            return outcome.is_accepted();
        }
        let is_adopted = self.filter.adopt_position(position).is_ok();
        self.stand_where_adopted();
        is_adopted
    }

    /// Notes the filter's answer to a pose, and returns true if it is displaced and is adopted.
    fn adopts(&mut self, pose: (Vec3, Quat), may_adopt: bool, outcome: &EkfOutcome) -> bool {
        let health = self.filter.health();
        if !self.is_flying() {
            return !outcome.is_accepted() && health.is_lost;
        }
        let persists = self.filter.position_persists();
        self.pose_trust.note(pose, 0.0, persists, outcome);
        let (jump_m, _) = self.filter.displacement();
        matches!(outcome, EkfOutcome::Rejected { .. })
            && health.is_displaced
            && may_adopt
            && jump_m <= ADOPTED_JUMP_M
            && !self.peers.has_near(pose.0, self.now_ms())
    }

    fn stand_where_adopted(&mut self) {
        if !self.is_flying() {
            self.ground_m = self.filter.state().position_m.z;
        }
    }

    /// Takes counts of the flow sensor.
    pub fn receive_flow(&mut self, flow: &FlowMeasurement) {
        if self.is_flying() && self.flow_trust.is_lost() {
            return;
        }
        // On the ground the outcome is part of the filter's health.
        let outcome = self.filter.update_flow(flow);
        if self.is_flying() {
            let deviation = self.filter.flow_deviation_counts().abs().max_element();
            self.flow_trust.note((flow.counts_x, flow.counts_y), deviation, false, &outcome);
        }
    }

    /// Takes a distance to the floor in m.
    pub fn receive_range(&mut self, range_m: f32) {
        if self.is_flying() && self.range_trust.is_lost() {
            return;
        }
        let floor_m = self.filter.floor_m();
        let outcome = self.filter.update_late_range(range_m, RANGE_SIGMA_M, RANGE_AGE_S);
        if self.is_flying() {
            // A robot lands on the floor below it.
            self.ground_m += self.filter.floor_m() - floor_m;
            let deviation = self.filter.range_deviation_m().abs();
            self.range_trust.note(range_m, deviation, false, &outcome);
        }
    }

    /// Returns the estimated state.
    #[must_use]
    pub fn state(&self) -> FlightState {
        self.filter.state()
    }

    /// Returns the height in m of the center of mass above the floor below the robot.
    #[must_use]
    pub fn height_above_floor_m(&self) -> f32 {
        self.filter.height_above_floor_m()
    }

    /// Returns the height in m of the floor below the robot in the world, 0 at the start.
    #[must_use]
    pub fn floor_m(&self) -> f32 {
        self.filter.floor_m()
    }

    /// Returns the covariance of the estimate's error; see [`Ekf::covariance`].
    #[must_use]
    pub fn covariance(&self) -> [[f32; 13]; 13] {
        self.filter.covariance()
    }

    /// Returns the reference that the controller follows; `None` without one, as on the ground.
    #[must_use]
    pub fn reference(&self) -> Option<Reference> {
        self.reference
    }

    /// Returns the height of the center of mass in m when the robot last stood on the ground.
    #[must_use]
    pub fn ground_m(&self) -> f32 {
        self.ground_m
    }

    /// Returns true from the end of a landing by a command until the motors are off.
    #[must_use]
    pub fn has_landed(&self) -> bool {
        self.has_touched_down
    }

    /// Returns the health of the estimate.
    #[must_use]
    pub fn health(&self) -> EkfHealth {
        self.filter.health()
    }

    /// Returns the state of the supervisor.
    #[must_use]
    pub fn stage(&self) -> SupervisorStage {
        self.supervisor.state().stage()
    }

    /// Returns the use of the motors that the supervisor permits.
    #[must_use]
    pub fn permission(&self) -> MotorPermission {
        self.permission
    }

    /// Advances by [`TICK_S`] and returns the duties of the motors until the next call.
    ///
    /// # Parameters
    /// `sample`: the raw sample of the IMU, `None` if it gave none. `battery_v`: voltage of the
    /// battery in V.
    pub fn tick(&mut self, sample: Option<&ImuSample>, battery_v: f32) -> MotorDuties {
        self.ticks += 1;
        let watched = self.monitor.update(sample, TICK_S);
        if let Some(raw) = sample {
            self.last_sample = *raw;
            self.propagate(raw);
        }
        if watched.is_ok() && self.ticks.is_multiple_of(u64::from(STANDSTILL_PERIOD_MS / TICK_MS)) {
            self.observe_standstill();
        }
        self.drive.measure_battery(battery_v, TICK_S);
        self.compare_force();
        let state = self.control_state();
        let health = self.filter.health();
        if health.is_position_valid && health.is_height_valid {
            self.position_ms = Some(self.now_ms());
        } else if self.position_age_ms() == u64::from(TICK_MS) {
            self.was_low = state.position_m.z - self.ground_m < BLIND_HEIGHT_M;
        }
        let input = SupervisorInput {
            requests: self.requests,
            imu: watched.map(|()| self.last_sample),
            is_calibrated: self.calibrator.calibration().is_some(),
            up_z: (state.attitude * Vec3::Z).z,
            height_m: state.position_m.z - self.ground_m,
            vertical_speed_m_s: state.velocity_m_s.z,
            is_position_valid: self.has_position(&state),
            fence_excursion_m: self.fence_excursion_m(state.position_m),
            setpoint: self.setpoint(),
            has_script_fault: self.has_script_fault,
            thrust_n: self.forces.0.iter().sum(),
            effort: self.effort(&state),
            rotors: RotorStatus::NotMeasured,
            battery_mv: (battery_v * 1000.0) as u16,
        };
        self.requests = PilotRequests::default();
        let conditions = self.settings.supervision.recognize(&input);
        let output = self.supervisor.step(TICK_MS, &conditions);
        if output.permission != self.permission {
            self.change(output.permission);
        }
        self.plan_if_late();
        self.filter.set_flying(self.is_flying());
        if self.ticks.is_multiple_of(CONTROL_TICKS) {
            self.control(&state);
        }
        if self.permission == MotorPermission::Off {
            self.forces = MotorForces::default();
            // The estimate of the rotors' thrust follows the stop.
            let _ = self.drive.update(&self.forces, TICK_S);
            return MotorDuties::default();
        }
        self.drive.update(&self.forces, TICK_S)
    }

    /// Compares the specific force of the present thrust with the measured one.
    fn compare_force(&mut self) {
        let thrust_n: f32 = self.drive.thrust().0.iter().sum();
        let expected_m_s2 = Vec3::Z * (thrust_n / self.settings.vehicle.mass_kg);
        let missing_m_s2 = expected_m_s2 - self.last_sample.accel_m_s2;
        self.missing_m_s2 += (missing_m_s2 - self.missing_m_s2) * (TICK_S / EFFORT_S);
    }

    /// Returns the effort of the motors and the motion of the robot meanwhile.
    fn effort(&self, state: &FlightState) -> MotorEffort {
        let reference_m = self.reference.map(|reference| reference.position_m);
        let up = state.attitude * Vec3::Z;
        MotorEffort {
            missing_m_s2: self.missing_m_s2,
            offset_m: reference_m.map_or(0.0, |at_m| at_m.distance(state.position_m)),
            speed_m_s: state.velocity_m_s.length(),
            reference_height_m: reference_m.map_or(0.0, |at_m| at_m.z - self.ground_m),
            cosine: self.wanted_up.map_or(1.0, |wanted| wanted.dot(up)),
        }
    }

    fn now_ms(&self) -> u64 {
        self.ticks * u64::from(TICK_MS)
    }

    fn now_s(&self) -> f64 {
        self.ticks as f64 / f64::from(SAMPLE_RATE_HZ)
    }

    /// Returns true from the moment at which the motors lift the robot until it has landed.
    #[must_use]
    pub fn is_flying(&self) -> bool {
        matches!(
            self.stage(),
            SupervisorStage::Flying | SupervisorStage::Landing | SupervisorStage::LevelOut
        )
    }

    /// Passes a sample to the calibration, or to the filter once it is calibrated.
    fn propagate(&mut self, raw: &ImuSample) {
        match self.calibrator.calibration() {
            Some(calibration) => {
                let sample = calibration.apply(raw);
                if let Some(filter) = &mut self.rate_filter {
                    filter.update(sample.gyro_rad_s);
                }
                // The monitor reports samples that the filter refuses.
                let _ = self.filter.propagate(&sample, TICK_S);
            }
            // A refused window begins anew; the robot stays in preflight.
            None => {
                let _ = self.calibrator.update(raw);
            }
        }
    }

    /// Returns the state with a filtered angular rate.
    fn control_state(&self) -> FlightState {
        let state = self.filter.state();
        match &self.rate_filter {
            Some(filter) => {
                let rate_rad_s = filter.output() - self.filter.gyro_bias_rad_s();
                FlightState { rate_rad_s, ..state }
            }
            None => state,
        }
    }

    /// Returns the time since the filter knew the position.
    fn position_age_ms(&self) -> u64 {
        self.position_ms.map_or(u64::MAX, |ms| self.now_ms() - ms)
    }

    /// Returns true if the position is known, or was lost shortly before and near the ground.
    fn has_position(&self, state: &FlightState) -> bool {
        let age_ms = self.position_age_ms();
        let is_low = self.was_low && state.position_m.z - self.ground_m < BLIND_HEIGHT_M;
        age_ms == 0 || (is_low && age_ms < BLIND_MS)
    }

    fn setpoint(&self) -> Option<SetpointStatus> {
        let needs_position = match self.guidance {
            Guidance::Absent | Guidance::Attitude { .. } => false,
            Guidance::Velocity { .. } | Guidance::Plan | Guidance::Reference(_) => true,
        };
        let age_ms = u32::try_from(self.now_ms() - self.command_ms?).unwrap_or(u32::MAX);
        Some(SetpointStatus { age_ms, needs_position })
    }

    /// Passes zero flow and the height of the ground to the filter of a robot that stands still.
    fn observe_standstill(&mut self) {
        let is_idle = !self.is_flying() && self.forces == MotorForces::default();
        let has_pose =
            self.pose_ms.is_some_and(|ms| self.now_ms() < ms + STANDSTILL_WITHOUT_POSE_MS);
        let force_m_s2 = self.last_sample.accel_m_s2.length() - GRAVITY_M_S2;
        let is_still = self.last_sample.gyro_rad_s.length() < STANDSTILL_RAD_S
            && force_m_s2.abs() < STANDSTILL_M_S2;
        if is_idle && !has_pose && is_still && self.calibrator.calibration().is_some() {
            self.receive_flow(&FlowMeasurement {
                counts_x: 0.0,
                counts_y: 0.0,
                sigma_counts: STANDSTILL_SIGMA_COUNTS,
                seconds: STANDSTILL_PERIOD_MS as f32 * TICK_S,
            });
            let _ = self.filter.update_height(self.ground_m, STANDSTILL_SIGMA_M);
        }
    }

    fn fence_excursion_m(&self, position_m: Vec3) -> Option<f32> {
        let fence = self.settings.fence;
        // Robots stand below the floor of a fence before take-off.
        let floored = position_m.with_z(position_m.z.max(fence.least_m().z));
        Some((floored - fence.clamp(floored)).length())
    }

    fn go_idle(&mut self) {
        if let Some(planner) = &mut self.planner {
            planner.go_idle();
        }
    }
}

/// Returns the yaw of a state in radians.
fn yaw_rad(state: &FlightState) -> f32 {
    let Quat { x, y, z, w } = state.attitude;
    libm::atan2f(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
}
