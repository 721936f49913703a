//! The robot file: its format, reader and checks, and the constants that build scripts generate from it.
//!
//! A robot file defines the chip of a robot, its number profile, the size of its virtual machine,
//! and the functions that its scripts may call. The compiler, the command line tool, the build
//! scripts and the documentation all take these facts from here; none of them is written a second
//! time.
//!
//! # Principles
//! * A fact about a robot is in its TOML file, never in code.
//! * A file is refused rather than guessed at: unknown keys, missing keys and absurd sizes are
//!   errors that name line and column and the correction.
//! * This crate names no robot. `bittybuzz-robot-files` lists the robots that ship, and a robot of
//!   `--robot my-robot.toml` has the same features.
//! * Functions are linked by name ([`name_hash`]), so a robot can gain functions without breaking old images.
//!
//! # To add a robot
//! Copy the file of the most similar robot. Scripts can be checked, run and simulated for it at
//! once with `--robot PATH.toml`. To ship the robot, add it to `spec/files`. Its firmware calls
//! [`generate_rust`] in its build script and has one Rust function for each `[[function]]` entry.
//! `docs/new-robot.md` is a guide through all of this.
//!
//! | Key | Meaning |
//! |---|---|
//! | `name` | lower-case word by which the command line knows it |
//! | `title` | its name for people |
//! | `chip` | the chip as probe-rs and datasheets name it; left out for a robot that is never flashed |
//! | `profile` | `"tiny"` (16-bit numbers) or `"full"` (32-bit numbers) |
//! | `tick_hz` | steps per second, 1 to 100; `bbz sim` takes 10, 5, 2 and 1 |
//! | `message_bytes` | bytes after the type of a swarm message that one frame of its link can carry: at least 9 in `tiny`, 48 in `full` |
//! | `link` | the medium of its frames: `"ir"`, `"nrf24"`, `"p2p"` or `"rab"`, see [`Medium`]; left out, `"rab"` for a robot without `chip`, and unknown for others |
//! | `on_fault` | `"restart"`, the default, or `"stop"`: see [`OnFault`] |
//! | `[vm]` | sizes of the virtual machine, see [`VmSizes`] |
//! | `[budget]` | the most that the firmware image may need, see [`Budget`]; left out with `chip` |
//! | `[layout]` | where firmware, script and data lie on the chip, see [`Layout`]; left out where no script can be flashed alone |
//! | `[[function]]` | a function that scripts may call, see [`RobotFunction`] |
//! | `[[table]]` | a table that the robot keeps up to date, such as `pos`, see [`SensorTable`] |
//! | `[[value]]` | a value in a table that the robot fills in every step, such as `pose.position.x`, see [`TableValue`] |
//! | `[[setting]]` | a number that people write to one robot's flash, see [`Setting`] |
//! | `[[indicator]]` | a signal of the firmware's by its lights, see [`Indicator`] |
//! | `[body]` | the body that the simulator moves, see [`BodySpec`]; left out for a robot with code of its own for it |
//! | `[[sensor]]` | a sensor of that body, see [`Sensor`] |
//!
//! A file without `chip` describes a robot that exists in the simulator only. It may leave out `title` (then it is
//! `name`), `profile` (`"full"`), `tick_hz` (10), `message_bytes` (the least of the profile) and `[vm]`, of which it may also leave out each key if it leaves out `memory`.
//!
//! # A robot for the simulator
//! A file with a `[body]` gives each function an effect:
//!
//! | Key of `[[function]]` | Meaning |
//! |---|---|
//! | `sets` | quantities of the actuators, and their values: `{ forward = "speed cm/s", turn = 0 }`; see [`ActuatorQuantity`] |
//! | `steers` | the vector along which the body drives: `{ forward = "x cm/s", leftward = "y cm/s" }` or `{ speed = "v", direction = "a rad" }`; see [`Steering`] |
//! | `reads` | the value that it returns: a sensor, or one of several values as in `"ring.0"`; see [`SensorValue`] |
//! | `logs` | true: the call is written to the log of the run |
//!
//! A value of `sets` or `steers` is a number, the name of a parameter, or either of them in a unit: `"speed m/s"`, `"-rate rad/s"`,
//! `"50 %"` or `"duty of 255"`, where 255 means the largest value that the body has.
//!
//! # Limits
//! The file describes no pins, clocks or drivers, which belong to the firmware. It describes how a
//! function is called, not how the firmware executes it. This is a host crate; nothing of it runs
//! on a robot.

mod body;
mod call;
mod effect;
mod error;
mod generate;
mod layout;
mod link;
mod memory;
mod read;
mod sensor;
mod setting;
mod signature;
mod trailing;
mod value;

use std::path::Path;

