//! The interface between the machine and the robot, or a host program that simulates one.

use crate::bytecode::ByteCode;
use crate::fault::{Fault, RobotFault};
use crate::machine::{Calls, MemoryView};
use crate::network::{Periods, Sighting};
use crate::number::Profile;
use crate::value::{Tag, Value};

/// The answer of a robot function.
#[derive(Clone, Copy, Debug)]
pub enum Reply<P: Profile> {
    /// The function is finished, with this result.
    Value(Value<P>),
    /// The function is not finished. The script waits, and the machine asks again on every run.
    Wait,
}

/// An axis of the robot's position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// mm
    X,
    /// mm
    Y,
    /// mm
    Z,
    /// degrees
    Orientation,
}

/// The robot, as the machine uses it: its functions, log, time, position and radio.
pub trait Host<P: Profile> {
    /// Calls the robot function with that name hash. `again` is false on the first call. It is true
    /// when the machine asks if a function that returned [`Reply::Wait`] is finished.
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault>;

    /// Executes `log(...)`.
    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: CallArguments<'_, P, C, SLOTS>);

    /// Returns true once `delay(ms)` is over; the delay starts when `again` is false.
    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool;

    /// Returns a coordinate of the robot's position; `None` if the robot does not know it.
    fn position(&mut self, axis: Axis) -> Option<f32>;

    /// Returns the periods of messages that the machine sends on its own.
    fn periods(&self) -> Periods {
        Periods::DEFAULT
    }

    /// Moves the oldest waiting frame into `frame` and returns its length. Writes the link's
    /// knowledge of the sender to `sighting`, which is empty on entry. The machine calls this
    /// before every step, until no frame is left.
    fn receive(&mut self, _frame: &mut [u8], _sighting: &mut Sighting<P>) -> Option<usize> {
        None
    }

    /// Moves the content of a long message into `content` and returns its length. The machine calls
    /// this function after [`Host::receive`] has returned the first [`FRAGMENT_HEAD`] bytes of a
    /// fragment, which stand for the whole message.
    ///
    /// [`FRAGMENT_HEAD`]: crate::message::FRAGMENT_HEAD
    fn receive_content(&mut self, _content: &mut [u8]) -> usize {
        0
    }

    /// Sends a frame to all robots in reach: queues it, best in a `bittybuzz_comms::queue::Outbox`.
    fn send(&mut self, _frame: &[u8]) {}

    /// Sends the content of a long message in fragments, which name this robot as the sender.
    /// Returns false if there is no room for it; the machine sends an entry of a stigmergy later
    /// then. A host may discard what it cannot send, and return true.
    fn send_content(&mut self, _robot: u16, _content: &[u8]) -> bool {
        true
    }

    /// True if slices end by time alone: the machine asks [`Host::is_slice_over`] before each
    /// instruction and counts no budget. This is for chips on which the question takes two cycles.
    const IS_TIMED: bool = false;

    /// Returns true if the machine must end the current slice. It must be false when [`Vm::run`] is
    /// called, else no instruction is executed.
    ///
    /// The machine asks after each instruction that may take long. These are all instructions
    /// except arithmetic, jumps, variables and calls of the script's own functions.
    ///
    /// [`Vm::run`]: crate::Vm::run
    fn is_slice_over(&mut self) -> bool {
        false
    }

    /// Receives the time that work on text took, in instructions. The machine takes it from the
    /// budget together with the instruction that did the work. Programs that run one instruction at
    /// a time count it.
    #[inline]
    fn has_worked(&mut self, _instructions: u16) {}

    /// Handles a fault of a listener or of a handler of conflicts. Returns true if only that call
    /// ends: the message is discarded and counted, and the script continues. Returns false if the
    /// fault stops the script. The machine does not ask about a failed `assert`, which always stops
    /// the script.
    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        _fault: &Fault,
        _calls: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        true
    }
}

/// The arguments of a call, on the machine's stack.
pub struct CallArguments<'a, P: Profile, C: ByteCode, const SLOTS: usize> {
    pub(crate) script: MemoryView<'a, P, C, SLOTS>,
    /// The slot after the last argument.
    pub(crate) end: usize,
    pub(crate) count: usize,
}

/// An argument, as a robot function sees it.
pub enum Argument<'a, P: Profile, C: ByteCode, const SLOTS: usize> {
    /// nil
    Nil,
    /// An integer.
    Int(i32),
    /// A float.
    Float(f32),
    /// A string.
    String(Text<'a, P, C, SLOTS>),
    /// A table with this number of entries.
    Table(usize),
    /// A function.
    Function,
}

/// A string, as a robot function sees it.
pub struct Text<'a, P: Profile, C: ByteCode, const SLOTS: usize> {
    script: MemoryView<'a, P, C, SLOTS>,
    value: Value<P>,
}

impl<'a, P: Profile, C: ByteCode, const SLOTS: usize> CallArguments<'a, P, C, SLOTS> {
    /// Returns the number of arguments.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Returns argument `index`, nil if there is none.
    pub fn value(&self, index: usize) -> Value<P> {
        if index < self.count {
            self.script.arena.get(self.end - self.count + index)
        } else {
            Value::nil()
        }
    }

    /// Returns argument `index` with the object that it refers to.
    pub fn item(&self, index: usize) -> Argument<'a, P, C, SLOTS> {
        let value = self.value(index);
        match value.tag() {
            Tag::INT => Argument::Int(value.as_int().unwrap_or(0)),
            Tag::FLOAT => Argument::Float(value.as_f32().unwrap_or(0.0)),
            Tag::NIL | Tag::UNSET => Argument::Nil,
            Tag::STRING | Tag::TEXT => Argument::String(Text { script: self.script, value }),
            Tag::TABLE | Tag::SNAPSHOT => {
                Argument::Table(self.script.arena.table_size(value.index()))
            }
            _ => Argument::Function,
        }
    }
}

impl<'a, P: Profile, C: ByteCode, const SLOTS: usize> Text<'a, P, C, SLOTS> {
    /// Makes the text of a value that is a string.
    pub(crate) fn new(script: MemoryView<'a, P, C, SLOTS>, value: Value<P>) -> Self {
        Text { script, value }
    }

    /// Returns the number of the string, if it is a constant.
    pub fn number(&self) -> Option<u16> {
        self.value.as_string()
    }

    /// Returns the bytes of the string; none for a constant whose text is not in the image.
    pub fn bytes(&self) -> impl Iterator<Item = u8> {
        self.script.text_bytes(self.value)
    }
}
