//! The equations of motion and their integration.
//!
//! With the rotation R from body to world, velocity v, rate ω, moments of inertia J, rotor speeds Ωᵢ in
//! the directions sᵢ, thrusts Tᵢ and reaction torques Qᵢ:
//! * m v̇ = R (Σ Tᵢ e₃ − D Rᵀ(v − wind)) + m g + contact + external force,
//! * q̇ = ½ q ⊗ (0, ω),
//! * J ω̇ = Σ rᵢ × Tᵢ e₃ − Σ sᵢ Qᵢ e₃ − ω × (J ω + h e₃) − ḣ e₃ + contact, with the rotors' angular
//!   momentum h = Jₚ Σ sᵢ Ωᵢ (Mahony, Kumar and Corke 2012, "Multirotor Aerial Vehicles"; ḣ is the
//!   reaction of rotors that gain speed),
//! * Ω̇ᵢ = k₁ (Ω꜀ − Ωᵢ) + k₂ (Ω꜀² − Ωᵢ²).
//!
//! The classical Runge-Kutta method of order 4 integrates all of them. It needs no tuning, keeps the
//! energy of a tumbling body to far better than 10⁻⁶ per second at a millisecond, and is stable for
//! the springs of contact. The quaternion is normalized after each step.

use glam::{DMat3, DQuat, DVec3};

use crate::airframe::{RAD_S_PER_RPM, SPIN_DIRECTIONS};
use crate::ground::Suspension;
use crate::{Airframe, DroneState, GRAVITY_M_S2, GroundContact};

/// Rate at which a motor without voltage slows down besides its measured dynamics, in 1/s. The
/// quadratic measured term alone never stops a rotor; friction does (choice).
const COAST_PER_S: f64 = 5.0;

/// The inputs that are constant during a step.
pub(crate) struct HeldInputs<'a> {
    pub(crate) rotors: RotorInputs<'a>,
    /// Force in the world frame in N.
    pub(crate) force_n: DVec3,
    /// Velocity of the air in the world frame in m/s.
    pub(crate) wind_m_s: DVec3,
    /// The ground, if the robot is near it.
    pub(crate) ground: Option<NearGround<'a>>,
}

/// The inputs of the four rotors.
pub(crate) struct RotorInputs<'a> {
    /// Position of each motor in the body frame in m.
    pub(crate) positions_m: &'a [DVec3; 4],
    /// Speed that the voltage of each motor commands, in rpm.
    pub(crate) command_rpm: [f64; 4],
    /// Factor on the torque of each motor.
    pub(crate) torque_factor: [f64; 4],
    /// Factor on the thrust of each motor, which includes the ground effect.
    pub(crate) thrust_factor: [f64; 4],
}

/// The ground near a robot.
pub(crate) struct NearGround<'a> {
    pub(crate) contact: &'a GroundContact,
    pub(crate) suspension: &'a Suspension,
    /// Height of the ground in m.
    pub(crate) height_m: f64,
}

/// The time derivative of the motion of a body.
struct BodyRate {
    velocity_m_s: DVec3,
    acceleration_m_s2: DVec3,
    attitude_per_s: DQuat,
    angular_acceleration_rad_s2: DVec3,
}

/// Thrust of all rotors along the body's z axis, their torque and their angular momentum about it.
struct RotorWrench {
    thrust_n: f64,
    torque_n_m: DVec3,
    momentum_n_m_s: f64,
}

/// Returns the acceleration of each rotor in rpm/s.
fn rotor_accelerations(
    airframe: &Airframe,
    speed_rpm: &[f64; 4],
    command_rpm: &[f64; 4],
) -> [f64; 4] {
    let (up, down) = (&airframe.spin_up, &airframe.spin_down);
    std::array::from_fn(|motor| {
        let (speed, command) = (speed_rpm[motor], command_rpm[motor]);
        let is_up = command >= speed;
        let linear = if is_up { up.linear_per_s } else { down.linear_per_s };
        let square = if is_up { up.square_per_rpm_s } else { down.square_per_rpm_s };
        let coast = if command <= 0.0 { COAST_PER_S } else { 0.0 };
        (command - speed) * (linear + square * (command + speed) + coast)
    })
}

