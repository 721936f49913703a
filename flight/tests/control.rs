//! Closed-loop flights of the controllers with a small rigid-body model in f64.
//!
//! The model is independent of the crate's mathematics: Newton-Euler equations with a quaternion,
//! first-order rotors with the lag of the vehicle, their reaction torque, and linear drag. The
//! state is known exactly, so the figures bound the error of control alone.

use bittybuzz_flight::geometric::{AttitudeTarget, GeometricController, GeometricSettings};
use bittybuzz_flight::mixer::Mixer;
use bittybuzz_flight::motor::LagCompensation;
use bittybuzz_flight::{
    FlightState, GRAVITY_M_S2, MotorForces, Quat, Reference, Vec3, Vehicle, Wrench,
};
use glam::{DQuat, DVec3};

const VEHICLE: Vehicle = Vehicle::CRAZYFLIE_2_1_PLUS;
const CONTROL_S: f64 = 0.002;
const SUBSTEPS: usize = 4;

/// A robot in the air, with rotors that lag.
struct Flight {
    position: DVec3,
    velocity: DVec3,
    attitude: DQuat,
    rate: DVec3,
    thrust: [f64; 4],
    /// Real thrust over the thrust that the crate expects.
    thrust_scale: f64,
    /// Share of its thrust that each motor has.
    motor_scale: [f64; 4],
    /// Real time constants of the rotors over those that the crate expects.
    lag_scale: f64,
    /// Real moments of inertia over those that the crate expects.
    inertia_scale: f64,
    mixer: Mixer,
    lag: LagCompensation,
    time: f64,
}

impl Flight {
    /// A robot at rest in the air, rotors at the speed of hover.
    fn hovering(thrust_scale: f64) -> Self {
        let hover = VEHICLE.mass_kg * GRAVITY_M_S2 / 4.0 / thrust_scale as f32;
        let mut lag = LagCompensation::new(&VEHICLE);
        for _ in 0..1000 {
            lag.update(&MotorForces([hover; 4]), 1.0, CONTROL_S as f32);
        }
        Flight {
            position: DVec3::ZERO,
            velocity: DVec3::ZERO,
            attitude: DQuat::IDENTITY,
            rate: DVec3::ZERO,
            thrust: [f64::from(hover); 4],
            thrust_scale,
            motor_scale: [1.0; 4],
            lag_scale: 1.0,
            inertia_scale: 1.0,
            mixer: Mixer::new(&VEHICLE),
            lag,
            time: 0.0,
        }
    }

    fn state(&self) -> FlightState {
        let q = self.attitude;
        FlightState {
            position_m: self.position.as_vec3(),
            velocity_m_s: self.velocity.as_vec3(),
            attitude: Quat::from_xyzw(q.x as f32, q.y as f32, q.z as f32, q.w as f32),
            rate_rad_s: self.rate.as_vec3(),
        }
    }

    /// Flies one step of the control loop with the wrench.
    fn step(&mut self, wrench: &Wrench) {
        let forces = self.mixer.mix(wrench).forces;
        let command = self.lag.update(&forces, 1.0, CONTROL_S as f32);
        for _ in 0..SUBSTEPS {
            self.integrate(&command, CONTROL_S / SUBSTEPS as f64);
        }
        self.time += CONTROL_S;
    }

    fn integrate(&mut self, command: &MotorForces, dt: f64) {
        let (arm, mass) = (f64::from(VEHICLE.arm_m), f64::from(VEHICLE.mass_kg));
        let inertia = self.inertia_scale * VEHICLE.inertia_kg_m2.as_dvec3();
        let places = [(arm, -arm), (-arm, -arm), (-arm, arm), (arm, arm)];
        let (mut lift, mut torque) = (0.0, DVec3::ZERO);
        for (i, (x, y)) in places.into_iter().enumerate() {
            let difference = f64::from(command.0[i]) - self.thrust[i];
            let lag = if difference > 0.0 { VEHICLE.spin_up_s } else { VEHICLE.spin_down_s };
            let change = difference / (f64::from(lag) * self.lag_scale);
            self.thrust[i] += change * dt;
            let thrust = self.thrust_scale * self.motor_scale[i] * self.thrust[i];
            // Thrust grows with the square of the rotor's rate, 2428 rad/s in hover at 0.078 N.
            let rotor_rate = 2428.0 * (self.thrust[i].max(1e-3) / 0.078).sqrt();
            let rotor_acceleration = rotor_rate * change / (2.0 * self.thrust[i].max(1e-3));
            let turn = if i % 2 == 0 { -1.0 } else { 1.0 };
            lift += thrust;
            torque += DVec3::new(y * thrust, -x * thrust, 0.0);
            torque.z += turn
                * (f64::from(VEHICLE.torque_per_thrust_m) * thrust
                    + f64::from(VEHICLE.rotor_inertia_kg_m2) * rotor_acceleration);
        }
        let body_velocity = self.attitude.inverse() * self.velocity;
        let drag = self.attitude * (body_velocity * DVec3::new(0.01351, 0.01351, 0.01677));
        let force = self.attitude * DVec3::new(0.0, 0.0, lift) - drag;
        self.position += self.velocity * dt;
        self.velocity += (force / mass - DVec3::Z * 9.81) * dt;
        let turn = DQuat::from_scaled_axis(self.rate * dt);
        self.attitude = (self.attitude * turn).normalize();
        self.rate += (torque - self.rate.cross(inertia * self.rate)) / inertia * dt;
    }

