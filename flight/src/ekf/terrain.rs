//! The height of the floor below the robot.
//!
//! A range that differs from the estimate at once, while the accelerometer shows no motion, comes
//! from a step of the floor: a mat, a table, stairs. Three ranges in a row that agree on the step make
//! it a fact. The height of the robot in the world stays; the floor moves.

/// Largest difference in m between two ranges that agree on a step: four deviations of the
/// difference of two ranges.
const AGREEMENT_M: f32 = 0.015;
/// Number of ranges that have to agree: 100 ms at 30 Hz.
const AGREEING: u8 = 3;

/// The height of the floor, and the step that ranges show.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Terrain {
    height_m: f32,
    /// Mean of the step upwards that the last ranges show, and their number.
    step_m: f32,
    count: u8,
}

impl Terrain {
    /// Returns the height of the floor in the world, in m.
    pub fn height_m(&self) -> f32 {
        self.height_m
    }

    /// Takes a range that agrees with the estimate.
    pub fn agree(&mut self) {
        self.count = 0;
    }

    /// Takes a range that shows the floor higher by `step_m`. Returns true if it became a fact.
    pub fn dispute(&mut self, step_m: f32) -> bool {
        if self.count == 0 || (step_m - self.step_m).abs() > AGREEMENT_M {
            self.step_m = step_m;
            self.count = 1;
            return false;
        }
        self.count += 1;
        self.step_m += (step_m - self.step_m) / f32::from(self.count);
        if self.count < AGREEING {
            return false;
        }
        self.height_m += self.step_m;
        self.count = 0;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_ranges_that_agree_move_the_floor() {
        let mut terrain = Terrain::default();
        assert!(!terrain.dispute(0.10) && !terrain.dispute(0.11) && terrain.dispute(0.093));
        assert!((terrain.height_m() - 0.101).abs() < 1e-6);
        // Noise does not agree with itself, and a range between that fits the floor ends the dispute.
        assert!([0.3, -0.2, 0.1, -0.3, 0.2, 0.3].into_iter().all(|step| !terrain.dispute(step)));
        terrain.agree();
        assert!(!terrain.dispute(0.3) && !terrain.dispute(0.3));
        assert!((terrain.height_m() - 0.101).abs() < 1e-6);
    }
}
