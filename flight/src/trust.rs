//! Trust in the measurements of one sensor during a flight.
//!
//! The filter's gates reject single wrong measurements. Two faults pass them and spoil the estimate:
//!
//! * **Repetition.** A sensor that repeats its last value agrees with a robot that moves steadily.
//!   A robot at rest in front of a good sensor repeats its value too, so a repetition counts only if
//!   the filter expects another value.
//! * **Noise.** Of very noisy measurements the gates accept those that happen to agree with the
//!   prediction, so the estimate drifts while the filter believes to be corrected. The share of
//!   rejected measurements shows it: correct ones are rejected once in 10,000 times, and what
//!   persists is adopted before the share has grown.
//!
//! A sensor that lost the trust does not get it back in flight: after a second without measurements
//! the gates have become so wide that they accept wrong ones. The robot lands.

use crate::ekf::EkfOutcome;

/// Limits of the trust in a sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrustLimits {
    /// Number of repetitions of an unexpected value that show a sensor that is stuck.
    pub most_repetitions: u8,
    /// Number of repetitions that show it even if the value is expected; `None` for a sensor that may
    /// repeat its value for long.
    pub most_expected: Option<u8>,
    /// Difference from the expected value, in the unit of the sensor, from which a value is
    /// unexpected.
    pub least_deviation: f32,
    /// Share of the newest measurement in the running share of rejected ones, 0 to 1.
    pub newest_share: f32,
    /// The same of a rejected measurement that agrees with the last ones, which may be adopted.
    pub persistent_share: f32,
}

/// Running share of rejected measurements from which a sensor is not trusted.
const REJECTED_MAX: f32 = 0.5;

impl TrustLimits {
    /// Limits of poses at 100 Hz. They find noise after 0.22 s, and poses of another robot after 0.43 s;
    /// poses that may be adopted are so after 0.3 s. Coordinates in f32 never repeat by chance.
    pub const POSE: Self = TrustLimits {
        most_repetitions: 30,
        most_expected: Some(30),
        least_deviation: 0.0,
        newest_share: 1.0 / 32.0,
        persistent_share: 1.0 / 64.0,
    };
    /// Limits of flow at 100 Hz, in counts. The whole count next to the expected one is at most half
    /// a count away, and the estimate is right to a quarter.
    pub const FLOW: Self = TrustLimits {
        most_repetitions: 15,
        most_expected: None,
        least_deviation: 0.75,
        newest_share: 1.0 / 31.0,
        persistent_share: 1.0 / 31.0,
    };
    /// Limits of distances in m at 30 Hz. With noise of 2.5 mm, two readings are equal in 11 % of all
    /// cases; even with 1 mm, at most 38 % of the readings have one value, and 17 in a row are equal
    /// once in 10⁷ cases.
    pub const RANGE: Self = TrustLimits {
        most_repetitions: 8,
        most_expected: Some(16),
        least_deviation: 0.003,
        newest_share: 1.0 / 16.0,
        persistent_share: 1.0 / 16.0,
    };
}

/// The trust in one sensor whose values have the type `T`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasurementTrust<T> {
    limits: TrustLimits,
    last: Option<T>,
    /// Repetitions of the last value, all and unexpected ones.
    repetitions: u8,
    unexpected: u8,
    rejected_share: f32,
    is_lost: bool,
}

impl<T: Copy + PartialEq> MeasurementTrust<T> {
    /// Returns the trust in a sensor without history.
    pub const fn new(limits: TrustLimits) -> Self {
        MeasurementTrust {
            limits,
            last: None,
            repetitions: 0,
            unexpected: 0,
            rejected_share: 0.0,
            is_lost: false,
        }
    }

    /// Forgets the history, such as before take-off.
    pub fn restart(&mut self) {
        *self = Self::new(self.limits);
    }

    /// Takes the filter's answer to a value.
    ///
    /// # Parameters
    /// `deviation`: magnitude of the difference between the value and the expected one, in the unit of
    /// [`TrustLimits::least_deviation`]. `persists`: the deviation agrees with the last ones.
    pub fn note(&mut self, value: T, deviation: f32, persists: bool, outcome: &EkfOutcome) {
        if self.last == Some(value) {
            let is_unexpected = deviation >= self.limits.least_deviation;
            self.repetitions = self.repetitions.saturating_add(1);
            self.unexpected = self.unexpected.saturating_add(u8::from(is_unexpected));
        } else {
            self.repetitions = 0;
            self.unexpected = 0;
        }
        self.last = Some(value);
        self.is_lost |= self.unexpected >= self.limits.most_repetitions
            || self.limits.most_expected.is_some_and(|most| self.repetitions >= most);
        let TrustLimits { newest_share, persistent_share, .. } = self.limits;
        let (rejected, share) = match outcome {
            EkfOutcome::Accepted => (0.0, newest_share),
            EkfOutcome::Rejected { .. } if persists => (1.0, persistent_share),
            EkfOutcome::Rejected { .. } => (1.0, newest_share),
            EkfOutcome::Refused(_) => return,
        };
        self.rejected_share += (rejected - self.rejected_share) * share;
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
        let mut trust = MeasurementTrust::new(TrustLimits::FLOW);
        let accepted = EkfOutcome::Accepted;
        (0..100).for_each(|value| trust.note(value / 15, 1.0, false, &accepted));
        assert!(!trust.is_lost(), "15 equal values are 14 repetitions");
        // A robot at rest may repeat its flow for long.
        (0..1000).for_each(|_| trust.note(7, 0.5, false, &accepted));
        (0..14).for_each(|_| trust.note(7, 1.0, false, &accepted));
        assert!(!trust.is_lost());
        trust.note(7, 1.0, false, &accepted);
        assert!(trust.is_lost());
        // No distance repeats for long.
        let mut distance = MeasurementTrust::new(TrustLimits::RANGE);
        (0..16).for_each(|_| distance.note(7, 0.0, false, &accepted));
        assert!(!distance.is_lost());
        distance.note(7, 0.0, false, &accepted);
        assert!(distance.is_lost());
        trust.note(8, 0.0, false, &accepted);
        assert!(trust.is_lost(), "trust does not return in flight");
        trust.restart();
        assert!(!trust.is_lost());
    }

    /// Without rejections before, the running share of n rejections is 1 − (1 − share)ⁿ.
    #[test]
    fn rejections_end_the_trust_after_the_time_of_the_closed_form() {
        let all = [TrustLimits::POSE, TrustLimits::FLOW, TrustLimits::RANGE];
        for (limits, persists) in all.into_iter().flat_map(|l| [(l, false), (l, true)]) {
            let share = if persists { limits.persistent_share } else { limits.newest_share };
            let expected = (0.5_f64.ln() / (1.0 - f64::from(share)).ln()).ceil();
            let mut trust = MeasurementTrust::<u8>::new(limits);
            let mut count = 0.0;
            while !trust.is_lost() {
                trust.note(count as u8, 0.0, persists, &REJECTED);
                count += 1.0;
            }
            assert_eq!(count, expected);
        }
    }

    #[test]
    fn rare_rejections_keep_the_trust() {
        let mut trust = MeasurementTrust::<u8>::new(TrustLimits::FLOW);
        for number in 0..10_000 {
            let outcome = if number % 3 == 0 { &REJECTED } else { &EkfOutcome::Accepted };
            trust.note((number % 200) as u8, 0.0, false, outcome);
            trust.note((number % 199) as u8, 0.0, false, &EkfOutcome::Refused(EkfRefusal::TooOld));
        }
        assert!(!trust.is_lost());
    }
}
