//! Compares the controllers, the mixer and the battery's compensation with recorded output of
//! Bitcraze's firmware.
//!
//! `flight/tests/vectors/README.md` describes the files. The limit is 1e-4 of the range of each output.

use crate::common::{ColumnErrors, VectorRow, Vectors};
use bittybuzz_flight::geometric::{GeometricController, GeometricSettings};
use bittybuzz_flight::mixer::{Mixer, MixerOutcome};
use bittybuzz_flight::motor::BatteryCompensation;
use bittybuzz_flight::{FlightState, MotorForces, Reference, Vec3, Vehicle, Wrench};

const ERROR_MAX: f64 = 1e-4;
/// Counts of the largest thrust and of a duty of 1.
const COUNTS: f32 = 65535.0;

/// The geometric law of Lee. All rows with a positive thrust are comparable, apart from the
/// feed-forward of the rate:
/// * The firmware divides the jerk by its thrust, and multiplies the rate of yaw by the z component of
///   the desired axis. This crate has the exact derivatives, which the tests of
///   `geometric::flatness` compare with numerical differentiation.
/// * The firmware leaves out the term J(Ω̇_r − Ω × Ω_r).
///
/// So the reference here has no jerk and no rate of yaw, and the recorded torque is compared without
/// the feed-forward k_Ω Ω_r, which the file has.
#[test]
fn geometric_law_agrees() {
    let vectors = Vectors::read("lee").unwrap();
    let mut errors = ColumnErrors::default();
    let inertia = GeometricSettings::BITCRAZE_LEE_INERTIA_KG_M2;
    let vehicle = Vehicle { mass_kg: 0.029, inertia_kg_m2: inertia, ..Vehicle::CRAZYFLIE_2_1_PLUS };
    let law = GeometricSettings::BITCRAZE_LEE;
    // The torque of a robot that does not turn is then the negative attitude error.
    let attitude_alone = GeometricSettings {
        attitude_1_s2: inertia.recip(),
        rate_1_s: Vec3::ZERO,
        attitude_integral_1_s3: Vec3::ZERO,
        ..law
    };
    let mut compared = 0;
    for row in vectors.rows() {
        if row.f64("thrust") <= 0.0 {
            continue;
        }
        compared += 1;
        let state = FlightState {
            position_m: row.vec3("position", ""),
            velocity_m_s: row.vec3("velocity", ""),
            attitude: row.quat(""),
            rate_rad_s: row.vec3("rate", ""),
        };
        let reference = Reference {
            position_m: row.vec3("to_position", ""),
            velocity_m_s: row.vec3("to_velocity", ""),
            acceleration_m_s2: row.vec3("to_acceleration", ""),
            yaw_rad: row.f32("to_yaw"),
            ..Reference::default()
        };
        let wrench = GeometricController::new(&vehicle, law).update(&state, &reference, 0.002);
        errors.compare(&row, "thrust", wrench.thrust_n);
        let rate_gain_n_m_s = Vec3::new(0.00115, 0.00115, 0.002);
        let expected = row.vec3("torque", "") - rate_gain_n_m_s * row.vec3("rate_r", "");
        for axis in 0..3 {
            let name = ["torque_x", "torque_y", "torque_z"][axis];
            errors.add(row, name, wrench.torque_n_m[axis].into(), expected[axis].into());
        }
        let at_rest = FlightState { rate_rad_s: Vec3::ZERO, ..state };
        let wrench =
            GeometricController::new(&vehicle, attitude_alone).update(&at_rest, &reference, 0.002);
        errors.compare_vec3(&row, "attitude_error", "", -wrench.torque_n_m);
    }
    assert!(compared * 100 >= vectors.rows().len() * 98, "{compared}");
    errors.assert_below("lee", ERROR_MAX);
}

/// The vehicle of the column `platform`, with the firmware's arm.
fn vehicle(row: &VectorRow<'_>) -> Vehicle {
    let sine_45 = std::f32::consts::FRAC_1_SQRT_2;
    if row.bool("platform") {
        Vehicle { arm_m: sine_45 * 0.05, ..Vehicle::CRAZYFLIE_BRUSHLESS }
    } else {
        Vehicle { arm_m: sine_45 * 0.046, ..Vehicle::CRAZYFLIE_2_1_PLUS }
    }
}

/// Compares the forces of the motors in rows in which no motor reaches a limit. There is no other
/// mixing then. At a limit the firmware lowers all motors alike, which loses thrust and keeps the
/// torque about z, while this crate gives up that torque first.
fn compare_mixing(name: &str, wrench: impl Fn(&VectorRow<'_>, &Vehicle) -> Wrench) {
    let vectors = Vectors::read(name).expect(name);
    let mut errors = ColumnErrors::default();
    let mut compared = 0;
    for row in vectors.rows() {
        let columns = ["raw1", "raw2", "raw3", "raw4"];
        // Half a count of roll or pitch is cut, so a motor close to a limit may reach it.
        let is_free = |column: &str| (2.0..f64::from(COUNTS) - 2.0).contains(&row.f64(column));
        if !columns.into_iter().all(is_free) {
            continue;
        }
        compared += 1;
        let vehicle = vehicle(&row);
        let outcome = Mixer::new(&vehicle).mix(&wrench(&row, &vehicle));
        let uncut = MixerOutcome { forces: outcome.forces, ..MixerOutcome::default() };
        assert_eq!(outcome, uncut, "{row}");
        for (column, force) in columns.into_iter().zip(outcome.forces.0) {
            errors.compare(&row, column, force / vehicle.most_thrust_n * COUNTS);
        }
    }
    println!("{name}: {compared} of {} cases", vectors.rows().len());
    assert!(compared >= 1000, "{compared}");
    errors.assert_below(name, ERROR_MAX);
}

#[test]
fn mixing_of_a_wrench_agrees() {
    compare_mixing("mixer_wrench", |row, _| Wrench {
        thrust_n: row.f32("thrust"),
        torque_n_m: row.vec3("torque", ""),
    });
}

/// The firmware adds to each motor the thrust, half of roll and pitch, and the whole of yaw, with
/// the motor's signs.
#[test]
fn mixing_of_commands_agrees() {
    compare_mixing("mixer_legacy", |row, vehicle| {
        let thrust_per_count_n = 4.0 * vehicle.most_thrust_n / COUNTS;
        let arm_m = vehicle.arm_m / 2.0;
        let arms_m = Vec3::new(arm_m, arm_m, vehicle.torque_per_thrust_m);
        let counts = Vec3::new(row.f32("roll"), row.f32("pitch"), row.f32("yaw"));
        Wrench {
            thrust_n: thrust_per_count_n * row.f32("thrust"),
            torque_n_m: thrust_per_count_n * arms_m * counts,
        }
    });
}

/// All rows are comparable. This crate limits a duty to 1, which the firmware leaves to the timer.
#[test]
fn battery_compensation_agrees() {
    let vectors = Vectors::read("battery").unwrap();
    let mut errors = ColumnErrors::default();
    for row in vectors.rows() {
        let vehicle = vehicle(&row);
        let mut compensation = BatteryCompensation::new(&vehicle);
        compensation.measure(row.f32("battery"), 0.0);
        let force = row.f32("thrust") / COUNTS * vehicle.most_thrust_n;
        let duty = compensation.duties(&MotorForces([force; 4])).0[0];
        let expected = row.f64("output").min(COUNTS.into());
        errors.add(row, "output", f64::from(duty * COUNTS), expected);
    }
    errors.assert_below("battery", ERROR_MAX);
}
