//! From the command in force to the forces of the motors.

use glam::{Quat, Vec3};

use super::command::Guidance;
use super::governor::{Governor, HeldAttitude};
use super::{AttitudeCommand, CONTROL_TICKS, FlightStack, TICK_MS, TICK_S, yaw_rad};
use crate::blind::BlindDescent;
use crate::geometric::AttitudeTarget;
use crate::planner::{PlanError, wrapped};
use crate::supervisor::{MotorPermission, SupervisorStage};
use crate::{FlightState, GRAVITY_M_S2, MotorForces, Reference, Wrench};

/// Height in m that a take-off by a velocity reaches at least.
const LIFT_OFF_M: f32 = 0.05;
/// Change of the thrust per error of the vertical speed in 1/s, as a share of the mass, of a robot
/// that holds an attitude.
const CLIMB_GAIN_1_S: f32 = 4.0;
/// Change per second of the thrust that keeps the height, per error of the vertical speed.
const CLIMB_INTEGRAL_1_S2: f32 = 3.0;
/// Speed in m/s at which the reference sinks after a landing, until the robot stands. The
/// supervisor's limit for a robot on the ground is 0.1 m/s.
const SETTLE_M_S: f32 = 0.08;
/// Thrust as a share of the weight below which a robot stands that does not sink. The ground
/// effect adds at most 4/15 to the thrust (gym-pybullet-drones 90b178a), so 79 % of the weight float.
const STANDING_SHARE: f32 = 0.65;
/// Height in m below which, and vertical speed in m/s below which, a landing robot may stand.
const GROUND_HEIGHT_M: f32 = 0.05;
const GROUND_SPEED_M_S: f32 = 0.04;
/// Time in ms for which a landing robot has to stand there until its motors stop.
const TOUCHDOWN_MS: u32 = 300;

impl FlightStack {
    /// Starts the planner of a robot that has no plan: from its motion in the air, else with a take-off.
    pub(super) fn start_in_air(
        &mut self,
        state: &FlightState,
        now_s: f64,
    ) -> Result<(), PlanError> {
        let (is_in_air, present) = (self.is_flying(), self.present(state));
        let planner = self.planner.as_mut().ok_or(PlanError::Limits)?;
        if planner.is_idle() && is_in_air {
            planner.catch(now_s, &present)?;
        } else if planner.is_idle() {
            let height_m = state.position_m.z + LIFT_OFF_M;
            planner.take_off(now_s, state.position_m, yaw_rad(state), height_m, None)?;
        }
        Ok(())
    }

    /// Reacts to another permission.
    pub(super) fn change(&mut self, permission: MotorPermission) {
        let before = core::mem::replace(&mut self.permission, permission);
        self.desk.note_permission();
        match permission {
            MotorPermission::Off => self.end_flight(),
            MotorPermission::Level => self.go_idle(),
            MotorPermission::Idle if before == MotorPermission::Off => {
                self.controller.reset();
                self.pose_trust.restart();
                self.flow_trust.restart();
                self.range_trust.restart();
                self.ground_m = self.filter.state().position_m.z;
            }
            // A take-off that expired before the robot left the ground.
            MotorPermission::Idle => self.go_idle(),
            MotorPermission::Follow => {
                if let Guidance::Velocity { is_new, .. } = &mut self.guidance {
                    *is_new = true;
                }
            }
            MotorPermission::Descend => self.begin_landing(),
        }
    }

    /// Drops the plan when motors stop.
    fn end_flight(&mut self) {
        let has_landed = self.planner.as_mut().is_some_and(|p| p.touched_down().is_ok());
        if !has_landed {
            self.go_idle();
        }
        self.has_touched_down = false;
        self.standing_ms = 0;
        self.reference = None;
    }

