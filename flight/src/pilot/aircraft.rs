//! The interface between a pilot and the controller that flies.

use crate::planner::{Destination, PlanReport, VelocityCommand};
use crate::stack::{FlightRefusal, FlightStack};
use crate::supervisor::SupervisorStage;
use crate::{FlightState, Reference, Vec3};

/// The state of an aircraft that a pilot needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AircraftStatus {
    /// The state of the supervisor.
    pub stage: SupervisorStage,
    /// The estimated motion.
    pub state: FlightState,
    /// The reference of this moment; `None` without one.
    pub reference: Option<Reference>,
    /// Height in m of the center of mass before take-off.
    pub ground_m: f32,
    /// A landing has ended, and neither a stop of the motors nor another flight was commanded.
    pub has_landed: bool,
}

/// A controller that flies by commands: the [`FlightStack`], or a body that follows the references
/// of a planner.
pub trait Aircraft {
    /// Returns the state.
    fn status(&self) -> AircraftStatus;

    /// Arms; see [`FlightStack::arm`].
    ///
    /// # Errors
    /// Refuses unless the aircraft is ready.
    fn arm(&mut self) -> Result<(), FlightRefusal>;

    /// Takes off; see [`FlightStack::take_off`].
    ///
    /// # Errors
    /// Refuses an aircraft that is not armed or has no position, and what the planner refuses.
    fn take_off(
        &mut self,
        height_m: f32,
        duration_s: Option<f32>,
    ) -> Result<PlanReport, FlightRefusal>;

    /// Lands; see [`FlightStack::land`].
    ///
    /// # Errors
    /// Refuses an aircraft that does not fly, and what the planner refuses.
    fn land(&mut self, duration_s: Option<f32>) -> Result<PlanReport, FlightRefusal>;

    /// Flies to a point in the planner's shortest time; see [`FlightStack::go_to`].
    ///
    /// # Errors
    /// Refuses an aircraft that does not fly, and what the planner refuses.
    fn go_to(&mut self, destination: Destination) -> Result<PlanReport, FlightRefusal>;

    /// Follows a velocity; see [`FlightStack::fly`].
    fn fly(&mut self, velocity: &VelocityCommand);

    /// Takes the place of another robot in m; see [`FlightStack::hear_peer`].
    fn hear_peer(&mut self, position_m: Vec3);

    /// Takes a sign of life of the script.
    fn renew(&mut self);

    /// Stops the motors.
    fn stop(&mut self);

    /// Sets if a fault has stopped the script. Such an aircraft lands.
    fn set_script_fault(&mut self, has_fault: bool);
}

impl Aircraft for FlightStack {
    fn status(&self) -> AircraftStatus {
        AircraftStatus {
            stage: self.stage(),
            state: self.state(),
            reference: self.reference(),
            ground_m: self.ground_m(),
            has_landed: self.has_landed(),
        }
    }

    fn arm(&mut self) -> Result<(), FlightRefusal> {
        FlightStack::arm(self)
    }

    fn take_off(
        &mut self,
        height_m: f32,
        duration_s: Option<f32>,
    ) -> Result<PlanReport, FlightRefusal> {
        FlightStack::take_off(self, height_m, duration_s)
    }

    fn land(&mut self, duration_s: Option<f32>) -> Result<PlanReport, FlightRefusal> {
        FlightStack::land(self, duration_s)
    }

    fn go_to(&mut self, destination: Destination) -> Result<PlanReport, FlightRefusal> {
        FlightStack::go_to(self, destination, None)
    }

    fn fly(&mut self, velocity: &VelocityCommand) {
        FlightStack::fly(self, velocity);
    }

    fn hear_peer(&mut self, position_m: Vec3) {
        FlightStack::hear_peer(self, position_m);
    }

    fn renew(&mut self) {
        FlightStack::renew(self);
    }

    fn stop(&mut self) {
        FlightStack::stop(self);
    }

    fn set_script_fault(&mut self, has_fault: bool) {
        FlightStack::set_script_fault(self, has_fault);
    }
}
