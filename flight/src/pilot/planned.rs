//! An aircraft without a controller: a planner whose references a body follows.
//!
//! The kinematic body of the simulator follows these references, so its flights have the shape and
//! the duration of those of the [`FlightStack`](crate::stack::FlightStack).

use glam::{Quat, Vec3};

use super::{Aircraft, AircraftStatus};
use crate::planner::{
    Destination, FlightLimits, PlanError, PlanReport, Planner, PositionFence, VelocityCommand,
    wrapped,
};
use crate::stack::CLEARANCE_M;
use crate::stack::FlightRefusal;
use crate::supervisor::SupervisorStage;
use crate::{FlightState, Reference};

/// Height in m to which a planner without a plan climbs at least, and from which on a robot that
/// lands is on the ground.
const LIFT_OFF_M: f32 = 0.05;
const TOUCHDOWN_M: f32 = 0.01;
/// Time in seconds after a plan to land in which the robot reaches the ground, and the speed in m/s
/// at which it sinks then.
const SETTLE_S: f64 = 0.5;
const SETTLE_M_S: f32 = 0.1;
/// Distance in m between robot and reference from which on somebody has moved the robot.
const MOVED_M: f32 = 1.0;
/// Velocity per distance from the reference in 1/s, and rate of turn per error of the yaw in 1/s.
const FOLLOW_1_S: f32 = 1.0;
const TURN_1_S: f32 = 2.0;

/// A velocity that a body without a controller follows.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyVelocity {
    /// Velocity in the world frame in m/s.
    pub velocity_m_s: Vec3,
    /// Rate of yaw in rad/s.
    pub yaw_rate_rad_s: f32,
}

/// An aircraft whose motion is that of a planner.
#[derive(Clone, Debug)]
pub struct PlannedAircraft {
    planner: Planner<1>,
    stage: SupervisorStage,
    now_s: f64,
    state: FlightState,
    has_position: bool,
    reference: Option<Reference>,
    /// Time in seconds at which the plan to land ended.
    settling_s: Option<f64>,
    has_landed: bool,
    has_script_fault: bool,
}

impl PlannedAircraft {
    /// Returns an aircraft that stands on the ground at z = 0.
    ///
    /// # Errors
    /// Returns [`PlanError::Limits`] if a limit is not finite or not positive.
    pub fn new(limits: FlightLimits) -> Result<Self, PlanError> {
        let mut planner = Planner::new(limits, PositionFence::WIDE)?;
        planner.raise_floor(CLEARANCE_M);
        Ok(PlannedAircraft {
            planner,
            stage: SupervisorStage::Ready,
            now_s: 0.0,
            state: FlightState::default(),
            has_position: false,
            reference: None,
            settling_s: None,
            has_landed: false,
            has_script_fault: false,
        })
    }

    /// Takes the time and the estimated position and yaw, if they are known.
    pub fn sense(&mut self, now_ms: u64, estimate: Option<(Vec3, f32)>) {
        let before_s = core::mem::replace(&mut self.now_s, now_ms as f64 / 1000.0);
        self.has_position = estimate.is_some();
        if let Some((position_m, yaw_rad)) = estimate {
            self.state.position_m = position_m;
            self.state.attitude = Quat::from_rotation_z(yaw_rad);
        }
        self.reference = self.planner.reference(self.now_s);
        let Some(reference) = self.reference else { return };
        if self.has_position && reference.position_m.distance(self.state.position_m) > MOVED_M {
            self.lose_plan();
            return;
        }
        self.settle(before_s);
    }

    /// Returns the velocity that a body commands until the next call, so that it is at the
    /// reference, `None` with its motors off. The velocity of the body follows a command as a lag
    /// of first order, and commands last for `period_s`.
    pub fn steer(&mut self, lag_s: f32, period_s: f32) -> Option<BodyVelocity> {
        if !matches!(self.stage, SupervisorStage::Flying | SupervisorStage::Landing) {
            return None;
        }
        // Halfway to the next command.
        let Some(next) = self.planner.reference(self.now_s + f64::from(period_s) / 2.0) else {
            self.state.velocity_m_s = Vec3::ZERO;
            return Some(BodyVelocity::default());
        };
        self.state.velocity_m_s = next.velocity_m_s;
        let mut velocity_m_s = next.velocity_m_s + next.acceleration_m_s2 * lag_s;
        let mut yaw_rate_rad_s = next.yaw_rate_rad_s;
        if let (Some(reference), true) = (self.reference, self.has_position) {
            velocity_m_s += (reference.position_m - self.state.position_m) * FOLLOW_1_S;
            yaw_rate_rad_s += wrapped(reference.yaw_rad - self.yaw_rad()) * TURN_1_S;
        }
        if self.settling_s.is_some() {
            velocity_m_s.z = -SETTLE_M_S;
        }
        Some(BodyVelocity { velocity_m_s, yaw_rate_rad_s })
    }

