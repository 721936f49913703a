//! The events of a robot in one tick, for observers. A robot records them only while it is watched.

use std::sync::Arc;

use bittybuzz_vm_core::RobotFault;

use crate::engine::{LossCause, SentFrame};

use super::log::{LogLine, Piece};
use super::post_mortem::PostMortem;

/// An event of a robot.
#[derive(Debug, Clone)]
pub enum SeenEvent {
    /// Its script logged a line.
    Log(LogLine),
    /// Its script had a fault.
    Fault(Arc<PostMortem>),
    /// Its script called a function of the robot.
    Call(FunctionCall),
    /// A frame arrived, and the queue discarded it or another frame.
    Unread(SentFrame, LossCause),
    /// A frame to be sent found the queue of its link full. The queue may have discarded another
    /// frame to take this one.
    Unsent(Vec<u8>),
}

/// A call of a function of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct FunctionCall {
    pub function: String,
    pub arguments: Vec<Piece>,
    pub result: CallResult,
}

/// The result of a call of a function of the robot.
#[derive(Debug, Clone, PartialEq)]
pub enum CallResult {
    /// It returned this value.
    Returned(Piece),
    /// The function continues, and the script waits. Another event shows its end.
    Waiting,
    /// The function does not take these arguments or cannot run now, which is a fault of the
    /// script.
    Refused(RobotFault),
}

/// The events that an observer uses in addition to log lines and faults. The simulator builds no
/// others: in a crowd, the fates of frames take many times longer than the rest of a tick.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Interest {
    /// Frames that are sent, arrive, are lost, or find a full queue.
    pub frames: bool,
    /// Calls of functions of the robot.
    pub calls: bool,
}

impl Interest {
    /// Everything that an observer can see.
    pub const ALL: Interest = Interest { frames: true, calls: true };
}

/// The events of a robot while it is watched.
#[derive(Debug, Clone, Default)]
pub struct Seen {
    pub interest: Interest,
    /// The events in the order in which they happened.
    pub events: Vec<SeenEvent>,
}

impl Seen {
    /// Records a call of a function, whose arguments are only read if calls are recorded.
    pub fn call(
        &mut self,
        function: &str,
        arguments: impl FnOnce() -> Vec<Piece>,
        result: CallResult,
    ) {
        if !self.interest.calls {
            return;
        }
        let arguments = arguments();
        let call = FunctionCall { function: function.to_owned(), arguments, result };
        self.events.push(SeenEvent::Call(call));
    }

    /// Records lines that were logged.
    pub fn log(&mut self, lines: &[LogLine]) {
        self.events.extend(lines.iter().cloned().map(SeenEvent::Log));
    }
}