    /// Follows a reference for some seconds and returns the position error at each step.
    fn follow(
        &mut self,
        controller: &mut GeometricController,
        seconds: f64,
        reference: impl Fn(f64) -> Reference,
    ) -> Vec<DVec3> {
        let start = self.time;
        let mut errors = Vec::new();
        while self.time - start < seconds {
            let wanted = reference(self.time - start);
            let wrench = controller.update(&self.state(), &wanted, CONTROL_S as f32);
            controller.note_mixing(&self.mixer.mix(&wrench));
            self.step(&wrench);
            let wanted = reference(self.time - start);
            errors.push(self.position - wanted.position_m.as_dvec3());
        }
        errors
    }
}

fn geometric() -> GeometricController {
    GeometricController::new(&VEHICLE, GeometricSettings::CRAZYFLIE_2_1_PLUS)
}

/// A step of the position.
fn at(position_m: Vec3) -> Reference {
    Reference { position_m, ..Reference::default() }
}

/// A move by `distance` from rest to rest in `duration`, by the polynomial
/// 35τ⁴ − 84τ⁵ + 70τ⁶ − 20τ⁷ and its derivatives.
fn go_to(distance: DVec3, duration: f64, t: f64) -> Reference {
    let tau = (t / duration).clamp(0.0, 1.0);
    let derivative = |order: i32| -> Vec3 {
        let value: f64 = [(4, 35.0), (5, -84.0), (6, 70.0), (7, -20.0)]
            .into_iter()
            .map(|(power, c): (i32, f64)| {
                let factor: i32 = (0..order).map(|k| power - k).product();
                c * f64::from(factor) * tau.powi(power - order)
            })
            .sum();
        (distance * (value / duration.powi(order))).as_vec3()
    };
    Reference {
        position_m: derivative(0),
        velocity_m_s: derivative(1),
        acceleration_m_s2: derivative(2),
        jerk_m_s3: derivative(3),
        snap_m_s4: derivative(4),
        ..Reference::default()
    }
}

/// A figure 8 of 2 m by 1 m in 8 s that starts smoothly.
fn figure_8(t: f64) -> Reference {
    let w = std::f64::consts::TAU / 8.0;
    let derivative = |order: i32| -> Vec3 {
        let phase = f64::from(order) * std::f64::consts::FRAC_PI_2;
        let x = w.powi(order) * (w * t + phase).sin();
        let y = 0.5 * (2.0 * w).powi(order) * (2.0 * w * t + phase).sin();
        Vec3::new(x as f32, y as f32, 0.0)
    };
    Reference {
        position_m: derivative(0),
        velocity_m_s: derivative(1),
        acceleration_m_s2: derivative(2),
        jerk_m_s3: derivative(3),
        snap_m_s4: derivative(4),
        ..Reference::default()
    }
}

fn rms(errors: &[DVec3]) -> f64 {
    (errors.iter().map(|error| error.length_squared()).sum::<f64>() / errors.len() as f64).sqrt()
}

fn mean(errors: &[DVec3]) -> f64 {
    errors.iter().map(|error| error.length()).sum::<f64>() / errors.len() as f64
}

