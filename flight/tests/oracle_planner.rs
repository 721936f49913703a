//! Compares polynomials and the planner with recorded output of Bitcraze's firmware.
//!
//! `flight/tests/vectors/README.md` describes the files. The limit is 1e-4 of the range of each output.

use crate::common::{ColumnErrors, VectorRow, Vectors};
use bittybuzz_flight::Vec3;
use bittybuzz_flight::planner::{Destination, FlightLimits, Planner, PositionFence};
use bittybuzz_flight::polynomial::{Endpoint, Polynomial};

const ERROR_MAX: f64 = 1e-4;
const DERIVATIVES: [&str; 4] = ["position", "velocity", "acceleration", "jerk"];

/// Returns the angle within ±π that differs by a multiple of 2π.
fn wrapped(angle: f64) -> f64 {
    angle - std::f64::consts::TAU * (angle / std::f64::consts::TAU).round()
}

/// Compares an angle with a column; a multiple of 2π makes no difference.
fn compare_angle(errors: &mut ColumnErrors, row: &VectorRow<'_>, column: &str, angle: f32) {
    let expected = row.f64(column);
    errors.add(row, column, expected + wrapped(f64::from(angle) - expected), expected);
}

/// Polynomials by the motion at both ends, and by the recorded coefficients of the powers of the time.
///
/// Coefficients of this crate belong to another variable, so those of the file are compared where
/// the curve shows them: its derivatives at the start are k!·c_k, which gives `c0` to `c4`.
#[test]
fn polynomials_agree() {
    let vectors = Vectors::read("polynomial").unwrap();
    let mut by_ends = ColumnErrors::default();
    let mut by_coefficients = ColumnErrors::default();
    for row in vectors.rows() {
        let end = |suffix: &str| Endpoint {
            position: row.f32(&format!("position{suffix}")),
            velocity: row.f32(&format!("velocity{suffix}")),
            acceleration: row.f32(&format!("acceleration{suffix}")),
        };
        let duration_s = row.f32("duration");
        let curve = Polynomial::between(end("0"), end("1"), duration_s).unwrap();
        let powers = std::array::from_fn(|k| row.f32(&format!("c{k}")));
        let same = Polynomial::from_powers_of_time(powers, duration_s).unwrap();
        for (curve, errors) in [(curve, &mut by_ends), (same, &mut by_coefficients)] {
            for (column, value) in DERIVATIVES.into_iter().zip(curve.at(row.f32("t"))) {
                errors.compare(&row, column, value);
            }
        }
        let factorials = [1.0, 1.0, 2.0, 6.0, 24.0];
        for (k, (value, factorial)) in curve.at(0.0).into_iter().zip(factorials).enumerate() {
            by_ends.compare(&row, &format!("c{k}"), value / factorial);
        }
    }
    by_ends.assert_below("polynomial by ends", ERROR_MAX);
    by_coefficients.assert_below("polynomial by coefficients", ERROR_MAX);
}

/// Curves from any motion to a goal, straight from [`Polynomial`]: the planner has no command that
/// puts its reference into an arbitrary motion, and none for constant velocity (`linear` = 1).
///
/// The angular rate is not compared, see `geometric_law_agrees` in `oracle_control.rs`.
#[test]
fn curves_to_a_goal_agree() {
    let vectors = Vectors::read("go_to").unwrap();
    let mut errors = ColumnErrors::default();
    for row in vectors.rows() {
        let duration_s = row.f32("duration");
        let is_relative = row.bool("relative");
        let mut start = Endpoint {
            position: row.vec3("position0", ""),
            velocity: row.vec3("velocity0", ""),
            acceleration: row.vec3("acceleration0", ""),
        };
        let goal_m = row.vec3("goal", "");
        let mut end = Endpoint::at_rest(if is_relative { start.position + goal_m } else { goal_m });
        let yaw0 = row.f32("yaw0");
        let goal_yaw = row.f64("goal_yaw") - if is_relative { 0.0 } else { f64::from(yaw0) };
        let turn = wrapped(goal_yaw) as f32;
        let mut yaw_start =
            Endpoint { position: yaw0, velocity: row.f32("yaw_rate0"), acceleration: 0.0 };
        let mut yaw_end = Endpoint::at_rest(yaw0 + turn);
        if row.bool("linear") {
            start.velocity = (end.position - start.position) / duration_s;
            start.acceleration = Vec3::ZERO;
            end.velocity = start.velocity;
            yaw_start.velocity = turn / duration_s;
            yaw_end.velocity = yaw_start.velocity;
        }
        let time_s = row.f32("t");
        let values = Polynomial::between(start, end, duration_s).unwrap().at(time_s);
        for (order, (column, value)) in DERIVATIVES.into_iter().zip(values).enumerate() {
            // After its end, a polynomial of this crate keeps its last velocity; the planner hovers.
            if order == 0 || time_s <= duration_s {
                errors.compare_vec3(&row, column, "", value);
            }
        }
        let yaw = Polynomial::between(yaw_start, yaw_end, duration_s).unwrap().at(time_s)[0];
        compare_angle(&mut errors, &row, "yaw", yaw);
    }
    errors.assert_below("go_to, curves", ERROR_MAX);
}

/// The planner itself, for starts at rest without `linear`. Its limits are so wide that each curve
/// takes the commanded duration.
#[test]
fn planner_agrees_from_hover() {
    let vectors = Vectors::read("go_to").unwrap();
    let mut errors = ColumnErrors::default();
    let limits = FlightLimits {
        speed_m_s: 1e3,
        climb_m_s: 1e3,
        acceleration_m_s2: 1e4,
        jerk_m_s3: 1e5,
        yaw_rate_rad_s: 1e3,
    };
    let mut compared = 0;
    for row in vectors.rows() {
        let is_at_rest =
            ["velocity0", "acceleration0"].into_iter().all(|name| row.vec3(name, "") == Vec3::ZERO)
                && row.f32("yaw_rate0") == 0.0;
        if row.bool("linear") || !is_at_rest {
            continue;
        }
        compared += 1;
        let mut planner = Planner::<1>::new(limits, PositionFence::WIDE).unwrap();
        let position_m = row.vec3("position0", "");
        let ground_m = position_m - Vec3::Z;
        planner.take_off(0.0, ground_m, row.f32("yaw0"), position_m.z, Some(1.0)).unwrap();
        planner.reference(2.0).unwrap();
        let (goal_m, goal_yaw) = (row.vec3("goal", ""), row.f32("goal_yaw"));
        let destination = if row.bool("relative") {
            Destination::Relative { displacement_m: goal_m, turn_rad: goal_yaw }
        } else {
            Destination::Absolute { position_m: goal_m, yaw_rad: Some(goal_yaw) }
        };
        let duration_s = row.f32("duration");
        let report = planner.go_to(2.0, destination, Some(duration_s)).unwrap();
        assert_eq!(report.duration_s, duration_s, "{row}");
        let reference = planner.reference(2.0 + row.f64("t")).unwrap();
        let values = [
            reference.position_m,
            reference.velocity_m_s,
            reference.acceleration_m_s2,
            reference.jerk_m_s3,
        ];
        for (column, value) in DERIVATIVES.into_iter().zip(values) {
            errors.compare_vec3(&row, column, "", value);
        }
        compare_angle(&mut errors, &row, "yaw", reference.yaw_rad);
    }
    println!("go_to: {compared} of {} cases", vectors.rows().len());
    assert!(compared * 5 >= vectors.rows().len(), "{compared}");
    errors.assert_below("go_to, planner", ERROR_MAX);
}
