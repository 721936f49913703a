//! Reasons why a pilot refuses a call.

use core::fmt;

use super::PermissionEnd;
use crate::planner::PlanError;
use crate::stack::FlightRefusal;

/// A reason why a pilot refused a call of the script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PilotRefusal {
    /// No person has armed the robot since power-on.
    NotArmed,
    /// The permission of a person ended.
    Ended(PermissionEnd),
    /// The battery is too low to take off.
    BatteryLow {
        /// Its voltage in mV.
        battery_mv: u16,
        /// Voltage in mV that a take-off needs.
        needed_mv: u16,
    },
    /// The checks before arming did not pass in time.
    NotReady,
    /// The robot does not fly, or lands.
    NotFlying,
    /// The robot does not know its position.
    NoPosition,
    /// The planner refused the place or the duration.
    Plan(PlanError),
}

impl From<FlightRefusal> for PilotRefusal {
    fn from(refusal: FlightRefusal) -> Self {
        match refusal {
            FlightRefusal::NotReady | FlightRefusal::NotArmed => PilotRefusal::NotReady,
            FlightRefusal::NotFlying => PilotRefusal::NotFlying,
            FlightRefusal::NoPosition => PilotRefusal::NoPosition,
            FlightRefusal::NotFinite => PilotRefusal::Plan(PlanError::NotFinite),
            FlightRefusal::Plan(error) => PilotRefusal::Plan(error),
        }
    }
}

impl fmt::Display for PilotRefusal {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let text = match self {
            PilotRefusal::NotArmed => "no person armed the robot",
            PilotRefusal::Ended(PermissionEnd::ScriptFault) => {
                "an error stopped the script, so a person has to arm the robot again"
            }
            PilotRefusal::Ended(PermissionEnd::Fault) => {
                "a fault ended the last flight, so a person has to arm the robot again"
            }
            PilotRefusal::Ended(PermissionEnd::Crash) => {
                "the robot fell, so a person has to arm it again"
            }
            PilotRefusal::Ended(PermissionEnd::Battery) => {
                "the battery was low, so a person has to arm the robot again"
            }
            PilotRefusal::Ended(PermissionEnd::Time) => {
                "a person armed the robot more than 30 minutes ago"
            }
            PilotRefusal::Ended(PermissionEnd::Person) => "a person disarmed the robot",
            PilotRefusal::BatteryLow { battery_mv, needed_mv } => {
                return write!(
                    out,
                    "the battery has {battery_mv} mV, and a take-off needs {needed_mv} mV"
                );
            }
            PilotRefusal::NotReady => {
                "the robot did not pass its checks: it has to stand upright and still"
            }
            PilotRefusal::NotFlying => "the robot does not fly",
            PilotRefusal::NoPosition => "the robot does not know its position",
            PilotRefusal::Plan(PlanError::NotFinite) => "an argument is not a finite number",
            PilotRefusal::Plan(PlanError::TooFar) => "the place is more than 30 minutes away",
            PilotRefusal::Plan(PlanError::Duration) => "the flight would take more than 30 minutes",
            PilotRefusal::Plan(_) => "there is no path to the place",
        };
        out.write_str(text)
    }
}
