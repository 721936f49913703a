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
//! The caller calls [`FlightStack::tick`] once per sample of the IMU, and passes other measurements on
//! when they arrive. Commands are velocities that expire: without a new one the
//! [supervisor](crate::supervisor) lands the robot.

use glam::Vec3;

use crate::calibration::{ImuCalibrator, ImuMonitor};
use crate::ekf::{Ekf, EkfConfig, EkfHealth, FlowMeasurement, PoseMeasurement};
use crate::filter::Butterworth;
use crate::geometric::{AttitudeTarget, GeometricController, GeometricSettings};
use crate::mixer::Mixer;
use crate::motor::RotorDrive;
use crate::planner::{FlightLimits, Planner, PositionFence, VelocityCommand};
use crate::supervisor::{
    MotorPermission, PilotRequests, RotorStatus, SetpointStatus, Supervisor, SupervisorInput,
    SupervisorLimits, SupervisorStage,
};
use crate::{FlightState, ImuSample, MotorDuties, MotorForces, Vehicle};

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
/// Height in m that a take-off by a velocity reaches at least.
const LIFT_OFF_M: f32 = 0.05;
/// Distance in m below the ground at which a landing aims, so that the feet touch it.
const GROUND_BELOW_M: f32 = 0.1;
/// Change of the thrust per vertical speed in 1/s, as a share of the mass, of a robot that levels out.
const LEVEL_DAMPING_1_S: f32 = 2.0;
/// Standard deviation in m of the distance to the ground at less than 2 m (crazyflie-firmware
/// 2a18fc29, `zranger2.c`).
const RANGE_SIGMA_M: f32 = 0.0025;

/// Parameters of the flight controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StackSettings {
    /// The robot.
    pub vehicle: Vehicle,
    /// Gains of the controller.
    pub gains: GeometricSettings,
    /// Parameters of the filter.
    pub filter: EkfConfig,
    /// Limits of planned motion.
    pub limits: FlightLimits,
    /// The box that planned motion does not leave.
    pub fence: PositionFence,
    /// Limits of the supervisor.
    pub supervision: SupervisorLimits,
}

impl StackSettings {
    /// A Crazyflie 2.1+ without a fence.
    pub const CRAZYFLIE_2_1_PLUS: Self = StackSettings {
        vehicle: Vehicle::CRAZYFLIE_2_1_PLUS,
        gains: GeometricSettings::CRAZYFLIE_2_1_PLUS,
        filter: EkfConfig::QUADROTOR,
        limits: FlightLimits::CRAZYFLIE,
        fence: PositionFence::WIDE,
        supervision: SupervisorLimits::CRAZYFLIE_2_1_PLUS,
    };
}

/// The last command, which expires.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TimedCommand {
    velocity: VelocityCommand,
    given_ms: u64,
    /// True until the planner has the command.
    is_new: bool,
}

/// The flight controller of one robot.
#[derive(Clone, Debug)]
pub struct FlightStack {
    settings: StackSettings,
    calibrator: ImuCalibrator,
    monitor: ImuMonitor,
    rate_filter: Option<Butterworth<Vec3>>,
    filter: Ekf,
    planner: Option<Planner<0>>,
    controller: GeometricController,
    mixer: Mixer,
    drive: RotorDrive,
    supervisor: Supervisor,
    permission: MotorPermission,
    requests: PilotRequests,
    command: Option<TimedCommand>,
    forces: MotorForces,
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
            command: None,
            forces: MotorForces::default(),
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

    /// Follows a velocity until the next command, for at most half a second. A robot on the ground
    /// arms and takes off if the velocity leads upwards.
    pub fn fly(&mut self, velocity: &VelocityCommand) {
        let is_known = self.command.is_some_and(|command| command.velocity == *velocity);
        let is_new = !is_known || self.command.is_some_and(|command| command.is_new);
        let given_ms = self.now_ms();
        self.command = Some(TimedCommand { velocity: *velocity, given_ms, is_new });
        self.requests.arm = velocity.velocity_m_s.z > 0.0;
    }

    /// Stops the motors, in flight too.
    pub fn stop(&mut self) {
        self.command = None;
        self.requests.arm = false;
        self.requests.disarm = true;
    }

    /// Takes a pose from outside. A robot on the ground accepts any place.
    pub fn receive_pose(&mut self, pose: &PoseMeasurement) {
        let outcome = self.filter.update_pose(pose);
        if !outcome.is_accepted() && !self.is_flying() && self.filter.health().is_lost {
            // A pose that is refused leaves the filter as it is.
            let _ = self.filter.adopt_pose(pose);
        }
    }

    /// Takes counts of the flow sensor.
    pub fn receive_flow(&mut self, flow: &FlowMeasurement) {
        // The outcome is part of the filter's health.
        let _ = self.filter.update_flow(flow);
    }

