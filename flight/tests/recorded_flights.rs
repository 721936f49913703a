//! Real flights: the Kalman filter replays those of a public data set.
//!
//! NanoBench (Ullah and Baca 2026, arXiv 2603.09908, BSD-3-Clause, github.com/syediu/nanobench-iros2026)
//! has flights of a Crazyflie 2.1 with Bitcraze's firmware in a room with cameras: poses of Vicon, and
//! specific force and rate of the robot, each 100 times per second. The variable `BITTYBUZZ_NANOBENCH`
//! names the folder with its CSV files; they are not part of this repository. Of files with the same
//! content, one counts. A flight in which the robot's own filter was wrong by 0.3 m or more counts apart:
//! there the robot crashed, or the streams do not belong together.
//!
//! # Method
//! The filter sees one pose of four, and is judged just before each. Between two samples of the inertial
//! sensors their values change linearly. The clocks of both streams differ from flight to flight: the
//! judge looks at the pose at the shift with which measured rates and those of the poses agree best.
//!
//! # Noise of these streams
//! They came by radio and by network, and their shift sways by up to 40 ms within a flight; the log has
//! each tenth sample of the gyroscope, without a filter against aliases. At 1 m/s and 3 rad/s, as in
//! these flights, that is a noise of centimeters and of 0.1 rad. The filter is told so; on a robot the
//! inertial sensors are read each millisecond, and the settings of the robot hold.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use bittybuzz_flight::ekf::{Ekf, EkfConfig, EkfNoise, PoseMeasurement};
use bittybuzz_flight::stack::StackSettings;
use bittybuzz_flight::trust::{MeasurementTrust, TrustLimits};
use bittybuzz_flight::{FlightState, GRAVITY_M_S2, ImuSample, Quat, Vec3};

use crate::common::{VectorRow, Vectors};
use crate::ekf_consistency::squared_length;

/// Poses of which the filter sees one.
const POSES: usize = 4;
/// Standard deviations of a pose with the sway of its time.
const SIGMA_M: f32 = 0.01;
const SIGMA_RAD: f32 = 0.1;
/// Noise of the inertial samples: 0.03 rad in 20 ms, and forces of vibration.
const GYRO: f32 = 0.2;
const ACCEL_XY: f32 = 0.5;
const ACCEL_Z: f32 = 0.3;
/// Error of the robot's own filter, in m, from which a flight counts apart.
const OWN_MAX_M: f64 = 0.3;
/// Steps of the filter between two samples.
const STEPS: usize = 10;
/// Largest shift of the two clocks in samples.
const SHIFT_MAX: i32 = 10;

/// One line of a flight.
struct Sample {
    time_s: f64,
    imu: ImuSample,
    position_m: Vec3,
    attitude: Quat,
    velocity_m_s: Vec3,
    /// Position by the robot's own filter.
    own_m: Vec3,
    has_thrust: bool,
}

fn sample(row: &VectorRow<'_>) -> Sample {
    let [x, y, z, w] = ["qx", "qy", "qz", "qw"].map(|name| row.f32(name));
    let at = |names: [&str; 3]| Vec3::from_array(names.map(|name| row.f32(name)));
    let motors = ["1", "2", "3", "4"].map(|motor| row.f64(&format!("motor_motor_m{motor}")));
    Sample {
        time_s: row.f64("t"),
        imu: ImuSample {
            gyro_rad_s: row.vec3("imu_gyro", ""),
            accel_m_s2: row.vec3("imu_acc", "") * GRAVITY_M_S2,
        },
        position_m: at(["px", "py", "pz"]),
        attitude: Quat::from_xyzw(x, y, z, w).normalize(),
        velocity_m_s: at(["vx", "vy", "vz"]),
        own_m: row.vec3("est_stateEstimate", ""),
        has_thrust: motors.iter().sum::<f64>() > 4.0 * 10_000.0,
    }
}

/// Reads a flight without lines whose time does not advance.
fn read(path: &Path) -> Vec<Sample> {
    let file = Vectors::read_file(path).unwrap_or_else(|error| panic!("{error}"));
    let mut samples: Vec<Sample> = Vec::new();
    for row in file.rows() {
        let next = sample(&row);
        if samples.last().is_none_or(|last| next.time_s > last.time_s + 0.001) {
            samples.push(next);
        }
    }
    samples
}

