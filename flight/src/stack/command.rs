//! Commands to the flight controller.
//!
//! Every command is a sign of life of the script. Without another one, or [`FlightStack::renew`],
//! for half a second the [supervisor](crate::supervisor) lands the robot, in spite of a plan that
//! takes longer.

use super::governor::HeldAttitude;
use super::{FlightStack, StackSettings, yaw_rad};
use crate::planner::{
    Destination, FlightLimits, PlanError, PlanReport, Planner, PositionFence, TrajectoryPiece,
    VelocityCommand,
};
use crate::supervisor::{Descent, LandingCause, SupervisorStage, SupervisorState};
use crate::{GRAVITY_M_S2, Reference};

/// Pieces of a trajectory that the flight controller can store.
pub const TRAJECTORY_PIECES: usize = 16;

/// Share of the thrust that plans use: a robot that climbs has 3 % less than its motors promise.
const PLANNED_SHARE: f32 = 0.97;
/// Acceleration in m/s² that plans leave to drag and to corrections of the path.
const RESERVE_M_S2: f32 = 0.2;

/// Height in m above that on the ground that a robot keeps until it lands.
pub(crate) const CLEARANCE_M: f32 = 0.05;

/// A reason why the flight controller refused a command. The command before stays in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlightRefusal {
    /// The supervisor's checks before arming fail, or the robot is armed already.
    NotReady,
    /// The robot is not armed on the ground.
    NotArmed,
    /// The robot does not fly by commands: it is on the ground, or lands by the supervisor.
    NotFlying,
    /// The robot does not know its position.
    NoPosition,
    /// A number is not finite.
    NotFinite,
    /// The planner refused the command.
    Plan(PlanError),
}

impl From<PlanError> for FlightRefusal {
    fn from(error: PlanError) -> Self {
        FlightRefusal::Plan(error)
    }
}

/// An attitude to hold and a vertical speed, as a pilot commands them. No position is needed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AttitudeCommand {
    /// Roll in radians. The tilt is limited to 0.5 and by the speed from which the robot stops before
    /// the fence, and changes by at most the planner's jerk.
    pub roll_rad: f32,
    /// Pitch in radians, limited as the roll.
    pub pitch_rad: f32,
    /// Rate of yaw in rad/s, limited as the planner's.
    pub yaw_rate_rad_s: f32,
    /// Vertical speed in m/s, limited as the planner's, and so that the robot stops before the fence
    /// and 5 cm above the ground.
    pub climb_m_s: f32,
}

/// The source of the motion that the controller follows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Guidance {
    /// No command came since power-on or the last stop.
    Absent,
    /// A velocity. `is_new` is true until the planner has it.
    Velocity { velocity: VelocityCommand, is_new: bool },
    /// The plan that the planner has.
    Plan,
    /// A reference of the caller.
    Reference(Reference),
    /// An attitude, with the part of it that the robot follows at present.
    Attitude { command: AttitudeCommand, held: HeldAttitude },
}

impl FlightStack {
    /// Arms a robot on the ground, whose script or pilot gave a sign of life; see
    /// [`FlightStack::renew`].
    ///
    /// # Errors
    /// Returns [`FlightRefusal::NotReady`] unless the robot is ready.
    pub fn arm(&mut self) -> Result<(), FlightRefusal> {
        if self.stage() != SupervisorStage::Ready {
            return Err(FlightRefusal::NotReady);
        }
        self.requests.arm = true;
        Ok(())
    }

    /// Disarms: stops the motors, in flight too.
    pub fn stop(&mut self) {
        self.desk.note_command();
        self.guidance = Guidance::Absent;
        self.command_ms = None;
        self.requests.disarm = true;
    }

    /// Stops the motors until the next power-on.
    pub fn emergency_stop(&mut self) {
        self.requests.emergency_stop = true;
    }

    /// Confirms that a robot that crashed is whole. The robot has to stand upright and still.
    pub fn recover(&mut self) {
        self.requests.recover = true;
    }

    /// Continues a flight that the supervisor ends only because no command came in time: the robot
    /// brakes and hovers, and flies by commands from the next tick on, unless it is on the ground.
    ///
    /// # Errors
    /// Refuses a robot that does not land, or lands for another cause.
    pub fn resume(&mut self) -> Result<(), FlightRefusal> {
        let SupervisorState::Landing {
            descent: Descent { cause: LandingCause::NoSetpoint, .. },
            ..
        } = self.supervisor.state()
        else {
            return Err(FlightRefusal::NotFlying);
        };
        self.requests.resume = true;
        self.fly(&VelocityCommand::STOP);
        Ok(())
    }

