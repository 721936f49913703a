//! Plans of a station: port 8.

use bittybuzz_crtp::{Height, HighLevelCommand, Pace, Parameter, StoredTrajectory, VerticalFlight};
use bittybuzz_flight::Vec3;
use bittybuzz_flight::arbiter::{CommandSource, Passage, StationCommand};
use bittybuzz_flight::planner::{Destination, PlanError, TrajectoryPiece};
use bittybuzz_flight::stack::{FlightRefusal, FlightStack, TRAJECTORY_PIECES};
use bittybuzz_flight::supervisor::SupervisorStage;
use heapless::Vec;

use super::{Outcome, Station, Waiting, outcome, resume};

/// The factors of the durations of a trajectory that are tried one after the other: one that is too fast
/// for the limits is flown slower, while Bitcraze's firmware would not follow it exactly.
const SLOWDOWNS: [f32; 5] = [1.0, 1.4, 2.0, 2.8, 4.0];

/// Time in ms for which a plan waits until the motion before it has ended: a take-off may take longer
/// than its command says, and programs start the trajectory after that.
const WAIT_MS: u64 = 3000;
/// Speed of the reference in m/s and acceleration in m/s² below which the robot is at rest.
const REST_M_S: f32 = 0.005;
const REST_M_S2: f32 = 0.02;

type Pieces = Vec<TrajectoryPiece, TRAJECTORY_PIECES>;

/// A vertical flight upwards, in m and seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rise {
    height: Height,
    /// `None` leaves it to the planner.
    duration_s: Option<f32>,
}

impl Station {
    /// Executes a command to plan.
    pub(super) fn plan(
        &mut self,
        command: &HighLevelCommand,
        stack: &mut FlightStack,
        now_ms: u64,
    ) -> Outcome {
        let stage = stack.stage();
        let is_landing =
            self.arbiter.poll(stage, now_ms).source == CommandSource::Landing && stack.is_flying();
        let kind = match command {
            // Programs land for two seconds and then stop, and this robot may take longer to land.
            HighLevelCommand::Stop if is_landing => return Outcome::Done,
            HighLevelCommand::Stop => StationCommand::Stop,
            HighLevelCommand::Land(_) => StationCommand::Land,
            _ => StationCommand::Plan,
        };
        let passage = match self.arbiter.pass_station(kind, stage, now_ms) {
            Ok(passage) => passage,
            Err(block) => return Outcome::Blocked(block),
        };
        self.waiting = None;
        if kind == StationCommand::Plan {
            self.grounding_ms = None;
        }
        if passage == Passage::Resume {
            let outcome = resume(stack);
            if outcome == Outcome::Done {
                self.waiting = Some(Waiting { command: *command, until_ms: now_ms + WAIT_MS });
            }
            return outcome;
        }
        match *command {
            HighLevelCommand::StartTrajectory { .. } if !is_at_rest(stack) => {
                let until_ms = now_ms + WAIT_MS;
                self.waiting = Some(Waiting { command: *command, until_ms });
                Outcome::Done
            }
            HighLevelCommand::Stop => self.stop(stack, now_ms),
            HighLevelCommand::Land(flight) => {
                if passage == Passage::Execute {
                    self.land(&flight, stack)
                } else {
                    Outcome::Done
                }
            }
            HighLevelCommand::TakeOff(flight) => {
                let rise = self.rise_of(&flight, stack);
                match stage {
                    SupervisorStage::Flying => self.change_height(&flight, stack),
                    SupervisorStage::Armed => self.rise(rise, stack, now_ms),
                    _ => self.start(rise, stack, now_ms),
                }
            }
            HighLevelCommand::GoTo { position_m, yaw_rad, duration_s, is_relative, .. } => {
                let position_m = Vec3::from_array(position_m);
                let destination = if is_relative {
                    Destination::Relative { displacement_m: position_m, turn_rad: yaw_rad }
                } else {
                    Destination::Absolute { position_m, yaw_rad: Some(yaw_rad) }
                };
                // A duration of 0 asks for the shortest.
                let duration_s = Some(duration_s).filter(|duration_s| *duration_s > 0.0);
                outcome(stack.go_to(destination, duration_s))
            }
            HighLevelCommand::StartTrajectory {
                trajectory,
                time_scale,
                is_position_relative,
                is_yaw_relative: false,
                is_reversed: false,
            } => {
                for slowdown in SLOWDOWNS {
                    let time_scale = time_scale * slowdown;
                    match self.pieces(&trajectory, time_scale) {
                        None => return Outcome::Refused,
                        Some(pieces) => {
                            match stack.follow_trajectory(&pieces, is_position_relative) {
                                Err(FlightRefusal::Plan(PlanError::Piece { .. })) => {}
                                result => return outcome(result),
                            }
                        }
                    }
                }
                Outcome::Refused
            }
            // The planner has no arcs, and follows pieces only forwards and in the frame of the world.
            HighLevelCommand::Spiral { .. } | HighLevelCommand::StartTrajectory { .. } => {
                Outcome::Refused
            }
        }
    }