/// Rise time from 10 to 90 % in seconds, and overshoot as a share, of a step to `target`.
fn step_figures(values: &[f64], target: f64) -> (f64, f64) {
    let first = |share: f64| values.iter().position(|v| v / target >= share).expect("no rise");
    let highest = values.iter().fold(f64::MIN, |highest, v| highest.max(v / target));
    ((first(0.9) - first(0.1)) as f64 * CONTROL_S, highest - 1.0)
}

/// Properties of the real robot over those that the crate expects.
#[derive(Clone, Copy)]
struct Mismatch {
    thrust: f64,
    lag: f64,
    inertia: f64,
}

impl Mismatch {
    const NONE: Self = Mismatch { thrust: 1.0, lag: 1.0, inertia: 1.0 };

    fn hovering(self) -> Flight {
        let mut flight = Flight::hovering(self.thrust);
        flight.lag_scale = self.lag;
        flight.inertia_scale = self.inertia;
        flight
    }
}

/// Holds an attitude for some seconds and returns the attitude after each step.
fn hold(flight: &mut Flight, attitude: Quat, seconds: f64) -> Vec<DQuat> {
    let mut controller = geometric();
    let thrust_n = VEHICLE.mass_kg * GRAVITY_M_S2;
    let target = AttitudeTarget { attitude, yaw_rate_rad_s: 0.0, thrust_n };
    let mut attitudes = Vec::new();
    for _ in 0..(seconds / CONTROL_S) as usize {
        let wrench = controller.hold_attitude(&flight.state(), &target, CONTROL_S as f32);
        controller.note_mixing(&flight.mixer.mix(&wrench));
        flight.step(&wrench);
        attitudes.push(flight.attitude);
    }
    attitudes
}

/// Rise time and overshoot of a roll step of 10 degrees.
fn roll_step(mismatch: Mismatch) -> (f64, f64) {
    let angle = 10.0_f64.to_radians();
    let attitudes = hold(&mut mismatch.hovering(), Quat::from_rotation_x(angle as f32), 1.0);
    let axes: Vec<DVec3> = attitudes.iter().map(|attitude| attitude.to_scaled_axis()).collect();
    assert!(axes.iter().all(|axis| axis.y.abs() < 0.01 && axis.z.abs() < 0.01));
    let rolls: Vec<f64> = axes.iter().map(|axis| axis.x).collect();
    step_figures(&rolls, angle)
}

/// Rise time, overshoot and last error in m of a step of the position.
fn position_step(target: DVec3, thrust: f64) -> (f64, f64, f64) {
    let mut flight = Flight::hovering(thrust);
    let mut controller = geometric();
    controller.preset_hover_thrust_n(VEHICLE.mass_kg * GRAVITY_M_S2 / thrust as f32);
    let errors = flight.follow(&mut controller, 6.0, |_| at(target.as_vec3()));
    let along = target.normalize();
    let values: Vec<f64> = errors.iter().map(|error| (*error + target).dot(along)).collect();
    let (rise, overshoot) = step_figures(&values, target.length());
    (rise, overshoot, errors.last().expect("no steps").length())
}

/// The bar is a rise of 180 ms and an overshoot of 5 %.
#[test]
fn geometric_roll_step_is_fast_and_damped() {
    let (rise, overshoot) = roll_step(Mismatch::NONE);
    println!("roll step: rise {rise:.3} s, overshoot {:.1} %", overshoot * 100.0);
    assert!(rise < 0.18 && overshoot < 0.02, "{rise} {overshoot}");
    for mismatch in [
        Mismatch { thrust: 0.95, ..Mismatch::NONE },
        Mismatch { thrust: 1.05, ..Mismatch::NONE },
        Mismatch { lag: 0.85, ..Mismatch::NONE },
        Mismatch { lag: 1.2, ..Mismatch::NONE },
        Mismatch { inertia: 0.8, ..Mismatch::NONE },
        Mismatch { inertia: 1.2, ..Mismatch::NONE },
    ] {
        let (rise, overshoot) = roll_step(mismatch);
        println!("roll step: rise {rise:.3} s, overshoot {:.1} %", overshoot * 100.0);
        assert!(rise < 0.18 && overshoot < 0.05, "{rise} {overshoot}");
    }
}

