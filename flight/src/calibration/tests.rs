use std::vec::Vec;

use glam::Quat;
use proptest::prelude::*;

use super::simulated_imu::SimulatedImu;
use super::*;

const DEGREE: f32 = core::f32::consts::PI / 180.0;
const UP: Vec3 = Vec3::new(0.0, 0.0, GRAVITY_M_S2);

/// Outcome of the first window.
fn calibrate(
    mut sample: impl FnMut(u16) -> ImuSample,
) -> Result<ImuCalibration, CalibrationRefusal> {
    let mut calibrator = ImuCalibrator::new();
    for n in 0..CALIBRATION_SAMPLES {
        if let Some(calibration) = calibrator.update(&sample(n))? {
            assert_eq!(n, CALIBRATION_SAMPLES - 1);
            return Ok(calibration);
        }
    }
    panic!("a full window gave no result")
}

fn calibrate_at(gyro_rad_s: Vec3, accel_m_s2: Vec3) -> Result<ImuCalibration, CalibrationRefusal> {
    let mut imu = SimulatedImu::at_rest(1);
    calibrate(|_| imu.sample(gyro_rad_s, accel_m_s2))
}

#[test]
fn variance_limit_is_100_steps_of_the_converter_squared() {
    let step = 2000.0 / 32768.0 * f64::from(DEGREE);
    assert!((f64::from(GYRO_VARIANCE_RAD2_S2_MAX) / (100.0 * step * step) - 1.0).abs() < 1e-4);
    assert!((CALIBRATED_BIAS_RAD_S_MAX / (3.0 * DEGREE) - 1.0).abs() < 1e-4);
    assert!((CALIBRATION_TILT_RAD_MAX / (15.0 * DEGREE) - 1.0).abs() < 1e-4);
}

#[test]
fn rest_gives_bias_and_scale() {
    let bias = Vec3::new(1.2, -0.7, 2.9) * DEGREE;
    let calibration = calibrate_at(bias, 1.03 * UP).unwrap();
    // The mean of 512 samples with 0.16 °/s rms, of which about 120 are independent.
    assert!((calibration.gyro_bias_rad_s() - bias).abs().max_element() < 0.06 * DEGREE);
    assert!((calibration.accel_scale() - 1.0 / 1.03).abs() < 1e-3);
    let applied =
        calibration.apply(&ImuSample { gyro_rad_s: bias + Vec3::X, accel_m_s2: 1.03 * UP });
    assert!((applied.gyro_rad_s - Vec3::X).length() < 0.1 * DEGREE);
    assert!((applied.accel_m_s2 - UP).length() < 0.01);
}

#[test]
fn identity_changes_nothing() {
    let sample = ImuSample { gyro_rad_s: Vec3::new(1.0, 2.0, 3.0), accel_m_s2: UP };
    assert_eq!(ImuCalibration::IDENTITY.apply(&sample), sample);
}

#[test]
fn thousand_robots_at_rest_calibrate_at_the_first_window() {
    for seed in 0..1000 {
        let mut imu = SimulatedImu::at_rest(seed);
        let bias = Vec3::new(
            imu.random.normal() as f32,
            imu.random.normal() as f32,
            imu.random.normal() as f32,
        );
        let bias = (bias * 0.7).clamp(Vec3::splat(-2.5), Vec3::splat(2.5)) * DEGREE;
        calibrate(|_| imu.sample(bias, UP)).unwrap();
    }
}

#[test]
fn steady_turn_is_refused() {
    for axis in [Vec3::X, Vec3::NEG_Y, Vec3::Z] {
        let result = calibrate_at(axis * 4.0 * DEGREE, UP);
        assert_eq!(result, Err(CalibrationRefusal::BiasTooLarge));
    }
}

#[test]
fn varying_rate_is_refused() {
    let mut imu = SimulatedImu::at_rest(1);
    // A hand that trembles with 2 °/s at 8 Hz.
    let result = calibrate(|n| {
        let rate = 2.0 * DEGREE * libm::sinf(0.05 * f32::from(n));
        imu.sample(Vec3::new(0.0, rate, 0.0), UP)
    });
    assert_eq!(result, Err(CalibrationRefusal::Turning));
}

#[test]
fn varying_force_is_refused() {
    let mut imu = SimulatedImu::at_rest(1);
    let result =
        calibrate(|n| imu.sample(Vec3::ZERO, UP + Vec3::X * 0.3 * libm::sinf(0.05 * f32::from(n))));
    assert_eq!(result, Err(CalibrationRefusal::Shaking));
}

