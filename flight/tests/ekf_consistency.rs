//! Consistency of the Kalman filter: the errors that occur are as large as the covariance says.
//!
//! A truth in f64 has the noise that the filter assumes. The normalized squared error of the estimate
//! (NEES, Bar-Shalom, Li and Kirubarajan 2001, section 5.4) of all 13 states then follows χ² with 13
//! degrees of freedom.
//!
//! Errors at two times of a flight are correlated: without positions, those of x, y and yaw never
//! decay. Each flight therefore gives one sample, at a time of its own. Samples of different flights
//! are independent, so their sum follows χ² with 13 degrees of freedom per flight, and the number of
//! samples inside an interval is binomial. Each bound rejects a correct filter for one choice of seeds
//! in 10,000. A filter that assumes half or twice the noise of the inertial sensors fails at least one
//! of the tests.
//!
//! The noise is that of calibrated sensors, such that products of two errors stay small. With three
//! times the noise and positions of 1 mm, the neglected product of the errors of yaw and velocity
//! raises the NEES from 13.1 to 13.5; with a third of the noise it stays at 13.1.

use bittybuzz_flight::ekf::{
    Ekf, EkfConfig, EkfNoise, EkfSigma, FlowMeasurement, PoseMeasurement, PositionMeasurement,
};
use bittybuzz_flight::{FlightState, GRAVITY_M_S2, ImuSample};
use glam::{DQuat, DVec3};
use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

const STATES: usize = 13;
const FLIGHTS: u64 = 400;
/// Seconds of the longest flight. The durations of the flights are spread evenly up to it.
const SECONDS: u64 = 10;
/// A normal variable is beyond this many standard deviations with a probability of 1/10,000.
const Z: f64 = 3.89;
/// The most by which the products of errors that the filter neglects raise the mean NEES. It was 13.17
/// in 24,000 flights of all three tests, and 13.3 in 4,800 flights with positions.
const NEGLECTED: f64 = 0.3;
const STEP_S: f64 = 0.001;

const SIGMA: EkfSigma = EkfSigma {
    position_xy_m: 0.1,
    position_z_m: 0.05,
    velocity_m_s: 0.05,
    tilt_rad: 0.01,
    yaw_rad: 0.02,
    gyro_bias_rad_s: 0.003,
    accel_bias_m_s2: 0.1,
};

const NOISE: EkfNoise = EkfNoise {
    accel_xy: 0.03,
    accel_z: 0.03,
    position: 0.0,
    attitude: 0.0,
    gyro: 0.001,
    gyro_bias: 2e-4,
    accel_bias: 5e-3,
};

struct Noise(Xoshiro256PlusPlus);

impl Noise {
    fn scalar(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.scalar(), self.scalar(), self.scalar())
    }
}

/// The true motion. It hovers near 1 m, sways by 0.1 rad and turns about z by up to 1 rad/s.
struct Truth {
    time_s: f64,
    position: DVec3,
    velocity: DVec3,
    attitude: DQuat,
    gyro_bias: DVec3,
    accel_bias: f64,
}

impl Truth {
    fn new(noise: &mut Noise) -> Self {
        let start = DVec3::new(0.0, 0.0, 1.0);
        let s = |sigma: f32| f64::from(sigma);
        let xy = s(SIGMA.position_xy_m);
        let tilt = s(SIGMA.tilt_rad);
        let error = noise.vector() * DVec3::new(tilt, tilt, s(SIGMA.yaw_rad));
        Truth {
            time_s: 0.0,
            position: start + noise.vector() * DVec3::new(xy, xy, s(SIGMA.position_z_m)),
            velocity: noise.vector() * s(SIGMA.velocity_m_s),
            attitude: DQuat::from_scaled_axis(error),
            gyro_bias: noise.vector() * s(SIGMA.gyro_bias_rad_s),
            accel_bias: noise.scalar() * s(SIGMA.accel_bias_m_s2),
        }
    }

