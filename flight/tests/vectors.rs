//! The reader of recorded vectors, and the form of the recorded files.

use std::path::Path;

use crate::common::{ColumnErrors, Vectors};
use bittybuzz_flight::{Quat, Vec3};

const TEXT: &str = "# a comment\n\
                    v_x_in,v_y_in,v_z_in,qw,qx,qy,qz,flag\n\
                    1,2.5,-3e-2,0,0,0,1,1\n\
                    0.1,0,4,1,0,0,0,0\n";

fn parse(text: &str) -> Result<Vectors, String> {
    Vectors::parse(Path::new("a.csv"), text).map_err(|error| error.to_string())
}

#[test]
fn rows_give_scalars_vectors_and_rotations() {
    let vectors = parse(TEXT).unwrap();
    assert_eq!(vectors.columns().len(), 8);
    let rows: Vec<_> = vectors.rows().collect();
    assert_eq!(rows.len(), 2);
    assert_eq!(rows[0].vec3("v", "in"), Vec3::new(1.0, 2.5, -0.03));
    assert_eq!(rows[0].quat(""), Quat::from_xyzw(0.0, 0.0, 1.0, 0.0));
    assert!(rows[0].bool("flag") && !rows[1].bool("flag"));
    assert_eq!(rows[1].f32("v_x_in"), 0.1);
    assert_eq!(rows[1].to_string(), "a.csv:4");
}

#[test]
fn errors_name_file_and_line() {
    let of = |text: &str| parse(text).unwrap_err();
    assert_eq!(of("# only a comment\n"), "a.csv:0: no line names the columns");
    assert_eq!(of("a,b\n"), "a.csv:0: no case");
    assert_eq!(of("1,2\n"), "a.csv:1: numbers in place of names of columns");
    assert_eq!(of("#\na,b\n1,2\n1\n"), "a.csv:4: 1 fields, but 2 columns");
    assert_eq!(of("a,b\n1,x\n"), "a.csv:2: `x` is not a finite number");
    assert_eq!(of("a,b\n1,NaN\n"), "a.csv:2: `NaN` is not a finite number");
    let missing = Vectors::read_file(Path::new("missing.csv")).unwrap_err();
    assert!(missing.to_string().starts_with("missing.csv:0: "), "{missing}");
}

#[test]
#[should_panic(expected = "a.csv:3: no column `w`")]
fn absent_columns_name_the_line() {
    let vectors = parse(TEXT).unwrap();
    let sum: f64 = vectors.rows().map(|row| row.f64("w")).sum();
    assert!(sum.is_nan(), "{sum}");
}

#[test]
fn errors_are_relative_to_the_range_of_a_column() {
    let vectors = parse(TEXT).unwrap();
    let mut errors = ColumnErrors::default();
    for row in vectors.rows() {
        errors.compare_vec3(&row, "v", "in", row.vec3("v", "in") + Vec3::new(0.0, 0.25, 0.0));
        errors.compare_quat(&row, "", -row.quat(""));
    }
    for (column, error) in errors.relative() {
        let expected = if column == "v_y_in" { 0.1 } else { 0.0 };
        assert!((error - expected).abs() < 1e-6, "{column}: {error}");
    }
    errors.assert_below("test", 0.11);
}

#[test]
#[should_panic(expected = "v_x_in: inf at a.csv:3")]
fn a_result_that_is_not_finite_fails() {
    let vectors = parse(TEXT).unwrap();
    let mut errors = ColumnErrors::default();
    vectors.rows().for_each(|row| errors.compare(&row, "v_x_in", f32::NAN));
    errors.assert_below("test", 1e9);
}

/// Each file with its least number of cases and columns that a caller relies on.
const FILES: [(&str, usize, &[&str]); 14] = [
    ("battery", 1000, &["thrust", "battery", "output"]),
    ("ekf_flow", 1000, &["flow_x", "dt_s", "p88_out"]),
    ("ekf_height", 1000, &["height", "p88_out"]),
    ("ekf_pose", 1000, &["mw", "p88_out"]),
    ("ekf_position", 1000, &["deviation", "p88_out"]),
    ("ekf_predict", 1000, &["flying", "p88_out", "noise_p88"]),
    ("ekf_start", 1000, &["case", "p88_in"]),
    ("ekf_tof", 1000, &["distance", "p88_out"]),
    ("go_to", 1000, &["relative", "goal_yaw", "yaw"]),
    ("lee", 1000, &["to_yaw", "thrust", "torque_z", "rate_r_z"]),
    ("lowpass", 1000, &["reset", "a2", "input", "output"]),
    ("mixer_legacy", 1000, &["platform", "raw1", "raw4"]),
    ("mixer_wrench", 1000, &["platform", "torque_x", "raw4"]),
    ("polynomial", 1000, &["duration", "c7", "jerk"]),
];

#[test]
fn recorded_files_are_complete() {
    for (name, cases, columns) in FILES {
        let vectors = Vectors::read(name).unwrap();
        assert!(vectors.rows().len() >= cases, "{name}: {} cases", vectors.rows().len());
        for column in columns {
            assert!(vectors.columns().iter().any(|name| name == column), "{name}: no `{column}`");
        }
    }
}

#[test]
fn recorded_covariances_are_positive() {
    for row in Vectors::read("ekf_start").unwrap().rows() {
        let p = row.covariance("in").map(|line| line.map(f64::from));
        // The factor L of P = L·Lᵀ (Cholesky) exists only for a positive matrix.
        let mut factor = [[0.0; 9]; 9];
        for i in 0..9 {
            for j in 0..=i {
                let rest = p[i][j] - (0..j).map(|k| factor[i][k] * factor[j][k]).sum::<f64>();
                assert!(i != j || rest > 0.0, "{row}: state {i}");
                factor[i][j] = if i == j { rest.sqrt() } else { rest / factor[j][j] };
            }
        }
    }
}
