//! Consistency of the Kalman filter: the errors that occur are as large as the covariance says.
//!
//! A truth in f64 has the noise that the filter assumes. The normalized squared error of the estimate
//! (NEES, Bar-Shalom, Li and Kirubarajan 2001, section 5.4) of all 13 states, averaged over 200
//! flights, then follows χ² with 2600 degrees of freedom, divided by 200.
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
const FLIGHTS: u64 = 200;
const SECONDS: usize = 10;
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

/// Returns eᵀ·P⁻¹·e by the factorization of Cholesky in f64.
fn squared_length(p: &[[f32; STATES]; STATES], error: &[f64; STATES]) -> f64 {
    let mut l = [[0.0f64; STATES]; STATES];
    let mut sum = 0.0;
    let mut y = [0.0; STATES];
    for i in 0..STATES {
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

/// Flies 200 times and checks the mean NEES each 0.1 s. `measure` is called after each step of 1 ms
/// with the number of steps so far.
fn assert_consistent(measure: impl Fn(&mut Ekf, &Truth, &mut Noise, &mut DVec3, usize)) {
    let config = EkfConfig {
        noise: NOISE,
        initial_sigma: SIGMA,
        variance_floor: 1e-12,
        ..EkfConfig::QUADROTOR
    };
    let start = FlightState { position_m: bittybuzz_flight::Vec3::Z, ..FlightState::default() };
    let samples = SECONDS * 10;
    let mut sums = vec![0.0; samples];
    let mut rejections = 0;
    for seed in 0..FLIGHTS {
        let mut noise = Noise(Xoshiro256PlusPlus::seed_from_u64(seed));
        let mut truth = Truth::new(&mut noise);
        let mut filter = Ekf::new(config, &start);
        filter.set_flying(true);
        let mut flow = DVec3::ZERO;
        for step in 1..=SECONDS * 1000 {
            let height = truth.position.z;
            let up = (truth.attitude.conjugate() * DVec3::Z).z;
            let seen = truth.velocity * (up / height);
            let (sample, rate) = truth.step(&mut noise);
            flow += DVec3::new(seen.x - rate.y, seen.y + rate.x, 0.0) * STEP_S;
            assert_eq!(filter.propagate(&sample, STEP_S as f32), Ok(()));
            measure(&mut filter, &truth, &mut noise, &mut flow, step);
            if step % 100 == 0 {
                sums[step / 100 - 1] += truth.nees(&filter);
            }
        }
        assert_eq!(filter.health().divergences, 0);
        rejections += filter.health().rejections;
    }
    let degrees = (STATES as u64 * FLIGHTS) as f64;
    let band = chi_squared(degrees, -1.96)..=chi_squared(degrees, 1.96);
    let inside = sums.iter().filter(|sum| band.contains(sum)).count();
    let mean = sums.iter().sum::<f64>() / (samples as u64 * FLIGHTS) as f64;
    println!("{inside} of {samples} inside, mean NEES {mean:.3}, {rejections} rejections");
    assert!(inside * 10 >= samples * 9, "only {inside} of {samples} inside; mean NEES {mean}");
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
