//! Gyroscope and accelerometer (Bosch BMI088) at 1 kHz.
//!
//! The path of a signal: angular rate, which changes evenly during a step, or mean specific force of the
//! step → filter of order 1 → sum with vibration, noise, offset and drift → limit and quantization.
//!
//! Simplifications: the filters of the chip have a higher order; the accelerometer's own sample rate
//! of 1.6 kHz is not modeled; both sensors sit at the center of mass, without misalignment and
//! with exact scale.

use glam::DVec3;

use crate::random::{NoiseConsumer, NoiseStream};
use crate::sensors::fault::FaultGate;
use crate::sensors::vibration::RotorPhases;
use crate::sensors::{RotorVibration, SensorFault};
use crate::{Airframe, DroneState, GRAVITY_M_S2, STEP_S};

/// Angular rate of one count of the gyroscope at ±2000 °/s, in rad/s.
const GYRO_COUNT_RAD_S: f64 = 4000.0 / 65_536.0 * core::f64::consts::PI / 180.0;
/// Specific force of one count of the accelerometer at ±24 g, in m/s².
const ACCEL_COUNT_M_S2: f64 = 48.0 / 65_536.0 * GRAVITY_M_S2;
/// Rise of the chip's temperature above that at the start, in K, and its time constant in seconds
/// (choice).
const WARM_UP_K: f64 = 10.0;
const WARM_UP_S: f64 = 120.0;

/// The properties of the inertial sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSettings {
    /// Density of the gyroscope's noise in rad/s/√Hz.
    pub gyro_density_rad_s: f64,
    /// Largest offset of the gyroscope in rad/s. Each build has one within this range.
    pub gyro_offset_rad_s: f64,
    /// Largest change of the offset by temperature in rad/s/K.
    pub gyro_drift_rad_s_k: f64,
    /// Density of the accelerometer's noise along x, y and z, in m/s²/√Hz.
    pub accel_density_m_s2: DVec3,
    /// Largest offset of the accelerometer in m/s².
    pub accel_offset_m_s2: f64,
    /// Corner frequency of the gyroscope's filter in Hz.
    pub gyro_corner_hz: f64,
    /// Corner frequency of the accelerometer's filter in Hz.
    pub accel_corner_hz: f64,
    /// Vibration.
    pub vibration: RotorVibration,
}

const DEGREE: f64 = core::f64::consts::PI / 180.0;
const MILLI_G: f64 = 1e-3 * GRAVITY_M_S2;

impl ImuSettings {
    /// The BMI088 as the flight controller sets it up. Densities, offsets and drift are recalled
    /// from the data sheet (BST-BMI088-DS001), where offsets are typical values; corner
    /// frequencies follow from the registers that Bitcraze's firmware writes.
    pub const BMI088: Self = ImuSettings {
        gyro_density_rad_s: 0.014 * DEGREE,
        gyro_offset_rad_s: 1.0 * DEGREE,
        gyro_drift_rad_s_k: 0.015 * DEGREE,
        accel_density_m_s2: DVec3::new(0.16 * MILLI_G, 0.16 * MILLI_G, 0.19 * MILLI_G),
        accel_offset_m_s2: 20.0 * MILLI_G,
        gyro_corner_hz: 116.0,
        accel_corner_hz: 145.0,
        vibration: RotorVibration::USUAL,
    };
}

/// One measurement in counts of the chip, in the body frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImuCounts {
    /// Angular rate about x, y and z.
    pub gyro: [i16; 3],
    /// Specific force along x, y and z.
    pub accel: [i16; 3],
}

impl ImuCounts {
    /// Returns the angular rate in rad/s.
    #[must_use]
    pub fn gyro_rad_s(&self) -> DVec3 {
        DVec3::from_array(self.gyro.map(f64::from)) * GYRO_COUNT_RAD_S
    }

    /// Returns the specific force in m/s².
    #[must_use]
    pub fn accel_m_s2(&self) -> DVec3 {
        DVec3::from_array(self.accel.map(f64::from)) * ACCEL_COUNT_M_S2
    }
}

/// Returns the counts of a signal, limited to the sensor's range.
fn counts(signal: DVec3, count: f64) -> [i16; 3] {
    // A conversion to an integer cuts the fraction off and limits the number.
    (signal / count).to_array().map(|value| (value + 0.5_f64.copysign(value)) as i16)
}