    /// Takes off from the ground with motors that idle.
    pub(super) fn rise(&mut self, rise: Rise, stack: &mut FlightStack, now_ms: u64) -> Outcome {
        let stage = stack.stage();
        if let Err(block) = self.arbiter.pass_station(StationCommand::Plan, stage, now_ms) {
            return Outcome::Blocked(block);
        }
        let height_m = match rise.height {
            Height::Absolute(height_m) => height_m - stack.ground_m(),
            Height::Above(height_m) => height_m,
        };
        outcome(stack.take_off(height_m, rise.duration_s))
    }

    fn rise_of(&self, flight: &VerticalFlight, stack: &FlightStack) -> Rise {
        let way_m = way_m(flight, stack);
        let duration_s = self.duration_s(flight.pace, Parameter::HlCommanderVtoff, way_m);
        Rise { height: flight.height, duration_s }
    }

    /// Flies straight up or down to the height of a take-off, in flight.
    fn change_height(&self, flight: &VerticalFlight, stack: &mut FlightStack) -> Outcome {
        let way_m = way_m(flight, stack);
        let duration_s = self.duration_s(flight.pace, Parameter::HlCommanderVtoff, way_m);
        let displacement_m = Vec3::Z * way_m;
        let destination = Destination::Relative { displacement_m, turn_rad: 0.0 };
        outcome(stack.go_to(destination, duration_s))
    }

    /// Lands on the ground, whatever the height of the command.
    fn land(&self, flight: &VerticalFlight, stack: &mut FlightStack) -> Outcome {
        let way_m = stack.state().position_m.z - stack.ground_m();
        let duration_s = self.duration_s(flight.pace, Parameter::HlCommanderVland, way_m);
        let result = stack.land(duration_s);
        // A landing does not fail for its duration.
        outcome(result.or_else(|_| stack.land(None)))
    }

    fn duration_s(&self, pace: Pace, speed: Parameter, way_m: f32) -> Option<f32> {
        let duration_s = match pace {
            Pace::DurationS(duration_s) => duration_s,
            Pace::SpeedMS(speed_m_s) => way_m.abs() / speed_m_s,
            Pace::Default => way_m.abs() / self.parameters().get(speed).as_f32(),
        };
        Some(duration_s).filter(|duration_s| *duration_s > 0.0)
    }

    /// Returns the pieces of a trajectory whose durations are multiplied by `time_scale`; `None` if one is
    /// not valid.
    fn pieces(&self, trajectory: &StoredTrajectory, time_scale: f32) -> Option<Pieces> {
        let mut pieces = Pieces::new();
        for number in 0..trajectory.len() {
            let piece = self.ports.trajectory_piece(trajectory, number).ok()?;
            let (mut position, mut yaw, mut scale) = (piece.position, piece.yaw, 1.0);
            for (coefficients, turn) in position.iter_mut().zip(&mut yaw) {
                coefficients.iter_mut().for_each(|coefficient| *coefficient *= scale);
                *turn *= scale;
                scale /= time_scale;
            }
            let position = position.map(Vec3::from_array);
            pieces
                .push(TrajectoryPiece::new(piece.duration_s * time_scale, position, yaw)?)
                .ok()?;
        }
        Some(pieces)
    }
}

/// Returns true if the reference is at rest.
pub(super) fn is_at_rest(stack: &FlightStack) -> bool {
    stack.reference().is_none_or(|reference| {
        reference.velocity_m_s.length() < REST_M_S
            && reference.acceleration_m_s2.length() < REST_M_S2
    })
}

/// Returns the way up in m.
fn way_m(flight: &VerticalFlight, stack: &FlightStack) -> f32 {
    match flight.height {
        Height::Absolute(height_m) => height_m - stack.state().position_m.z,
        Height::Above(height_m) => height_m,
    }
}
