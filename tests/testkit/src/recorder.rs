//! A host that records what a script asks for and answers as the test wants it.

use std::fmt;
use std::rc::Rc;

use bittybuzz_compiler::symbols::Symbols;
use bittybuzz_vm_core::hash::name_hash;
use bittybuzz_vm_core::message::FRAGMENT_HEAD;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Argument, Axis, ByteCode, CallArguments, Calls, Fault, Host, Periods, Reply, RobotFault,
    Sighting, Type, Value,
};

use crate::link::{Direct, Link, Received};

/// An argument of a call, copied out of the machine.
#[derive(Debug, Clone)]
pub enum RecordedArgument {
    /// nil
    Nil,
    /// An integer.
    Int(i32),
    /// A float. Two floats are equal if all their bits are.
    Float(f32),
    /// The number of a constant string.
    String(u16),
    /// The bytes of a string made at run time.
    Text(Vec<u8>),
    /// A table with that number of entries.
    Table(usize),
    /// A function.
    Function,
}

impl PartialEq for RecordedArgument {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (RecordedArgument::Nil, RecordedArgument::Nil)
            | (RecordedArgument::Function, RecordedArgument::Function) => true,
            (RecordedArgument::Int(a), RecordedArgument::Int(b)) => a == b,
            (RecordedArgument::Float(a), RecordedArgument::Float(b)) => a.to_bits() == b.to_bits(),
            (RecordedArgument::String(a), RecordedArgument::String(b)) => a == b,
            (RecordedArgument::Text(a), RecordedArgument::Text(b)) => a == b,
            (RecordedArgument::Table(a), RecordedArgument::Table(b)) => a == b,
            _ => false,
        }
    }
}

impl Eq for RecordedArgument {}

impl fmt::Display for RecordedArgument {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            RecordedArgument::Nil => f.write_str("nil"),
            RecordedArgument::Int(value) => value.fmt(f),
            // With its fraction, so that 1.0 does not look like 1.
            RecordedArgument::Float(value) => write!(f, "{value:?}"),
            RecordedArgument::String(number) => write!(f, "string {number}"),
            RecordedArgument::Text(bytes) => f.write_str(&String::from_utf8_lossy(bytes)),
            RecordedArgument::Table(size) => write!(f, "table of {size}"),
            RecordedArgument::Function => f.write_str("function"),
        }
    }
}

impl RecordedArgument {
    fn all<P: Profile, C: ByteCode, const SLOTS: usize>(
        arguments: &CallArguments<'_, P, C, SLOTS>,
    ) -> Vec<RecordedArgument> {
        let copy = |index| match arguments.item(index) {
            Argument::Nil => RecordedArgument::Nil,
            Argument::Int(value) => RecordedArgument::Int(value),
            Argument::Float(value) => RecordedArgument::Float(value),
            Argument::String(text) => match text.number() {
                Some(number) => RecordedArgument::String(number),
                None => RecordedArgument::Text(text.bytes().collect()),
            },
            Argument::Table(size) => RecordedArgument::Table(size),
            Argument::Function => RecordedArgument::Function,
        };
        (0..arguments.count()).map(copy).collect()
    }

    /// Returns its integer, if it is one.
    pub fn as_int(&self) -> Option<i32> {
        match self {
            RecordedArgument::Int(value) => Some(*value),
            _ => None,
        }
    }

    /// Returns its type as `type()` names it.
    pub fn type_of(&self) -> Type {
        match self {
            RecordedArgument::Nil => Type::Nil,
            RecordedArgument::Int(_) => Type::Int,
            RecordedArgument::Float(_) => Type::Float,
            RecordedArgument::String(_) | RecordedArgument::Text(_) => Type::String,
            RecordedArgument::Table(_) => Type::Table,
            RecordedArgument::Function => Type::Closure,
        }
    }
}

/// A request of the script.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Event {
    /// A call of a robot function, recorded once however long the script waits for it.
    Call {
        /// Hash of the function's name.
        function: u16,
        /// Its arguments.
        arguments: Vec<RecordedArgument>,
    },
    /// `log(...)`
    Log(Vec<RecordedArgument>),
    /// `delay(ms)`, recorded once.
    Delay(i32),
}

/// A robot function that the machine calls, or asks again whether it is finished.
#[derive(Debug)]
pub struct Call<'a> {
    /// Hash of the function's name.
    pub function: u16,
    /// Its arguments.
    pub arguments: &'a [RecordedArgument],
    /// Times that the machine has asked again.
    pub polls: u32,
    /// The number of this call, from 1.
    pub number: u32,
}

/// The answer to a [`Call`].
#[derive(Debug, Clone, Copy)]
pub enum Answer {
    /// Finished: nil.
    Nil,
    /// Finished: an integer.
    Int(i32),
    /// Finished: the first argument, nil if there is none.
    First,
    /// Not finished.
    Wait,
    /// A run-time error.
    Fault(RobotFault),
}