/// Returns the effect of the rotors on the body.
fn rotor_wrench(
    airframe: &Airframe,
    inputs: &RotorInputs,
    speed_rpm: &[f64; 4],
    acceleration_rpm_s: &[f64; 4],
) -> RotorWrench {
    let thrusts: [f64; 4] = std::array::from_fn(|motor| {
        airframe.thrust_n(speed_rpm[motor]) * inputs.thrust_factor[motor]
    });
    let torques: [f64; 4] = std::array::from_fn(|motor| {
        airframe.torque_n_m(speed_rpm[motor]) * inputs.torque_factor[motor]
    });
    let mut thrust_n = 0.0;
    let mut torque_n_m = DVec3::ZERO;
    let mut momentum = 0.0;
    let mut momentum_rate = 0.0;
    for motor in 0..4 {
        let direction = SPIN_DIRECTIONS[motor];
        thrust_n += thrusts[motor];
        torque_n_m.x += inputs.positions_m[motor].y * thrusts[motor];
        torque_n_m.y -= inputs.positions_m[motor].x * thrusts[motor];
        torque_n_m.z -= direction * torques[motor];
        momentum += direction * speed_rpm[motor];
        momentum_rate += direction * acceleration_rpm_s[motor];
    }
    let spin = airframe.propeller_inertia_kg_m2 * RAD_S_PER_RPM;
    torque_n_m.z -= spin * momentum_rate;
    RotorWrench { thrust_n, torque_n_m, momentum_n_m_s: spin * momentum }
}

/// Returns the time derivative of the motion of the body.
fn derivative(
    airframe: &Airframe,
    state: &DroneState,
    rotors: &RotorWrench,
    inputs: &HeldInputs,
) -> BodyRate {
    let rotation = DMat3::from_quat(state.attitude);
    let air_velocity = rotation.transpose() * (state.velocity_m_s - inputs.wind_m_s);
    let mut body_force_n = air_velocity * -airframe.drag_n_s_m;
    body_force_n.z += rotors.thrust_n;
    let mut force_n = rotation * body_force_n + inputs.force_n;
    let mut torque_n_m = rotors.torque_n_m;
    if let Some(NearGround { contact, suspension, height_m }) = &inputs.ground {
        let (contact_n, contact_n_m) =
            contact.wrench(airframe, state, &rotation, suspension, *height_m);
        force_n += contact_n;
        torque_n_m += contact_n_m;
    }
    let mut acceleration_m_s2 = force_n / airframe.mass_kg;
    acceleration_m_s2.z -= GRAVITY_M_S2;

    let rate = state.rate_rad_s;
    let mut angular_momentum = airframe.inertia_kg_m2 * rate;
    angular_momentum.z += rotors.momentum_n_m_s;
    let angular_acceleration_rad_s2 =
        (torque_n_m - rate.cross(angular_momentum)) / airframe.inertia_kg_m2;
    let spin_quaternion = DQuat::from_xyzw(rate.x / 2.0, rate.y / 2.0, rate.z / 2.0, 0.0);
    BodyRate {
        velocity_m_s: state.velocity_m_s,
        acceleration_m_s2,
        attitude_per_s: state.attitude * spin_quaternion,
        angular_acceleration_rad_s2,
    }
}

/// Returns the speeds after `seconds` of constant accelerations.
fn spun(speed_rpm: &[f64; 4], acceleration_rpm_s: &[f64; 4], seconds: f64) -> [f64; 4] {
    std::array::from_fn(|motor| speed_rpm[motor] + acceleration_rpm_s[motor] * seconds)
}

/// Returns the state after `seconds` with a constant derivative of the body's motion.
fn moved(state: &DroneState, rate: &BodyRate, seconds: f64) -> DroneState {
    DroneState {
        position_m: state.position_m + rate.velocity_m_s * seconds,
        velocity_m_s: state.velocity_m_s + rate.acceleration_m_s2 * seconds,
        attitude: state.attitude + rate.attitude_per_s * seconds,
        rate_rad_s: state.rate_rad_s + rate.angular_acceleration_rad_s2 * seconds,
        ..*state
    }
}

