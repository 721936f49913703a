//! The filter without biases against the filter with nine states of Mueller, Hamer and D'Andrea
//! 2015, written here with dense matrices in f64.

use bittybuzz_flight::ekf::{Ekf, EkfConfig, FlowMeasurement, PositionMeasurement};
use bittybuzz_flight::{FlightState, ImuSample, Vec3};
use glam::{DMat3, DQuat, DVec3};

const GRAVITY_M_S2: f64 = 9.81;

type Matrix = [[f64; 9]; 9];

fn multiply(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..9).map(|k| a[i][k] * b[k][j]).sum()))
}

fn transposed(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

fn identity() -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|j| f64::from(i == j)))
}

/// Returns I − [h]× + [h]×²/2.
fn second_order(h: DVec3) -> DMat3 {
    let skew = DMat3::from_cols(h.cross(DVec3::X), h.cross(DVec3::Y), h.cross(DVec3::Z));
    DMat3::IDENTITY - skew + skew * skew * 0.5
}

struct Reference {
    position: DVec3,
    velocity: DVec3,
    attitude: DQuat,
    p: Matrix,
}

impl Reference {
    fn set_block(a: &mut Matrix, row: usize, column: usize, block: DMat3) {
        for i in 0..3 {
            for j in 0..3 {
                a[row + i][column + j] = block.col(j)[i];
            }
        }
    }

    fn predict(&mut self, rate: DVec3, accel_z: f64, seconds: f64) {
        let r = DMat3::from_quat(self.attitude);
        let up = r.transpose() * DVec3::Z;
        let cross =
            |v: DVec3| DMat3::from_cols(v.cross(DVec3::X), v.cross(DVec3::Y), v.cross(DVec3::Z));
        let mut a = identity();
        Self::set_block(&mut a, 0, 3, r * seconds);
        Self::set_block(&mut a, 0, 6, r * cross(self.velocity) * -seconds);
        Self::set_block(&mut a, 3, 3, DMat3::IDENTITY - cross(rate) * seconds);
        Self::set_block(&mut a, 3, 6, cross(up) * (-GRAVITY_M_S2 * seconds));
        Self::set_block(&mut a, 6, 6, second_order(rate * (0.5 * seconds)));
        self.p = multiply(&multiply(&a, &self.p), &transposed(&a));
        let lift = DVec3::Z * accel_z;
        self.position += r * (self.velocity * seconds + lift * (0.5 * seconds * seconds))
            - DVec3::Z * (0.5 * GRAVITY_M_S2 * seconds * seconds);
        self.velocity += (lift - rate.cross(self.velocity) - up * GRAVITY_M_S2) * seconds;
        self.attitude = (self.attitude * DQuat::from_scaled_axis(rate * seconds)).normalize();
    }

    fn add_noise(&mut self, seconds: f64) {
        for i in 0..3 {
            let accel = if i == 2 { 1.0 } else { 0.5 };
            self.p[i][i] += (accel * seconds * seconds).powi(2);
            self.p[3 + i][3 + i] += (accel * seconds).powi(2);
            self.p[6 + i][6 + i] += (0.1 * seconds).powi(2);
        }
    }

    /// Applies scalars in sequence against one linearization and moves the error into the state.
    fn update(&mut self, scalars: &[([f64; 9], f64, f64)]) {
        let mut error = [0.0; 9];
        for (h, innovation, variance) in scalars {
            let ph: [f64; 9] = std::array::from_fn(|i| (0..9).map(|j| self.p[i][j] * h[j]).sum());
            let s = (0..9).map(|i| h[i] * ph[i]).sum::<f64>() + variance;
            let known: f64 = (0..9).map(|i| h[i] * error[i]).sum();
            let t: Matrix = std::array::from_fn(|i| {
                std::array::from_fn(|j| f64::from(i == j) - ph[i] / s * h[j])
            });
            let joseph = multiply(&multiply(&t, &self.p), &transposed(&t));
            for i in 0..9 {
                error[i] += ph[i] / s * (innovation - known);
                for j in 0..9 {
                    self.p[i][j] = joseph[i][j] + ph[i] * ph[j] / (s * s) * variance;
                }
            }
        }
        let at = |i: usize| DVec3::new(error[i], error[i + 1], error[i + 2]);
        self.position += at(0);
        self.velocity += at(3);
        self.attitude = (self.attitude * DQuat::from_scaled_axis(at(6))).normalize();
        let mut t = identity();
        Self::set_block(&mut t, 6, 6, second_order(at(6) * 0.5));
        self.p = multiply(&multiply(&t, &self.p), &transposed(&t));
        for i in 0..9 {
            self.p[i][i] = self.p[i][i].max(1e-6);
        }
    }