    /// Moves for a millisecond and returns what sensors measure, and the true rate.
    fn step(&mut self, noise: &mut Noise) -> (ImuSample, DVec3) {
        let t = self.time_s;
        let tau = std::f64::consts::TAU;
        // Derivatives of sines, so that the angles come back.
        let rate = DVec3::new(
            0.1 * tau * 0.7 * (tau * 0.7 * t).cos(),
            0.1 * tau * 0.5 * (tau * 0.5 * t).cos(),
            (tau * 0.2 * t).sin(),
        );
        let up = self.attitude.conjugate() * DVec3::Z;
        // A spring and a damper keep the height, as a pilot would.
        let world_velocity = self.attitude * self.velocity;
        let lift = f64::from(GRAVITY_M_S2) / up.z.max(0.5)
            - 2.0 * (self.position.z - 1.0)
            - 2.0 * world_velocity.z;
        let per_step = |density: f32| f64::from(density) / STEP_S.sqrt();
        let gust = noise.vector() * DVec3::new(1.0, 1.0, 0.0) * per_step(NOISE.accel_xy);
        let force = DVec3::Z * lift + gust;
        let sample = ImuSample {
            gyro_rad_s: (rate + self.gyro_bias + noise.vector() * per_step(NOISE.gyro)).as_vec3(),
            accel_m_s2: (DVec3::Z
                * (lift + self.accel_bias + noise.scalar() * per_step(NOISE.accel_z)))
            .as_vec3(),
        };
        let world_force = self.attitude * force - DVec3::Z * f64::from(GRAVITY_M_S2);
        let next = world_velocity + world_force * STEP_S;
        self.position += (world_velocity + next) * (0.5 * STEP_S);
        self.attitude = (self.attitude * DQuat::from_scaled_axis(rate * STEP_S)).normalize();
        self.velocity = self.attitude.conjugate() * next;
        self.gyro_bias += noise.vector() * (f64::from(NOISE.gyro_bias) * STEP_S.sqrt());
        self.accel_bias += noise.scalar() * f64::from(NOISE.accel_bias) * STEP_S.sqrt();
        self.time_s += STEP_S;
        (sample, rate)
    }

    /// The normalized squared error of an estimate.
    fn nees(&self, filter: &Ekf) -> f64 {
        let state = filter.state();
        let turn = state.attitude.as_dquat().normalize().conjugate() * self.attitude;
        let turn = if turn.w < 0.0 { -turn } else { turn };
        let parts = [
            self.position - state.position_m.as_dvec3(),
            self.velocity - filter.body_velocity_m_s().as_dvec3(),
            turn.to_scaled_axis(),
            self.gyro_bias - filter.gyro_bias_rad_s().as_dvec3(),
        ];
        let mut error = [0.0; STATES];
        for i in 0..12 {
            error[i] = parts[i / 3][i % 3];
        }
        error[12] = self.accel_bias - f64::from(filter.accel_bias_m_s2());
        squared_length(&filter.covariance(), &error)
    }
}

/// Returns eᵀ·P⁻¹·e of the first states by the factorization of Cholesky in f64.
pub fn squared_length<const FIRST: usize>(
    p: &[[f32; STATES]; STATES],
    error: &[f64; FIRST],
) -> f64 {
    let mut l = [[0.0f64; FIRST]; FIRST];
    let mut sum = 0.0;
    let mut y = [0.0; FIRST];
    for i in 0..FIRST {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            let rest = f64::from(p[i][j]) - dot;
            if i == j {
                assert!(rest > 0.0, "the covariance is not positive at state {i}");
                l[i][i] = rest.sqrt();
            } else {
                l[i][j] = rest / l[j][j];
            }
        }
        let dot: f64 = (0..i).map(|k| l[i][k] * y[k]).sum();
        y[i] = (error[i] - dot) / l[i][i];
        sum += y[i] * y[i];
    }
    sum
}

/// The approximate χ² quantile of Wilson and Hilferty 1931 for a normal quantile z.
fn chi_squared(degrees: f64, z: f64) -> f64 {
    let part = 2.0 / (9.0 * degrees);
    degrees * (1.0 - part + z * part.sqrt()).powi(3)
}

