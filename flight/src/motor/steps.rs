//! Rounding of duties to the steps of a timer.

use crate::MotorDuties;

/// Rounds duties to steps, and adds the part that a step leaves out to the next one. A step of 256 is
/// 0.6 % of the thrust in hover; rotors average over many of them, so the mean thrust is exact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DutySteps {
    /// The part of a step that was left out, for each motor.
    rest: [f32; 4],
}

impl DutySteps {
    /// Returns the steps for these duties of a timer with 256, of which the last is not used. A duty
    /// that is not finite counts as 0.
    pub fn of_256(&mut self, duties: &MotorDuties) -> [u8; 4] {
        let mut steps = [0; 4];
        for ((step, rest), duty) in steps.iter_mut().zip(&mut self.rest).zip(duties.0) {
            // A motor that is off stays off.
            if !(duty.is_finite() && duty > 0.0) {
                *rest = 0.0;
                continue;
            }
            let exact = duty.min(1.0) * 256.0 + *rest;
            // The conversion saturates at both ends.
            *step = (exact + 0.5) as u8;
            *rest = (exact - f32::from(*step)).clamp(-0.5, 0.5);
        }
        steps
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_mean_is_exact() {
        let duties = MotorDuties([0.5, 0.501, 0.7003, 0.002]);
        let mut steps = DutySteps::default();
        let mut sums = [0_u32; 4];
        for _ in 0..1000 {
            for ((sum, step), duty) in sums.iter_mut().zip(steps.of_256(&duties)).zip(duties.0) {
                assert!((f32::from(step) - 256.0 * duty).abs() <= 1.0);
                *sum += u32::from(step);
            }
        }
        for (sum, duty) in sums.into_iter().zip(duties.0) {
            let error = sum as f32 - 256_000.0 * duty;
            assert!(error.abs() <= 1.0, "{error} of 1,000 steps");
        }
    }

    #[test]
    fn ends_and_bad_numbers() {
        let mut steps = DutySteps::default();
        for _ in 0..3 {
            assert_eq!(steps.of_256(&MotorDuties([1.0, 2.0, f32::NAN, -1.0])), [255, 255, 0, 0]);
        }
        // A motor that was off begins without a rest.
        assert_eq!(steps.of_256(&MotorDuties([0.25; 4]))[3], 64);
        for _ in 0..10 {
            assert_eq!(steps.of_256(&MotorDuties::default()), [0; 4]);
        }
    }
}
