//! The description of the world, with which a session, a recording or a trace begins.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::about::AboutDescription;
use crate::controls::Control;
use crate::request::Texts;

/// Lengths are in mm, times in seconds. The default describes a world of which nothing is known.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct BeginEvent {
    /// Present for a recording.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub recording: Option<RecordingDescription>,
    /// Present, and true, for robots outside the simulator.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub watched: Option<bool>,
    /// Width and height.
    pub size: [f64; 2],
    pub ticks_per_second: f64,
    /// The last tick.
    pub end: u64,
    /// `None` outside the simulator.
    pub seed: Option<u32>,
    pub groups: Vec<GroupDescription>,
    /// Later patches lie over earlier ones.
    pub ground: Vec<PatchDescription>,
    pub obstacles: Vec<ObstacleDescription>,
    /// The discs that robots push. The samples have their places.
    pub movables: Vec<MovableDescription>,
    pub lights: Vec<LightDescription>,
    pub pose_errors: Vec<PoseErrorDescription>,
    pub media: Vec<MediumDescription>,
    /// The times of the scenario's events.
    pub events: Vec<f64>,
    pub commands: Vec<CommandDescription>,
    pub quantities: QuantityNames,
    pub expectations: Vec<ExpectationDescription>,
    pub measures: Vec<MeasureDescription>,
    pub assignment: Option<AssignmentDescription>,
    /// Present if scripts can be edited.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub scripts: Option<ScriptsDescription>,
    /// Present if scripts can be edited.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub controls: Option<Vec<Control>>,
    /// Present if scripts can be edited.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub about: Option<AboutDescription>,
    /// Present in a session: true if the run pauses at a fault.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[cfg_attr(test, ts(optional))]
    pub stops_on_error: Option<bool>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct RecordingDescription {
    /// The name of its file, if it has one.
    pub name: Option<String>,
    /// The error that ends the recording early; `None` if it is complete.
    pub cut: Option<String>,
}

/// Robots with successive numbers and ids. A recording has no names.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct GroupDescription {
    pub name: Option<String>,
    /// The name of the robots' model.
    pub robot: Option<String>,
    /// The path of the script, relative to the folder of the scenario.
    pub script: Option<String>,
    /// The form of the robots in pictures.
    pub glyph: GlyphName,
    pub count: u32,
    pub first_id: u16,
    /// The radius of a body in mm.
    pub radius: f64,
    /// The link between the robots; `None` if it is not known.
    pub link: Option<LinkDescription>,
    /// The slots of a machine.
    pub slots: Option<u32>,
    /// The mean velocity of the wind that the robots feel, along x and y in mm/s.
    pub wind: Option<[f64; 2]>,
    /// The keys of the scenario by which the surroundings of the robots differ from usual ones.
    pub surroundings: Vec<SurroundingsDescription>,
    /// The box that the robots do not leave in flight.
    pub fence: Option<FenceDescription>,
}

/// A box that robots do not leave, in mm. It has no wall where a coordinate is missing.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct FenceDescription {
    /// The least x and y.
    pub least: [Option<f64>; 2],
    /// The greatest x and y.
    pub most: [Option<f64>; 2],
    /// The greatest height.
    pub height: Option<f64>,
}

/// The form in which pictures show the body of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(rename_all = "snake_case")]
pub enum GlyphName {
    /// A disc of which only the size is known, with a notch ahead.
    Disc,
    /// A disc on three legs.
    Legs,
    /// A disc between two wheels.
    Wheels,
    /// A frame with four rotors. Such robots fly.
    Rotors,
}

/// The link between the robots of a group.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct LinkDescription {
    /// The name of the medium.
    pub medium: &'static str,
    /// The range in mm; `None` is unlimited.
    pub range: Option<f64>,
    /// True if the range is measured between the rims of two robots, not between their middles.
    pub is_between_rims: bool,
}

/// A number in the scenario that describes the surroundings of robots.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct SurroundingsDescription {
    /// The name of the key.
    pub key: &'static str,
    pub value: f64,
    /// The unit, if the number has one.
    pub unit: &'static str,
}

