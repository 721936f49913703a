//! Timers that measure for how long a condition has held, and the conditions that are watched.

use super::conditions::{Acceleration, Conditions, Inclination, RotorStatus};

/// The time for which a condition has held, up to `HOLD_MS_MAX` milliseconds.
///
/// Two samples that show the condition, at least the limit apart, end the timer if all samples
/// between show it too. One sample alone never does, however late it comes. The time saturates at
/// the limit, so it cannot wrap, and a supervisor has a finite number of states.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct HoldTimer<const HOLD_MS_MAX: u16>(Option<u16>);

impl<const HOLD_MS_MAX: u16> HoldTimer<HOLD_MS_MAX> {
    /// Returns a timer of a condition that holds since now.
    pub const fn started() -> Self {
        HoldTimer(Some(0))
    }

    /// Takes a sample, `elapsed_ms` after the last one. Returns true if the limit is reached.
    pub fn update(&mut self, holds: bool, elapsed_ms: u32) -> bool {
        let limit = u32::from(HOLD_MS_MAX);
        self.0 = match (holds, self.0) {
            (false, _) => None,
            (true, None) => Some(0),
            (true, Some(ms)) => {
                let ms = u32::from(ms).saturating_add(elapsed_ms).min(limit);
                Some(u16::try_from(ms).unwrap_or(HOLD_MS_MAX))
            }
        };
        self.0 == Some(HOLD_MS_MAX)
    }

    /// Returns the time in milliseconds, 0 while the condition does not hold.
    pub fn held_ms(self) -> u16 {
        self.0.unwrap_or(0)
    }
}

/// Timers of a robot that tips over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct TumbleMonitor {
    upside_down: HoldTimer<100>,
    weight_upwards: HoldTimer<100>,
    weight_sideways: HoldTimer<1000>,
}

/// A sign by which a robot is recognized as tumbled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TumbleSign {
    /// The attitude is upside down.
    UpsideDown,
    /// The accelerometer's z axis measures less than -0.2 g.
    WeightUpwards,
    /// The accelerometer's z axis measures less than 0.5 g.
    WeightSideways,
}

impl TumbleMonitor {
    /// Takes a sample and returns the first sign that has lasted.
    pub(super) fn update(&mut self, elapsed_ms: u32, now: &Conditions) -> Option<TumbleSign> {
        let is_upside_down = now.inclination == Inclination::UpsideDown;
        let is_upwards = now.acceleration == Acceleration::Upwards;
        let is_sideways = is_upwards || now.acceleration == Acceleration::Sideways;
        // All timers take each sample, so no evaluation here may be skipped.
        let upside_down = self.upside_down.update(is_upside_down, elapsed_ms);
        let upwards = self.weight_upwards.update(is_upwards, elapsed_ms);
        let sideways = self.weight_sideways.update(is_sideways, elapsed_ms);
        if upside_down {
            Some(TumbleSign::UpsideDown)
        } else if upwards {
            Some(TumbleSign::WeightUpwards)
        } else if sideways {
            Some(TumbleSign::WeightSideways)
        } else {
            None
        }
    }
}

/// Timers of a robot in the air.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct FlightMonitor {
    pub(super) tumble: TumbleMonitor,
    impact: HoldTimer<2>,
    blocked_rotor: HoldTimer<200>,
    no_effect: HoldTimer<500>,
    outside_fence: HoldTimer<100>,
    empty_battery: HoldTimer<1000>,
    ground_without_lift: HoldTimer<1000>,
    no_lift: HoldTimer<2000>,
}

/// The timers of a [`FlightMonitor`] that have reached their limit.
#[derive(Clone, Copy, Debug)]
pub(super) struct FlightFindings {
    pub tumble: Option<TumbleSign>,
    pub has_impact: bool,
    pub has_blocked_rotor: bool,
    pub has_no_effect: bool,
    pub is_outside_fence: bool,
    pub is_battery_empty: bool,
    pub is_on_ground_without_lift: bool,
    pub has_no_lift: bool,
}

impl FlightMonitor {
    /// Returns the timers of a robot that takes off.
    pub(super) fn after_ground(tumble: TumbleMonitor) -> Self {
        FlightMonitor { tumble, ..Self::default() }
    }

    pub(super) fn update(&mut self, elapsed_ms: u32, now: &Conditions) -> FlightFindings {
        let is_empty = now.battery == super::BatteryLevel::Empty;
        let is_blocked = now.rotors == RotorStatus::Blocked;
        let is_resting = now.is_at_ground && !now.has_lift;
        FlightFindings {
            tumble: self.tumble.update(elapsed_ms, now),
            has_impact: self.impact.update(now.has_impact, elapsed_ms),
            has_blocked_rotor: self.blocked_rotor.update(is_blocked, elapsed_ms),
            has_no_effect: self.no_effect.update(now.is_vain, elapsed_ms),
            is_outside_fence: self.outside_fence.update(now.is_outside_fence, elapsed_ms),
            is_battery_empty: self.empty_battery.update(is_empty, elapsed_ms),
            is_on_ground_without_lift: self.ground_without_lift.update(is_resting, elapsed_ms),
            has_no_lift: self.no_lift.update(!now.has_lift, elapsed_ms),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::vec::Vec;

    #[test]
    fn one_sample_never_ends_a_timer() {
        let mut timer = HoldTimer::<100>::default();
        assert!(!timer.update(true, u32::MAX));
        assert!(timer.update(true, u32::MAX));
        assert!(timer.update(true, u32::MAX));
        assert_eq!(timer.held_ms(), 100);
    }

    proptest! {
        /// An oracle keeps the times of all samples and looks back.
        #[test]
        fn a_timer_agrees_with_the_history(
            samples in prop::collection::vec((any::<bool>(), 0u32..400), 1..60),
        ) {
            let mut timer = HoldTimer::<500>::default();
            let mut history: Vec<(u64, bool)> = Vec::new();
            let mut now = 0;
            for (holds, elapsed_ms) in samples {
                now += u64::from(elapsed_ms);
                history.push((now, holds));
                let since = history.iter().rev().take_while(|(_, holds)| *holds).last();
                let expected = since.is_some_and(|(since, _)| now - since >= 500);
                prop_assert_eq!(timer.update(holds, elapsed_ms), expected);
            }
        }
    }
}