    /// Lets the reference sink after a landing, and ends the landing once the robot stands.
    fn settle(&mut self, state: &FlightState, reference: &mut Reference, dt_s: f32) {
        let Some(planner) = &mut self.planner else { return };
        if !(planner.is_landing() && planner.is_done()) {
            self.settle_m = 0.0;
            self.standing_ms = 0;
            return;
        }
        self.settle_m += SETTLE_M_S * dt_s;
        reference.position_m.z -= self.settle_m;
        reference.velocity_m_s.z -= SETTLE_M_S;
        let weight_n = self.settings.vehicle.mass_kg * GRAVITY_M_S2;
        let thrust_n: f32 = self.forces.0.iter().sum();
        let is_standing = thrust_n < STANDING_SHARE * weight_n
            && state.position_m.z - self.ground_m < GROUND_HEIGHT_M
            && state.velocity_m_s.z.abs() < GROUND_SPEED_M_S;
        let control_ms = TICK_MS * CONTROL_TICKS as u32;
        self.standing_ms = if is_standing { self.standing_ms + control_ms } else { 0 };
        // The supervisor alone ends a landing that it began.
        if self.standing_ms >= TOUCHDOWN_MS && self.permission == MotorPermission::Follow {
            self.has_touched_down = planner.touched_down().is_ok();
        }
    }

    /// Passes a new velocity to the planner, and starts it if it has no plan.
    fn plan(&mut self, state: &FlightState, now_s: f64) {
        let is_climbing = match self.guidance {
            Guidance::Velocity { velocity, .. } => velocity.velocity_m_s.z > 0.0,
            Guidance::Plan => false,
            _ => return,
        };
        let is_in_air = self.stage() == SupervisorStage::Flying && !self.has_touched_down;
        if (is_in_air || is_climbing) && self.start_in_air(state, now_s).is_ok() {
            self.has_touched_down = false;
        }
        if let Guidance::Velocity { velocity, is_new: true } = self.guidance
            && let Ok(planner) = self.able_planner()
        {
            let is_new = planner.follow_velocity(now_s, velocity).is_err();
            self.guidance = Guidance::Velocity { velocity, is_new };
        }
    }

    /// Returns the reference that the command in force gives, if it gives one.
    fn next_reference(&mut self, state: &FlightState, dt_s: f32) -> Option<Reference> {
        match self.guidance {
            Guidance::Reference(wanted) if self.permission == MotorPermission::Follow => {
                let before = self.reference.unwrap_or_else(|| self.present(state));
                return Some(self.governor(dt_s)?.reference(&before, &wanted));
            }
            Guidance::Attitude { .. } if self.permission == MotorPermission::Follow => return None,
            _ => {}
        }
        let now_s = self.now_s();
        if self.permission == MotorPermission::Follow {
            self.plan(state, now_s);
        }
        let mut reference = self.planner.as_mut()?.reference(now_s)?;
        self.settle(state, &mut reference, dt_s);
        Some(reference)
    }

    /// Returns the wrench of a robot in the air that has no reference: it sinks.
    fn sink(&mut self, state: &FlightState, dt_s: f32) -> Wrench {
        // Flow spoils the velocity before it loses the trust; a range or a pose does not.
        let brakes = !self.flow_trust.is_lost();
        let hover_n = self.controller.hover_thrust_n();
        let ground_m = self.ground_m;
        let descent = self.blind.get_or_insert_with(|| BlindDescent::new(state, ground_m, brakes));
        let target = descent.target(state, hover_n, self.settings.vehicle.mass_kg, dt_s);
        self.controller.hold_attitude(state, &target, dt_s)
    }

    /// Returns the reference of a robot that goes on as it does.
    fn present(&self, state: &FlightState) -> Reference {
        Reference {
            position_m: state.position_m,
            velocity_m_s: state.velocity_m_s,
            acceleration_m_s2: self.asked_m_s2,
            yaw_rad: yaw_rad(state),
            ..Reference::default()
        }
    }

    /// Returns the present motion of the robot as an attitude to hold.
    pub(super) fn held(&self, state: &FlightState) -> HeldAttitude {
        HeldAttitude {
            acceleration_m_s2: self.asked_m_s2.truncate(),
            climb_m_s: state.velocity_m_s.z + self.asked_m_s2.z / CLIMB_GAIN_1_S,
            yaw_rad: yaw_rad(state),
            yaw_rate_rad_s: 0.0,
        }
    }

