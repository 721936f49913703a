//! The controls of scripts, which the page shows over the world.

use bittybuzz_compiler::comments::controls::{self, ControlForm};
use serde::Serialize;

/// A control. In JSON, the key `kind` has the name of the variant.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Control {
    Slider(Slider),
    Switch(Switch),
    Button(Button),
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Slider {
    /// The name of the global.
    pub name: String,
    pub least: f64,
    pub most: f64,
    pub step: f64,
    /// True if the global gets floats.
    pub is_float: bool,
    /// The number that the script assigns to the global, if it is a literal.
    pub value: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Switch {
    /// The name of the global.
    pub name: String,
    /// The number that the script assigns to the global, if it is a literal.
    pub value: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct Button {
    /// The name of the global.
    pub name: String,
    /// The number that the script assigns to the global, if it is a literal.
    pub value: Option<f64>,
}

impl Control {
    /// Returns the name of the global.
    pub fn name(&self) -> &str {
        match self {
            Control::Slider(Slider { name, .. })
            | Control::Switch(Switch { name, .. })
            | Control::Button(Button { name, .. }) => name,
        }
    }
}

impl From<controls::Control> for Control {
    fn from(control: controls::Control) -> Self {
        let controls::Control { name, form, value } = control;
        match form {
            ControlForm::Slider { least, most, step, is_float } => {
                Control::Slider(Slider { name, least, most, step, is_float, value })
            }
            ControlForm::Switch => Control::Switch(Switch { name, value }),
            ControlForm::Button => Control::Button(Button { name, value }),
        }
    }
}
