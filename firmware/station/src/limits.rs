//! Parameters that change the flight: limits of speeds, the fence, and voltages of the battery.

use bittybuzz_crtp::Parameter;
use bittybuzz_flight::Vec3;
use bittybuzz_flight::pilot::PilotSettings;
use bittybuzz_flight::planner::{FlightLimits, PositionFence};
use bittybuzz_flight::stack::FlightStack;

use super::{Outcome, Station, outcome};

impl Station {
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
        let own = PilotSettings::CRAZYFLIE.limits;
        // The planner has one horizontal speed.
        let speed_m_s = number(Parameter::PosCtlXVelMax).min(number(Parameter::PosCtlYVelMax));
        let climb_m_s = number(Parameter::PosCtlZVelMax);
        let limits = FlightLimits { speed_m_s, climb_m_s, ..own };
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
        match PositionFence::new(least_m, most_m) {
            Some(fence) => outcome(stack.restrict(limits, fence)),
            None => Outcome::Refused,
        }
    }
}
