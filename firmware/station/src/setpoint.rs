//! Set-points of a station: ports 3 and 7.

use bittybuzz_crtp::{FullState, Setpoint, ThrustSetpoint, Tilt, Vertical};
use bittybuzz_flight::arbiter::{Passage, SETPOINT_FRESH_MS, StationCommand};
use bittybuzz_flight::planner::{VelocityCommand, VelocityFrame};
use bittybuzz_flight::stack::{AttitudeCommand, FlightStack};
use bittybuzz_flight::supervisor::SupervisorStage;
use bittybuzz_flight::{Quat, Reference, Vec3};

use super::{Outcome, Station, outcome, resume};

/// Vertical speed per difference of height in 1/s, as of the script's pilot, and the most in m/s.
const CLIMB_1_S: f32 = 2.0;
const CLIMB_M_S: f32 = 0.5;
/// Vertical speed in m/s until the robot has left the ground.
const LIFT_M_S: f32 = 0.3;
/// Height in m above the ground that a set-point must exceed to start the robot.
const LIFT_M: f32 = 0.08;
/// Height in m above the ground from which down a set-point leads to the ground: robots that follow
/// set-points stay that high.
const GROUND_M: f32 = 0.05;
/// Time in seconds for which a set-point holds.
const HOLD_S: f32 = SETPOINT_FRESH_MS as f32 / 1000.0;
/// Time in ms that a landing may take longer than planned until a stop takes effect.
const LANDING_SPARE_MS: f32 = 3000.0;
/// The thrust that keeps the height, and its distance from the greatest: as Bitcraze's firmware in its
/// mode that holds the height (crtp_commander_rpyt.c).
const HOVER_THRUST: f32 = 32_767.0;

impl Station {
    /// Follows a set-point.
    pub(super) fn follow(
        &mut self,
        setpoint: &Setpoint,
        stack: &mut FlightStack,
        now_ms: u64,
    ) -> Outcome {
        let kind = match setpoint {
            Setpoint::Stop => return self.stop(stack, now_ms),
            Setpoint::Thrust(thrust) => StationCommand::Thrust { is_zero: thrust.thrust == 0 },
            _ => StationCommand::Setpoint,
        };
        let stage = stack.stage();
        match self.arbiter.pass_station(kind, stage, now_ms) {
            Err(block) => return Outcome::Blocked(block),
            Ok(Passage::Execute | Passage::Resume) => {}
            Ok(Passage::Ignore | Passage::Hover) => return Outcome::Done,
        }
        self.start = None;
        self.waiting = None;
        self.grounding_ms = leads_to_ground(setpoint, stack).then_some(now_ms);
        let climb_m_s = climb_m_s(setpoint, stack);
        match stage {
            SupervisorStage::Flying => apply(setpoint, climb_m_s, stack),
            // A set-point that comes late continues the flight; those that follow find the robot flying.
            SupervisorStage::LevelOut => {
                stack.fly(&VelocityCommand::STOP);
                Outcome::Done
            }
            SupervisorStage::Landing => resume(stack),
            _ if climb_m_s <= CLIMB_1_S * LIFT_M => Outcome::Done,
            _ if !self.may_start(now_ms) => Outcome::Refused,
            SupervisorStage::Armed => lift(setpoint, stack),
            // The set-points that follow find the motors idling.
            SupervisorStage::Ready => outcome(stack.arm()),
            _ => Outcome::Done,
        }
    }

    /// Turns the motors off. A robot whose set-points led to the ground just before lands first: it
    /// follows them late, so that it would fall from a height of up to 0.7 m. cflib's MotionCommander
    /// sends the stop together with its last height.
    pub(super) fn stop(&mut self, stack: &mut FlightStack, now_ms: u64) -> Outcome {
        if self.stop_due_ms.is_some() {
            return Outcome::Done;
        }
        let stage = stack.stage();
        let is_grounding = self
            .grounding_ms
            .is_some_and(|last_ms| now_ms.saturating_sub(last_ms) <= SETPOINT_FRESH_MS);
        if is_grounding
            && self.arbiter.pass_station(StationCommand::Land, stage, now_ms).is_ok()
            && let Ok(report) = stack.land(None)
        {
            let patience_ms = 1000.0 * report.duration_s + LANDING_SPARE_MS;
            self.stop_due_ms = Some(now_ms + patience_ms as u64);
            return Outcome::Done;
        }
        if let Err(block) = self.arbiter.pass_station(StationCommand::Stop, stage, now_ms) {
            return Outcome::Blocked(block);
        }
        self.start = None;
        self.waiting = None;
        stack.stop();
        Outcome::Done
    }
}