    /// Ends a landing once the robot is on the ground.
    fn settle(&mut self, before_s: f64) {
        if !(self.planner.is_landing() && self.planner.is_done()) {
            self.settling_s = None;
            return;
        }
        let since_s = *self.settling_s.get_or_insert(before_s);
        let is_down = self.has_position && self.state.position_m.z < TOUCHDOWN_M;
        if is_down || self.now_s - since_s >= SETTLE_S {
            self.lose_plan();
            self.has_landed = true;
            if self.stage == SupervisorStage::Landing {
                self.stage = SupervisorStage::Landed;
            }
        }
    }

    fn lose_plan(&mut self) {
        self.planner.go_idle();
        self.reference = None;
        self.settling_s = None;
    }

    fn yaw_rad(&self) -> f32 {
        let ahead = self.state.attitude * Vec3::X;
        libm::atan2f(ahead.y, ahead.x)
    }

    /// Starts the planner of a robot in the air that has no plan, at rest where the robot is.
    fn start_in_air(&mut self) -> Result<(), FlightRefusal> {
        if self.stage != SupervisorStage::Flying || self.has_landed {
            return Err(FlightRefusal::NotFlying);
        }
        if self.planner.is_idle() {
            let (start_m, yaw_rad) = (self.state.position_m, self.yaw_rad());
            let height_m = start_m.z + LIFT_OFF_M;
            self.planner.take_off(self.now_s, start_m, yaw_rad, height_m, None)?;
        }
        Ok(())
    }
}

impl Aircraft for PlannedAircraft {
    fn status(&self) -> AircraftStatus {
        let (stage, state, reference) = (self.stage, self.state, self.reference);
        AircraftStatus { stage, state, reference, ground_m: 0.0, has_landed: self.has_landed }
    }

    fn arm(&mut self) -> Result<(), FlightRefusal> {
        if self.stage != SupervisorStage::Ready {
            return Err(FlightRefusal::NotReady);
        }
        self.stage = SupervisorStage::Armed;
        Ok(())
    }

    fn take_off(
        &mut self,
        height_m: f32,
        duration_s: Option<f32>,
    ) -> Result<PlanReport, FlightRefusal> {
        if self.stage != SupervisorStage::Armed {
            return Err(FlightRefusal::NotArmed);
        }
        if !self.has_position {
            return Err(FlightRefusal::NoPosition);
        }
        let start_m = self.state.position_m.with_z(0.0);
        let yaw_rad = self.yaw_rad();
        let report = self.planner.take_off(self.now_s, start_m, yaw_rad, height_m, duration_s)?;
        self.reference = self.planner.reference(self.now_s);
        self.stage = SupervisorStage::Flying;
        self.has_landed = false;
        Ok(report)
    }

    fn land(&mut self, duration_s: Option<f32>) -> Result<PlanReport, FlightRefusal> {
        self.start_in_air()?;
        Ok(self.planner.land(self.now_s, 0.0, duration_s)?)
    }

    fn go_to(&mut self, destination: Destination) -> Result<PlanReport, FlightRefusal> {
        self.start_in_air()?;
        Ok(self.planner.go_to(self.now_s, destination, None)?)
    }

    fn fly(&mut self, velocity: &VelocityCommand) {
        let velocity = if velocity.is_finite() { *velocity } else { VelocityCommand::STOP };
        // A velocity moves only a robot that flies.
        if self.start_in_air().is_ok() {
            let _ = self.planner.follow_velocity(self.now_s, velocity);
        }
    }

    /// Does nothing: its places come from the simulator and belong to no other robot.
    fn hear_peer(&mut self, _: Vec3) {}

    fn renew(&mut self) {}

    fn stop(&mut self) {
        self.lose_plan();
        self.state.velocity_m_s = Vec3::ZERO;
        self.has_landed = false;
        self.stage = SupervisorStage::Ready;
    }

    fn set_script_fault(&mut self, has_fault: bool) {
        let is_new = has_fault && !self.has_script_fault;
        self.has_script_fault = has_fault;
        if is_new && self.start_in_air().is_ok() {
            // A planner that lands already goes on.
            let _ = self.planner.land(self.now_s, 0.0, None);
            self.stage = SupervisorStage::Landing;
        }
    }
}
