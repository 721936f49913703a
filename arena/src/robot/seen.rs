//! The events of a robot in one tick, which an observer sees. A robot notes them only while it is watched.

use bittybuzz_vm_core::RobotFault;

use crate::engine::{LossCause, SentFrame};

use super::faults::FaultRecord;
use super::log::{LogLine, Piece};

/// An event of a robot.
#[derive(Debug, Clone)]
pub enum RobotEvent {
    /// Its script logged a line.
    Log(LogLine),
    /// Its script had a fault.
    Fault(FaultRecord),
    /// Its script called a function of the robot.
    Call(FunctionCall),
    /// A frame arrived and did not get into its queue, or pushed another one out.
    Unread(SentFrame, LossCause),
    /// A frame found the queue of its link full. The queue may have discarded another frame to take this one.
    Unsent(Vec<u8>),
}

/// A call of a function of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct FunctionCall {
    /// Its name.
    pub function: String,
    /// The arguments.
    pub arguments: Vec<Piece>,
    /// Its result.
    pub result: CallResult,
}

/// The result of a call of a function of the robot.
#[derive(Debug, Clone, PartialEq)]
pub enum CallResult {
    /// It returned this value.
    Returned(Piece),
    /// It goes on, and the script waits. Another event shows its end.
    Waiting,
    /// It does not take these arguments, or cannot do this now: a fault of the script.
    Refused(RobotFault),
}

/// The events of a robot while it is watched.
#[derive(Debug, Clone, Default)]
pub struct Seen {
    /// In the order in which they happened.
    pub events: Vec<RobotEvent>,
}

impl Seen {
    /// Notes a call of a function.
    pub fn call(&mut self, function: &str, arguments: Vec<Piece>, result: CallResult) {
        let call = FunctionCall { function: function.to_owned(), arguments, result };
        self.events.push(RobotEvent::Call(call));
    }

    /// Notes lines that were logged.
    pub fn log(&mut self, lines: &[LogLine]) {
        self.events.extend(lines.iter().cloned().map(RobotEvent::Log));
    }
}
