//! Trust in the measurements of one sensor during a flight.
//!
//! The filter's gates reject single wrong measurements. Two faults pass them and spoil the estimate:
//!
//! * **Repetition.** A sensor that repeats its last value agrees with a robot that moves steadily.
//!   Noise makes many equal values in a row unlikely.
//! * **Noise.** Of very noisy measurements the gates accept those that happen to agree with the
//!   prediction, so the estimate drifts while the filter believes to be corrected. The share of
//!   rejected measurements shows it: correct ones are rejected once in 10,000 times.
//!
//! A sensor that lost the trust does not get it back in flight: after a second without measurements
//! the gates have become so wide that they accept wrong ones. The robot lands.

use crate::ekf::EkfOutcome;

/// Limits of the trust in a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrustLimits {
    /// Number of repetitions of a value that show a sensor that is stuck.
    pub most_repetitions: u8,
    /// Share of the newest measurement in the running share of rejected ones, 0 to 1.
    pub newest_share: f32,
}

/// Running share of rejected measurements from which a sensor is not trusted.
const REJECTED_MAX: f32 = 0.5;

impl TrustLimits {
    /// Limits of poses at 100 Hz. They find noise, or poses of another robot, after 0.22 s.
    pub const POSE: Self = TrustLimits { most_repetitions: 30, newest_share: 1.0 / 32.0 };
    /// Limits of flow at 100 Hz.
    ///
    /// With noise of half a count, two readings are equal in a quarter of all cases, and 16 in a row
    /// once in 10⁹ cases.
    pub const FLOW: Self = TrustLimits { most_repetitions: 15, newest_share: 1.0 / 16.0 };
    /// Limits of distances in mm at 40 Hz. With noise of 2.5 mm, two readings are equal in 11 % of all
    /// cases, and 9 in a row once in 10⁷ cases.
    pub const RANGE: Self = TrustLimits { most_repetitions: 8, newest_share: 1.0 / 8.0 };
}

/// The trust in one sensor whose values have the type `T`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasurementTrust<T> {
    limits: TrustLimits,
    last: Option<T>,
    repetitions: u8,
    rejected_share: f32,
    is_lost: bool,
}

impl<T: Copy + PartialEq> MeasurementTrust<T> {
    /// Returns the trust in a sensor without history.
    pub const fn new(limits: TrustLimits) -> Self {
        MeasurementTrust { limits, last: None, repetitions: 0, rejected_share: 0.0, is_lost: false }
    }

    /// Forgets the history, such as before take-off.
    pub fn restart(&mut self) {
        *self = Self::new(self.limits);
    }

    /// Returns true if the filter may take the next value of the sensor.
    pub fn admits(&mut self, value: T) -> bool {
        let repeats = self.last == Some(value);
        self.repetitions = if repeats { self.repetitions.saturating_add(1) } else { 0 };
        self.last = Some(value);
        self.is_lost |= self.repetitions >= self.limits.most_repetitions;
        !self.is_lost
    }

    /// Takes the filter's answer to a value that was admitted.
    pub fn note(&mut self, outcome: &EkfOutcome) {
        let rejected = match outcome {
            EkfOutcome::Accepted => 0.0,
            EkfOutcome::Rejected { .. } => 1.0,
            EkfOutcome::Refused(_) => return,
        };
        self.rejected_share += (rejected - self.rejected_share) * self.limits.newest_share;
        self.is_lost |= self.rejected_share > REJECTED_MAX;
    }

    /// Returns true if the sensor is not trusted for the rest of the flight.
    pub fn is_lost(&self) -> bool {
        self.is_lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ekf::EkfRefusal;

    const REJECTED: EkfOutcome = EkfOutcome::Rejected { distance_ratio: 2.0 };

    #[test]
    fn a_stuck_sensor_loses_the_trust() {
        let mut trust = MeasurementTrust::new(TrustLimits::RANGE);
        assert!((0..100).all(|value| trust.admits(value / 8)), "8 equal values are 7 repetitions");
        assert!((0..8).all(|_| trust.admits(7)));
        assert!(!trust.admits(7) && trust.is_lost());
        assert!(!trust.admits(8), "trust does not return in flight");
        trust.restart();
        assert!(trust.admits(7));
    }

    /// Without rejections before, the running share of n rejections is 1 − (1 − share)ⁿ.
    #[test]
    fn rejections_end_the_trust_after_the_time_of_the_closed_form() {
        for limits in [TrustLimits::POSE, TrustLimits::FLOW, TrustLimits::RANGE] {
            let expected = (0.5_f64.ln() / (1.0 - f64::from(limits.newest_share)).ln()).ceil();
            let mut trust = MeasurementTrust::<u8>::new(limits);
            let mut count = 0.0;
            while !trust.is_lost() {
                trust.note(&REJECTED);
                count += 1.0;
            }
            assert_eq!(count, expected);
        }
    }

    #[test]
    fn rare_rejections_keep_the_trust() {
        let mut trust = MeasurementTrust::<u8>::new(TrustLimits::FLOW);
        for number in 0..10_000 {
            trust.note(if number % 3 == 0 { &REJECTED } else { &EkfOutcome::Accepted });
            trust.note(&EkfOutcome::Refused(EkfRefusal::TooOld));
        }
        assert!(!trust.is_lost());
    }
}
