//! The settings of a world and their valid ranges.

use super::error::SettingsError;
use super::geometry::Area;

/// The settings with which a world begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WorldSettings {
    /// The seed of all random numbers in the world.
    pub seed: u64,
    /// The number of threads; 0 is one per core. The trace does not depend on it.
    pub threads: usize,
    /// Size of the world.
    pub area: Area,
    /// Reading of light sensors far from all lamps, 0 to 1023.
    pub ambient_light: f32,
}

impl Default for WorldSettings {
    fn default() -> Self {
        let area = Area { width: 2000.0, height: 2000.0 };
        WorldSettings { seed: 0, threads: 1, area, ambient_light: 0.0 }
    }
}

impl WorldSettings {
    /// Fails if a setting is not valid.
    pub fn check(&self) -> Result<(), SettingsError> {
        let length = "a number from 1 to 1e6";
        first_wrong(&[
            ("area.width", within(self.area.width, 1.0, 1e6), length),
            ("area.height", within(self.area.height, 1.0, 1e6), length),
            ("ambient_light", within(self.ambient_light, 0.0, 1023.0), "0 to 1023"),
        ])
    }
}

/// Fails with the first field whose check does not hold. Each check is the path of the field, the
/// result of the check, and the condition.
pub fn first_wrong(checks: &[(&'static str, bool, &'static str)]) -> Result<(), SettingsError> {
    match checks.iter().find(|(_, holds, _)| !holds) {
        Some(&(field, _, must)) => Err(SettingsError { field, must }),
        None => Ok(()),
    }
}

/// Returns true for a number from `least` to `most`.
#[must_use]
pub fn within(number: f32, least: f32, most: f32) -> bool {
    number >= least && number <= most
}

/// Returns true for a finite number greater than 0.
#[must_use]
pub fn above_0(number: f32) -> bool {
    number > 0.0 && number.is_finite()
}

/// Returns true for a finite number that is not negative.
#[must_use]
pub fn not_below_0(number: f32) -> bool {
    number >= 0.0 && number.is_finite()
}