/// Returns true if a set-point leads to the ground while it holds. Those of sticks do not count: a
/// pilot who stops means it.
fn leads_to_ground(setpoint: &Setpoint, stack: &FlightStack) -> bool {
    let after = |climb_m_s: f32| stack.state().position_m.z + HOLD_S * climb_m_s;
    let height_m = match *setpoint {
        Setpoint::Stop | Setpoint::Thrust(_) => return false,
        Setpoint::Attitude { vertical: Vertical::HeightM(height_m), .. }
        | Setpoint::Hover { height_m, .. }
        | Setpoint::FullState(FullState { position_m: [_, _, height_m], .. })
        | Setpoint::Position { position_m: [_, _, height_m], .. } => height_m,
        Setpoint::Velocity { velocity_m_s: [_, _, climb_m_s], .. }
        | Setpoint::Attitude { vertical: Vertical::SpeedMS(climb_m_s), .. } => after(climb_m_s),
    };
    height_m <= stack.ground_m() + GROUND_M
}

/// Returns the vertical speed in m/s to which a set-point leads.
fn climb_m_s(setpoint: &Setpoint, stack: &FlightStack) -> f32 {
    let to = |height_m: f32| {
        (CLIMB_1_S * (height_m - stack.state().position_m.z)).clamp(-CLIMB_M_S, CLIMB_M_S)
    };
    match *setpoint {
        Setpoint::Stop => 0.0,
        Setpoint::Thrust(ThrustSetpoint { thrust, .. }) => {
            CLIMB_M_S * (f32::from(thrust) - HOVER_THRUST) / HOVER_THRUST
        }
        Setpoint::Velocity { velocity_m_s: [_, _, climb_m_s], .. } => climb_m_s,
        Setpoint::Attitude { vertical: Vertical::SpeedMS(climb_m_s), .. } => climb_m_s,
        Setpoint::Attitude { vertical: Vertical::HeightM(height_m), .. }
        | Setpoint::Hover { height_m, .. } => to(height_m),
        Setpoint::FullState(FullState { position_m: [_, _, height_m], .. })
        | Setpoint::Position { position_m: [_, _, height_m], .. } => to(height_m),
    }
}

/// Leaves the ground, straight up.
fn lift(setpoint: &Setpoint, stack: &mut FlightStack) -> Outcome {
    match setpoint {
        Setpoint::Thrust(_) | Setpoint::Attitude { .. } => outcome(
            stack.hold(&AttitudeCommand { climb_m_s: LIFT_M_S, ..AttitudeCommand::default() }),
        ),
        _ => {
            let velocity_m_s = Vec3::Z * LIFT_M_S;
            stack.fly(&VelocityCommand { velocity_m_s, ..VelocityCommand::STOP });
            Outcome::Done
        }
    }
}

/// Follows a set-point in flight.
fn apply(setpoint: &Setpoint, climb_m_s: f32, stack: &mut FlightStack) -> Outcome {
    match *setpoint {
        Setpoint::Stop => Outcome::Done,
        // A pilot who takes the thrust away wants the robot on the ground.
        Setpoint::Thrust(ThrustSetpoint { thrust: 0, .. }) => outcome(stack.land(None)),
        // The flight controller holds angles only.
        Setpoint::Thrust(ThrustSetpoint { tilt: Tilt::Rate { .. }, .. }) => Outcome::Refused,
        Setpoint::Thrust(ThrustSetpoint {
            tilt: Tilt::Angle { roll_rad, pitch_rad },
            yaw_rate_rad_s,
            ..
        })
        | Setpoint::Attitude { roll_rad, pitch_rad, yaw_rate_rad_s, .. } => {
            outcome(stack.hold(&AttitudeCommand { roll_rad, pitch_rad, yaw_rate_rad_s, climb_m_s }))
        }
        Setpoint::Velocity { velocity_m_s, yaw_rate_rad_s } => {
            let velocity_m_s = Vec3::from_array(velocity_m_s);
            let frame = VelocityFrame::World;
            stack.fly(&VelocityCommand { frame, velocity_m_s, yaw_rate_rad_s });
            Outcome::Done
        }
        Setpoint::Hover { ahead_m_s, left_m_s, yaw_rate_rad_s, .. } => {
            let velocity_m_s = Vec3::new(ahead_m_s, left_m_s, climb_m_s);
            let frame = VelocityFrame::Yaw;
            stack.fly(&VelocityCommand { frame, velocity_m_s, yaw_rate_rad_s });
            Outcome::Done
        }
        Setpoint::FullState(ref state) => {
            let [x, y, z, w] = state.quaternion;
            let [_, _, yaw_rate_rad_s] = state.rates_rad_s;
            outcome(stack.track(&Reference {
                position_m: Vec3::from_array(state.position_m),
                velocity_m_s: Vec3::from_array(state.velocity_m_s),
                acceleration_m_s2: Vec3::from_array(state.acceleration_m_s2),
                yaw_rad: yaw_rad(Quat::from_xyzw(x, y, z, w)),
                yaw_rate_rad_s,
                ..Reference::default()
            }))
        }
        Setpoint::Position { position_m, yaw_rad } => {
            let position_m = Vec3::from_array(position_m);
            outcome(stack.track(&Reference { position_m, yaw_rad, ..Reference::default() }))
        }
    }
}

/// Returns the direction of the nose on the ground in radians.
fn yaw_rad(attitude: Quat) -> f32 {
    let ahead = attitude * Vec3::X;
    libm::atan2f(ahead.y, ahead.x)
}
