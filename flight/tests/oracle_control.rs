//! Compares the controllers, the mixer and the battery's compensation with recorded output of
//! Bitcraze's firmware.
//!
//! `flight/tests/vectors/README.md` describes the files. The limit is 1e-4 of the range of each output.

use crate::common::{ColumnErrors, VectorRow, Vectors};
use bittybuzz_flight::cascade::{ATTITUDE_PERIOD_S, Cascade, CascadeCommand, CascadeSettings};
use bittybuzz_flight::geometric::{GeometricController, GeometricSettings};
use bittybuzz_flight::mixer::{Mixer, MixerOutcome};
use bittybuzz_flight::motor::BatteryCompensation;
use bittybuzz_flight::pid::Pid;
use bittybuzz_flight::{FlightState, MotorForces, Reference, Vec3, Vehicle, Wrench};

const LIMIT: f64 = 1e-4;
/// Counts of the largest thrust and of a duty of 1.
const COUNTS: f32 = 65535.0;
/// Ticks of the attitude loop in one step of the loops of position and velocity.
const TICKS: u32 = 5;
const TORQUES: [&str; 3] = ["roll_counts", "pitch_counts", "yaw_counts"];
const RATES: [&str; 3] = ["desired_roll_rate", "desired_pitch_rate", "desired_yaw_rate"];

/// Modes of `cascade.csv`.
const POSITION: f64 = 0.0;
const ATTITUDE: f64 = 3.0;
const RATE: f64 = 4.0;

fn degrees(row: &VectorRow<'_>, column: &str) -> f32 {
    row.f64(column).to_degrees() as f32
}

/// The state of a row of `cascade.csv`, whose angles are rotations about z, y and x.
fn cascade_state(row: &VectorRow<'_>) -> FlightState {
    let half = |column: &str| 0.5 * row.f64(column);
    let turn = |axis: glam::DVec3, half: f64| {
        glam::DQuat::from_xyzw(
            axis.x * half.sin(),
            axis.y * half.sin(),
            axis.z * half.sin(),
            half.cos(),
        )
    };
    let attitude = turn(glam::DVec3::Z, half("yaw"))
        * turn(glam::DVec3::Y, half("pitch"))
        * turn(glam::DVec3::X, half("roll"));
    FlightState {
        position_m: row.vec3("position", ""),
        velocity_m_s: row.vec3("velocity", ""),
        attitude: attitude.as_quat(),
        rate_rad_s: row.vec3("rate", ""),
    }
}

/// The whole cascade, in the modes that it has: position with yaw, and attitude with thrust.
///
/// In the mode of attitude the firmware adds up the commanded rate of yaw; this crate takes the yaw,
/// so the recorded sum is its input.
///
/// At the first tick after a reset the firmware takes 0 for the previous rate, which gives a kick of
/// the derivative; this crate takes the present rate. The torques of roll and pitch are not
/// comparable at that tick; yaw has no derivative.
#[test]
fn cascade_agrees() {
    let vectors = Vectors::read("cascade").unwrap();
    let mut errors = ColumnErrors::default();
    let mut cascade = Cascade::new(CascadeSettings::CRAZYFLIE);
    for row in vectors.rows() {
        let (mode, tick) = (row.f64("mode"), row.f64("tick"));
        if tick == 0.0 {
            cascade.reset();
        }
        let state = cascade_state(&row);
        let command = if mode == POSITION {
            let reference = Reference {
                position_m: row.vec3("to_position", ""),
                yaw_rad: row.f32("to_yaw"),
                ..Reference::default()
            };
            cascade.update(&state, &reference)
        } else if mode == ATTITUDE {
            let desired = ["to_roll", "to_pitch", "desired_yaw"].map(|name| degrees(&row, name));
            cascade.hold_attitude(&state, desired, row.f32("to_thrust"))
        } else {
            continue;
        };
        let torques = [command.roll_counts, command.pitch_counts, command.yaw_counts];
        for (axis, (name, torque)) in TORQUES.into_iter().zip(torques).enumerate() {
            if tick > 0.0 || axis == 2 {
                errors.compare(&row, name, torque);
            }
        }
        errors.compare(&row, "thrust_counts", command.thrust_counts);
    }
    errors.assert_below("cascade", LIMIT);
}

