//! The time by which poses are older than the filter assumes.
//!
//! Poses by radio carry no time, and the way from the cameras to the robot takes 10 to 60 ms that
//! change. A constant speed does not show the age, but a turn does: the gyroscope shows the attitude
//! of each moment of the past, and the measured attitude is later than the one of the assumed age by rate
//! times delay. The regression of one on the other over the last seconds is the delay. It uses roll
//! and pitch only: they always turn back, so a marker frame that is off does not look like a delay.

use glam::{Vec2, Vec3, Vec3Swizzles};

/// Share of the sums that a further pose leaves: a memory of 1 s at 100 Hz.
const KEPT: f32 = 1.0 - 1.0 / 100.0;
/// Sum of squared rates in (rad/s)² at which half of the delay that poses show counts, so that a robot
/// that hardly turns keeps the assumed age.
const DOUBT_RAD2_S2: f32 = 0.5;

/// Delay in seconds below which noise is as large as a delay. As with an outer force, a longer one
/// counts the more, the longer it is.
const LEAST_DELAY_S: f32 = 0.004;

/// The regression of the delay.
///
/// The filter follows the measured attitudes, so it takes over a slow lag itself. The regression
/// therefore runs on the rate without the part that the filter has taken over by its gain.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct PoseAge {
    /// Part of the rate that the filter has taken over, per second of delay.
    taken_rad_s: Vec2,
    /// Sum of rate · (angle from the measured attitude to that of the assumed age).
    lag_rad2_s: f32,
    /// Sum of squared rates.
    rate_rad2_s2: f32,
}

impl PoseAge {
    /// Returns the age in seconds at which a pose of this assumed age is most likely, 0 to `most_s`.
    pub fn estimate_s(&self, assumed_s: f32, most_s: f32) -> f32 {
        if assumed_s > most_s {
            return assumed_s;
        }
        let delay_s = self.lag_rad2_s / (self.rate_rad2_s2 + DOUBT_RAD2_S2);
        let square = delay_s * delay_s;
        let least = LEAST_DELAY_S * LEAST_DELAY_S;
        let counted_s = if square > least { delay_s * (1.0 - least / square) } else { 0.0 };
        (assumed_s + counted_s).clamp(0.0, most_s)
    }

    /// Takes a pose.
    ///
    /// # Parameters
    /// `angle_rad`: turn in the body frame from the estimate at the age `assumed_s + delay_s` to the
    /// measured attitude. `rate_rad_s`: rate at that time. `gain`: share of the angle by which the
    /// filter turns.
    pub fn note(&mut self, angle_rad: Vec3, rate_rad_s: Vec3, delay_s: f32, gain: f32) {
        let rate = rate_rad_s.xy() - self.taken_rad_s;
        self.taken_rad_s += rate * gain;
        let square = rate.length_squared();
        let lag = square * delay_s - angle_rad.xy().dot(rate);
        self.lag_rad2_s = self.lag_rad2_s * KEPT + lag;
        self.rate_rad2_s2 = self.rate_rad2_s2 * KEPT + square;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot rocks by 0.1 rad each second, its markers are off by 0.05 rad, and its poses are 50 ms
    /// older than assumed. The filter follows each pose by a share.
    #[test]
    fn finds_the_delay_of_a_robot_that_rocks() {
        let mut age = PoseAge::default();
        let tilt = |s: f32| 0.1 * libm::sinf(s * core::f32::consts::TAU);
        let (gain, mut taken_rad) = (0.06, 0.0);
        for number in 0..600 {
            let now_s = number as f32 * 0.01;
            let assumed_s = age.estimate_s(0.01, 0.1);
            let angle_rad = tilt(now_s - 0.06) + 0.05 - tilt(now_s - assumed_s) - taken_rad;
            let rate_rad_s = (tilt(now_s - assumed_s + 0.001) - tilt(now_s - assumed_s)) * 1e3;
            age.note(Vec3::X * angle_rad, Vec3::X * rate_rad_s, assumed_s - 0.01, gain);
            taken_rad += gain * angle_rad;
        }
        let found_s = age.estimate_s(0.01, 0.1);
        assert!((0.055..0.062).contains(&found_s), "{found_s}");
        assert_eq!(age.estimate_s(0.2, 0.1), 0.2, "too old stays too old");
    }

    /// Without a turn there is no delay, whatever the frame of the markers is.
    #[test]
    fn a_hover_shows_no_delay() {
        let mut age = PoseAge::default();
        for _ in 0..600 {
            age.note(Vec3::new(0.05, -0.05, 0.1), Vec3::new(0.0, 0.0, 1.0), 0.0, 0.0);
        }
        assert_eq!(age.estimate_s(0.01, 0.1), 0.01);
    }
}
