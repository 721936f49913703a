use proptest::prelude::*;

use bittybuzz_random::Random;

use super::*;
use crate::calibration::simulated_imu::SimulatedImu;

const DEGREE: f32 = PI / 180.0;
const UP: Vec3 = Vec3::new(0.0, 0.0, GRAVITY_M_S2);
const DT_S: f32 = 0.001;

/// Fault that a stream of samples at 1 kHz gives first, with the number of samples until then.
fn first_fault(
    monitor: &mut ImuMonitor,
    samples: u32,
    mut sample: impl FnMut(u32) -> Option<ImuSample>,
) -> Option<(u32, ImuFault)> {
    (0..samples)
        .find_map(|n| monitor.update(sample(n).as_ref(), DT_S).err().map(|fault| (n + 1, fault)))
}

/// Fault and delay in samples after a second of flight without fault, for `fault_at` = 0, 1, ...
fn delay(mut change: impl FnMut(u32, ImuSample) -> Option<ImuSample>) -> Option<(u32, ImuFault)> {
    let mut imu = SimulatedImu::in_flight(5);
    let mut monitor = ImuMonitor::new();
    assert_eq!(first_fault(&mut monitor, 1000, |_| Some(imu.sample(Vec3::ONE, UP))), None);
    first_fault(&mut monitor, 1000, |n| change(n, imu.sample(Vec3::ONE, UP)))
}

fn assert_detected(
    expected: ImuFault,
    most_ms: u32,
    change: impl FnMut(u32, ImuSample) -> Option<ImuSample>,
) {
    let (delay_ms, fault) = delay(change).unwrap();
    assert_eq!(fault, expected);
    assert!(delay_ms <= most_ms, "{fault:?} after {delay_ms} ms");
}

#[test]
fn robot_at_rest_gives_no_fault_in_ten_minutes() {
    let mut imu = SimulatedImu::at_rest(2);
    let mut monitor = ImuMonitor::new();
    assert_eq!(first_fault(&mut monitor, 600_000, |_| Some(imu.sample(Vec3::ZERO, UP))), None);
}

#[test]
fn vibration_of_rotors_gives_no_fault() {
    // Rotors at different frequencies, and all at the same one, so that the amplitudes add up.
    for seed in 0..8 {
        let mut imu = SimulatedImu::in_flight(seed);
        if seed > 0 {
            imu.rotor_hz = [370.0 + 13.0 * seed as f64; 4];
        }
        // One rotor alone has 40 °/s and 2 g here.
        if seed % 2 == 1 {
            imu.rotor_hz[1..].fill(0.0);
            imu.gyro_vibration_rad_s *= 4.0;
            imu.accel_vibration_m_s2 *= 4.0;
        }
        let mut monitor = ImuMonitor::new();
        let fault = first_fault(&mut monitor, 20_000, |_| Some(imu.sample(Vec3::ZERO, UP)));
        assert_eq!(fault, None, "{:?} Hz", imu.rotor_hz);
    }
}

#[test]
fn vibration_beyond_the_expected_gives_no_fault() {
    for rotor_hz in [380.0, 425.0, 470.0] {
        let mut imu = SimulatedImu::in_flight(1);
        imu.rotor_hz = [rotor_hz; 4];
        imu.gyro_vibration_rad_s *= 50.0 / 40.0;
        imu.accel_vibration_m_s2 *= 6.0 / 2.0;
        let mut monitor = ImuMonitor::new();
        let fault = first_fault(&mut monitor, 20_000, |_| Some(imu.sample(Vec3::ZERO, UP)));
        assert_eq!(fault, None, "{rotor_hz} Hz");
    }
}

#[test]
fn aggressive_maneuver_gives_no_fault() {
    let mut imu = SimulatedImu::in_flight(3);
    let mut monitor = ImuMonitor::new();
    // Angular acceleration up to 500 rad/s² with the lag of the rotors, rate up to 17 rad/s.
    let fault = first_fault(&mut monitor, 10_000, |n| {
        let phase = 30.0 * n as f32 * DT_S;
        let rate = 500.0 / 30.0 * libm::sinf(phase);
        Some(imu.sample(Vec3::new(rate, -rate, 5.0), 1.8 * UP))
    });
    assert_eq!(fault, None);
}

#[test]
fn collision_and_hard_landing_give_no_fault() {
    // The rate jumps by 1000 °/s between two samples; the shock is a half sine of 20 g for 4 ms.
    let collision = delay(|n, mut sample| {
        if n >= 10 {
            sample.gyro_rad_s += Vec3::X * 1000.0 * DEGREE;
        }
        if (10..14).contains(&n) {
            let shock = libm::sinf(PI * (n as f32 - 9.5) / 4.0);
            sample.accel_m_s2.z += 20.0 * GRAVITY_M_S2 * shock;
        }
        Some(sample)
    });
    assert_eq!(collision, None);
}

#[test]
fn single_wrong_samples_give_no_fault() {
    for wrong in [2000.0 * DEGREE, -2000.0 * DEGREE] {
        let fault = delay(|n, mut sample| {
            if n % 100 == 50 {
                sample.gyro_rad_s = Vec3::splat(wrong);
                sample.accel_m_s2 = Vec3::splat(24.0 * GRAVITY_M_S2);
            }
            Some(sample)
        });
        assert_eq!(fault, None);
    }
}

