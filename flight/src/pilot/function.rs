//! The flight functions of a robot file, and their arguments in SI units.

use glam::Vec3;

use super::PilotSettings;

/// Duration of a step in seconds, the unit of the durations of `takeoff` and `land`.
const STEP_S: f32 = 0.1;
/// Least pace of `takeoff` and `land` in m/s, so that every duration is finite.
const PACE_M_S_MIN: f32 = 0.001;

/// A function by which a script flies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PilotFunction {
    /// `takeoff`
    TakeOff,
    /// `land`
    Land,
    /// `hover`
    Hover,
    /// `spin`
    Spin,
    /// `goTo`, which waits.
    GoTo,
    /// `goto`, which does not wait.
    Approach,
    /// `move_toward`
    MoveToward,
    /// `forward`
    Forward,
    /// `left`
    Left,
    /// `right`
    Right,
}

/// A call of a flight function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FlightRequest {
    TakeOff {
        height_m: f32,
        /// Mean speed in m/s, if the call states it.
        pace_m_s: Option<f32>,
    },
    Land {
        pace_m_s: Option<f32>,
    },
    Hover {
        height_m: f32,
    },
    Spin {
        height_m: f32,
        rate_rad_s: f32,
    },
    /// z counts from the ground of the world, as in `pos`.
    GoTo {
        position_m: Vec3,
    },
    Approach {
        x_m: f32,
        y_m: f32,
        height_m: Option<f32>,
    },
    Cruise {
        forward_m_s: f32,
        left_m_s: f32,
        turn_rad_s: f32,
    },
}

impl PilotFunction {
    /// All functions, by their names in robot files.
    pub const ALL: [(&'static str, PilotFunction); 10] = [
        ("takeoff", PilotFunction::TakeOff),
        ("land", PilotFunction::Land),
        ("hover", PilotFunction::Hover),
        ("spin", PilotFunction::Spin),
        ("goTo", PilotFunction::GoTo),
        ("goto", PilotFunction::Approach),
        ("move_toward", PilotFunction::MoveToward),
        ("forward", PilotFunction::Forward),
        ("left", PilotFunction::Left),
        ("right", PilotFunction::Right),
    ];

    /// Returns the function with this name in robot files.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().find(|(known, _)| *known == name).map(|(_, function)| *function)
    }

    /// Returns the name of the function in robot files.
    #[must_use]
    pub fn name(self) -> &'static str {
        let known = Self::ALL.iter().find(|(_, function)| *function == self);
        known.map_or("", |(name, _)| name)
    }

    /// Returns true if the function returns 1 or 0 to the script, not nil.
    #[must_use]
    pub fn has_value(self) -> bool {
        matches!(self, PilotFunction::TakeOff | PilotFunction::GoTo | PilotFunction::Approach)
    }

    /// Returns the request of a call with these arguments, in mm, mm/s, degrees per second and
    /// steps. A missing argument counts as 0.
    pub(super) fn request(self, numbers: &[f32], settings: &PilotSettings) -> FlightRequest {
        let number = |index: usize| numbers.get(index).copied().unwrap_or(0.0);
        let meters = |index: usize| number(index) / 1000.0;
        let pace_m_s = match numbers {
            [_, steps, ..] if *steps > 0.0 => {
                Some((meters(0) / (steps * STEP_S)).max(PACE_M_S_MIN))
            }
            _ => None,
        };
        let turn =
            |turn_rad_s| FlightRequest::Cruise { forward_m_s: 0.0, left_m_s: 0.0, turn_rad_s };
        match self {
            PilotFunction::TakeOff => FlightRequest::TakeOff { height_m: meters(0), pace_m_s },
            PilotFunction::Land => FlightRequest::Land { pace_m_s },
            PilotFunction::Hover => FlightRequest::Hover { height_m: meters(0) },
            // The argument is clockwise seen from above.
            PilotFunction::Spin => {
                FlightRequest::Spin { height_m: meters(0), rate_rad_s: -number(1).to_radians() }
            }
            PilotFunction::GoTo => {
                FlightRequest::GoTo { position_m: Vec3::new(meters(0), meters(1), meters(2)) }
            }
            PilotFunction::Approach => FlightRequest::Approach {
                x_m: meters(0),
                y_m: meters(1),
                height_m: (numbers.len() > 2).then(|| meters(2)),
            },
            PilotFunction::MoveToward => FlightRequest::Cruise {
                forward_m_s: meters(0),
                left_m_s: meters(1),
                turn_rad_s: 0.0,
            },
            PilotFunction::Forward => FlightRequest::Cruise {
                forward_m_s: settings.cruise_m_s,
                left_m_s: 0.0,
                turn_rad_s: 0.0,
            },
            PilotFunction::Left => turn(settings.turn_rad_s),
            PilotFunction::Right => turn(-settings.turn_rad_s),
        }
    }
}