/// Each loop by itself in all modes, with the recorded output of the loop above as its input.
///
/// Columns that a mode does not use are left out, and torques with a derivative at the first tick, as
/// in [`cascade_agrees`]. Loops of the horizontal velocity work in the frame that turns with the yaw.
#[test]
fn loops_of_the_cascade_agree() {
    let vectors = Vectors::read("cascade").unwrap();
    let mut errors = ColumnErrors::default();
    let settings = CascadeSettings::CRAZYFLIE;
    let gains = [
        [settings.position_xy, settings.position_xy, settings.position_z],
        [settings.velocity_xy, settings.velocity_xy, settings.velocity_z],
        [settings.tilt, settings.tilt, settings.yaw],
        [settings.tilt_rate, settings.tilt_rate, settings.yaw_rate],
    ];
    let new_loops = || gains.map(|level| level.map(Pid::new));
    let mut loops = new_loops();
    for row in vectors.rows() {
        let (mode, tick) = (row.f64("mode"), row.f64("tick") as u32);
        if tick == 0 {
            loops = new_loops();
        }
        let [position, velocity, attitude, rate] = &mut loops;
        if mode < ATTITUDE && tick % TICKS == 0 {
            let (sin, cos) = row.f64("yaw").sin_cos();
            let (sin, cos) = (sin as f32, cos as f32);
            let turn = |v: Vec3| [v.x * cos + v.y * sin, v.y * cos - v.x * sin, v.z];
            let wanted_m = turn(row.vec3("to_position", ""));
            let position_m = turn(row.vec3("position", ""));
            let velocity_m_s = turn(row.vec3("velocity", ""));
            let commanded = row.vec3("to_velocity", "");
            let period_s = ATTITUDE_PERIOD_S * TICKS as f32;
            // Mode 2 commands a velocity in the frame that turns with the yaw, and a height.
            let commanded = if mode == 2.0 { commanded.to_array() } else { turn(commanded) };
            let output: [f32; 3] = std::array::from_fn(|axis| {
                let wanted = if mode == POSITION || (mode == 2.0 && axis == 2) {
                    position[axis].update(wanted_m[axis], position_m[axis], period_s)
                } else {
                    commanded[axis]
                };
                velocity[axis].update(wanted, velocity_m_s[axis], period_s)
            });
            let most = settings.most_tilt_deg;
            let tilt = [-output[1], output[0]].map(|angle| angle.clamp(-most, most).to_radians());
            errors.compare(&row, "desired_roll", tilt[0]);
            errors.compare(&row, "desired_pitch", tilt[1]);
            let thrust = output[2] * 1000.0 + settings.thrust_base_counts;
            let thrust = thrust.clamp(settings.least_thrust_counts, COUNTS);
            errors.compare(&row, "thrust_counts", thrust);
        }
        for (axis, angle) in ["roll", "pitch", "yaw"].into_iter().enumerate() {
            let desired = degrees(&row, &format!("desired_{angle}"));
            let measured = degrees(&row, angle);
            let output = if axis == 2 {
                attitude[axis].update_angle_deg(desired, measured, ATTITUDE_PERIOD_S)
            } else {
                attitude[axis].update(desired, measured, ATTITUDE_PERIOD_S)
            };
            if mode != RATE || axis == 2 {
                errors.compare(&row, RATES[axis], output.to_radians());
            }
            let measured = degrees(&row, ["rate_x", "rate_y", "rate_z"][axis]);
            let output = rate[axis].update(degrees(&row, RATES[axis]), measured, ATTITUDE_PERIOD_S);
            if tick > 0 || axis == 2 {
                errors.compare(&row, TORQUES[axis], output.clamp(-32767.0, 32767.0));
            }
        }
    }
    errors.assert_below("cascade, loops", LIMIT);
}

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
    errors.assert_below("lee", LIMIT);
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
    errors.assert_below(name, LIMIT);
}

#[test]
fn mixing_of_a_wrench_agrees() {
    compare_mixing("mixer_wrench", |row, _| Wrench {
        thrust_n: row.f32("thrust"),
        torque_n_m: row.vec3("torque", ""),
    });
}

#[test]
fn mixing_of_commands_agrees() {
    compare_mixing("mixer_legacy", |row, vehicle| {
        let command = CascadeCommand {
            roll_counts: row.f32("roll"),
            pitch_counts: row.f32("pitch"),
            yaw_counts: row.f32("yaw"),
            thrust_counts: row.f32("thrust"),
        };
        command.wrench(vehicle)
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
    errors.assert_below("battery", LIMIT);
}
