//! Numbers in which one robot differs from others of its kind.

use std::fmt::{Display, Formatter};

use crate::{Layout, Robot};

/// A number in which one robot differs from others of its kind. `bbz flash --set` writes it to
/// flash, where it survives new scripts and firmware.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// Its name, such as `range_mm`.
    pub name: String,
    /// The smallest value.
    pub least: u16,
    /// The largest value.
    pub most: u16,
    /// One line of help: the meaning, the unit, and the value that is used without the setting.
    pub help: String,
}

/// An assignment such as `range_mm=300` that a robot does not take.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SettingError {
    /// The assignment.
    pub assignment: String,
    /// The title of the robot.
    pub robot: String,
    /// The reason.
    pub cause: SettingCause,
    /// The settings of the robot, a line each; none if it has no flash for them.
    pub settings: Vec<String>,
}

/// A reason why a robot does not take an assignment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SettingCause {
    /// The robot has no settings.
    NoSettings,
    /// The assignment is no name and value.
    NoAssignment,
    /// No setting has this name.
    UnknownName,
    /// The value is no whole number in the setting's range.
    Beyond {
        /// The smallest value.
        least: u16,
        /// The largest value.
        most: u16,
    },
    /// An assignment before it sets the same setting.
    Repeated,
}

impl SettingError {
    /// Returns the remedy.
    pub fn help(&self) -> String {
        match self.settings.as_slice() {
            [] => "its robot file has no [[setting]]".to_owned(),
            settings => settings.join("\n      "),
        }
    }
}

impl Display for SettingError {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        write!(f, "the {} does not take the setting `{}`: ", self.robot, self.assignment)?;
        match self.cause {
            SettingCause::NoSettings => f.write_str("it has no settings"),
            SettingCause::NoAssignment => f.write_str("it is not of the form NAME=NUMBER"),
            SettingCause::UnknownName => f.write_str("no setting has this name"),
            SettingCause::Beyond { least, most } => {
                write!(f, "the value is no whole number from {least} to {most}")
            }
            SettingCause::Repeated => f.write_str("it is given twice"),
        }
    }
}

impl std::error::Error for SettingError {}

impl Robot {
    /// Returns the address of the settings region and its first bytes for assignments such as
    /// `range_mm=300`. Settings that are not assigned are erased. Returns `None` without assignments.
    ///
    /// # Errors
    /// The first assignment that names no setting, sets one for the second time, or has a value that is
    /// no number in its range.
    pub fn settings_content(
        &self,
        assignments: &[String],
    ) -> Result<Option<(u32, Vec<u8>)>, SettingError> {
        let values = self.setting_values(assignments)?;
        Ok(self.settings_part(&values))
    }

    /// Returns the values of all settings for assignments such as `range_mm=300`, in the order of the
    /// robot file. Returns no values without assignments.
    ///
    /// # Errors
    /// As of [`Robot::settings_content`].
    pub fn setting_values(&self, assignments: &[String]) -> Result<Vec<Option<u16>>, SettingError> {
        let Some(first) = assignments.first() else { return Ok(Vec::new()) };
        if self.layout.as_ref().is_none_or(|layout| layout.settings.is_none()) {
            return Err(self.refused(first, SettingCause::NoSettings));
        }
        let mut values = vec![None; self.settings.len()];
        for assignment in assignments {
            self.assign(assignment, &mut values)
                .map_err(|cause| self.refused(assignment, cause))?;
        }
        Ok(values)
    }

    /// Returns the names of the settings that have a value, and the values.
    pub fn named_settings(&self, values: &[Option<u16>]) -> Vec<(&str, u16)> {
        let all = self.settings.iter().zip(values);
        all.filter_map(|(setting, value)| Some((setting.name.as_str(), (*value)?))).collect()
    }

    /// Returns the address of the settings region and its first bytes for the values of
    /// [`Robot::setting_values`]. Returns `None` without values.
    pub fn settings_part(&self, values: &[Option<u16>]) -> Option<(u32, Vec<u8>)> {
        let region = self.layout.as_ref()?.settings.filter(|_| !values.is_empty())?;
        Some((region.address, Layout::settings_section(values)))
    }

    fn assign(&self, assignment: &str, values: &mut [Option<u16>]) -> Result<(), SettingCause> {
        let (name, value) = assignment.split_once('=').ok_or(SettingCause::NoAssignment)?;
        let mut slots = self.settings.iter().zip(values);
        let (&Setting { least, most, .. }, slot) =
            slots.find(|(setting, _)| setting.name == name).ok_or(SettingCause::UnknownName)?;
        let value = value.parse().ok().filter(|value| (least..=most).contains(value));
        let value = value.ok_or(SettingCause::Beyond { least, most })?;
        match slot.replace(value) {
            None => Ok(()),
            Some(_) => Err(SettingCause::Repeated),
        }
    }

    fn refused(&self, assignment: &str, cause: SettingCause) -> SettingError {
        let settings = self.settings.iter().map(|setting| {
            let Setting { name, least, most, help } = setting;
            format!("{name}={least} to {name}={most}: {help}")
        });
        SettingError {
            assignment: assignment.to_owned(),
            robot: self.title.clone(),
            cause,
            settings: settings.collect(),
        }
    }
}