#[test]
fn slow_turn_about_a_horizontal_axis_is_refused_by_the_accelerometer() {
    let mut imu = SimulatedImu::at_rest(1);
    let sensor_bias = -3.0 * DEGREE;
    let result = calibrate(|n| {
        let tilt = Quat::from_rotation_x(5.0 * DEGREE * 0.001 * f32::from(n));
        imu.sample(Vec3::X * (5.0 * DEGREE + sensor_bias), tilt.inverse() * UP)
    });
    assert_eq!(result, Err(CalibrationRefusal::Shaking));
}

#[test]
fn wrong_gravity_is_refused() {
    for factor in [0.0, 0.5, 0.88, 1.12, 2.0] {
        let result = calibrate_at(Vec3::ZERO, factor * UP);
        assert_eq!(result, Err(CalibrationRefusal::WrongGravity), "{factor}");
    }
}

#[test]
fn tilted_robot_is_refused() {
    for (angle, expected) in [
        (14.5, None),
        (15.5, Some(CalibrationRefusal::Tilted)),
        (90.0, Some(CalibrationRefusal::Tilted)),
        (180.0, Some(CalibrationRefusal::Tilted)),
    ] {
        for turn in [Quat::from_rotation_x(angle * DEGREE), Quat::from_rotation_y(-angle * DEGREE)]
        {
            assert_eq!(calibrate_at(Vec3::ZERO, turn * UP).err(), expected, "{angle}");
        }
    }
}

#[test]
fn stuck_axis_is_a_sensor_fault() {
    for axis in 0..3 {
        let mut imu = SimulatedImu::at_rest(1);
        let result = calibrate(|_| {
            let mut sample = imu.sample(Vec3::ZERO, UP);
            sample.gyro_rad_s[axis] = 0.01;
            sample
        });
        assert_eq!(result, Err(CalibrationRefusal::GyroStuck));
        let result = calibrate(|_| {
            let mut sample = imu.sample(Vec3::ZERO, UP);
            sample.accel_m_s2[axis] = UP[axis];
            sample
        });
        assert_eq!(result, Err(CalibrationRefusal::AccelStuck));
    }
    let frozen = calibrate(|_| ImuSample { gyro_rad_s: Vec3::ZERO, accel_m_s2: UP });
    assert_eq!(frozen, Err(CalibrationRefusal::GyroStuck));
}

#[test]
fn refused_window_is_followed_by_a_new_one() {
    let mut imu = SimulatedImu::at_rest(3);
    let mut calibrator = ImuCalibrator::new();
    for _ in 0..200 {
        assert_eq!(calibrator.update(&imu.sample(Vec3::ZERO, UP)), Ok(None));
    }
    let bad = ImuSample { gyro_rad_s: Vec3::new(0.0, f32::NAN, 0.0), accel_m_s2: UP };
    assert_eq!(calibrator.update(&bad), Err(CalibrationRefusal::NotFinite));
    let moving: Vec<_> =
        (0..512).map(|_| calibrator.update(&imu.sample(Vec3::splat(0.2), UP))).collect();
    assert!(moving[..511].iter().all(|result| *result == Ok(None)));
    assert_eq!(moving[511], Err(CalibrationRefusal::BiasTooLarge));
    assert_eq!(calibrator.calibration(), None);
    let rest: Vec<_> = (0..512).map(|_| calibrator.update(&imu.sample(Vec3::ZERO, UP))).collect();
    assert!(rest[..511].iter().all(|result| *result == Ok(None)));
    let calibration = rest[511].unwrap().unwrap();
    // Later samples do not change the calibration, whatever they are.
    assert_eq!(calibrator.update(&bad), Ok(Some(calibration)));
    assert_eq!(calibrator.calibration(), Some(calibration));
}

proptest! {
    #[test]
    fn accepted_calibration_is_within_its_limits(
        samples in prop::collection::vec(any::<([f32; 3], [f32; 3])>(), 1..8),
        scale in prop::sample::select(std::vec![1e-9_f32, 1e-3, 1.0]),
    ) {
        let mut calibrator = ImuCalibrator::new();
        for (gyro, accel) in samples.iter().cycle().take(1100) {
            let gyro_rad_s = Vec3::from(*gyro) * scale;
            let accel_m_s2 = UP + (Vec3::from(*accel) * scale).clamp(Vec3::NEG_ONE, Vec3::ONE);
            let sample = ImuSample { gyro_rad_s, accel_m_s2 };
            if let Ok(Some(calibration)) = calibrator.update(&sample) {
                let bias = calibration.gyro_bias_rad_s().abs().max_element();
                prop_assert!(bias <= CALIBRATED_BIAS_RAD_S_MAX);
                prop_assert!((0.9..1.12).contains(&calibration.accel_scale()));
            }
        }
    }
}
