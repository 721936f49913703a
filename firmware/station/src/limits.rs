//! Parameters that change the flight: limits of speeds, the fence, and voltages of the battery.

use bittybuzz_crtp::Parameter;
use bittybuzz_flight::Vec3;
use bittybuzz_flight::pilot::PilotSettings;
use bittybuzz_flight::planner::{FlightLimits, PositionFence};
use bittybuzz_flight::stack::FlightStack;

use super::{Outcome, Station, outcome};

/// A limit of the flight that the robot's owner sets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OwnerLimit {
    /// The greatest horizontal speed in m/s.
    Speed,
    /// The greatest vertical speed in m/s, upwards and downwards.
    Climb,
    /// The greatest height in m.
    Height,
    /// The greatest distance in m from the origin in the direction of +x.
    Front,
    /// The greatest distance in m from the origin in the direction of -x.
    Back,
    /// The greatest distance in m from the origin in the direction of +y.
    Left,
    /// The greatest distance in m from the origin in the direction of -y.
    Right,
}

impl Station {
    /// Takes a limit of the robot's owner, before the first packet arrives. The robot has it after
    /// power-on, and no station loosens it. A number beyond the range of the limit's parameter counts as
    /// the nearest in it (`comms/crtp`).
    pub fn limit(&mut self, limit: OwnerLimit, number: f32) {
        let bounds: &[(Parameter, f32)] = match limit {
            OwnerLimit::Speed => {
                &[(Parameter::PosCtlXVelMax, number), (Parameter::PosCtlYVelMax, number)]
            }
            OwnerLimit::Climb => &[(Parameter::PosCtlZVelMax, number)],
            OwnerLimit::Height => &[(Parameter::FenceMostZ, number)],
            OwnerLimit::Front => &[(Parameter::FenceMostX, number)],
            OwnerLimit::Back => &[(Parameter::FenceLeastX, -number)],
            OwnerLimit::Left => &[(Parameter::FenceMostY, number)],
            OwnerLimit::Right => &[(Parameter::FenceLeastY, -number)],
        };
        for (parameter, bound) in bounds {
            self.parameters_mut().bound(*parameter, *bound);
        }
    }

    /// Returns the limits and the fence in the parameters, with which the flight controller starts.
    /// Returns `None` for a fence without room inside.
    pub fn limits(&self) -> Option<(FlightLimits, PositionFence)> {
        let number = |parameter| self.parameters().get(parameter).as_f32();
        // The planner has one horizontal speed.
        let speed_m_s = number(Parameter::PosCtlXVelMax).min(number(Parameter::PosCtlYVelMax));
        let climb_m_s = number(Parameter::PosCtlZVelMax);
        let limits = FlightLimits { speed_m_s, climb_m_s, ..PilotSettings::CRAZYFLIE.limits };
        let least_m = Vec3::new(
            number(Parameter::FenceLeastX),
            number(Parameter::FenceLeastY),
            number(Parameter::FenceLeastZ),
        );
        let most_m = Vec3::new(
            number(Parameter::FenceMostX),
            number(Parameter::FenceMostY),
            number(Parameter::FenceMostZ),
        );
        Some((limits, PositionFence::new(least_m, most_m)?))
    }

    /// Applies the limits in the parameters. A fence without room inside is refused, and the limits of
    /// speeds with it.
    ///
    /// Bitcraze's firmware shows a low battery by `pm.lowVoltage`, and switches itself off by
    /// `pm.criticalLowVoltage` only if it is built for that (pm_stm32f4.c). The ranges of both end at
    /// the robot's own limits, so a station only tightens them.
    pub(super) fn restrict(&self, stack: &mut FlightStack) -> Outcome {
        let number = |parameter| self.parameters().get(parameter).as_f32();
        let mv = |parameter| (number(parameter) * 1000.0 + 0.5) as u16;
        stack.set_battery_limits(mv(Parameter::PmLowVoltage), mv(Parameter::PmCriticalLowVoltage));
        match self.limits() {
            Some((limits, fence)) => outcome(stack.restrict(limits, fence)),
            None => Outcome::Refused,
        }
    }
}