/// Returns the state after `seconds` of constant inputs. Time and specific force are unchanged.
///
/// The rotors do not depend on the body, so their four stages come first.
pub(crate) fn advance(
    airframe: &Airframe,
    state: &DroneState,
    inputs: &HeldInputs,
    seconds: f64,
) -> DroneState {
    let half = seconds / 2.0;
    let command_rpm = &inputs.rotors.command_rpm;
    let speed_1 = state.rotor_rpm;
    let spin_1 = rotor_accelerations(airframe, &speed_1, command_rpm);
    let speed_2 = spun(&speed_1, &spin_1, half);
    let spin_2 = rotor_accelerations(airframe, &speed_2, command_rpm);
    let speed_3 = spun(&speed_1, &spin_2, half);
    let spin_3 = rotor_accelerations(airframe, &speed_3, command_rpm);
    let speed_4 = spun(&speed_1, &spin_3, seconds);
    let spin_4 = rotor_accelerations(airframe, &speed_4, command_rpm);
    let wrench = |speed, spin| rotor_wrench(airframe, &inputs.rotors, speed, spin);

    let first = derivative(airframe, state, &wrench(&speed_1, &spin_1), inputs);
    let middle = moved(state, &first, half);
    let second = derivative(airframe, &middle, &wrench(&speed_2, &spin_2), inputs);
    let middle = moved(state, &second, half);
    let third = derivative(airframe, &middle, &wrench(&speed_3, &spin_3), inputs);
    let end = moved(state, &third, seconds);
    let fourth = derivative(airframe, &end, &wrench(&speed_4, &spin_4), inputs);

    let mean = BodyRate {
        velocity_m_s: (first.velocity_m_s
            + (second.velocity_m_s + third.velocity_m_s) * 2.0
            + fourth.velocity_m_s)
            / 6.0,
        acceleration_m_s2: (first.acceleration_m_s2
            + (second.acceleration_m_s2 + third.acceleration_m_s2) * 2.0
            + fourth.acceleration_m_s2)
            / 6.0,
        attitude_per_s: (first.attitude_per_s
            + (second.attitude_per_s + third.attitude_per_s) * 2.0
            + fourth.attitude_per_s)
            / 6.0,
        angular_acceleration_rad_s2: (first.angular_acceleration_rad_s2
            + (second.angular_acceleration_rad_s2 + third.angular_acceleration_rad_s2) * 2.0
            + fourth.angular_acceleration_rad_s2)
            / 6.0,
    };
    let mut next = moved(state, &mean, seconds);
    next.attitude = next.attitude.normalize();
    next.rotor_rpm = std::array::from_fn(|motor| {
        let mean = (spin_1[motor] + 2.0 * (spin_2[motor] + spin_3[motor]) + spin_4[motor]) / 6.0;
        let speed = speed_1[motor] + mean * seconds;
        // Friction stops a rotor in the end.
        if command_rpm[motor] <= 0.0 && speed < 1.0 { 0.0 } else { speed }
    });
    next
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLUS: Airframe = Airframe::CRAZYFLIE_2_1_PLUS;

    /// A body of three different moments of inertia without air.
    fn top() -> Airframe {
        Airframe {
            inertia_kg_m2: DVec3::new(16e-6, 22e-6, 30e-6),
            drag_n_s_m: DVec3::ZERO,
            thrust_n_rpm: [0.0; 2],
            torque_n_m_rpm: [0.0; 2],
            ..PLUS
        }
    }

    fn inputs(command_rpm: [f64; 4]) -> HeldInputs<'static> {
        const POSITIONS_M: [DVec3; 4] = {
            let arm = PLUS.arm_m;
            [
                DVec3::new(arm, -arm, 0.0),
                DVec3::new(-arm, -arm, 0.0),
                DVec3::new(-arm, arm, 0.0),
                DVec3::new(arm, arm, 0.0),
            ]
        };
        HeldInputs {
            rotors: RotorInputs {
                positions_m: &POSITIONS_M,
                command_rpm,
                torque_factor: [1.0; 4],
                thrust_factor: [1.0; 4],
            },
            force_n: DVec3::ZERO,
            wind_m_s: DVec3::ZERO,
            ground: None,
        }
    }

    fn after(
        airframe: &Airframe,
        start: DroneState,
        inputs: &HeldInputs,
        steps: u32,
        seconds: f64,
    ) -> DroneState {
        (0..steps).fold(start, |state, _| advance(airframe, &state, inputs, seconds))
    }

    /// Angular momentum of body and rotors in the world frame.
    fn angular_momentum(airframe: &Airframe, state: &DroneState) -> DVec3 {
        let mut momentum = airframe.inertia_kg_m2 * state.rate_rad_s;
        for (speed, direction) in state.rotor_rpm.iter().zip(SPIN_DIRECTIONS) {
            momentum.z += airframe.propeller_inertia_kg_m2 * speed * RAD_S_PER_RPM * direction;
        }
        state.attitude * momentum
    }

    fn tumbling() -> DroneState {
        DroneState {
            // Near the middle axis, about which the rotation is unstable.
            rate_rad_s: DVec3::new(0.5, 20.0, -1.0),
            ..DroneState::at_rest(DVec3::ZERO, 0.3)
        }
    }

    #[test]
    fn tumbling_conserves_energy_and_angular_momentum() {
        let airframe = top();
        let energy = |state: &DroneState| {
            0.5 * state.rate_rad_s.dot(airframe.inertia_kg_m2 * state.rate_rad_s)
        };
        let start = tumbling();
        let mut flips = 0;
        let mut state = start;
        for _ in 0..2000 {
            let next = advance(&airframe, &state, &inputs([0.0; 4]), 0.0005);
            flips += u32::from(next.rate_rad_s.y * state.rate_rad_s.y < 0.0);
            state = next;
        }
        assert!(flips > 0, "the body must flip over");
        assert!((energy(&state) / energy(&start) - 1.0).abs() < 1e-6);
        let change = angular_momentum(&airframe, &state) - angular_momentum(&airframe, &start);
        assert!(change.length() < 1e-6 * angular_momentum(&airframe, &start).length());
    }

    /// Without air, nothing outside turns the robot: rotors that gain speed turn the body.
    #[test]
    fn rotors_and_body_exchange_angular_momentum() {
        let airframe = top();
        let start = tumbling();
        let state =
            after(&airframe, start, &inputs([20_000.0, 0.0, 9_000.0, 2_000.0]), 2000, 0.0005);
        assert!(state.rotor_rpm[0] > 19_000.0);
        let change = angular_momentum(&airframe, &state) - angular_momentum(&airframe, &start);
        assert!(change.length() < 1e-6 * angular_momentum(&airframe, &start).length());
        // The pair 1 and 3 gains momentum about +z, so a body at rest turns about -z.
        let rest = DroneState::at_rest(DVec3::ZERO, 0.0);
        let spun = after(&airframe, rest, &inputs([20_000.0, 0.0, 20_000.0, 0.0]), 2000, 0.0005);
        assert!(spun.rate_rad_s.z < -1.0);
    }

    /// Half the step leaves a sixteenth of the error.
    #[test]
    fn integration_has_order_four() {
        let start = DroneState { rotor_rpm: [21_000.0; 4], ..tumbling() };
        let input = inputs([24_000.0, 22_500.0, 23_000.0, 22_800.0]);
        let end = |steps: u32| after(&PLUS, start, &input, steps, 0.4 / f64::from(steps));
        let exact = end(6400);
        let error = |steps| {
            let state = end(steps);
            (state.position_m - exact.position_m).length()
                + (state.attitude - exact.attitude).length()
        };
        for steps in [50, 100] {
            let ratio = error(steps) / error(2 * steps);
            assert!((13.0..19.0).contains(&ratio), "{steps}: {ratio}");
        }
    }

    /// With k₁ and k₂, the speed follows dΩ/dt = k₂ (c − Ω)(Ω + B) with B = c + k₁/k₂, whose
    /// solution is (Ω + B)/(c − Ω) = K exp(k₂ (c + B) t) with constant K.
    #[test]
    fn rotors_follow_the_closed_form() {
        for airframe in [PLUS, Airframe::CRAZYFLIE_BRUSHLESS] {
            for (start, command) in [(8_000.0, 24_000.0), (24_000.0, 8_000.0)] {
                let response = if command > start { airframe.spin_up } else { airframe.spin_down };
                let square = response.square_per_rpm_s;
                let offset = command + response.linear_per_s / square;
                let constant = (start + offset) / (command - start);
                let mut state = DroneState::at_rest(DVec3::ZERO, 0.0);
                state.rotor_rpm = [start; 4];
                for step in 1..=400 {
                    state = advance(&airframe, &state, &inputs([command; 4]), 0.0005);
                    let seconds = f64::from(step) * 0.0005;
                    let growth = constant * (square * (command + offset) * seconds).exp();
                    let exact = (growth * command - offset) / (1.0 + growth);
                    for speed in state.rotor_rpm {
                        assert!((speed - exact).abs() < 1e-4, "{step}: {speed} {exact}");
                    }
                }
            }
        }
    }

    /// Time constants near hover, linearized by hand: 1/(k₁ + 2 k₂ Ω).
    #[test]
    fn rotors_near_hover_have_the_published_time_constants() {
        for (airframe, up_s, down_s) in
            [(PLUS, 0.112, 0.103), (Airframe::CRAZYFLIE_BRUSHLESS, 0.057, 0.062)]
        {
            let hover = airframe.hover_speed_rpm();
            for (start, tau) in [(hover - 1.0, up_s), (hover + 1.0, down_s)] {
                let [rate, ..] = rotor_accelerations(&airframe, &[start; 4], &[hover; 4]);
                assert!(((hover - start) / rate - tau).abs() < 0.0006);
            }
        }
    }

    #[test]
    fn a_motor_without_voltage_stops() {
        let start = DroneState { rotor_rpm: [23_000.0; 4], ..tumbling() };
        let state = after(&PLUS, start, &inputs([0.0; 4]), 6000, 0.0005);
        assert_eq!(state.rotor_rpm, [0.0; 4]);
    }

    /// Drag along an axis: v = v₀ exp(−d t / m), and d v = m g at terminal velocity.
    #[test]
    fn drag_matches_the_closed_form() {
        let mut state = DroneState::at_rest(DVec3::ZERO, 0.0);
        state.velocity_m_s.x = 2.0;
        let state = after(&PLUS, state, &inputs([0.0; 4]), 2000, 0.0005);
        let exact = 2.0 * (-PLUS.drag_n_s_m.x / PLUS.mass_kg).exp();
        assert!((state.velocity_m_s.x - exact).abs() < 1e-9);
        let falling = after(&PLUS, state, &inputs([0.0; 4]), 60_000, 0.0005);
        let terminal = -PLUS.mass_kg * GRAVITY_M_S2 / PLUS.drag_n_s_m.z;
        assert!((falling.velocity_m_s.z / terminal - 1.0).abs() < 1e-6);
    }

    #[test]
    fn still_air_is_relative() {
        let mut moving = DroneState::at_rest(DVec3::ZERO, 0.0);
        moving.velocity_m_s = DVec3::new(1.0, -2.0, 0.0);
        let mut windy = inputs([0.0; 4]);
        windy.wind_m_s = DVec3::new(1.0, -2.0, 0.0);
        let state = after(&PLUS, moving, &windy, 100, 0.0005);
        assert!((state.velocity_m_s.truncate() - moving.velocity_m_s.truncate()).length() < 1e-12);
    }

    /// Signs of the mixer: see the frames of the flight controller.
    #[test]
    fn motors_turn_the_body_in_the_documented_directions() {
        let turned = |stronger: [usize; 2]| {
            let mut state = DroneState::at_rest(DVec3::ZERO, 0.0);
            state.rotor_rpm = [20_000.0; 4];
            for motor in stronger {
                state.rotor_rpm[motor] = 23_000.0;
            }
            let command = state.rotor_rpm;
            after(&PLUS, state, &inputs(command), 20, 0.0005).rate_rad_s
        };
        let roll = turned([2, 3]);
        assert!(roll.x > 0.5 && roll.y.abs() < 1e-9 && roll.z.abs() < 1e-9, "{roll}");
        let pitch = turned([1, 2]);
        assert!(pitch.y > 0.5 && pitch.x.abs() < 1e-9 && pitch.z.abs() < 1e-9, "{pitch}");
        let yaw = turned([1, 3]);
        assert!(yaw.z > 0.01 && yaw.x.abs() < 1e-9 && yaw.y.abs() < 1e-9, "{yaw}");
    }
}
