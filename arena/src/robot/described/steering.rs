//! The rule by which two wheels follow a vector.
//!
//! It is `SetWheelSpeedsFromVector` of the Buzz controllers for the foot-bot and the Khepera IV
//! (buzz-lang/Buzz 49ea418, `src/buzz/argos/buzz_controller_footbot.cpp`).

use bittybuzz_robot_spec::Steering;

/// The way in which a robot turns towards a vector.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Turning {
    /// It goes straight.
    #[default]
    Straight,
    /// It goes in a curve.
    Soft,
    /// It turns on the spot.
    Hard,
}

impl Turning {
    /// Returns the way in which the robot turns for a vector that is `off_rad` off its heading. A
    /// turn on the spot goes on to a smaller angle than that at which it begins, so that the robot
    /// does not change between both with every step.
    fn next(self, rule: &Steering, off_rad: f64) -> Turning {
        let exceeds = |limit_deg: f64| off_rad > limit_deg.to_radians();
        let hard_turn_deg = match self {
            Turning::Hard => rule.soft_turn_deg,
            Turning::Straight | Turning::Soft => rule.hard_turn_deg,
        };
        if exceeds(hard_turn_deg) {
            Turning::Hard
        } else if exceeds(rule.no_turn_deg) {
            Turning::Soft
        } else {
            Turning::Straight
        }
    }
}

/// Returns the speeds of the left and of the right wheel, in mm/s, for a vector in the frame of the
/// robot: ahead and to the left, in mm/s. `turning` is the way in which the last vector turned the
/// robot, and becomes that of this one.
pub fn wheel_speeds(rule: &Steering, turning: &mut Turning, [ahead, left]: [f64; 2]) -> [f64; 2] {
    let direction_rad = libm::atan2(left, ahead);
    let off_rad = direction_rad.abs();
    let speed = libm::hypot(ahead, left).min(rule.speed_mm_s);
    *turning = turning.next(rule, off_rad);
    let [inner, outer] = match turning {
        Turning::Straight => [speed, speed],
        Turning::Soft => {
            let difference = speed * (off_rad / rule.hard_turn_deg.to_radians());
            [speed - difference, speed + difference]
        }
        Turning::Hard => [-rule.speed_mm_s, rule.speed_mm_s],
    };
    if direction_rad > 0.0 { [inner, outer] } else { [outer, inner] }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The defaults of `<wheel_turning>`, with the speed in mm/s.
    const ARGOS: Steering =
        Steering { hard_turn_deg: 90.0, soft_turn_deg: 70.0, no_turn_deg: 10.0, speed_mm_s: 100.0 };

    /// Vectors by length in mm/s and direction in degrees, each after the one before, and the wheel
    /// speeds that the source of the controller gives: `base` is the length, at most 100; a soft
    /// turn has `base - base * (1 - factor)` and `base + base * (1 - factor)` with the factor
    /// `(90 - |angle|) / 90`; a hard turn has -100 and 100; the slower wheel is on the side of the
    /// vector.
    const HISTORY: [([f64; 2], [f64; 2]); 19] = [
        // Straight up to 10 degrees, and the length is the speed up to the maximum.
        ([50.0, 0.0], [50.0, 50.0]),
        ([250.0, 0.0], [100.0, 100.0]),
        ([80.0, 9.0], [80.0, 80.0]),
        ([80.0, -9.0], [80.0, 80.0]),
        // factor = (90 - 45) / 90 = 0.5: 80 - 40 and 80 + 40.
        ([80.0, 45.0], [40.0, 120.0]),
        ([80.0, -45.0], [120.0, 40.0]),
        // factor = (90 - 81) / 90 = 0.1: a soft turn goes on above the 70 degrees.
        ([100.0, 81.0], [10.0, 190.0]),
        // Above 90 degrees both wheels have the maximum, for short vectors, too.
        ([5.0, 91.0], [-100.0, 100.0]),
        ([5.0, -120.0], [100.0, -100.0]),
        ([50.0, 180.0], [-100.0, 100.0]),
        // The hard turn goes on down to 70 degrees.
        ([50.0, 81.0], [-100.0, 100.0]),
        ([50.0, -71.0], [100.0, -100.0]),
        // factor = (90 - 69) / 90 = 21 / 90: 90 - 69 and 90 + 69.
        ([90.0, 69.0], [21.0, 159.0]),
        // Now it is soft up to 90 degrees again.
        ([90.0, 81.0], [9.0, 171.0]),
        ([90.0, -100.0], [100.0, -100.0]),
        // From a hard turn straight on, as soon as the vector is ahead.
        ([60.0, 5.0], [60.0, 60.0]),
        ([60.0, -100.0], [100.0, -100.0]),
        // The vector of length 0 has the angle 0, so that it stops each turn.
        ([0.0, 0.0], [0.0, 0.0]),
        // A vector of negative length points the other way: 150 degrees to the right.
        ([-60.0, 30.0], [100.0, -100.0]),
    ];

    #[test]
    fn wheels_follow_vectors_as_in_argos() {
        let mut turning = Turning::default();
        for ([length, direction_deg], expected) in HISTORY {
            let (sin, cos) = direction_deg.to_radians().sin_cos();
            let found = wheel_speeds(&ARGOS, &mut turning, [length * cos, length * sin]);
            let is_close = |index: usize| (found[index] - expected[index]).abs() < 1e-9;
            assert!(is_close(0) && is_close(1), "{length} at {direction_deg}: {found:?}");
        }
    }

    /// A vector straight to the left is exactly 90 degrees off: not more, so the turn is soft, with
    /// the factor 0.
    #[test]
    fn a_vector_to_the_side_is_a_soft_turn() {
        let mut turning = Turning::default();
        assert_eq!(wheel_speeds(&ARGOS, &mut turning, [0.0, 60.0]), [0.0, 120.0]);
        assert_eq!(wheel_speeds(&ARGOS, &mut turning, [0.0, -60.0]), [120.0, 0.0]);
    }
}
