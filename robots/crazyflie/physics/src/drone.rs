//! One robot: its body, rotors, battery and contact with the ground.

use glam::{DMat3, DVec3};

use crate::dynamics::{HeldInputs, NearGround, RotorInputs, advance};
use crate::ground::{REST_DEPTH_M, Suspension};
use crate::random::{NoiseConsumer, NoiseStream};
use crate::{
    Airframe, DroneState, GRAVITY_M_S2, GroundContact, Impact, PowerSource, STEP_S, ground_effect,
};

/// Largest external force that a robot follows, in N: 300 times its weight.
const FORCE_N_MAX: f64 = 100.0;
/// Largest speed of the wind that a robot follows, in m/s.
const WIND_M_S_MAX: f64 = 100.0;

/// The surroundings of a robot during a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DroneSurroundings {
    /// Height of the ground below the robot in m.
    pub ground_m: f64,
    /// Velocity of the air in the world frame in m/s.
    pub wind_m_s: DVec3,
    /// Force in the world frame in N, for example of downwash and collisions.
    pub external_force_n: DVec3,
}

/// Quantities that follow from an airframe and that each step uses.
#[derive(Clone, Debug, PartialEq)]
struct DerivedQuantities {
    motor_positions_m: [DVec3; 4],
    suspension: Suspension,
    /// Speed in rpm and voltage in V of a motor at the least measured thrust.
    least_measured: (f64, f64),
}

impl DerivedQuantities {
    fn new(airframe: &Airframe) -> Self {
        DerivedQuantities {
            motor_positions_m: airframe.motor_positions_m(),
            suspension: Suspension::new(airframe),
            least_measured: airframe.least_measured(),
        }
    }
}

/// One robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Drone {
    airframe: Airframe,
    derived: DerivedQuantities,
    state: DroneState,
    power: PowerSource,
    battery_volts: f64,
    /// Thrust of each motor as a share of the airframe's, for this build.
    build_efficiency: [f64; 4],
    /// Share that the faults that were set leave of it.
    fault_efficiency: [f64; 4],
    contact: GroundContact,
    /// The surroundings in which the robot rests: while they last and no motor turns, nothing moves.
    rest: Option<DroneSurroundings>,
}

/// Largest change of velocity in a step of a robot at rest, in m/s: an acceleration of 1 µm/s².
const REST_CHANGE_M_S: f64 = 1e-9;
/// Largest speed of a robot at rest in m/s, and its largest rate in rad/s.
const REST_SPEED_M_S: f64 = 1e-7;
const REST_RATE_RAD_S: f64 = 1e-6;

/// Returns true if a robot without turning rotors moved so little in a step that it rests.
fn is_resting(before: &DroneState, after: &DroneState) -> bool {
    let change = after.velocity_m_s - before.velocity_m_s;
    after.rotor_rpm == [0.0; 4]
        && change.length_squared() < REST_CHANGE_M_S * REST_CHANGE_M_S
        && after.velocity_m_s.length_squared() < REST_SPEED_M_S * REST_SPEED_M_S
        && after.rate_rad_s.length_squared() < REST_RATE_RAD_S * REST_RATE_RAD_S
        && before.rate_rad_s.length_squared() < REST_RATE_RAD_S * REST_RATE_RAD_S
}

/// Returns the vector, shortened to this length; zero if it is not finite.
fn limited(vector: DVec3, most: f64) -> DVec3 {
    if vector.is_finite() { vector.clamp_length_max(most) } else { DVec3::ZERO }
}

impl Drone {
    /// Returns a robot whose motors are exactly those of the airframe. It stands on the ground at
    /// the origin, with a full battery.
    #[must_use]
    pub fn nominal(airframe: Airframe) -> Self {
        let power = PowerSource::FULL;
        let mut drone = Drone {
            airframe,
            derived: DerivedQuantities::new(&airframe),
            state: DroneState::at_rest(DVec3::ZERO, 0.0),
            power,
            battery_volts: power.volts(&airframe.battery, 0.0),
            build_efficiency: [1.0; 4],
            fault_efficiency: [1.0; 4],
            contact: GroundContact::default(),
            rest: None,
        };
        drone.stand(0.0, 0.0, 0.0, 0.0);
        drone
    }

