//! The robot: notes what a script asks for, and answers the same on every run.
//!
//! It runs on microcontrollers without an allocator, so it keeps a checksum and not, like `bittybuzz-testkit`, the
//! values.

use bittybuzz_vm_core::hash::name_hash;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Argument, Axis, ByteCode, CallArguments, Host, Refusal, Reply, RobotFault, Text, Value,
};

use crate::trace::Trace;

/// What an event begins with in the trace.
#[derive(Clone, Copy)]
#[repr(u8)]
pub enum Event {
    Entry = 1,
    NoEntry = 2,
    Slice = 3,
    Global = 4,
    Call = 5,
    Log = 6,
    Delay = 7,
    Position = 8,
    End = 9,
}

/// The robot's memory.
#[derive(Default)]
pub struct Recorder {
    pub trace: Trace,
    /// How often what the script waits for was asked for.
    polls: u8,
    calls: u16,
}

impl Recorder {
    #[inline(never)]
    pub fn event(&mut self, event: Event, word: u32) {
        self.trace.add(event as u32);
        self.trace.add(word);
    }

    #[inline(never)]
    fn items<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        arguments: &CallArguments<'_, P, C, SLOTS>,
    ) {
        for index in 0..arguments.count() {
            let (kind, content) = match arguments.item(index) {
                Argument::Nil => (0, 0),
                Argument::Int(value) => (1, value as u32),
                Argument::Float(value) => (2, value.to_bits()),
                Argument::String(text) => (3, self.text(&text)),
                Argument::Table(size) => (4, size as u32),
                Argument::Function => (5, 0),
            };
            self.trace.add(kind);
            self.trace.add(content);
        }
    }

    /// The number of a constant; another text's length, after its bytes.
    fn text<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        text: &Text<'_, P, C, SLOTS>,
    ) -> u32 {
        let mut length = 0;
        if P::FULL && text.number().is_none() {
            for byte in text.bytes() {
                self.trace.add(u32::from(byte));
                length += 1;
            }
        }
        text.number().map_or(length, u32::from)
    }

    /// Whether what is pending is over: after none to three questions.
    fn is_over(&mut self, again: bool, asked: u8) -> bool {
        self.polls = if again { self.polls.wrapping_add(1) } else { 0 };
        self.polls >= asked & 3
    }
}

impl<P: Profile> Host<P> for Recorder {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        const LED: u16 = name_hash("led");
        const GO_TO: u16 = name_hash("goto");
        const SET_MOTOR: u16 = name_hash("set_motor");
        if !again {
            self.calls = self.calls.wrapping_add(1);
            self.event(Event::Call, u32::from(function));
            self.items(&arguments);
        }
        match function {
            LED => match arguments.item(0) {
                Argument::Int(_) => Ok(Reply::Value(Value::nil())),
                _ => Err(RobotFault::WrongType(arguments.value(0).type_of())),
            },
            SET_MOTOR => Err(RobotFault::Refused(Refusal::NotBuiltIn)),
            GO_TO if !self.is_over(again, self.calls as u8) => Ok(Reply::Wait),
            _ => Ok(Reply::Value(Value::int(i32::from(self.calls)))),
        }
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: CallArguments<'_, P, C, SLOTS>) {
        self.event(Event::Log, arguments.count() as u32);
        self.items(&arguments);
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        if !again {
            self.event(Event::Delay, ms as u32);
        }
        self.is_over(again, ms as u8)
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        self.event(Event::Position, axis as u32);
        match axis {
            Axis::X => Some(1.5),
            Axis::Y => Some(-2.0),
            Axis::Z => None,
            Axis::Orientation => Some(90.0),
        }
    }
}