    /// Sets if the script ended by a fault and has not restarted. Such a robot lands.
    pub fn set_script_fault(&mut self, has_fault: bool) {
        self.has_script_fault = has_fault;
    }

    /// Changes the limits and the fence of motions from now on. A plan in force stays as it is, and the
    /// supervisor watches the new fence at once.
    ///
    /// # Errors
    /// Refuses a limit that is not finite or not positive.
    pub fn restrict(
        &mut self,
        limits: FlightLimits,
        fence: PositionFence,
    ) -> Result<(), FlightRefusal> {
        if let Some(planner) = &mut self.planner {
            planner.restrict(limits, fence)?;
        }
        self.settings.limits = limits;
        self.settings.fence = fence;
        Ok(())
    }

    /// Sets the voltages in mV below which the robot does not take off, and below which it lands.
    pub fn set_battery_limits(&mut self, low_mv: u16, empty_mv: u16) {
        let supervision = &mut self.settings.supervision;
        supervision.battery_low_mv = low_mv;
        supervision.battery_empty_mv = empty_mv;
    }

    /// Takes a sign of life of the script or pilot, so that the command in force does not expire.
    pub fn renew(&mut self) {
        self.command_ms = Some(self.now_ms());
    }

    /// Takes off from the ground to a height above it, in m, within a duration in seconds. The
    /// planner chooses the duration if there is none, or if it is too short.
    ///
    /// # Errors
    /// Refuses a robot that is not armed or that does not know its position, and what
    /// [`Planner::take_off`] refuses.
    pub fn take_off(
        &mut self,
        height_m: f32,
        duration_s: Option<f32>,
    ) -> Result<PlanReport, FlightRefusal> {
        if self.stage() != SupervisorStage::Armed {
            return Err(FlightRefusal::NotArmed);
        }
        let state = self.filter.state();
        if !self.has_position(&state) {
            return Err(FlightRefusal::NoPosition);
        }
        let now_s = self.now_s();
        let height_m = self.ground_m + height_m;
        let planner = self.able_planner()?;
        let report =
            planner.take_off(now_s, state.position_m, yaw_rad(&state), height_m, duration_s)?;
        self.desk.note_plan();
        self.guide(Guidance::Plan);
        Ok(report)
    }

    /// Lands below the point where the reference stops. The motors stop by themselves once the
    /// robot stands on the ground.
    ///
    /// # Errors
    /// Refuses a robot that does not fly, and what [`Planner::land`] refuses.
    pub fn land(&mut self, duration_s: Option<f32>) -> Result<PlanReport, FlightRefusal> {
        let ground_m = self.ground_m;
        self.plan_flight(|planner, now_s| planner.land(now_s, ground_m, duration_s))
    }

    /// Flies to a point and stops there; see [`Planner::go_to`].
    ///
    /// # Errors
    /// Refuses a robot that does not fly, and what the planner refuses.
    pub fn go_to(
        &mut self,
        destination: Destination,
        duration_s: Option<f32>,
    ) -> Result<PlanReport, FlightRefusal> {
        self.plan_flight(|planner, now_s| planner.go_to(now_s, destination, duration_s))
    }

    /// Brakes and hovers.
    ///
    /// # Errors
    /// Refuses a robot that does not fly.
    pub fn hover(&mut self) -> Result<PlanReport, FlightRefusal> {
        self.plan_flight(|planner, now_s| planner.hover(now_s))
    }

    /// Follows a trajectory of at most [`TRAJECTORY_PIECES`] pieces; see
    /// [`Planner::follow_trajectory`].
    ///
    /// # Errors
    /// Refuses a robot that does not fly, and what the planner refuses.
    pub fn follow_trajectory(
        &mut self,
        pieces: &[TrajectoryPiece],
        is_relative: bool,
    ) -> Result<PlanReport, FlightRefusal> {
        self.plan_flight(|planner, now_s| planner.follow_trajectory(now_s, pieces, is_relative))
    }

    /// Follows a velocity until the next command, for at most half a second. An armed robot on the
    /// ground takes off if the velocity leads upwards.
    ///
    /// A velocity that is not finite stops the robot in the air. If it were ignored, the command
    /// before it would not expire.
    pub fn fly(&mut self, velocity: &VelocityCommand) {
        let velocity = if velocity.is_finite() { velocity } else { &VelocityCommand::STOP };
        let is_known = matches!(
            self.guidance,
            Guidance::Velocity { velocity: known, is_new: false } if known == *velocity
        );
        self.guide(Guidance::Velocity { velocity: *velocity, is_new: !is_known });
    }