use bittybuzz_toml_reader::file;
use bittybuzz_vm_core::Parts;
pub use bittybuzz_vm_core::hash::name_hash;
pub use body::{BodySpec, DriveSpec, Steering};
pub use call::{accepted_lists, accepting, idle_result};
pub use effect::{ActuatorQuantity, Amount, EffectAssignment, FunctionEffect, SteeringVector};
pub use error::{RobotError, RobotErrors, RobotFileCause};
pub use generate::generate_rust;
pub use layout::{Layout, Region};
pub use link::Medium;
pub use read::is_robot_name;
pub use sensor::{DistanceUnit, Sensor, SensorKind, SensorReading, SensorValue};
pub use setting::{Setting, SettingCause, SettingError};
pub use signature::{PARAMETERS_MAX, Parameter, SignatureType, parameter_at, takes_count};
pub use trailing::{NoSection, SCRIPT_MARK, find_script_section, script_section};
pub use value::{
    TableValue, ValueConstant, ValueKey, ValuePath, ValueReading, ValueScale, ValueSource, table_of,
};

/// The content of a robot file.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// The name on the command line, such as `kilobot`.
    pub name: String,
    /// The name in texts for people, such as `Crazyflie 2.1`.
    pub title: String,
    /// The chip as probe-rs and datasheets name it; `None` for a robot that is never flashed.
    pub chip: Option<String>,
    /// The number profile for which its scripts are compiled by default.
    pub profile: NumberProfile,
    /// Steps per second.
    pub tick_hz: u32,
    /// Bytes of a swarm message that one frame of its link carries, link headers not counted.
    pub message_bytes: u32,
    /// The medium of its frames; `None` if it is unknown, so that nothing is known about their times.
    pub link: Option<Medium>,
    /// The consequence of a fault of its script; [`OnFault::Restart`] if left out.
    pub on_fault: OnFault,
    /// Sizes of its virtual machine.
    pub vm: VmSizes,
    /// The parts of its virtual machine: all, or those of a given firmware, see [`Robot::limited_to`].
    pub parts: Parts,
    /// The limits of its firmware; `None` for a robot that is never flashed.
    pub budget: Option<Budget>,
    /// The places of firmware, script and data on the chip; `None` if a script cannot be flashed
    /// without the firmware.
    pub layout: Option<Layout>,
    /// The functions that its scripts may call, in the order of the file, and those that read its
    /// values.
    pub functions: Vec<RobotFunction>,
    /// The values in tables that it fills in every step, in the order of the file.
    pub values: Vec<TableValue>,
    /// The tables that it keeps up to date for its scripts, in the order of the file.
    pub tables: Vec<SensorTable>,
    /// The settings that each robot has, in the order of the file.
    pub settings: Vec<Setting>,
    /// The signals that the firmware gives with its lights, in the order of the file.
    pub indicators: Vec<Indicator>,
    /// The body that the simulator moves; `None` if the simulator does not have this kind of robot,
    /// or has code for it.
    pub body: Option<BodySpec>,
    /// The sensors of that body, in the order of the file.
    pub sensors: Vec<Sensor>,
}

/// A number profile of the virtual machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum NumberProfile {
    /// 16-bit integers and floats.
    Tiny,
    /// 32-bit integers and floats, strings made at run time.
    Full,
}

impl NumberProfile {
    /// Returns the profile of that name.
    pub fn from_name(name: &str) -> Option<NumberProfile> {
        [NumberProfile::Tiny, NumberProfile::Full]
            .into_iter()
            .find(|profile| profile.name() == name)
    }

    /// Returns the name in robot files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            NumberProfile::Tiny => "tiny",
            NumberProfile::Full => "full",
        }
    }
}

/// The consequence of a fault. A failed `assert` stops the script in either case.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum OnFault {
    /// A fault in a listener or in a handler of conflicts ends that call. After any other fault,
    /// the script restarts when a pause is over.
    #[default]
    Restart,
    /// Every fault stops the script until power-on.
    Stop,
}

impl OnFault {
    /// The words of robot files and scenarios.
    pub const WORDS: [(&str, OnFault); 2] =
        [("restart", OnFault::Restart), ("stop", OnFault::Stop)];
}

/// The largest number of frames in a queue of a robot without a chip, or of one that is simulated.
pub const QUEUED_MAX: u32 = 64;

/// The largest number of long messages that a robot can receive at once, or that can wait to be
/// sent.
pub const LONG_MAX: u32 = 16;