#[test]
fn silence_is_found_within_6_ms() {
    assert_detected(ImuFault::Silent, 6, |_, _| None);
    // Four lost samples are not yet silence.
    assert_eq!(delay(|n, sample| (n % 5 == 4).then_some(sample)), None);
}

#[test]
fn invalid_time_counts_as_silence() {
    for dt_s in [f32::NAN, f32::INFINITY, -0.001] {
        let mut monitor = ImuMonitor::new();
        assert_eq!(monitor.update(None, dt_s), Err(ImuFault::Silent));
        // The silence ends with the next sample.
        assert_eq!(monitor.update(None, 0.0), Err(ImuFault::Silent));
        let sample = ImuSample { gyro_rad_s: Vec3::ZERO, accel_m_s2: UP };
        assert_eq!(monitor.update(Some(&sample), dt_s), Err(ImuFault::Silent));
        assert_eq!(monitor.update(Some(&sample), DT_S), Ok(()));
    }
}

#[test]
fn value_that_is_not_finite_is_found_at_once() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for axis in 0..3 {
            assert_detected(ImuFault::NotFinite, 1, |_, mut sample| {
                sample.gyro_rad_s[axis] = bad;
                Some(sample)
            });
            assert_detected(ImuFault::NotFinite, 1, |_, mut sample| {
                sample.accel_m_s2[axis] = bad;
                Some(sample)
            });
        }
    }
    // The sample after it is judged as if the bad one had been missing.
    let fault = delay(|n, sample| if n == 0 { Some(sample) } else { None });
    assert_eq!(fault, Some((7, ImuFault::Silent)));
}

#[test]
fn saturation_is_found_within_5_ms() {
    for sign in [1.0, -1.0] {
        assert_detected(ImuFault::GyroSaturated, 5, |_, mut sample| {
            sample.gyro_rad_s.y = sign * 32767.0 / 32768.0 * 2000.0 * DEGREE;
            Some(sample)
        });
        assert_detected(ImuFault::AccelSaturated, 5, |_, mut sample| {
            sample.accel_m_s2.x = sign * 17.0 * GRAVITY_M_S2;
            Some(sample)
        });
    }
}

#[test]
fn stuck_axis_is_found_within_36_ms() {
    for axis in 0..3 {
        let mut frozen = None;
        assert_detected(ImuFault::GyroStuck, 36, |_, mut sample| {
            sample.gyro_rad_s[axis] = *frozen.get_or_insert(sample.gyro_rad_s[axis]);
            Some(sample)
        });
        assert_detected(ImuFault::AccelStuck, 36, |_, mut sample| {
            sample.accel_m_s2[axis] = 0.0;
            Some(sample)
        });
    }
    // The whole sensor repeats its last sample.
    let mut frozen = None;
    assert_detected(ImuFault::GyroStuck, 36, |_, sample| Some(*frozen.get_or_insert(sample)));
}

#[test]
fn noise_is_found_within_40_ms() {
    let mut random = Random::new(9);
    for axis in 0..3 {
        for _ in 0..50 {
            assert_detected(ImuFault::GyroNoisy, 40, |_, mut sample| {
                sample.gyro_rad_s[axis] += 130.0 * DEGREE * random.normal() as f32;
                Some(sample)
            });
            assert_detected(ImuFault::AccelNoisy, 40, |_, mut sample| {
                // One bit of the value flips at random.
                let bit = if random.chance(0.5) { 14.0 } else { -14.0 };
                sample.accel_m_s2[axis] = bit * GRAVITY_M_S2;
                Some(sample)
            });
        }
    }
    // Random bytes instead of the rate.
    let (delay_ms, _) = delay(|_, mut sample| {
        sample.gyro_rad_s.x = random.uniform(1.0) as f32 * 2000.0 * DEGREE;
        Some(sample)
    })
    .unwrap();
    assert!(delay_ms <= 10, "{delay_ms} ms");
}

#[test]
fn fault_ends_with_its_cause() {
    let mut imu = SimulatedImu::in_flight(5);
    let mut monitor = ImuMonitor::new();
    let frozen = imu.sample(Vec3::ZERO, UP);
    assert!(first_fault(&mut monitor, 40, |_| Some(frozen)).is_some());
    assert_eq!(first_fault(&mut monitor, 100, |_| Some(imu.sample(Vec3::ZERO, UP))), None);
}

proptest! {
    #[test]
    fn any_finite_samples_keep_the_history_finite(
        samples in prop::collection::vec(any::<(Option<([f32; 3], [f32; 3])>, f32)>(), 1..200),
    ) {
        let mut monitor = ImuMonitor::new();
        for (sample, dt_s) in samples {
            let sample = sample.map(|(gyro, accel)| {
                ImuSample { gyro_rad_s: gyro.into(), accel_m_s2: accel.into() }
            });
            let _ = monitor.update(sample.as_ref(), dt_s);
            prop_assert!(monitor.gyro.mean_square.is_finite());
            prop_assert!(monitor.accel.mean_square.is_finite());
        }
    }
}
