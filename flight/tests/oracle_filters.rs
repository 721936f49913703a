//! Compares the low-pass and complementary filters with recorded output of Bitcraze's firmware.
//!
//! `flight/tests/vectors/README.md` describes the files. The limit is 1e-4 of the range of each output.

use crate::common::{ColumnErrors, Vectors};
use bittybuzz_flight::complementary::ComplementaryFilter;
use bittybuzz_flight::filter::Butterworth;
use bittybuzz_flight::{ImuSample, Vec3};

const LIMIT: f64 = 1e-4;

/// All rows are comparable. Sequences carry the state on.
#[test]
fn low_pass_filter_agrees() {
    let vectors = Vectors::read("lowpass").unwrap();
    let mut errors = ColumnErrors::default();
    let mut filter = None;
    for row in vectors.rows() {
        if row.f64("step") == 0.0 {
            filter = Butterworth::new(row.f32("cutoff_hz"), row.f32("rate_hz"), 0.0);
        }
        let filter = filter.as_mut().unwrap();
        let input = row.f32("input");
        let output = if row.bool("reset") {
            filter.reset(input);
            filter.output()
        } else {
            filter.update(input)
        };
        errors.compare(&row, "output", output);
    }
    errors.assert_below("lowpass", LIMIT);
}

/// Each row is one update from the recorded state.
///
/// The firmware's reciprocal square root is approximate, so in rows with `exact` = 0 its quaternion
/// is up to 0.18 % too long or short. Only the rotation that it stands for is comparable there, so
/// the recorded quaternions are normalized. The integral of the firmware is the negative bias.
///
/// Rows with a bias but without a specific force are left out: there the firmware ignores the bias,
/// while this crate always subtracts it.
#[test]
fn updates_of_the_complementary_filter_agree() {
    let vectors = Vectors::read("complementary").unwrap();
    let mut errors = ColumnErrors::default();
    let mut compared = 0;
    for row in vectors.rows() {
        let is_unbiased = row.vec3("integral", "in") == Vec3::ZERO;
        if row.vec3("force", "") == Vec3::ZERO && !is_unbiased {
            continue;
        }
        compared += 1;
        let mut filter = ComplementaryFilter::with_attitude(row.quat("in"))
            .and_then(|filter| filter.with_gyro_bias(-row.vec3("integral", "in")))
            .unwrap();
        let dt_s = row.f32("dt_s");
        let sample =
            ImuSample { gyro_rad_s: row.vec3("rate", ""), accel_m_s2: row.vec3("force", "") };
        let result = filter.update(&sample, dt_s);
        let expected = row.quat("out").normalize();
        let result = if result.dot(expected) < 0.0 { -result } else { result };
        let parts = result.to_array().into_iter().zip(expected.to_array());
        for (name, (part, expected)) in ["qx", "qy", "qz", "qw"].into_iter().zip(parts) {
            errors.add(row, name, part.into(), expected.into());
        }
        errors.compare_vec3(&row, "integral", "out", -filter.gyro_bias_rad_s());
        // From an integral of zero, the change keeps all its digits.
        if row.bool("exact") && is_unbiased {
            let change = -filter.gyro_bias_rad_s() / dt_s;
            let expected = row.vec3("integral", "out") / dt_s;
            for axis in 0..3 {
                let name = ["change_x", "change_y", "change_z"][axis];
                errors.add(row, name, change[axis].into(), expected[axis].into());
            }
        }
    }
    assert!(compared * 100 >= vectors.rows().len() * 98, "{compared}");
    errors.assert_below("complementary", LIMIT);
}

/// Sequences with `exact` = 1 carry the state of this crate's filter on for 25 updates.
#[test]
fn sequences_of_the_complementary_filter_agree() {
    let vectors = Vectors::read("complementary").unwrap();
    let mut errors = ColumnErrors::default();
    let mut filter = ComplementaryFilter::new();
    // Only rows of a sequence have a successor with a step above 0.
    let steps = vectors.rows().skip(1).map(|row| row.f64("step")).chain([0.0]);
    for (row, next_step) in vectors.rows().zip(steps) {
        if !row.bool("exact") || (row.f64("step") == 0.0 && next_step == 0.0) {
            continue;
        }
        if row.f64("step") == 0.0 {
            filter = ComplementaryFilter::with_attitude(row.quat("in"))
                .and_then(|filter| filter.with_gyro_bias(-row.vec3("integral", "in")))
                .unwrap();
        }
        let sample =
            ImuSample { gyro_rad_s: row.vec3("rate", ""), accel_m_s2: row.vec3("force", "") };
        errors.compare_quat(&row, "out", filter.update(&sample, row.f32("dt_s")));
        errors.compare_vec3(&row, "integral", "out", -filter.gyro_bias_rad_s());
    }
    errors.assert_below("complementary, sequences", LIMIT);
}
