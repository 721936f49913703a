//! The checks that a robot passes before a person may arm it.

use core::num::NonZeroU8;

use super::conditions::{BatteryLevel, Conditions, Inclination, SetpointFreshness};

/// A check before flight.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PreflightCheck {
    /// The IMU is calibrated.
    Calibration,
    /// The robot stands on its feet, tilted by at most 30 degrees.
    Upright,
    /// Nobody moves the robot.
    Still,
    /// The battery has enough charge to take off.
    Battery,
    /// The robot stands within its fence.
    Fence,
    /// The script runs.
    Script,
    /// The script or a pilot has sent a set-point within the last 2 s.
    Setpoint,
}

impl PreflightCheck {
    /// All checks.
    pub const ALL: [PreflightCheck; 7] = [
        PreflightCheck::Calibration,
        PreflightCheck::Upright,
        PreflightCheck::Still,
        PreflightCheck::Battery,
        PreflightCheck::Fence,
        PreflightCheck::Script,
        PreflightCheck::Setpoint,
    ];

    fn bit(self) -> u8 {
        1 << self as u8
    }

    fn passes_before_arming(self, now: &Conditions) -> bool {
        match self {
            PreflightCheck::Calibration => now.is_calibrated,
            PreflightCheck::Upright => now.inclination == Inclination::Upright,
            PreflightCheck::Still => now.is_still,
            PreflightCheck::Battery => now.battery == BatteryLevel::Good,
            PreflightCheck::Fence => !now.is_outside_fence,
            PreflightCheck::Script => !now.has_script_fault,
            PreflightCheck::Setpoint => now.setpoint != SetpointFreshness::Lost,
        }
    }

    /// Rotors shake an armed robot and lower its voltage. A robot that tips over while it is armed
    /// has tumbled.
    fn passes_while_armed(self, now: &Conditions) -> bool {
        match self {
            PreflightCheck::Upright | PreflightCheck::Still => true,
            PreflightCheck::Battery => now.battery != BatteryLevel::Empty,
            _ => self.passes_before_arming(now),
        }
    }
}

/// The checks that failed, at least one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct FailedChecks(NonZeroU8);

impl FailedChecks {
    /// Calibration alone, which every robot lacks at power-on.
    pub(super) const AT_POWER_ON: FailedChecks = FailedChecks(NonZeroU8::MIN);

    /// Returns the checks that keep a person from arming the robot.
    pub(super) fn before_arming(now: &Conditions) -> Option<Self> {
        Self::collect(|check| check.passes_before_arming(now))
    }

    /// Returns the checks that disarm a robot on the ground.
    pub(super) fn while_armed(now: &Conditions) -> Option<Self> {
        Self::collect(|check| check.passes_while_armed(now))
    }

    fn collect(passes: impl Fn(PreflightCheck) -> bool) -> Option<Self> {
        let failed = PreflightCheck::ALL.into_iter().filter(|check| !passes(*check));
        NonZeroU8::new(failed.fold(0, |bits, check| bits | check.bit())).map(FailedChecks)
    }

    /// Returns true if the check failed.
    pub fn contains(self, check: PreflightCheck) -> bool {
        self.0.get() & check.bit() != 0
    }

    /// Returns an iterator over the checks that failed.
    pub fn iter(self) -> impl Iterator<Item = PreflightCheck> {
        PreflightCheck::ALL.into_iter().filter(move |check| self.contains(*check))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec;
    use std::vec::Vec;

    #[test]
    fn each_condition_fails_its_check() {
        type Change = fn(&mut Conditions);
        let cases: [(PreflightCheck, Change); 8] = [
            (PreflightCheck::Calibration, |now| now.is_calibrated = false),
            (PreflightCheck::Upright, |now| now.inclination = Inclination::Tilted),
            (PreflightCheck::Still, |now| now.is_still = false),
            (PreflightCheck::Battery, |now| now.battery = BatteryLevel::Low),
            (PreflightCheck::Battery, |now| now.battery = BatteryLevel::Empty),
            (PreflightCheck::Fence, |now| now.is_outside_fence = true),
            (PreflightCheck::Script, |now| now.has_script_fault = true),
            (PreflightCheck::Setpoint, |now| now.setpoint = SetpointFreshness::Lost),
        ];
        for (check, change) in cases {
            let mut now = Conditions::AT_REST;
            change(&mut now);
            let failed: Vec<_> = FailedChecks::before_arming(&now).unwrap().iter().collect();
            assert_eq!(failed, vec![check]);
        }
        assert_eq!(FailedChecks::before_arming(&Conditions::AT_REST), None);
    }

    #[test]
    fn an_armed_robot_may_shake_and_its_voltage_may_sag() {
        let mut now = Conditions::AT_REST;
        now.is_still = false;
        now.battery = BatteryLevel::Low;
        now.inclination = Inclination::Tilted;
        assert_eq!(FailedChecks::while_armed(&now), None);
        now.battery = BatteryLevel::Empty;
        assert!(FailedChecks::while_armed(&now).unwrap().contains(PreflightCheck::Battery));
    }

    #[test]
    fn the_check_at_power_on_is_the_calibration() {
        let failed: Vec<_> = FailedChecks::AT_POWER_ON.iter().collect();
        assert_eq!(failed, vec![PreflightCheck::Calibration]);
    }
}