/// A filter of order 1 with the step response 1 − exp(−2π f t).
#[derive(Clone, Debug, PartialEq)]
struct FirstOrderFilter {
    /// Response to a unit input after a period.
    share: f64,
    /// Response at the end of a period to an input that rises from 0 to 1 in it.
    ramp_share: f64,
    value: DVec3,
}

impl FirstOrderFilter {
    fn new(corner_hz: f64, period_s: f64, value: DVec3) -> Self {
        let periods = core::f64::consts::TAU * corner_hz * period_s;
        let share = -libm::expm1(-periods);
        FirstOrderFilter { share, ramp_share: 1.0 - share / periods, value }
    }

    /// Follows a period with a constant input.
    fn update(&mut self, input: DVec3) -> DVec3 {
        self.value += (input - self.value) * self.share;
        self.value
    }

    /// Follows a period in which the input changes evenly.
    fn update_evenly(&mut self, from: DVec3, to: DVec3) -> DVec3 {
        self.value += (from - self.value) * self.share + (to - from) * self.ramp_share;
        self.value
    }
}

/// The inertial sensors of one build.
#[derive(Clone, Debug, PartialEq)]
pub struct Imu {
    settings: ImuSettings,
    hover_rpm: f64,
    noise: NoiseStream,
    gyro_offset_rad_s: DVec3,
    gyro_drift_rad_s_k: DVec3,
    accel_offset_m_s2: DVec3,
    warm_k: f64,
    /// Angular rate at the end of the last step in rad/s.
    rate_rad_s: DVec3,
    gyro: FirstOrderFilter,
    accel: FirstOrderFilter,
    gyro_noise: FirstOrderFilter,
    accel_noise: FirstOrderFilter,
    phases: RotorPhases,
    gate: FaultGate<ImuCounts>,
}

impl Imu {
    /// Returns the sensors of one build, at rest.
    ///
    /// # Parameters
    /// `seed`: the build and its noise.
    #[must_use]
    pub fn new(airframe: &Airframe, settings: ImuSettings, seed: u64) -> Self {
        let mut noise = NoiseStream::new(seed, NoiseConsumer::Imu);
        let up = DVec3::new(0.0, 0.0, GRAVITY_M_S2);
        Imu {
            hover_rpm: airframe.hover_speed_rpm(),
            gyro_offset_rad_s: noise.uniform_vector(settings.gyro_offset_rad_s),
            gyro_drift_rad_s_k: noise.uniform_vector(settings.gyro_drift_rad_s_k),
            accel_offset_m_s2: noise.uniform_vector(settings.accel_offset_m_s2),
            warm_k: 0.0,
            rate_rad_s: DVec3::ZERO,
            gyro: FirstOrderFilter::new(settings.gyro_corner_hz, STEP_S, DVec3::ZERO),
            accel: FirstOrderFilter::new(settings.accel_corner_hz, STEP_S, up),
            gyro_noise: FirstOrderFilter::new(settings.gyro_corner_hz, STEP_S, DVec3::ZERO),
            accel_noise: FirstOrderFilter::new(settings.accel_corner_hz, STEP_S, DVec3::ZERO),
            phases: RotorPhases::new([0; 4].map(|_| 0.5 + noise.uniform(0.5))),
            gate: FaultGate::new(),
            settings,
            noise,
        }
    }

    /// Sets or clears the fault of both sensors.
    pub fn set_fault(&mut self, fault: Option<SensorFault>) {
        self.gate.fault = fault;
    }

    /// Returns the present offset of the gyroscope in rad/s, to judge an estimate.
    #[must_use]
    #[cfg(test)]
    fn true_gyro_offset_rad_s(&self) -> DVec3 {
        self.gyro_offset_rad_s + self.gyro_drift_rad_s_k * self.warm_k
    }

    /// Returns the offset of the accelerometer in m/s², to judge an estimate.
    #[must_use]
    #[cfg(test)]
    fn true_accel_offset_m_s2(&self) -> DVec3 {
        self.accel_offset_m_s2
    }