    /// Follows a reference of the caller until the next command, without a plan. A stream of references
    /// within the limits of the planner is followed exactly; toward others the robot flies within these
    /// limits and its fence.
    ///
    /// # Errors
    /// Refuses a robot that does not fly and a number that is not finite.
    pub fn track(&mut self, reference: &Reference) -> Result<(), FlightRefusal> {
        self.require_flight()?;
        let r = reference;
        let is_finite = r.position_m.is_finite()
            && r.velocity_m_s.is_finite()
            && r.acceleration_m_s2.is_finite()
            && r.jerk_m_s3.is_finite()
            && r.snap_m_s4.is_finite()
            && r.yaw_rad.is_finite()
            && r.yaw_rate_rad_s.is_finite();
        if !is_finite {
            return Err(FlightRefusal::NotFinite);
        }
        self.go_idle();
        self.desk.note_plan();
        self.guide(Guidance::Reference(*reference));
        Ok(())
    }

    /// Holds an attitude until the next command. An armed robot on the ground takes off if it
    /// shall climb; [`FlightStack::land`] lands it.
    ///
    /// # Errors
    /// Refuses a robot that is neither armed nor flies, and a number that is not finite.
    pub fn hold(&mut self, command: &AttitudeCommand) -> Result<(), FlightRefusal> {
        if self.stage() != SupervisorStage::Armed {
            self.require_flight()?;
        }
        let AttitudeCommand { roll_rad, pitch_rad, yaw_rate_rad_s, climb_m_s } = *command;
        let numbers = [roll_rad, pitch_rad, yaw_rate_rad_s, climb_m_s];
        if !numbers.iter().all(|number| number.is_finite()) {
            return Err(FlightRefusal::NotFinite);
        }
        let held = match self.guidance {
            Guidance::Attitude { held, .. } => held,
            _ => self.held(&self.filter.state()),
        };
        self.go_idle();
        self.desk.note_plan();
        self.guide(Guidance::Attitude { command: *command, held });
        Ok(())
    }

    /// Makes this the source of the motion.
    fn guide(&mut self, guidance: Guidance) {
        self.desk.note_command();
        self.guidance = guidance;
        self.renew();
    }

    /// Passes a command to the planner of a robot in flight.
    fn plan_flight(
        &mut self,
        command: impl FnOnce(&mut Planner<TRAJECTORY_PIECES>, f64) -> Result<PlanReport, PlanError>,
    ) -> Result<PlanReport, FlightRefusal> {
        self.require_flight()?;
        let state = self.filter.state();
        let now_s = self.now_s();
        self.start_in_air(&state, now_s)?;
        let report = command(self.able_planner()?, now_s)?;
        self.desk.note_plan();
        self.guide(Guidance::Plan);
        Ok(report)
    }

    /// Returns the planner, which plans with the thrust that the battery and the load leave.
    pub(super) fn able_planner(&mut self) -> Result<&mut Planner<TRAJECTORY_PIECES>, PlanError> {
        let spare_m_s2 = self.spare_acceleration_m_s2();
        let floor_m = self.ground_m + CLEARANCE_M;
        let planner = self.planner.as_mut().ok_or(PlanError::Limits)?;
        planner.limit_acceleration(spare_m_s2);
        planner.raise_floor(floor_m);
        Ok(planner)
    }

    /// Returns the upward acceleration in m/s² that a plan may ask for.
    fn spare_acceleration_m_s2(&self) -> f32 {
        let StackSettings { vehicle, gains, .. } = &self.settings;
        let motor_n = self.drive.available_thrust_n().min(vehicle.most_thrust_n);
        let lift_n = gains.most_lift_m_s2 * vehicle.mass_kg;
        let thrust_n = PLANNED_SHARE * (4.0 * motor_n).min(lift_n);
        GRAVITY_M_S2 * (thrust_n / self.controller.hover_thrust_n() - 1.0) - RESERVE_M_S2
    }

    fn require_flight(&self) -> Result<(), FlightRefusal> {
        let is_flying = self.stage() == SupervisorStage::Flying && !self.has_touched_down;
        if is_flying { Ok(()) } else { Err(FlightRefusal::NotFlying) }
    }
}