/// Returns the rates by the poses, each over four samples.
fn pose_rates(samples: &[Sample]) -> Vec<Vec3> {
    let rate = |index: usize| {
        let around = samples.get(index.wrapping_sub(2)).zip(samples.get(index + 2));
        around.map_or(Vec3::ZERO, |(before, after)| {
            let turn = before.attitude.conjugate() * after.attitude;
            turn.to_scaled_axis() / (after.time_s - before.time_s) as f32
        })
    };
    (0..samples.len()).map(rate).collect()
}

/// Returns by how many samples the poses are late.
fn shift(samples: &[Sample]) -> i32 {
    let rates = pose_rates(samples);
    let difference = |shift: i32| -> f64 {
        let pairs = samples.iter().zip(0i32..).filter_map(|(sample, index)| {
            let rate = rates.get(usize::try_from(index + shift).ok()?)?;
            let turn = sample.imu.gyro_rad_s - *rate;
            Some(f64::from(turn.truncate().length_squared()))
        });
        let squares: Vec<f64> = pairs.collect();
        squares.iter().sum::<f64>() / squares.len() as f64
    };
    let shifts = -SHIFT_MAX..=SHIFT_MAX;
    let best = shifts.min_by(|one, other| difference(*one).total_cmp(&difference(*other)));
    best.expect("the range is not empty")
}

/// The result of one flight.
#[derive(Debug, Default)]
struct Replay {
    seconds: f64,
    shift: i32,
    /// Errors of the estimate before a pose counts, in m, m/s and rad, and those of the robot's own filter.
    position_m: Vec<f64>,
    velocity_m_s: Vec<f64>,
    attitude_rad: Vec<f64>,
    own_m: Vec<f64>,
    nees: Vec<f64>,
    rejected: usize,
    is_trust_lost: bool,
    is_position_lost: bool,
}

fn replay(path: &Path) -> Replay {
    let samples = read(path);
    let shift = shift(&samples);
    let mut found = Replay { shift, ..Replay::default() };
    let first = &samples[0];
    let start = FlightState {
        position_m: first.position_m,
        attitude: first.attitude,
        velocity_m_s: first.velocity_m_s,
        ..FlightState::default()
    };
    let own = StackSettings::CRAZYFLIE_2_1_PLUS.filter;
    let noise = EkfNoise { gyro: GYRO, accel_xy: ACCEL_XY, accel_z: ACCEL_Z, ..own.noise };
    let mut filter = Ekf::new(EkfConfig { noise, ..own }, &start);
    let mut trust = MeasurementTrust::<(Vec3, Quat)>::new(TrustLimits::POSE);
    let take_off = samples.iter().position(|sample| sample.has_thrust).unwrap_or(samples.len());
    for (index, pair) in samples.windows(2).enumerate() {
        let [before, after] = pair else { continue };
        let is_flying = after.has_thrust;
        filter.set_flying(is_flying);
        let seconds = (after.time_s - before.time_s) as f32 / STEPS as f32;
        for step in 1..=STEPS {
            let share = step as f32 / STEPS as f32;
            let imu = ImuSample {
                gyro_rad_s: before.imu.gyro_rad_s.lerp(after.imu.gyro_rad_s, share),
                accel_m_s2: before.imu.accel_m_s2.lerp(after.imu.accel_m_s2, share),
            };
            // A sample that a crash drove out of range counts as none.
            let _ = filter.propagate(&imu, seconds);
        }
        let now = index + 1;
        let measures = now.is_multiple_of(POSES);
        // The moments just before a pose judge the filter, from half a second after the take-off on.
        let truth = usize::try_from(now as i32 + shift).ok().and_then(|at| samples.get(at));
        if let Some(truth) = truth.filter(|_| measures && is_flying && now > take_off + 50) {
            judge(&mut found, &filter, truth, after);
        }
        if measures {
            let pose = PoseMeasurement {
                position_m: after.position_m,
                attitude: after.attitude,
                sigma_m: SIGMA_M,
                sigma_rad: SIGMA_RAD,
                age_s: 0.0,
            };
            let outcome = filter.update_pose(&pose);
            if is_flying {
                found.rejected += usize::from(!outcome.is_accepted());
                trust.note(
                    (pose.position_m, pose.attitude),
                    0.0,
                    filter.position_persists(),
                    &outcome,
                );
                found.is_trust_lost |= trust.is_lost();
                found.is_position_lost |= !filter.health().is_position_valid;
            }
        }
    }
    found.seconds = found.position_m.len() as f64 * POSES as f64 * 0.01;
    found
}