    fn unit(index: usize) -> [f64; 9] {
        std::array::from_fn(|i| f64::from(i == index))
    }
}

/// The variances at the start.
fn initial() -> Matrix {
    let variances = [100.0, 100.0, 1.0, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4];
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { variances[i] } else { 0.0 }))
}

/// Rate and acceleration along z while the robot sways and keeps its height.
fn motion(time_s: f64, at: &Reference) -> (DVec3, f64) {
    let rate = DVec3::new((5.0 * time_s).cos() * 0.8, (4.0 * time_s).cos() * -0.6, 0.5);
    let up = (at.attitude.conjugate() * DVec3::Z).z;
    let climb = (at.attitude * at.velocity).z;
    (rate, GRAVITY_M_S2 / up - 2.0 * (at.position.z - 1.0) - 2.0 * climb)
}

#[test]
fn ten_seconds_of_positions_and_flow_agree() {
    let start = FlightState { position_m: Vec3::Z, ..FlightState::default() };
    let mut filter = Ekf::new(EkfConfig::NINE_STATES, &start);
    filter.set_flying(true);
    let mut reference = Reference {
        position: DVec3::Z,
        velocity: DVec3::ZERO,
        attitude: DQuat::IDENTITY,
        p: initial(),
    };
    let mut worst = DVec3::ZERO;
    for step in 0..1000 {
        let time_s = 0.01 * f64::from(step);
        let (rate, accel_z) = motion(time_s, &reference);
        let imu = ImuSample {
            gyro_rad_s: rate.as_vec3(),
            accel_m_s2: Vec3::new(0.3, -0.2, accel_z as f32),
        };
        filter.propagate(&imu, 0.01).unwrap();
        reference.predict(rate, accel_z, 0.01);
        for _ in 0..10 {
            reference.add_noise(0.001);
        }
        if step % 5 == 4 {
            let error =
                DVec3::new((17.0 * time_s).sin(), (11.0 * time_s).cos(), (23.0 * time_s).sin());
            let measured = reference.position + error * 0.02;
            let outcome = filter.update_position(&PositionMeasurement {
                position_m: measured.as_vec3(),
                sigma_m: 0.02,
                age_s: 0.0,
            });
            assert!(outcome.is_accepted(), "step {step}: {outcome:?}");
            let innovation = measured - reference.position;
            let scalars: [_; 3] =
                std::array::from_fn(|i| (Reference::unit(i), innovation[i], 4e-4));
            reference.update(&scalars);
        }
        if step % 7 == 6 {
            let k = 0.01 * 350.0 / 0.71674;
            let r33 = (reference.attitude.conjugate() * DVec3::Z).z;
            let (z, v) = (reference.position.z, reference.velocity);
            let expected = DVec3::new(v.x * r33 / z - rate.y, v.y * r33 / z + rate.x, 0.0) * k;
            let counts = DVec3::new(expected.x.round(), expected.y.round(), 0.0);
            let outcome = filter.update_flow(&FlowMeasurement {
                counts_x: counts.x as f32,
                counts_y: counts.y as f32,
                sigma_counts: 2.0,
                seconds: 0.01,
            });
            assert!(outcome.is_accepted(), "step {step}: {outcome:?}");
            let innovation = counts - expected;
            let scalars: [_; 2] = std::array::from_fn(|i| {
                let mut h = [0.0; 9];
                h[2] = -k * r33 / (z * z) * v[i];
                h[3 + i] = k * r33 / z;
                (h, innovation[i], 4.0 + 1.0 / 12.0)
            });
            reference.update(&scalars);
        }
        let state = filter.state();
        let position = (state.position_m.as_dvec3() - reference.position).length();
        let velocity = (filter.body_velocity_m_s().as_dvec3() - reference.velocity).length();
        let angle = state.attitude.as_dquat().normalize().angle_between(reference.attitude);
        worst = worst.max(DVec3::new(position, velocity, angle));
        assert!(position < 2e-5, "step {step}: position differs by {position}");
        assert!(velocity < 2e-5, "step {step}: velocity differs by {velocity}");
        assert!(angle < 2e-5, "step {step}: attitude differs by {angle}");
        let covariance = filter.covariance();
        for (i, row) in reference.p.iter().enumerate() {
            for (j, expected) in row.iter().enumerate() {
                let scale = (row[i] * reference.p[j][j]).sqrt();
                let difference = (f64::from(covariance[i][j]) - expected).abs();
                assert!(difference < 1e-3 * scale, "step {step}: entry {i},{j}");
            }
        }
        assert_eq!(covariance[9][9], 0.0);
        assert_eq!(filter.gyro_bias_rad_s(), Vec3::ZERO);
    }
    println!("largest differences: {worst} m, m/s, rad");
}