    /// Takes a distance to the ground in m.
    pub fn receive_range(&mut self, range_m: f32) {
        let _ = self.filter.update_range(range_m, RANGE_SIGMA_M);
    }

    /// Returns the estimated state.
    #[must_use]
    pub fn state(&self) -> FlightState {
        self.filter.state()
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
        self.drive.measure_battery(battery_v, TICK_S);
        let state = self.control_state();
        let input = SupervisorInput {
            requests: self.requests,
            imu: watched.map(|()| self.last_sample),
            is_calibrated: self.calibrator.calibration().is_some(),
            up_z: (state.attitude * Vec3::Z).z,
            height_m: state.position_m.z - self.ground_m,
            vertical_speed_m_s: state.velocity_m_s.z,
            is_position_valid: self.filter.health().is_position_valid,
            fence_excursion_m: self.fence_excursion_m(state.position_m),
            setpoint: self.setpoint(),
            has_script_fault: false,
            thrust_n: self.forces.0.iter().sum(),
            rotors: RotorStatus::NotMeasured,
            battery_mv: (battery_v * 1000.0) as u16,
        };
        self.requests.disarm = false;
        let conditions = self.settings.supervision.recognize(&input);
        let output = self.supervisor.step(TICK_MS, &conditions);
        if output.permission != self.permission {
            self.change(output.permission);
        }
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

    fn now_ms(&self) -> u64 {
        self.ticks * u64::from(TICK_MS)
    }

    fn now_s(&self) -> f64 {
        self.ticks as f64 / f64::from(SAMPLE_RATE_HZ)
    }

    fn is_flying(&self) -> bool {
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

    fn setpoint(&self) -> Option<SetpointStatus> {
        let command = self.command?;
        let age_ms = u32::try_from(self.now_ms() - command.given_ms).unwrap_or(u32::MAX);
        Some(SetpointStatus { age_ms, needs_position: true })
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

    /// Reacts to another permission.
    fn change(&mut self, permission: MotorPermission) {
        let before = core::mem::replace(&mut self.permission, permission);
        let now_s = self.now_s();
        match permission {
            MotorPermission::Off | MotorPermission::Level => self.go_idle(),
            MotorPermission::Idle if before == MotorPermission::Off => {
                self.controller.reset();
                self.ground_m = self.filter.state().position_m.z;
            }
            MotorPermission::Idle | MotorPermission::Follow => {}
            MotorPermission::Descend => {
                let ground_m = self.ground_m - GROUND_BELOW_M;
                if let Some(planner) = &mut self.planner {
                    // A planner that is idle has no plan to land from; the robot stays level.
                    let _ = planner.land(now_s, ground_m, None);
                }
            }
        }
        if permission == MotorPermission::Follow
            && let Some(command) = &mut self.command
        {
            command.is_new = true;
        }
    }

    /// Passes a new command to the planner.
    fn plan(&mut self, state: &FlightState) {
        let now_s = self.now_s();
        let (Some(planner), Some(command)) = (&mut self.planner, &mut self.command) else { return };
        if !command.is_new {
            return;
        }
        let velocity = command.velocity;
        if planner.is_idle() {
            if velocity.velocity_m_s.z <= 0.0 {
                return;
            }
            let target = AttitudeTarget::level(state, 0.0);
            let (yaw_rad, _, _) = target.attitude.to_euler(glam::EulerRot::ZYX);
            let height_m = state.position_m.z + LIFT_OFF_M;
            if planner.take_off(now_s, state.position_m, yaw_rad, height_m, None).is_err() {
                return;
            }
        }
        command.is_new = planner.follow_velocity(now_s, velocity).is_err();
    }

    /// Computes the forces of the motors.
    fn control(&mut self, state: &FlightState) {
        let dt_s = TICK_S * CONTROL_TICKS as f32;
        if self.permission == MotorPermission::Follow {
            self.plan(state);
        }
        let now_s = self.now_s();
        let reference = self.planner.as_mut().and_then(|planner| planner.reference(now_s));
        let wrench = match (self.permission, reference) {
            (MotorPermission::Off | MotorPermission::Idle, _) | (MotorPermission::Follow, None) => {
                self.forces = MotorForces::default();
                return;
            }
            (MotorPermission::Follow | MotorPermission::Descend, Some(reference)) => {
                self.controller.update(state, &reference, dt_s)
            }
            (MotorPermission::Level | MotorPermission::Descend, _) => {
                let damping = LEVEL_DAMPING_1_S * state.velocity_m_s.z;
                let hover_n = self.controller.hover_thrust_n();
                let thrust_n = (hover_n - self.settings.vehicle.mass_kg * damping).max(0.0);
                let target = AttitudeTarget::level(state, thrust_n);
                self.controller.hold_attitude(state, &target, dt_s)
            }
        };
        let outcome = self.mixer.mix(&wrench);
        self.controller.note_mixing(&outcome);
        self.forces = outcome.forces;
    }
}
