//! Compares the Kalman filter with recorded output of Bitcraze's firmware.
//!
//! `flight/tests/vectors/README.md` describes the files. The limit is 1e-4 of the range of each output.
//! Each case starts from a state and covariance of `ekf_start.csv`, in the configuration
//! [`EkfConfig::NINE_STATES`], with variances of zero for the biases.
//!
//! # Outputs
//! Columns of the files are compared as they are. A few large covariances determine the range of a
//! column, so two other forms of the output are compared as well, under their own names:
//! * `share pIJ`: covariances divided by the standard deviations before the call, which lie within ±1
//!   after an update;
//! * `change`: the state after minus the state before, and the rotation vector between both.
//!
//! The firmware drops an estimated turn of up to 1e-4 rad about each axis; this crate never does.
//! That difference is below the limit for the columns of the file. The other forms leave out the
//! attitude of such cases. They also leave out states with a variance near the floor of 1e-6, which
//! the firmware applies after each scalar, and this crate after the last one.
//!
//! # Differences that the cases avoid
//! * Flow: the firmware does not subtract the change of the state by x from the innovation of y. Either
//!   y is independent in a case, or the innovation of x is 0.
//! * Flow below 0.1 m: the firmware keeps the derivative by the height, this crate takes 0.
//! * Pose: the firmware does not subtract the changes of the attitude error by the scalar updates
//!   before. The cases have no covariances of the attitude error, so there are no such changes.
//! * Gates: the firmware's functions have none. Innovations are small enough that no gate rejects.
//! * Tilt beyond 84 degrees: sensors below the robot are refused here; flow is not in the firmware.

use crate::common::{ColumnErrors, VectorRow, Vectors};
use bittybuzz_flight::ekf::{
    Ekf, EkfConfig, EkfNoise, EkfOutcome, FlowMeasurement, PoseMeasurement, PositionMeasurement,
};
use bittybuzz_flight::{FlightState, ImuSample, Quat, Vec3};

const ERROR_MAX: f64 = 1e-4;
const STATES: [&str; 9] = ["x", "y", "z", "px", "py", "pz", "d0", "d1", "d2"];
/// Number of covariances that a row records.
const RECORDED: usize = 9;
/// Variance of the rounding of flow to whole counts, which this crate adds.
const QUANTIZATION_VARIANCE: f32 = 1.0 / 12.0;

/// Variance below which the floor of 1e-6 may have acted.
const NEAR_FLOOR: f64 = 2e-6;

type Covariance = [[f32; 9]; 9];

/// The state and covariance before a call.
struct Start {
    position_m: Vec3,
    /// In the body frame.
    velocity_m_s: Vec3,
    attitude: Quat,
    covariance: Covariance,
}

impl Start {
    fn new(row: &VectorRow<'_>) -> Self {
        Start {
            position_m: row.vec3("", "in"),
            velocity_m_s: Vec3::new(row.f32("px_in"), row.f32("py_in"), row.f32("pz_in")),
            attitude: row.quat("in").normalize(),
            covariance: row.covariance("in"),
        }
    }

    /// Creates a filter with this state and covariance.
    fn filter(&self, config: EkfConfig) -> Ekf {
        let state = FlightState {
            position_m: self.position_m,
            velocity_m_s: self.attitude * self.velocity_m_s,
            attitude: self.attitude,
            rate_rad_s: Vec3::ZERO,
        };
        let mut filter = Ekf::new(config, &state);
        self.give_covariance(&mut filter);
        filter
    }

    /// Sets the covariances of one state with the others to 0.
    fn isolate(&mut self, state: usize) {
        for other in (0..9).filter(|other| *other != state) {
            self.covariance[state][other] = 0.0;
            self.covariance[other][state] = 0.0;
        }
    }

    fn give_covariance(&self, filter: &mut Ekf) {
        let mut covariance = [[0.0; 13]; 13];
        for (row, from) in covariance.iter_mut().zip(&self.covariance) {
            row[..9].copy_from_slice(from);
        }
        filter.adopt_covariance(&covariance).expect("a covariance");
    }

    /// Creates a filter that reaches this state after it turned at a constant rate for `seconds`.
    fn filter_after_turn(&self, rate_rad_s: Vec3, seconds: f32) -> Ekf {
        let attitude = self.attitude * Quat::from_scaled_axis(rate_rad_s * seconds).conjugate();
        let velocity = self.velocity_m_s;
        // This specific force keeps the velocity in the body frame as it is.
        let accel_m_s2 =
            attitude.conjugate() * Vec3::new(0.0, 0.0, 9.81) + rate_rad_s.cross(velocity);
        let sample = ImuSample { gyro_rad_s: rate_rad_s, accel_m_s2 };
        let run = |position_m: Vec3| {
            let before =
                FlightState { position_m, velocity_m_s: attitude * velocity, attitude, rate_rad_s };
            let mut filter = Ekf::new(EkfConfig::NINE_STATES, &before);
            filter.propagate(&sample, seconds).expect("a valid sample");
            filter
        };
        let travel_m = run(Vec3::ZERO).state().position_m;
        let mut filter = run(self.position_m - travel_m);
        self.give_covariance(&mut filter);
        filter
    }
}

