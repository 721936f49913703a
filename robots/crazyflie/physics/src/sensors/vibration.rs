//! Vibration that unbalanced rotors and turbulent air cause at the inertial sensors.

use glam::DVec3;

use crate::{DroneState, STEP_S};

/// Amplitudes of vibration while all rotors turn at the speed of hover. Amplitudes grow with the
/// square of the speed, as the force of an unbalanced mass does.
///
/// No measured spectrum was found. The defaults are choices such that the raw accelerometer shows
/// 0.5 g rms along x, and about 0.02 g rms after the flight controller's filter of 30 Hz.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RotorVibration {
    /// Acceleration by one rotor along x and y, before the sensor's filter, in m/s².
    pub accel_m_s2: f64,
    /// Share of this acceleration that appears along z.
    pub vertical_share: f64,
    /// Angular rate by one rotor about x and y, before the sensor's filter, in rad/s.
    pub gyro_rad_s: f64,
    /// Density of noise of the air at the accelerometer, in m/s²/√Hz.
    pub broadband_m_s2_sqrt_hz: f64,
}

impl RotorVibration {
    /// A robot with usual propellers (choice).
    pub const USUAL: Self = RotorVibration {
        accel_m_s2: 9.81,
        vertical_share: 0.3,
        gyro_rad_s: 0.05,
        broadband_m_s2_sqrt_hz: 0.035,
    };
    /// Perfectly balanced rotors in smooth air.
    pub const NONE: Self = RotorVibration {
        accel_m_s2: 0.0,
        vertical_share: 0.0,
        gyro_rad_s: 0.0,
        broadband_m_s2_sqrt_hz: 0.0,
    };
}

/// Returns sin(2π `turns`), with an error below 10⁻⁵. It is much quicker than a full sine.
///
/// # Parameters
/// `turns`: 0 to 1.5.
fn sine_of_turns(turns: f64) -> f64 {
    // Reflect into the quarter turn around zero, where the Taylor series of order 9 is accurate.
    let mut turns = if turns >= 1.0 { turns - 1.0 } else { turns };
    if turns > 0.75 {
        turns -= 1.0;
    } else if turns > 0.25 {
        turns = 0.5 - turns;
    }
    let angle = turns * core::f64::consts::TAU;
    let square = angle * angle;
    let series = 1.0 / 120.0 - square * (1.0 / 5040.0 - square / 362_880.0);
    angle * (1.0 - square * (1.0 / 6.0 - square * series))
}

/// The angles of the rotors.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RotorPhases {
    /// Angle of each rotor in turns, 0 to 1.
    turns: [f64; 4],
}

/// Vibration at one moment, as it leaves the filters of the sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shake {
    pub(super) accel_m_s2: DVec3,
    pub(super) gyro_rad_s: DVec3,
    /// Mean of the squared speeds as a share of that of hover.
    pub(super) strength: f64,
}

impl RotorPhases {
    /// Starts with these angles in turns, 0 to 1.
    pub(super) fn new(turns: [f64; 4]) -> Self {
        RotorPhases { turns }
    }

    /// Turns the rotors for one step.
    pub(super) fn advance(&mut self, state: &DroneState) {
        for (turns, speed) in self.turns.iter_mut().zip(state.rotor_rpm) {
            *turns += speed * (STEP_S / 60.0);
            // A rotor turns less than once in a step unless a caller made its speed absurd.
            if *turns >= 1.0 {
                *turns -= turns.floor();
            }
        }
    }

    /// Returns the vibration at this moment.
    ///
    /// # Parameters
    /// * `hover_rpm`: the speed for which amplitudes hold.
    /// * `gyro_hz`, `accel_hz`: corner frequencies of the sensors' filters of order 1. Their gain is
    ///   applied; their phase has no effect on a periodic disturbance.
    pub(super) fn shake(
        &self,
        vibration: &RotorVibration,
        state: &DroneState,
        hover_rpm: f64,
        gyro_hz: f64,
        accel_hz: f64,
    ) -> Shake {
        let mut shake = Shake { accel_m_s2: DVec3::ZERO, gyro_rad_s: DVec3::ZERO, strength: 0.0 };
        for (turns, speed) in self.turns.into_iter().zip(state.rotor_rpm) {
            let strength = (speed / hover_rpm) * (speed / hover_rpm);
            shake.strength += strength / 4.0;
            let sine = sine_of_turns(turns);
            let cosine = sine_of_turns(turns + 0.25);
            let frequency = speed / 60.0;
            let gain = |corner: f64| {
                let ratio = frequency / corner;
                strength / (1.0 + ratio * ratio).sqrt()
            };
            let accel = gain(accel_hz) * vibration.accel_m_s2;
            shake.accel_m_s2 +=
                DVec3::new(accel * cosine, accel * sine, accel * vibration.vertical_share * cosine);
            let gyro = gain(gyro_hz) * vibration.gyro_rad_s;
            shake.gyro_rad_s += DVec3::new(-gyro * sine, gyro * cosine, 0.0);
        }
        shake
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sine_is_accurate() {
        for step in 0..1500 {
            let turns = f64::from(step) / 1000.0;
            let exact = libm::sin(turns * core::f64::consts::TAU);
            assert!((sine_of_turns(turns) - exact).abs() < 1e-5, "{turns}");
        }
    }

    /// One rotor at 300 Hz: amplitude and number of zero crossings.
    #[test]
    fn vibration_has_the_frequency_of_the_rotor() {
        let mut state = DroneState::at_rest(DVec3::ZERO, 0.0);
        state.rotor_rpm = [18_000.0, 0.0, 0.0, 0.0];
        let vibration = RotorVibration { accel_m_s2: 2.0, ..RotorVibration::USUAL };
        let mut phases = RotorPhases::new([0.1; 4]);
        let mut crossings = 0;
        let mut squares = 0.0;
        let mut before = 0.0;
        for _ in 0..10_000 {
            phases.advance(&state);
            let shake = phases.shake(&vibration, &state, 18_000.0, 1e9, 300.0);
            crossings += u32::from(before < 0.0 && shake.accel_m_s2.y >= 0.0);
            before = shake.accel_m_s2.y;
            squares += before * before;
            assert!((shake.strength - 0.25).abs() < 1e-12);
        }
        assert!((2999..=3001).contains(&crossings), "{crossings}");
        // At its corner frequency, the filter passes half the power: 2²/2/2.
        assert!((squares / 10_000.0 - 1.0).abs() < 0.01);
    }
}
