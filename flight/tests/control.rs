//! Closed-loop flights of the controllers with a small rigid-body model in f64.
//!
//! The model is independent of the crate's mathematics: Newton-Euler equations with a quaternion,
//! first-order rotors with the lag of the vehicle, their reaction torque, and linear drag. The
//! state is known exactly, so the figures bound the error of control alone.

use bittybuzz_flight::cascade::{Cascade, CascadeSettings};
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
    mixer: Mixer,
    lag: LagCompensation,
    is_lag_compensated: bool,
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
            mixer: Mixer::new(&VEHICLE),
            lag,
            is_lag_compensated: true,
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
        let command = if self.is_lag_compensated {
            self.lag.update(&forces, 1.0, CONTROL_S as f32)
        } else {
            forces
        };
        for _ in 0..SUBSTEPS {
            self.integrate(&command, CONTROL_S / SUBSTEPS as f64);
        }
        self.time += CONTROL_S;
    }

    fn integrate(&mut self, command: &MotorForces, dt: f64) {
        let (arm, mass) = (f64::from(VEHICLE.arm_m), f64::from(VEHICLE.mass_kg));
        let inertia = VEHICLE.inertia_kg_m2.as_dvec3();
        let places = [(arm, -arm), (-arm, -arm), (-arm, arm), (arm, arm)];
        let (mut lift, mut torque) = (0.0, DVec3::ZERO);
        for (i, (x, y)) in places.into_iter().enumerate() {
            let difference = f64::from(command.0[i]) - self.thrust[i];
            let lag = if difference > 0.0 { VEHICLE.spin_up_s } else { VEHICLE.spin_down_s };
            let change = difference / f64::from(lag);
            self.thrust[i] += change * dt;
            let thrust = self.thrust_scale * self.thrust[i];
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

fn roll_step(thrust_scale: f64) -> (f64, f64) {
    let mut flight = Flight::hovering(thrust_scale);
    let mut controller = geometric();
    let angle = 10.0_f64.to_radians();
    let target = AttitudeTarget {
        attitude: Quat::from_rotation_x(angle as f32),
        yaw_rate_rad_s: 0.0,
        thrust_n: VEHICLE.mass_kg * GRAVITY_M_S2,
    };
    let mut rolls = Vec::new();
    for _ in 0..500 {
        let wrench = controller.hold_attitude(&flight.state(), &target, CONTROL_S as f32);
        controller.note_mixing(&flight.mixer.mix(&wrench));
        flight.step(&wrench);
        let axis = flight.attitude.to_scaled_axis();
        rolls.push(axis.x);
        assert!(axis.y.abs() < 0.01 && axis.z.abs() < 0.01);
    }
    step_figures(&rolls, angle)
}

fn position_step(target: DVec3, thrust_scale: f64) -> (f64, f64, f64) {
    let mut flight = Flight::hovering(thrust_scale);
    let mut controller = geometric();
    controller.preset_hover_thrust_n(VEHICLE.mass_kg * GRAVITY_M_S2 / thrust_scale as f32);
    let errors = flight.follow(&mut controller, 6.0, |_| at(target.as_vec3()));
    let values: Vec<f64> =
        errors.iter().map(|error| (*error + target).dot(target.normalize())).collect();
    let (rise, overshoot) = step_figures(&values, target.length());
    (rise, overshoot, errors.last().expect("no steps").length())
}

#[test]
fn print_all() {
    for scale in [0.95, 1.0, 1.05] {
        println!("scale {scale}");
        println!("roll step rise, overshoot {:?}", roll_step(scale));
        println!("x step {:?}", position_step(DVec3::X, scale));
        println!("z step {:?}", position_step(DVec3::Z, scale));
        println!("-z step {:?}", position_step(-DVec3::Z, scale));
        for axis in [DVec3::X, DVec3::Z, DVec3::new(0.6, 0.64, 0.48)] {
            let mut flight = Flight::hovering(scale);
            let mut controller = geometric();
            flight.follow(&mut controller, 4.0, |_| at(Vec3::ZERO));
            let errors = flight.follow(&mut controller, 2.0, |t| go_to(axis, 2.0, t));
            println!("go to {axis}: rms {:.4}, end {:.4}", rms(&errors), errors[999].length());
        }
        let mut flight = Flight::hovering(scale);
        let mut controller = geometric();
        let sink = flight.follow(&mut controller, 4.0, |_| at(Vec3::ZERO));
        println!("sink without preset {:.4}", sink.iter().map(|e| e.length()).fold(0.0, f64::max));
        flight.follow(&mut controller, 8.0, figure_8);
        let errors = flight.follow(&mut controller, 16.0, figure_8);
        println!("figure 8 mean {:.4}", mean(&errors));
    }
    for settings in [CascadeSettings::CRAZYFLIE, CascadeSettings::TRACKING] {
        let mut flight = Flight::hovering(1.0);
        flight.is_lag_compensated = false;
        let mut cascade = Cascade::new(settings);
        let mut errors = Vec::new();
        for k in 0..4000 {
            let t = f64::from(k) * CONTROL_S - 6.0;
            let reference = go_to(DVec3::X, 2.0, t);
            flight.step(&cascade.update(&flight.state(), &reference).wrench(&VEHICLE));
            if t >= 0.0 {
                errors.push(flight.position - reference.position_m.as_dvec3());
            }
        }
        println!("cascade rms {:.4}", rms(&errors));
    }
}