    /// Returns the limits of set-points that the planner has not made; `None` without valid limits.
    fn governor(&mut self, dt_s: f32) -> Option<Governor> {
        let planner = self.able_planner().ok()?;
        Some(Governor { limits: *planner.limits(), fence: *planner.fence(), dt_s })
    }

    /// Returns the wrench that a pilot commands.
    fn hold_command(
        &mut self,
        state: &FlightState,
        command: &AttitudeCommand,
        before: &HeldAttitude,
        dt_s: f32,
    ) -> Option<Wrench> {
        let has_position = self.has_position(state);
        let governor = self.governor(dt_s)?;
        let mut held = governor.attitude(before, state, command, has_position);
        // With a large error of yaw the errors of roll and pitch would mix.
        let most_rad = self.settings.gains.most_yaw_error_rad;
        let here_rad = yaw_rad(state);
        held.yaw_rad = here_rad + wrapped(held.yaw_rad - here_rad).max(-most_rad).min(most_rad);
        self.guidance = Guidance::Attitude { command: *command, held };
        let tilt_rad = held.tilt_rad();
        let attitude = Quat::from_rotation_z(held.yaw_rad)
            * Quat::from_rotation_y(tilt_rad.y)
            * Quat::from_rotation_x(tilt_rad.x);
        let slow_m_s = held.climb_m_s - state.velocity_m_s.z;
        let climb_m_s2 = CLIMB_GAIN_1_S * slow_m_s;
        self.asked_m_s2 = held.acceleration_m_s2.extend(climb_m_s2);
        let hover_n = self.controller.hover_thrust_n();
        let learned_n = CLIMB_INTEGRAL_1_S2 * slow_m_s * dt_s * self.settings.vehicle.mass_kg;
        self.controller.preset_hover_thrust_n(hover_n + learned_n);
        // The tilt of a command is at most 0.5 rad.
        let up_z = (attitude * Vec3::Z).z;
        let thrust_n = (hover_n + self.settings.vehicle.mass_kg * climb_m_s2).max(0.0) / up_z;
        let yaw_rate_rad_s = held.yaw_rate_rad_s;
        let target = AttitudeTarget { attitude, yaw_rate_rad_s, thrust_n };
        Some(self.controller.hold_attitude(state, &target, dt_s))
    }

    /// Computes the forces of the motors.
    pub(super) fn control(&mut self, state: &FlightState) {
        let dt_s = TICK_S * CONTROL_TICKS as f32;
        let reference = self.next_reference(state, dt_s);
        self.reference = reference;
        self.asked_m_s2 = reference.map_or(Vec3::ZERO, |reference| reference.acceleration_m_s2);
        let wrench = match (self.permission, reference, self.guidance) {
            (MotorPermission::Off | MotorPermission::Idle, ..) => None,
            (MotorPermission::Level, ..) => Some(self.sink(state, dt_s)),
            (MotorPermission::Follow | MotorPermission::Descend, Some(reference), _) => {
                self.blind = None;
                Some(self.controller.update(state, &reference, dt_s))
            }
            (MotorPermission::Follow, None, Guidance::Attitude { command, held }) => {
                let stands = self.stage() == SupervisorStage::Armed && command.climb_m_s <= 0.0;
                self.blind = None;
                if stands { None } else { self.hold_command(state, &command, &held, dt_s) }
            }
            (MotorPermission::Follow, None, _) => {
                let stands = self.stage() == SupervisorStage::Armed || self.has_touched_down;
                (!stands).then(|| self.sink(state, dt_s))
            }
            (MotorPermission::Descend, None, _) => Some(self.sink(state, dt_s)),
        };
        self.wanted_up = wrench.map(|_| self.controller.wanted_up());
        let Some(wrench) = wrench else {
            self.blind = None;
            self.forces = MotorForces::default();
            return;
        };
        self.mixer.limit_thrust_n(self.drive.available_thrust_n());
        let outcome = self.mixer.mix(&wrench);
        self.controller.note_mixing(&outcome);
        self.forces = outcome.forces;
    }
}