/// Flies [`FLIGHTS`] times and checks the NEES at the end of each flight. `measure` is called after each
/// step of 1 ms with the number of steps so far.
fn assert_consistent(measure: impl Fn(&mut Ekf, &Truth, &mut Noise, &mut DVec3, u64)) {
    let config = EkfConfig {
        noise: NOISE,
        initial_sigma: SIGMA,
        variance_floor: 1e-12,
        ..EkfConfig::QUADROTOR
    };
    let start = FlightState { position_m: bittybuzz_flight::Vec3::Z, ..FlightState::default() };
    let mut samples = Vec::new();
    let mut rejections = 0;
    for seed in 0..FLIGHTS {
        let mut noise = Noise(Xoshiro256PlusPlus::seed_from_u64(seed));
        let mut truth = Truth::new(&mut noise);
        let mut filter = Ekf::new(config, &start);
        filter.set_flying(true);
        let mut flow = DVec3::ZERO;
        for step in 1..=(seed + 1) * SECONDS * 1000 / FLIGHTS {
            let height = truth.position.z;
            let up = (truth.attitude.conjugate() * DVec3::Z).z;
            let seen = truth.velocity * (up / height);
            let (sample, rate) = truth.step(&mut noise);
            flow += DVec3::new(seen.x - rate.y, seen.y + rate.x, 0.0) * STEP_S;
            assert_eq!(filter.propagate(&sample, STEP_S as f32), Ok(()));
            measure(&mut filter, &truth, &mut noise, &mut flow, step);
        }
        samples.push(truth.nees(&filter));
        assert_eq!(filter.health().divergences, 0);
        rejections += filter.health().rejections;
    }
    let flights = FLIGHTS as f64;
    let mean = samples.iter().sum::<f64>() / flights;
    let degrees = STATES as f64;
    let [low, high] = [-Z, Z].map(|z| chi_squared(degrees * flights, z) / flights);
    let means = [low, high + NEGLECTED];
    // 80 % of the samples of a correct filter are between these quantiles.
    let quantiles = [-1.2816, 1.2816].map(|z| chi_squared(degrees, z));
    let inside = samples.iter().filter(|sample| is_between(**sample, quantiles)).count();
    // The binomial distribution of 400 samples is nearly normal.
    let deviation = (flights * 0.8 * 0.2).sqrt();
    let counts = [-Z, Z].map(|z| 0.8 * flights + z * deviation);
    println!("mean NEES {mean:.3}, {inside} of {FLIGHTS} inside, {rejections} rejections");
    assert!(is_between(mean, means), "the mean NEES {mean} is not in {means:?}");
    assert!(is_between(inside as f64, counts), "{inside} of {FLIGHTS} samples are inside");
}

fn is_between(value: f64, [low, high]: [f64; 2]) -> bool {
    low <= value && value <= high
}

#[test]
fn positions_give_a_consistent_estimate() {
    let sigma_m = 0.001;
    assert_consistent(|filter, truth, noise, _, step| {
        if step % 10 == 0 {
            let position = truth.position + noise.vector() * sigma_m;
            let _ = filter.update_position(&PositionMeasurement {
                position_m: position.as_vec3(),
                sigma_m: sigma_m as f32,
                age_s: 0.0,
            });
        }
    });
}

#[test]
fn poses_give_a_consistent_estimate() {
    let (sigma_m, sigma_rad) = (0.002, 0.01);
    assert_consistent(|filter, truth, noise, _, step| {
        if step % 20 == 0 {
            let position = truth.position + noise.vector() * sigma_m;
            let turn = DQuat::from_scaled_axis(noise.vector() * sigma_rad);
            let _ = filter.update_pose(&PoseMeasurement {
                position_m: position.as_vec3(),
                attitude: (truth.attitude * turn).as_quat(),
                sigma_m: sigma_m as f32,
                sigma_rad: sigma_rad as f32,
                age_s: 0.0,
            });
        }
    });
}

/// Flow and range observe neither x, y nor yaw, whose errors grow as the covariance says.
#[test]
fn flow_and_range_give_a_consistent_estimate() {
    let sigma_counts = 2.0;
    let sigma_m = 0.005;
    let counts_per_rad = 350.0 / 0.71674;
    assert_consistent(|filter, truth, noise, flow, step| {
        if step % 10 == 0 {
            let counts = *flow * counts_per_rad + noise.vector() * sigma_counts;
            *flow = DVec3::ZERO;
            let _ = filter.update_flow(&FlowMeasurement {
                counts_x: counts.x.round() as f32,
                counts_y: counts.y.round() as f32,
                sigma_counts: sigma_counts as f32,
                seconds: 0.01,
            });
        }
        if step % 25 == 0 {
            let up = (truth.attitude.conjugate() * DVec3::Z).z;
            let tilt = (up.acos() - 7.5f64.to_radians()).max(0.0);
            let range = truth.position.z / tilt.cos() + noise.scalar() * sigma_m;
            let _ = filter.update_range(range as f32, sigma_m as f32);
        }
    });
}