/// Sizes of the virtual machine of a robot. A size of 0 leaves its feature out, if 0 is allowed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct VmSizes {
    /// Bytes that the whole machine object may take, including all other sizes here.
    pub memory: u32,
    /// Slots of the arena that holds globals, heap and stack; see [`Robot::slot_bytes`].
    pub slots: u32,
    /// The largest number of neighbors that are remembered; 0 leaves `neighbors` out.
    pub neighbors: u32,
    /// True if the robot measures the direction of a neighbor; true if left out.
    pub bearings: bool,
    /// Messages that can wait to be read by the script.
    pub in_queue: u32,
    /// Messages that can wait to be sent.
    pub out_queue: u32,
    /// Long messages, which travel in fragments, that can be received at once, at most
    /// [`LONG_MAX`]; 1 if left out.
    pub in_long: u32,
    /// Long messages that can wait to be sent, at most [`LONG_MAX`]; 1 if left out.
    pub out_long: u32,
    /// Entries of all stigmergies together; 0 leaves `stigmergy` out. At most 255, or
    /// [`ENTRIES_MAX`](bittybuzz_vm_core::ENTRIES_MAX) without a chip.
    pub stigmergy_entries: u32,
    /// The largest number of swarms that are known, at most 8; 0 leaves `swarm` out.
    pub swarms: u32,
    /// True if the machine has the floating-point functions of `math`, and powers; true if left
    /// out.
    pub maths: bool,
    /// Steps of silence after which a beacon is sent; 10 if left out.
    pub beacon_steps: u32,
    /// Steps without a message after which a neighbor is forgotten; 30 if left out.
    pub forget_steps: u32,
    /// Steps between two advertisements of stigmergy entries while nothing changes; 20 if left out.
    pub advertise_steps: u32,
}

/// The limits of a robot's firmware.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget {
    /// Bytes of flash, including the script.
    pub flash_bytes: u32,
    /// Bytes of RAM that are allocated statically.
    pub ram_bytes: u32,
}

/// A function that scripts may call on a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotFunction {
    /// Its name in scripts, which may stand in tables: `debug.print`.
    pub name: String,
    /// The argument lists that it accepts: at least one, and no list twice.
    pub accepts: Vec<Vec<Parameter>>,
    /// The type of its result; `None` if it returns nil.
    pub returns: Option<SignatureType>,
    /// True if the function finishes later. The script waits for it, but the robot does not.
    pub waits: bool,
    /// Its effect, with units, in one line.
    pub help: String,
    /// The effect in the simulator; `Some` if the robot has a [`BodySpec`].
    pub effect: Option<FunctionEffect>,
}

impl RobotFunction {
    /// Returns the number of the function in images.
    pub const fn hash(&self) -> u16 {
        name_hash(self.name.as_str())
    }

    /// Returns true if the function reads a value for a table, so that no script calls it.
    pub fn is_reader(&self) -> bool {
        self.effect.as_ref().is_some_and(|effect| effect.fills.is_some())
    }

    /// Returns each way to call it, as `distance(beam: int): int`.
    pub fn forms(&self) -> impl Iterator<Item = String> {
        self.accepts.iter().map(|list| {
            let list: Vec<String> = list.iter().map(ToString::to_string).collect();
            let returns = self.returns.map_or(String::new(), |kind| format!(": {kind}"));
            format!("{}({}){returns}", self.name, list.join(", "))
        })
    }
}

/// A signal that the firmware gives with the robot's lights, in place of or in addition to the
/// script's color.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Indicator {
    /// One line that describes the light as people see it, such as `red, blinking`.
    pub shows: String,
    /// One line with the state of the robot and, if there is one, the remedy.
    pub means: String,
}

/// A table that a robot keeps up to date for its scripts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SensorTable {
    /// The global that holds the table, such as `pos`.
    pub name: String,
    /// Its fields; at least one.
    pub fields: Vec<Parameter>,
    /// Its meaning, with units, in one line.
    pub help: String,
}

impl Robot {
    /// Reads a robot file. `path` only serves to name the file in errors.
    pub fn parse(text: &str, path: &str) -> Result<Robot, RobotErrors> {
        read::robot(text, path)
    }

    /// Reads the robot file at a path.
    pub fn read(path: &Path) -> Result<Robot, RobotErrors> {
        let name = path.to_string_lossy();
        match file::read_text(path, file::TEXT_BYTES_MAX) {
            Ok(text) => Robot::parse(&text, &name),
            Err(error) => Err(RobotErrors::unreadable(&name, &error)),
        }
    }

    /// Returns the function of that name.
    pub fn function(&self, name: &str) -> Option<&RobotFunction> {
        self.functions.iter().find(|function| function.name == name)
    }

    /// Returns the unit in which scripts get the distance of a neighbor.
    pub fn neighbor_unit(&self) -> DistanceUnit {
        let unit = |sensor: &Sensor| match sensor.kind {
            SensorKind::RangeAndBearing { unit, .. } => Some(unit),
            _ => None,
        };
        self.sensors.iter().find_map(unit).unwrap_or_default()
    }

    /// Returns the table of that name.
    pub fn table(&self, name: &str) -> Option<&SensorTable> {
        self.tables.iter().find(|table| table.name == name)
    }
}

#[cfg(test)]
mod tests;