    /// Follows one step, and returns the measurement at its end unless a fault hides it.
    pub fn sample(&mut self, state: &DroneState) -> Option<ImuCounts> {
        let gyro = self.gyro.update_evenly(self.rate_rad_s, state.rate_rad_s);
        self.rate_rad_s = state.rate_rad_s;
        let accel = self.accel.update(state.specific_force_m_s2);
        self.phases.advance(state);
        self.warm_k += (WARM_UP_K - self.warm_k) * (STEP_S / WARM_UP_S);
        let settings = &self.settings;
        let shake = self.phases.shake(
            &settings.vibration,
            state,
            self.hover_rpm,
            settings.gyro_corner_hz,
            settings.accel_corner_hz,
        );
        // White noise of density d, sampled at f, has the deviation d √(f/2).
        let factor = self.gate.noise_factor() * (0.5 / STEP_S).sqrt();
        let broadband = settings.vibration.broadband_m_s2_sqrt_hz * shake.strength;
        let accel_density = settings.accel_density_m_s2;
        let accel_deviation =
            (accel_density * accel_density + DVec3::splat(broadband * broadband)).to_array();
        let accel_deviation = DVec3::from_array(accel_deviation.map(f64::sqrt)) * factor;
        let gyro_white = self.noise.normal_vector() * (settings.gyro_density_rad_s * factor);
        let accel_white = self.noise.normal_vector() * accel_deviation;
        let gyro = gyro
            + shake.gyro_rad_s
            + self.gyro_noise.update(gyro_white)
            + self.gyro_offset_rad_s
            + self.gyro_drift_rad_s_k * self.warm_k;
        let accel = accel
            + shake.accel_m_s2
            + self.accel_noise.update(accel_white)
            + self.accel_offset_m_s2;
        self.gate.pass(ImuCounts {
            gyro: counts(gyro, GYRO_COUNT_RAD_S),
            accel: counts(accel, ACCEL_COUNT_M_S2),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLUS: Airframe = Airframe::CRAZYFLIE_2_1_PLUS;

    fn still() -> ImuSettings {
        ImuSettings { vibration: RotorVibration::NONE, ..ImuSettings::BMI088 }
    }

    /// Returns the measurements of a state that lasts `seconds`.
    fn run(imu: &mut Imu, mut state: DroneState, seconds: u64) -> Vec<ImuCounts> {
        let mut readings = Vec::new();
        for _ in 0..1000 * seconds {
            state.steps += 1;
            readings.extend(imu.sample(&state));
        }
        readings
    }

    fn mean_and_deviation(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
        let count = values.clone().count() as f64;
        let mean = values.clone().sum::<f64>() / count;
        let square = values.map(|value| (value - mean) * (value - mean)).sum::<f64>() / count;
        (mean, square.sqrt())
    }

    /// White noise of density d through a filter of order 1 with the corner f has the deviation
    /// d √(π f / 2); sampling at 1 kHz and quantization change it slightly.
    #[test]
    fn noise_at_rest_has_the_deviation_of_the_data_sheet() {
        let mut imu = Imu::new(&PLUS, still(), 3);
        let readings = run(&mut imu, DroneState::at_rest(DVec3::ZERO, 0.0), 20);
        assert_eq!(readings.len(), 20_000);
        let half_pi = core::f64::consts::FRAC_PI_2;
        let (mean, found) = mean_and_deviation(readings.iter().map(|r| r.gyro_rad_s().x));
        let expected = 0.014 * DEGREE * (half_pi * 116.0_f64).sqrt();
        assert!((found / expected - 1.0).abs() < 0.15, "{found} {expected}");
        assert!((mean - imu.true_gyro_offset_rad_s().x).abs() < 1e-3 * DEGREE * 20.0);
        let (mean, found) = mean_and_deviation(readings.iter().map(|r| r.accel_m_s2().z));
        let expected = 0.19 * MILLI_G * (half_pi * 145.0_f64).sqrt();
        assert!((found / expected - 1.0).abs() < 0.15, "{found} {expected}");
        assert!((mean - GRAVITY_M_S2 - imu.true_accel_offset_m_s2().z).abs() < 0.01);
    }

    #[test]
    fn offsets_differ_between_builds_within_the_range() {
        let offsets: Vec<f64> = (0..200)
            .map(|seed| Imu::new(&PLUS, still(), seed).true_gyro_offset_rad_s().y / DEGREE)
            .collect();
        assert!(offsets.iter().all(|offset| offset.abs() <= 1.0));
        let (mean, deviation) = mean_and_deviation(offsets.iter().copied());
        assert!(mean.abs() < 0.15 && (deviation - 0.577).abs() < 0.1, "{mean} {deviation}");
    }

    #[test]
    fn the_gyroscope_drifts_while_it_warms_up() {
        let mut imu = Imu::new(&PLUS, still(), 5);
        let before = imu.true_gyro_offset_rad_s();
        run(&mut imu, DroneState::at_rest(DVec3::ZERO, 0.0), 120);
        let exact = imu.gyro_drift_rad_s_k * WARM_UP_K * (1.0 - (-1.0_f64).exp());
        assert!((imu.true_gyro_offset_rad_s() - before - exact).length() < 1e-3 * exact.length());
    }

    #[test]
    fn signals_are_filtered_and_limited() {
        let mut imu = Imu::new(&PLUS, still(), 1);
        let mut state = DroneState::at_rest(DVec3::ZERO, 0.0);
        state.rate_rad_s = DVec3::new(10.0, 100.0, -100.0);
        state.specific_force_m_s2 = DVec3::new(0.0, 1e4, -1e4);
        let readings = run(&mut imu, state, 1);
        let mut imu = Imu::new(&PLUS, still(), 1);
        let mut pushed = DroneState::at_rest(DVec3::ZERO, 0.0);
        pushed.specific_force_m_s2.x = 10.0;
        let early_force = run(&mut imu, pushed, 1)[0];
        // One time constant of 116 Hz is 1.372 ms. The rate rises during the first millisecond, whose
        // response is 1 − (1 − exp(−t/τ)) τ/t.
        let early = readings[0].gyro_rad_s().x / 10.0;
        let exact = 1.0 - (1.0 - (-1.0_f64 / 1.372).exp()) * 1.372;
        assert!((early - exact).abs() < 0.01, "{early}");
        // The specific force of a step is its mean, so the other sensor follows a step.
        let early = early_force.accel_m_s2().x / 10.0;
        let exact = 1.0 - (-core::f64::consts::TAU * 0.145).exp();
        assert!((early - exact).abs() < 0.05, "{early}");
        let last = readings[999];
        assert_eq!(last.gyro[1..], [i16::MAX, i16::MIN]);
        assert_eq!(last.accel[1..], [i16::MAX, i16::MIN]);
        assert!((last.gyro_rad_s().x - 10.0).abs() < 0.03);
    }

    /// Deviation of the acceleration in hover, raw and after a Butterworth filter of order 2 at 30 Hz.
    #[test]
    fn vibration_in_hover_has_the_documented_size() {
        let mut imu = Imu::new(&PLUS, ImuSettings::BMI088, 2);
        let mut state = DroneState::at_rest(DVec3::ZERO, 0.0);
        let hover = PLUS.hover_speed_rpm();
        state.rotor_rpm = [0.99, 1.0, 1.01, 1.02].map(|factor| factor * hover);
        let signal: Vec<f64> =
            run(&mut imu, state, 20).iter().map(|r| r.accel_m_s2().x / GRAVITY_M_S2).collect();
        let (_, raw) = mean_and_deviation(signal.iter().copied());
        assert!((0.4..0.65).contains(&raw), "{raw}");
        let o = (core::f64::consts::PI * 30.0 / 1000.0).tan();
        let c = 1.0 + 2.0_f64.sqrt() * o + o * o;
        let (mut y, mut y1, mut y2, mut x1, mut x2) = (vec![], 0.0, 0.0, 0.0, 0.0);
        for x in &signal {
            let b = o * o / c;
            let next = b * (x + 2.0 * x1 + x2)
                - 2.0 * (o * o - 1.0) / c * y1
                - (1.0 - 2.0_f64.sqrt() * o + o * o) / c * y2;
            (x2, x1, y2, y1) = (x1, *x, y1, next);
            y.push(next);
        }
        let (_, filtered) = mean_and_deviation(y[1000..].iter().copied());
        assert!((0.015..0.03).contains(&filtered), "{filtered}");
    }

    #[test]
    fn faults_reach_the_measurements() {
        let mut imu = Imu::new(&PLUS, still(), 4);
        let state = DroneState::at_rest(DVec3::ZERO, 0.0);
        let (_, usual) =
            mean_and_deviation(run(&mut imu, state, 5).iter().map(|r| r.gyro_rad_s().z));
        imu.set_fault(Some(SensorFault::Noisy(10.0)));
        let (_, noisy) =
            mean_and_deviation(run(&mut imu, state, 5).iter().map(|r| r.gyro_rad_s().z));
        assert!((noisy / usual - 10.0).abs() < 1.0, "{noisy} {usual}");
        imu.set_fault(Some(SensorFault::Silent));
        assert!(run(&mut imu, state, 1).is_empty());
    }
}