/// A host that records. By default all functions return nil, delays are over when the machine asks
/// again, the position is unknown, and no frame arrives.
pub struct Recorder {
    /// Everything that the script asked for, in order.
    pub events: Vec<Event>,
    /// The answer to each call.
    pub answer: Box<dyn FnMut(&Call<'_>) -> Answer>,
    /// The number of times that the machine must ask again before a delay of that many milliseconds
    /// is over.
    pub delay_polls: Box<dyn FnMut(i32) -> u32>,
    /// The position, in the order of [`Axis`].
    pub position: [Option<f32>; 4],
    /// Periods of beacons and advertisements.
    pub periods: Periods,
    /// The frames that wait and those that were sent.
    pub link: Box<dyn Link>,
    /// Names of strings and functions in [`Recorder::lines`].
    pub symbols: Option<Rc<Symbols>>,
    /// Faults that ended a listener or a handler of conflicts.
    pub contained: Vec<Fault>,
    /// The functions that ran at each of these faults, at most a hundred: the listener, and those that it called.
    pub contained_calls: Vec<usize>,
    /// Times that the machine has asked again whether a function or delay is finished.
    pub asked_again: u32,
    /// The same, for what the script waits for now.
    pub polls: u32,
    /// Calls of robot functions.
    pub calls: u32,
}

impl Default for Recorder {
    fn default() -> Self {
        Recorder {
            events: Vec::new(),
            answer: Box::new(|_| Answer::Nil),
            delay_polls: Box::new(|_| 1),
            position: [None; 4],
            periods: Periods::DEFAULT,
            link: Box::new(Direct::default()),
            symbols: None,
            contained: Vec::new(),
            contained_calls: Vec::new(),
            asked_again: 0,
            polls: 0,
            calls: 0,
        }
    }
}

impl Recorder {
    /// Returns a recorder that answers calls so.
    pub fn answering(answer: impl FnMut(&Call<'_>) -> Answer + 'static) -> Self {
        Recorder { answer: Box::new(answer), ..Recorder::default() }
    }

    /// Returns a recorder with these names.
    pub fn with_symbols(symbols: Symbols) -> Self {
        Recorder { symbols: Some(Rc::new(symbols)), ..Recorder::default() }
    }

    /// Returns what the script logged and called, line by line: `f(1, 2)` and the arguments of
    /// `log` without a space.
    pub fn lines(&self) -> Vec<String> {
        self.events.iter().filter_map(|event| self.line(event)).collect()
    }

    /// Returns what the script logged, line by line.
    pub fn logs(&self) -> Vec<String> {
        let logs = self.events.iter().filter(|event| matches!(event, Event::Log(_)));
        logs.filter_map(|event| self.line(event)).collect()
    }

    /// Returns what the script logged last.
    pub fn last_log(&self) -> Option<String> {
        let last = self.events.iter().rev().find(|event| matches!(event, Event::Log(_)))?;
        self.line(last)
    }

    fn line(&self, event: &Event) -> Option<String> {
        let show = |items: &[RecordedArgument], separator: &str| {
            items.iter().map(|item| self.show(item)).collect::<Vec<_>>().join(separator)
        };
        match event {
            Event::Call { function, arguments } => {
                let imports = self.symbols.iter().flat_map(|symbols| &symbols.imports);
                let name = { imports }.find(|name| name_hash(name) == *function);
                let name = name.map_or(function.to_string(), Clone::clone);
                Some(format!("{name}({})", show(arguments, ", ")))
            }
            Event::Log(items) => Some(show(items, "")),
            Event::Delay(_) => None,
        }
    }

    /// Returns an argument as text, a constant string by its name.
    pub fn show(&self, argument: &RecordedArgument) -> String {
        match argument {
            RecordedArgument::String(number) => {
                let name = self.symbols.as_ref().and_then(|symbols| symbols.string(*number));
                name.map_or_else(|| argument.to_string(), str::to_owned)
            }
            other => other.to_string(),
        }
    }
}

impl<P: Profile> Host<P> for Recorder {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        let items = RecordedArgument::all(&arguments);
        if again {
            self.polls += 1;
            self.asked_again += 1;
        } else {
            self.polls = 0;
            self.calls += 1;
            self.events.push(Event::Call { function, arguments: items.clone() });
        }
        let call = Call { function, arguments: &items, polls: self.polls, number: self.calls };
        match (self.answer)(&call) {
            Answer::Nil => Ok(Reply::Value(Value::nil())),
            Answer::Int(value) => Ok(Reply::Value(Value::int(value))),
            Answer::First => Ok(Reply::Value(arguments.value(0))),
            Answer::Wait => Ok(Reply::Wait),
            Answer::Fault(fault) => Err(fault),
        }
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: CallArguments<'_, P, C, SLOTS>) {
        self.events.push(Event::Log(RecordedArgument::all(&arguments)));
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        if again {
            self.polls += 1;
            self.asked_again += 1;
        } else {
            self.polls = 0;
            self.events.push(Event::Delay(ms));
        }
        self.polls >= (self.delay_polls)(ms)
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        let [x, y, z, orientation] = self.position;
        match axis {
            Axis::X => x,
            Axis::Y => y,
            Axis::Z => z,
            Axis::Orientation => orientation,
        }
    }

    fn periods(&self) -> Periods {
        self.periods
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        let Received { bytes, sender, place } = self.link.pop()?;
        // A frame longer than the machine's is cut, which the machine reports as malformed.
        let length = bytes.len().min(frame.len());
        frame[..length].copy_from_slice(&bytes[..length]);
        sighting.robot = sender;
        sighting.place = place.map(|place| place.map(Value::float));
        Some(length)
    }

    fn receive_content(&mut self, content: &mut [u8]) -> usize {
        self.link.take_content(content)
    }

    fn send(&mut self, frame: &[u8]) {
        self.link.send(frame);
    }

    fn send_content(&mut self, robot: u16, content: &[u8]) -> bool {
        let piece = size_of::<P::Frame>() - FRAGMENT_HEAD;
        self.link.send_content(robot, content, piece)
    }

    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        fault: &Fault,
        calls: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        self.contained.push(*fault);
        self.contained_calls.push(calls.take(100).count());
        true
    }
}