/// Compares a filter with the recorded state and covariance after the call. The attitude is left out
/// if `has_attitude` is false.
fn compare(
    errors: &mut ColumnErrors,
    row: &VectorRow<'_>,
    start: &Start,
    filter: &Ekf,
    has_attitude: bool,
) {
    let state = filter.state();
    let body_velocity_m_s = filter.body_velocity_m_s();
    let before = [start.position_m.to_array(), start.velocity_m_s.to_array()].concat();
    let after = [state.position_m.to_array(), body_velocity_m_s.to_array()].concat();
    for ((name, before), after) in STATES.into_iter().zip(before).zip(after) {
        let column = format!("{name}_out");
        errors.compare(row, &column, after);
        let expected = row.f64(&column) - f64::from(before);
        errors.add(row, &format!("change {name}"), f64::from(after - before), expected);
    }
    let mut has_turn = true;
    if has_attitude {
        errors.compare_quat(row, "out", state.attitude);
        let turn = |after: Quat| {
            let turn = start.attitude.conjugate() * after;
            (turn.xyz() * (2.0 * turn.w.signum())).to_array()
        };
        let expected = turn(row.quat("out"));
        // The firmware drops a turn of up to 1e-4 rad about each axis.
        has_turn = expected.iter().any(|angle| angle.abs() > 1e-6);
        let turns = turn(state.attitude).into_iter().zip(expected).filter(|_| has_turn);
        for (name, (turn, expected)) in ["d0", "d1", "d2"].into_iter().zip(turns) {
            errors.add(row, &format!("change {name}"), turn.into(), expected.into());
        }
    }
    let covariance = filter.covariance();
    let mut compare_entry = |i: usize, j: usize, expected: f64| {
        let result = f64::from(covariance[i][j]);
        errors.add(row, &format!("p{i}{j}_out"), result, expected);
        let is_near_floor = [i, j].iter().any(|k| row.f64(&format!("p{k}{k}_out")) < NEAR_FLOOR);
        if is_near_floor || (j > 5 && !has_turn) {
            return;
        }
        let variances = start.covariance[i][i] * start.covariance[j][j];
        let scale = f64::from(variances).sqrt();
        errors.add(row, &format!("share p{i}{j}"), result / scale, expected / scale);
    };
    for i in 0..9 {
        compare_entry(i, i, row.f64(&format!("p{i}{i}_out")));
    }
    let off_diagonal = (0..9).flat_map(|i| (i + 1..9).map(move |j| (i, j)));
    let quarter = row.f64("quarter") as usize;
    let places: Vec<(usize, usize)> = off_diagonal.skip(quarter).step_by(4).collect();
    assert_eq!(places.len(), RECORDED);
    for (k, (i, j)) in places.into_iter().enumerate() {
        compare_entry(i, j, row.f64(&format!("c{k}")));
    }
}

