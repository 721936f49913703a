//! Parameters that change the flight: limits of speeds, and the fence.

use bittybuzz_crtp::Parameter;
use bittybuzz_flight::Vec3;
use bittybuzz_flight::pilot::PilotSettings;
use bittybuzz_flight::planner::{FlightLimits, PositionFence};
use bittybuzz_flight::stack::FlightStack;

use super::{Outcome, Station, outcome};

impl Station {
    /// Applies the limits in the parameters. A fence without room inside is refused as a whole.
    pub(super) fn restrict(&self, stack: &mut FlightStack) -> Outcome {
        let number = |parameter| self.parameters().get(parameter).as_f32();
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