/// The errors of the poses that a robot gets from a source outside of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct PoseErrorDescription {
    /// The number of the robot.
    pub robot: usize,
    /// The displacement along x and y in mm.
    pub displaced: [f64; 2],
    /// The number of the robot whose poses it gets in place of its own.
    pub seen_as: Option<usize>,
}

/// A painted part of the ground with the keys of a scenario.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(untagged)]
pub enum PatchDescription {
    Disc { at: [f64; 2], radius: f64, brightness: f64 },
    Block { at: [f64; 2], size: [f64; 2], heading: f64, brightness: f64 },
}

/// An obstacle with the keys of a scenario. Robots pass over it at its height and above.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(untagged)]
pub enum ObstacleDescription {
    Disc { at: [f64; 2], radius: f64, height: Option<f64> },
    Block { at: [f64; 2], size: [f64; 2], heading: f64, height: Option<f64> },
    Wall { from: [f64; 2], to: [f64; 2], height: Option<f64> },
}

/// A disc that robots push. Robots pass over it at its height and above.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MovableDescription {
    pub radius: f64,
    pub height: Option<f64>,
}

/// A lamp that is lit.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct LightDescription {
    /// The position in mm.
    pub at: [f64; 2],
    pub brightness: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MediumDescription {
    pub name: String,
    /// The share of frames that the scenario lets the medium lose, for robots that touch and at the
    /// end of the range; `None` stands for the physical model's.
    pub loss: Option<[f64; 2]>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct CommandDescription {
    /// The tick before which the command acts.
    pub tick: u64,
    pub text: String,
}

/// The quantities that a client can choose from, by source.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct QuantityNames {
    /// Those of `plot` in the scenario.
    pub plot: Vec<String>,
    /// Those of each robot.
    pub robot: Vec<String>,
    /// Those of the swarm.
    pub swarm: Vec<String>,
    /// Globals of the scripts.
    pub global: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ExpectationDescription {
    pub name: Option<String>,
    /// The expectation in words.
    pub text: String,
    /// The line of the scenario.
    pub line: usize,
    /// The values that it wants; `None` if they are not a range of numbers.
    pub band: Option<BandDescription>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct MeasureDescription {
    pub name: String,
    /// The measure in words.
    pub text: String,
    /// True if it is the time in seconds at which a condition is true first.
    pub is_time: bool,
}

/// A range of a quantity for some time, in which an expectation wants the robots' values.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct BandDescription {
    /// The quantity, written as in `plot`.
    pub quantity: String,
    /// The first and the last time.
    pub from: f64,
    pub to: f64,
    /// The smallest and the greatest value; `None` if there is no limit.
    pub low: Option<f64>,
    pub high: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct AssignmentDescription {
    #[serde(flatten)]
    pub task: TaskDescription,
    /// The task in other languages, by their codes, such as `fr`.
    pub translations: BTreeMap<&'static str, TaskDescription>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct TaskDescription {
    pub title: String,
    /// The task in words.
    pub text: String,
}

/// The texts that the client may edit.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct ScriptsDescription {
    /// The names of the scripts.
    pub names: Vec<String>,
    /// The name of the scenario.
    pub scenario: String,
    /// The path of the scenario.
    pub file: String,
    /// The names of the scripts that the client may write to their files.
    pub writable: Vec<String>,
    /// The texts with which the run began. A script that could not be read then is missing.
    pub begun: Texts,
    /// Texts that were typed earlier and not saved.
    pub unsaved: Vec<UnsavedText>,
}

/// A text that was typed earlier and not saved.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
pub struct UnsavedText {
    pub id: String,
    /// The script, or the scenario.
    pub name: String,
    /// The path of the file.
    pub file: String,
    /// The time at which it was typed, in seconds since 1970.
    pub seconds: u64,
    /// True if the file has another text now than when it was changed.
    pub changed: bool,
    pub text: String,
}