/// Runs `case` for each row of a file, with the start that the row names.
fn for_each_case(name: &str, mut case: impl FnMut(&VectorRow<'_>, &mut Start)) {
    let starts = Vectors::read("ekf_start").expect("ekf_start.csv");
    let starts: Vec<VectorRow<'_>> = starts.rows().collect();
    for row in Vectors::read(name).expect(name).rows() {
        let start = &starts[row.f64("case") as usize];
        assert_eq!(start.f64("case"), row.f64("case"));
        case(&row, &mut Start::new(start));
    }
}

/// Compares updates, of which every one must be accepted.
fn compare_updates(name: &str, update: impl Fn(&VectorRow<'_>, &mut Start) -> (Ekf, EkfOutcome)) {
    let mut errors = ColumnErrors::default();
    for_each_case(name, |row, start| {
        let (filter, outcome) = update(row, start);
        assert!(outcome.is_accepted(), "{row}: {outcome:?}");
        compare(&mut errors, row, start, &filter, true);
    });
    errors.assert_below(name, ERROR_MAX);
}

fn position(row: &VectorRow<'_>, deviation: &str) -> PositionMeasurement {
    PositionMeasurement {
        position_m: row.vec3("measured", ""),
        sigma_m: row.f32(deviation),
        age_s: 0.0,
    }
}

#[test]
fn position_updates_agree() {
    compare_updates("ekf_position", |row, start| {
        let mut filter = start.filter(EkfConfig::NINE_STATES);
        let outcome = filter.update_position(&position(row, "deviation"));
        (filter, outcome)
    });
}

#[test]
fn pose_updates_agree() {
    compare_updates("ekf_pose", |row, start| {
        (6..9).for_each(|attitude| start.isolate(attitude));
        let mut filter = start.filter(EkfConfig::NINE_STATES);
        let position = position(row, "deviation_position");
        let [x, y, z, w] = ["mx", "my", "mz", "mw"].map(|part| row.f32(part));
        let outcome = filter.update_pose(&PoseMeasurement {
            position_m: position.position_m,
            attitude: Quat::from_xyzw(x, y, z, w),
            sigma_m: position.sigma_m,
            sigma_rad: row.f32("deviation_attitude"),
            age_s: 0.0,
        });
        (filter, outcome)
    });
}

#[test]
fn range_updates_agree() {
    compare_updates("ekf_tof", |row, start| {
        let mut filter = start.filter(EkfConfig::NINE_STATES);
        let outcome = filter.update_range(row.f32("distance"), row.f32("deviation"));
        (filter, outcome)
    });
}

/// This crate takes the mean rate over the sensor's time, so its filter turns at the recorded rate
/// for that time before. It adds the variance of quantization, which is subtracted here.
#[test]
fn flow_updates_agree() {
    compare_updates("ekf_flow", |row, start| {
        if row.bool("independent") {
            start.velocity_m_s.y = 0.0;
            start.isolate(4);
        }
        let seconds = row.f32("dt_s");
        let mut filter = start.filter_after_turn(row.vec3("rate", ""), seconds);
        let deviation = row.f32("deviation");
        let outcome = filter.update_flow(&FlowMeasurement {
            counts_x: row.f32("flow_x"),
            counts_y: row.f32("flow_y"),
            sigma_counts: (deviation * deviation - QUANTIZATION_VARIANCE).sqrt(),
            seconds,
        });
        (filter, outcome)
    });
}

#[test]
fn height_updates_agree() {
    compare_updates("ekf_height", |row, start| {
        let mut filter = start.filter(EkfConfig::NINE_STATES);
        let outcome = filter.update_height(row.f32("height"), row.f32("deviation"));
        (filter, outcome)
    });
}

/// Runs one prediction of a recorded case, with noise of the given densities.
fn predicted(row: &VectorRow<'_>, start: &Start, noise: EkfNoise) -> Ekf {
    // The firmware's prediction sets no limit on the covariance.
    let config = EkfConfig { noise, variance_floor: 0.0, ..EkfConfig::NINE_STATES };
    let mut filter = start.filter(config);
    filter.set_flying(row.bool("flying"));
    let sample = ImuSample { gyro_rad_s: row.vec3("rate", ""), accel_m_s2: row.vec3("force", "") };
    filter.propagate(&sample, row.f32("dt_s")).expect("a valid sample");
    // The covariance follows every 10 ms or before an update: this update has no weight.
    let outcome = filter.update_height(filter.state().position_m.z, 1e6);
    assert!(outcome.is_accepted(), "{row}: {outcome:?}");
    filter
}

/// Predictions without noise. On the ground (`flying` = 0) the firmware pulls the attitude to its
/// first yaw by a thousandth per step, which this crate does not, so the attitude is left out there.
#[test]
fn predictions_agree() {
    let none = EkfNoise {
        accel_xy: 0.0,
        accel_z: 0.0,
        position: 0.0,
        attitude: 0.0,
        gyro: 0.0,
        gyro_bias: 0.0,
        accel_bias: 0.0,
    };
    let mut errors = ColumnErrors::default();
    for_each_case("ekf_predict", |row, start| {
        let filter = predicted(row, start, none);
        compare(&mut errors, row, start, &filter, row.bool("flying"));
    });
    errors.assert_below("ekf_predict", ERROR_MAX);
}

/// Variances after the noise.
///
/// The firmware adds a standard deviation of acceleration or rate times the step; this crate adds a
/// density of half the step before and half after the prediction. Both give the same variance to
/// the first order in the step when the density is the deviation times √step. Steps above 10 ms are
/// left out, because the second order exceeds the limit there.
///
/// The growth of a variance is the sharper number: the variance after the noise divided by that
/// before it. It is compared for the attitude, whose noise does not depend on the turn, and for the
/// velocity where turn and step are so small that the second order does not matter.
#[test]
fn process_noise_agrees() {
    let mut errors = ColumnErrors::default();
    for_each_case("ekf_predict", |row, start| {
        let seconds = row.f32("dt_s");
        if seconds > 0.0101 {
            return;
        }
        let noise = EkfNoise {
            accel_xy: 0.5 * seconds.sqrt(),
            accel_z: seconds.sqrt(),
            attitude: 0.1 * seconds.sqrt(),
            ..EkfNoise::NINE_STATES
        };
        let covariance = predicted(row, start, noise).covariance();
        let is_slow = seconds < 0.0051 && row.vec3("rate", "").length() * seconds < 0.004;
        for (i, line) in covariance.iter().enumerate().take(9).skip(3) {
            let column = format!("noise_p{i}{i}");
            errors.compare(row, &column, line[i]);
            if i > 5 || is_slow {
                let before = row.f64(&format!("p{i}{i}_out"));
                let growth = f64::from(line[i]) / before;
                errors.add(row, &format!("growth p{i}{i}"), growth, row.f64(&column) / before);
            }
        }
    });
    errors.assert_below("ekf_predict, noise", ERROR_MAX);
}