    /// Returns a robot whose motors differ as those of robots of one kind do.
    ///
    /// # Parameters
    /// `seed`: the build. Robots of one seed are equal.
    #[must_use]
    pub fn new(airframe: Airframe, seed: u64) -> Self {
        let mut noise = NoiseStream::new(seed, NoiseConsumer::Motors);
        let mut drone = Drone::nominal(airframe);
        for factor in &mut drone.build_efficiency {
            *factor = (1.0 + airframe.motor_spread * noise.normal().clamp(-3.0, 3.0)).max(0.0);
        }
        drone
    }

    /// Puts the robot on its feet, at rest, and forgets impacts and crashes.
    ///
    /// # Parameters
    /// `ground_m`: height of the ground. `x_m`, `y_m`, `yaw_rad`: the pose.
    pub fn stand(&mut self, ground_m: f64, x_m: f64, y_m: f64, yaw_rad: f64) {
        let height_m = ground_m + self.airframe.feet_below_m - REST_DEPTH_M;
        let position = DVec3::new(x_m, y_m, height_m);
        let steps = self.state.steps;
        self.state = DroneState { steps, ..DroneState::at_rest(position, yaw_rad) };
        self.contact = GroundContact::default();
        self.rest = None;
    }

    /// Puts the robot into this state, and forgets impacts and crashes. For tests and replays.
    pub fn set_state(&mut self, state: DroneState) {
        self.state = state;
        self.contact = GroundContact::in_flight();
        self.rest = None;
    }

    /// Returns the state at the end of the last step.
    #[must_use]
    pub fn state(&self) -> &DroneState {
        &self.state
    }

    /// Returns the parameters.
    #[must_use]
    pub fn airframe(&self) -> &Airframe {
        &self.airframe
    }

    /// Returns the contact with the ground.
    #[must_use]
    pub fn contact(&self) -> &GroundContact {
        &self.contact
    }

    /// Returns true once the robot crashed. Its motors still follow their duties, except those
    /// whose propeller touches the ground.
    #[must_use]
    pub fn has_crashed(&self) -> bool {
        self.contact.crash().is_some()
    }

    /// Returns the voltage under load in V.
    #[must_use]
    pub fn battery_volts(&self) -> f64 {
        self.battery_volts
    }

    /// Returns the source of power.
    #[must_use]
    pub fn power(&self) -> PowerSource {
        self.power
    }

    /// Replaces the source of power. A charge is limited to 0 to 1 and a voltage to 0 to 5 V; a
    /// number that is not finite counts as 0.
    pub fn set_power(&mut self, power: PowerSource) {
        let limit = |value: f64, most| if value.is_finite() { value.clamp(0.0, most) } else { 0.0 };
        self.power = match power {
            PowerSource::Battery { charge } => PowerSource::Battery { charge: limit(charge, 1.0) },
            PowerSource::Constant { volts } => PowerSource::Constant { volts: limit(volts, 5.0) },
        };
        self.battery_volts = self.power.volts(&self.airframe.battery, self.motor_thrust_n());
    }

    /// Sets the share of its thrust and torque that each motor still has, 0 to 1. A damaged
    /// propeller with 80 % has 0.8. A number that is not finite counts as 0.
    pub fn set_motor_efficiency(&mut self, shares: [f64; 4]) {
        self.fault_efficiency =
            shares.map(|share| if share.is_finite() { share.clamp(0.0, 1.0) } else { 0.0 });
    }

    /// Returns the step of the motors' duty that is nearest to this finite one.
    fn stepped(&self, duty: f64) -> f64 {
        let steps = self.airframe.duty_steps;
        // A conversion to an integer is much quicker than a call of `round`.
        let nearest = ((duty * steps).clamp(0.0, steps - 1.0) + 0.5) as u32;
        f64::from(nearest) / steps
    }

