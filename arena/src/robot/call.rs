//! Calls of robot functions, and the state that functions keep between two calls.

use std::any::Any;
use std::fmt::Debug;

use crate::engine::{Digest, Io, Stream};

use super::log::{LineKind, LogLine, Piece};
use super::program::ProgramId;

/// The effect of a robot function. Arguments are checked before, as on the robot.
pub type Effect = Box<dyn Fn(&mut RobotCall<'_, '_>) -> Done + Send + Sync>;

/// The outcome of a function.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Done {
    /// It is finished and returns nil.
    Nil,
    /// It is finished and returns an integer.
    Int(i32),
    /// It is finished and returns a number.
    Float(f32),
    /// It is not finished and is called again.
    Wait,
    /// It is finished, had no effect and returns 0, 0.0 or nil.
    Idle,
    /// An argument is outside of the range that the robot accepts.
    OutOfRange,
}

/// A call of a robot function.
pub struct RobotCall<'a, 'io> {
    /// The inputs and outputs of the robot.
    pub io: &'a mut Io<'io>,
    /// State that outlives the call.
    pub memory: &'a mut FunctionMemory,
    pub numbers: CallNumbers<'a>,
    /// False in the first call, true in the repeated calls after [`Done::Wait`].
    pub again: bool,
    /// Converts the arguments to pieces of a log line.
    pub(super) pieces: &'a dyn Fn() -> Vec<Piece>,
}

/// The state that the functions of a robot keep between two calls.
#[derive(Debug, Clone)]
pub struct FunctionMemory {
    /// The part of the firmware that executes functions between two steps of the script.
    pub autopilot: Option<Box<dyn Autopilot>>,
    /// Voltage of the battery in mV, if an event of the scenario has set it.
    pub battery_mv: Option<u16>,
    /// Errors of poses from outside that events of the scenario have caused.
    pub(super) pose_error: PoseError,
    /// Random numbers of the robot's functions.
    pub chance: Stream,
    pub(super) logged: Vec<LogLine>,
    /// The program that calls the functions.
    pub(super) program: ProgramId,
}

/// The battery of a robot, without the noise of its sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BatteryState {
    /// Voltage in mV.
    pub millivolts: u16,
    /// Remaining charge, 0 to 1; `None` if only the voltage is known, as after an event that sets it.
    pub charge: Option<f32>,
}

/// The errors of a source of poses outside of the robots, such as cameras.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseError {
    /// Displacement in mm.
    pub displaced_mm: [f32; 2],
    /// The source takes another robot for this one: its id minus the own id.
    pub seen_as: Option<i32>,
}

/// The part of a robot's firmware that executes functions between two steps of the script, such as
/// the flight to a place. Its `Debug` text contains its complete state, because digests of runs are
/// computed from it.
pub trait Autopilot: Any + Debug + Send {
    /// Returns a copy that continues exactly as the original would.
    fn copy(&self) -> Box<dyn Autopilot>;

    /// Acts for one tick, after the script's step. `battery_mv` is the voltage of the battery, if
    /// an event of the scenario has set it.
    fn tick(&mut self, io: &mut Io<'_>, battery_mv: Option<u16>);

    /// Returns the voltage of the battery in mV, without noise, at a time of the run in ms; `None`
    /// if the robot does not measure it.
    fn battery_mv(&self, milliseconds: u64) -> Option<u16> {
        let _ = milliseconds;
        None
    }

    /// Returns the remaining charge of the battery, 0 to 1, at a time of the run in ms; `None` if
    /// only its voltage is known.
    fn battery_charge(&self, milliseconds: u64) -> Option<f32> {
        let _ = milliseconds;
        None
    }

    /// Sets the errors of poses from outside. A robot without such poses has none.
    fn set_pose_error(&mut self, error: PoseError) {
        let _ = error;
    }

    /// Brings the robot to rest after a fault has stopped the script.
    fn give_up(&mut self, io: &mut Io<'_>);

    /// Handles a restart of the script.
    fn start(&mut self);

    /// Takes over the state that survives a power cycle, such as the charge of the battery.
    fn adopt(&mut self, before: &dyn Any) {
        let _ = before;
    }
}

impl FunctionMemory {
    /// Adds its state to a digest. Logged lines are left out, because they only wait for the host.
    pub(super) fn add_to(&self, digest: &mut Digest) {
        let FunctionMemory { autopilot, battery_mv, pose_error, chance, logged: _, program: _ } =
            self;
        digest.text_of(&(autopilot, battery_mv, chance));
        // Runs without such events keep their digests.
        if *pose_error != PoseError::default() {
            digest.text_of(pose_error);
        }
    }
}

impl Clone for Box<dyn Autopilot> {
    fn clone(&self) -> Self {
        (**self).copy()
    }
}

/// The numeric arguments of a call. An argument that is missing or not a number counts as 0.
#[derive(Debug, Clone, Copy)]
pub struct CallNumbers<'a>(pub(super) &'a [f32]);

impl CallNumbers<'_> {
    /// Returns the number of arguments.
    #[must_use]
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// Returns an argument as a float.
    #[must_use]
    pub fn float(&self, index: usize) -> f32 {
        self.0.get(index).copied().unwrap_or(0.0)
    }

    /// Returns an argument as an integer. All integers that functions take are exact in a float.
    #[must_use]
    pub fn int(&self, index: usize) -> i32 {
        self.float(index) as i32
    }
}

impl RobotCall<'_, '_> {
    /// Returns the autopilot, if it is of that type.
    pub fn autopilot<T: Autopilot>(&mut self) -> Option<&mut T> {
        let autopilot: &mut dyn Any = &mut **self.memory.autopilot.as_mut()?;
        autopilot.downcast_mut()
    }

    /// Logs the call itself, as in `turret_set(0.5)`.
    pub fn log_call(&mut self, name: &str) {
        let text = |text: &str| Piece::Text(text.as_bytes().to_vec());
        let mut pieces = vec![text(name), text("(")];
        for (index, argument) in (self.pieces)().into_iter().enumerate() {
            let is_string = matches!(argument, Piece::Constant(_) | Piece::Text(_));
            let quote = if is_string { "\"" } else { "" };
            let comma = if index > 0 { ", " } else { "" };
            pieces.extend([text(comma), text(quote), argument, text(quote)]);
        }
        pieces.push(text(")"));
        self.add_line(pieces);
    }

    /// Logs a line: `before`, and all arguments.
    pub fn log(&mut self, before: Vec<Piece>) {
        let mut pieces = before;
        pieces.extend((self.pieces)());
        self.add_line(pieces);
    }

    /// Logs a line of text.
    pub fn log_text(&mut self, text: &str) {
        self.add_line(vec![Piece::Text(text.as_bytes().to_vec())]);
    }

    fn add_line(&mut self, pieces: Vec<Piece>) {
        let (tick, program) = (self.io.now, self.memory.program);
        self.memory.logged.push(LogLine { tick, program, pieces, kind: LineKind::Logged });
    }
}