/// The bar is 0.3 m, the distance outside a fence at which a robot lands.
#[test]
fn geometric_control_bears_a_weak_motor() {
    for motor in 0..4 {
        let mut controller = geometric();
        let mut flight = Flight::hovering(1.0);
        flight.motor_scale[motor] = 0.8;
        let errors = flight.follow(&mut controller, 8.0, |_| Reference::default());
        let most = errors.iter().map(|error| error.length()).fold(0.0, f64::max);
        let end = errors.last().unwrap().length();
        println!("weak motor: {most:.3} m, at the end {end:.3} m");
        assert!(most < 0.3 && end < 0.02, "{most} {end}");
    }
}

/// The bar is 30 mm rms against the plan.
#[test]
fn geometric_control_follows_a_move() {
    for thrust in [0.95, 1.0, 1.05] {
        for distance in [DVec3::X, DVec3::Y, DVec3::Z, DVec3::new(0.6, 0.64, 0.48)] {
            let mut flight = Flight::hovering(thrust);
            let mut controller = geometric();
            flight.follow(&mut controller, 4.0, |_| at(Vec3::ZERO));
            let errors = flight.follow(&mut controller, 2.0, |t| go_to(distance, 2.0, t));
            println!("move with thrust {thrust}: {:.1} mm rms", 1e3 * rms(&errors));
            let bound_m = if thrust == 1.0 { 0.003 } else { 0.010 };
            assert!(rms(&errors) < bound_m, "{distance} {thrust}: {}", rms(&errors));
        }
    }
}

/// The bar is 35 mm mean.
#[test]
fn geometric_control_follows_a_figure_8() {
    for thrust in [0.95, 1.0] {
        let mut flight = Flight::hovering(thrust);
        let mut controller = geometric();
        flight.follow(&mut controller, 8.0, figure_8);
        let errors = flight.follow(&mut controller, 16.0, figure_8);
        println!("figure 8 with thrust {thrust}: {:.1} mm mean", 1e3 * mean(&errors));
        assert!(mean(&errors) < 0.010, "{thrust}: {}", mean(&errors));
    }
}

/// The bar is an overshoot of 3 %, also with a thrust that is 5 % off.
#[test]
fn geometric_position_step_does_not_overshoot() {
    for thrust in [0.95, 1.0, 1.05] {
        for target in [DVec3::X, DVec3::Z, -DVec3::Z, DVec3::Z * 0.1, DVec3::X * 3.0] {
            let (rise, overshoot, last_m) = position_step(target, thrust);
            println!("step {target}: rise {rise:.2} s, overshoot {:.1} %", overshoot * 100.0);
            assert!(overshoot < 0.03 && last_m < 0.01, "{target} {thrust}: {overshoot} {last_m}");
        }
    }
}

/// Without a preset, a thrust 5 % too low makes the robot sink once, and the integral takes it up.
#[test]
fn geometric_integral_takes_up_a_wrong_thrust() {
    let mut flight = Flight::hovering(0.95);
    let mut controller = geometric();
    let errors = flight.follow(&mut controller, 6.0, |_| at(Vec3::ZERO));
    let deepest = errors.iter().map(|error| -error.z).fold(0.0, f64::max);
    println!("sink: {:.1} mm", 1e3 * deepest);
    assert!(deepest < 0.03, "{deepest}");
    assert!(errors.last().expect("no steps").length() < 1e-3);
    let needed = VEHICLE.mass_kg * GRAVITY_M_S2 / 0.95;
    assert!((controller.hover_thrust_n() - needed).abs() < 0.002 * needed);
}

/// Level-out from a large tilt, and a turn by 120 degrees of yaw.
#[test]
fn geometric_control_returns_from_large_angles() {
    let mut flight = Flight::hovering(1.0);
    flight.attitude = DQuat::from_axis_angle(DVec3::new(0.6, 0.8, 0.0), 1.4);
    flight.rate = DVec3::new(3.0, -2.0, 1.0);
    let attitudes = hold(&mut flight, Quat::IDENTITY, 1.5);
    let tilt = (attitudes.last().copied().expect("no steps") * DVec3::Z).z.acos();
    assert!(tilt < 0.02, "{tilt}");

    let mut flight = Flight::hovering(1.0);
    let mut controller = geometric();
    let turned = |_| Reference { yaw_rad: 2.1, ..Reference::default() };
    let errors = flight.follow(&mut controller, 3.0, turned);
    let highest = errors.iter().map(|error| error.length()).fold(0.0, f64::max);
    assert!(highest < 0.05, "{highest}");
    let yaw = flight.attitude.to_scaled_axis().z;
    assert!((yaw - 2.1).abs() < 0.02, "{yaw}");
}
