//! The interface between the machine and the robot, or the host program that plays one.

use crate::bytecode::ByteCode;
use crate::fault::{Fault, RobotFault};
use crate::machine::{Calls, View};
use crate::network::{Periods, Sighting};
use crate::number::Profile;
use crate::value::{Tag, Value};

/// The answer of a robot function.
#[derive(Clone, Copy, Debug)]
pub enum Reply<P: Profile> {
    /// It is finished, with this result.
    Value(Value<P>),
    /// It goes on. The script waits; the machine asks again on every run.
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

/// The robot's side.
pub trait Host<P: Profile> {
    /// Calls the robot function with that name hash. `again` is false the first time and true when the machine asks
    /// whether a function that answered [`Reply::Wait`] is finished.
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault>;

    /// `log(...)`
    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: Arguments<'_, P, C, SLOTS>);

    /// Returns true once `delay(ms)` is over; the delay starts when `again` is false.
    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool;

    /// The robot's position, `None` where it does not know it.
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

    /// Sends a frame to all robots in reach: queues it, best in a `bittybuzz_comms::queue::Outbox`.
    fn send(&mut self, _frame: &[u8]) {}

    /// Slices end by time alone: the machine asks [`Host::is_slice_over`] before each instruction and counts no budget.
    /// For chips on which the question takes two cycles.
    const IS_TIMED: bool = false;

    /// Returns true if the machine has to return from the slice that it runs. It must be false when [`Vm::run`] is called,
    /// else no instruction is executed.
    ///
    /// The machine asks after each instruction that may take long: everything but arithmetic, jumps, variables and calls
    /// of the script's own functions.
    ///
    /// [`Vm::run`]: crate::Vm::run
    fn is_slice_over(&mut self) -> bool {
        false
    }

    /// Text took the time of that number of instructions, which the budget loses with the instruction that made it. Programs that
    /// run one instruction at a time count them.
    #[inline]
    fn has_worked(&mut self, _instructions: u16) {}

    /// A listener or a handler of conflicts ended with a fault. Returns true if only that call ends: the message is
    /// discarded and counted, and the script goes on. Returns false if the fault stops the script. Not asked about a
    /// failed `assert`, which always stops it.
    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        _fault: &Fault,
        _calls: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        true
    }
}

/// The arguments of a call, on the machine's stack.
pub struct Arguments<'a, P: Profile, C: ByteCode, const SLOTS: usize> {
    pub(crate) script: View<'a, P, C, SLOTS>,
    /// Slot above the last.
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
    script: View<'a, P, C, SLOTS>,
    value: Value<P>,
}

impl<'a, P: Profile, C: ByteCode, const SLOTS: usize> Arguments<'a, P, C, SLOTS> {
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
    /// The string that a value is.
    pub(crate) fn new(script: View<'a, P, C, SLOTS>, value: Value<P>) -> Self {
        Text { script, value }
    }

    /// Its number, if it is a constant of the script.
    pub fn number(&self) -> Option<u16> {
        self.value.as_string()
    }

    /// Its bytes; none for a constant whose text is not in the image.
    pub fn bytes(&self) -> impl Iterator<Item = u8> {
        self.script.text_bytes(self.value)
    }
}