impl Replay {
    /// Adds the errors of another flight.
    fn add(&mut self, other: Replay) {
        self.seconds += other.seconds;
        self.rejected += other.rejected;
        self.position_m.extend(other.position_m);
        self.velocity_m_s.extend(other.velocity_m_s);
        self.attitude_rad.extend(other.attitude_rad);
        self.own_m.extend(other.own_m);
        self.nees.extend(other.nees);
    }
}

/// Notes the errors of the estimate at the moment of a pose.
fn judge(found: &mut Replay, filter: &Ekf, truth: &Sample, now: &Sample) {
    let estimate = filter.state();
    let position = truth.position_m - estimate.position_m;
    let body = truth.attitude.conjugate() * truth.velocity_m_s;
    let velocity = body - filter.body_velocity_m_s();
    let turn = (estimate.attitude.conjugate() * truth.attitude).to_scaled_axis();
    let mut error = [0.0; 9];
    for (part, value) in [position, velocity, turn].into_iter().enumerate() {
        error[3 * part..3 * part + 3].copy_from_slice(&value.as_dvec3().to_array());
    }
    found.position_m.push(position.length().into());
    found.velocity_m_s.push(velocity.length().into());
    found.attitude_rad.push(turn.length().into());
    found.own_m.push((truth.position_m - now.own_m).length().into());
    found.nees.push(squared_length(&filter.covariance(), &error));
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

fn most(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{folder:?}: {error}"));
    for entry in entries {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "csv") {
            found.push(path);
        }
    }
}

/// Returns the flights of the data set, each once, in the order of their names.
fn flights() -> BTreeMap<String, PathBuf> {
    let folder = std::env::var_os("BITTYBUZZ_NANOBENCH").expect("it names the data set's folder");
    let mut paths = Vec::new();
    files(Path::new(&folder), &mut paths);
    paths.sort();
    let mut contents = BTreeSet::new();
    paths.retain(|path| contents.insert(std::fs::read(path).unwrap()));
    let name = |path: &Path| path.strip_prefix(&folder).unwrap().display().to_string();
    paths.into_iter().map(|path| (name(&path), path)).collect()
}

/// No flight is lost, and the estimate is better than the robot's own and as good as its covariance says.
#[test]
#[ignore = "needs a public data set"]
fn public_flights_are_followed() {
    let mut all = Replay::default();
    let (mut count, mut apart) = (0, Vec::new());
    let mut worst = (0.0, String::new());
    for (name, path) in flights() {
        let found = replay(&path);
        if most(&found.own_m) >= OWN_MAX_M {
            apart.push(name);
            continue;
        }
        count += 1;
        println!(
            "{name}: {:.0} s, shift {}, {:.0} mm rms, {:.0} at most (own {:.0}, {:.0}), {:.0} mm/s, \
             {:.0} mrad, NEES {:.1}, {} rejected",
            found.seconds,
            found.shift,
            rms(&found.position_m) * 1e3,
            most(&found.position_m) * 1e3,
            rms(&found.own_m) * 1e3,
            most(&found.own_m) * 1e3,
            rms(&found.velocity_m_s) * 1e3,
            rms(&found.attitude_rad) * 1e3,
            mean(&found.nees),
            found.rejected,
        );
        if rms(&found.position_m) > worst.0 {
            worst = (rms(&found.position_m), name.clone());
        }
        assert!(!found.is_trust_lost && !found.is_position_lost, "{name}");
        all.add(found);
    }
    let [position, own] = [&all.position_m, &all.own_m].map(|errors| rms(errors) * 1e3);
    println!(
        "{count} flights, {:.0} s: {position:.1} mm rms (own {own:.1}), {:.0} mm/s, {:.0} mrad, NEES {:.1}, \
         {} of {} poses rejected; worst {} with {:.1} mm; apart: {apart:?}",
        all.seconds,
        rms(&all.velocity_m_s) * 1e3,
        rms(&all.attitude_rad) * 1e3,
        mean(&all.nees),
        all.rejected,
        all.nees.len(),
        worst.1,
        worst.0 * 1e3,
    );
    assert!(count >= 60, "{count} flights: is this the whole data set?");
    assert!(position < own);
    assert!((2.0..12.0).contains(&mean(&all.nees)));
}
