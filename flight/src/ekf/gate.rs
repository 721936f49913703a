//! The gates that a measurement passes before it changes the estimate.
//!
//! A gate knows the noise of the sensor. Wind, a touch, a moved marker or a slow radio are no noise:
//! they differ from the estimate by more, but each measurement shows the same difference. Such an
//! effect passes up to a floor, and a larger one can be adopted; noise does neither.

use glam::Vec3;

use super::measurement::{EkfOutcome, EkfRefusal};

/// The 0.9999 quantile of χ² with one degree of freedom.
pub(super) const GATE_1: f32 = 15.14;
/// The 0.9999 quantile of χ² with three degrees of freedom.
pub(super) const GATE_3: f32 = 21.11;

/// A gate of one measurement.
#[derive(Clone, Copy)]
pub(super) struct Gate {
    /// Largest squared distance.
    pub limit: f32,
    /// Magnitude of an innovation that passes whatever its distance is, in the innovation's unit.
    pub floor: f32,
}

impl Gate {
    /// Returns the variance with which a measurement counts, or the reason why it does not count.
    ///
    /// An innovation beyond the limit and below the floor counts with the noise that would just let
    /// it pass: such an effect persists, and each measurement of it moves the estimate a little.
    ///
    /// # Parameters
    /// `distance`: squared distance of the innovation. `square`: its squared magnitude. `variance`:
    /// variance of the measurement.
    pub fn judge(
        &self,
        distance: Option<f32>,
        square: f32,
        variance: f32,
    ) -> Result<f32, EkfOutcome> {
        let distance = distance.ok_or(EkfOutcome::Refused(EkfRefusal::NotFinite))?;
        if distance <= self.limit {
            Ok(variance)
        } else if square <= self.floor * self.floor {
            Ok(variance + square / self.limit)
        } else {
            Err(EkfOutcome::Rejected { distance_ratio: distance / self.limit })
        }
    }
}

/// The innovations of one kind of measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Deviation {
    last: Vec3,
    /// Number of innovations in a row that agreed with the one before.
    agreeing: u8,
}

/// Number of innovations that have to agree with the one before: noise that is three times larger than
/// assumed makes two agree in half of all cases.
const AGREEING: u8 = 3;

impl Deviation {
    /// Returns the last innovation.
    pub fn last(&self) -> Vec3 {
        self.last
    }

    /// Takes the next innovation. Returns true if the last ones differ from each other by no more than
    /// noise of this variance and a slow effect explain, which changes by at most `change` between
    /// two measurements.
    pub fn persists(&mut self, innovation: Vec3, variance: f32, change: f32) -> bool {
        let last = core::mem::replace(&mut self.last, innovation);
        // The difference of two measurements has twice the variance of one.
        let agrees = innovation.distance_squared(last) <= 2.0 * GATE_3 * variance + change * change;
        self.agreeing = if agrees { (self.agreeing + 1).min(AGREEING) } else { 0 };
        self.agreeing == AGREEING
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_effect_that_persists_passes_up_to_the_floor() {
        let judge = |floor: f32, x: f32| {
            let gate = Gate { limit: GATE_1, floor };
            gate.judge(Some(x * x / 0.01), x * x, 0.01)
        };
        assert_eq!(judge(0.0, 0.38), Ok(0.01));
        assert!(matches!(judge(0.3, 0.4), Err(EkfOutcome::Rejected { .. })));
        // The noise lets it just pass: 0.16 / (0.01 + 0.16 / 15.14) is below the limit.
        let variance = judge(0.5, 0.4).unwrap();
        assert!(variance > 0.02 && 0.16 / variance <= GATE_1);
    }

    #[test]
    fn noise_does_not_persist() {
        let mut deviation = Deviation::default();
        for number in 0..3 {
            assert!(!deviation.persists(Vec3::X * 0.05, 1e-6, 0.005), "{number}");
        }
        assert!(deviation.persists(Vec3::X * 0.053, 1e-6, 0.005));
        assert!(!deviation.persists(Vec3::X * -0.05, 1e-6, 0.005));
    }
}