    /// Returns the thrust of intact motors at the present speeds, in N. It determines the current.
    fn motor_thrust_n(&self) -> f64 {
        self.state.rotor_rpm.iter().map(|speed| self.airframe.thrust_n(*speed)).sum()
    }

    /// Advances by a millisecond and returns an impact on the ground that began in it.
    ///
    /// # Parameters
    /// `duties`: the share of the battery's voltage for each motor, 0 to 1. The motors get the nearest
    /// step of the airframe. Others are limited; a number that is not finite turns the motor off.
    pub fn step(&mut self, duties: [f64; 4], surroundings: &DroneSurroundings) -> Option<Impact> {
        let duties = duties.map(|duty| if duty.is_finite() { self.stepped(duty) } else { 0.0 });
        let impact = if duties == [0.0; 4] && self.rest == Some(*surroundings) {
            self.state.steps += 1;
            None
        } else {
            self.move_for_step(duties, surroundings)
        };
        let thrust_n = self.motor_thrust_n();
        self.power.discharge(&self.airframe.battery, thrust_n, STEP_S);
        self.battery_volts = self.power.volts(&self.airframe.battery, thrust_n);
        impact
    }

    fn move_for_step(
        &mut self,
        duties: [f64; 4],
        surroundings: &DroneSurroundings,
    ) -> Option<Impact> {
        let ground_m = if surroundings.ground_m.is_finite() { surroundings.ground_m } else { 0.0 };
        let rotation = DMat3::from_quat(self.state.attitude);
        let DerivedQuantities { motor_positions_m, suspension, least_measured } = &self.derived;
        let mut command_rpm = [0.0; 4];
        let mut torque_factor = [1.0; 4];
        let mut thrust_factor = [1.0; 4];
        let is_upright = rotation.z_axis.z > 0.0;
        for motor in 0..4 {
            if !self.contact.touches_propeller(motor) {
                let volts = duties[motor] * self.battery_volts;
                command_rpm[motor] = self.airframe.commanded_speed_rpm(volts, *least_measured);
            }
            let efficiency = self.build_efficiency[motor] * self.fault_efficiency[motor];
            torque_factor[motor] = efficiency;
            thrust_factor[motor] = efficiency;
            if is_upright {
                let hub = motor_positions_m[motor].with_z(self.airframe.propellers_above_m);
                let height_m = self.state.position_m.z + (rotation * hub).z - ground_m;
                thrust_factor[motor] *= ground_effect(height_m, self.airframe.propeller_radius_m);
            }
        }
        let before = self.state;
        let fall_m = -before.velocity_m_s.z.min(0.0) * STEP_S;
        // Twice the fall leaves room for the acceleration of a step.
        let is_near_ground =
            before.position_m.z - ground_m < GroundContact::reach_m(&self.airframe) + 2.0 * fall_m;
        let inputs = HeldInputs {
            rotors: RotorInputs {
                positions_m: motor_positions_m,
                command_rpm,
                torque_factor,
                thrust_factor,
            },
            force_n: limited(surroundings.external_force_n, FORCE_N_MAX),
            wind_m_s: limited(surroundings.wind_m_s, WIND_M_S_MAX),
            ground: is_near_ground.then_some(NearGround {
                contact: &self.contact,
                suspension,
                height_m: ground_m,
            }),
        };
        let mut state = advance(&self.airframe, &before, &inputs, STEP_S);
        let mut force = (state.velocity_m_s - before.velocity_m_s) / STEP_S;
        force.z += GRAVITY_M_S2;
        state.specific_force_m_s2 = state.attitude.conjugate() * force;
        state.steps += 1;
        let is_at_rest = self.contact.is_touching() && is_resting(&before, &state);
        if is_at_rest {
            state.velocity_m_s = DVec3::ZERO;
            state.rate_rad_s = DVec3::ZERO;
        }
        self.rest = is_at_rest.then_some(*surroundings);
        self.state = state;

        if is_near_ground {
            self.contact.update(
                &self.airframe,
                &state,
                suspension,
                ground_m,
                -before.velocity_m_s.z,
            )
        } else {
            self.contact.fly();
            None
        }
    }
}
