//! The machine's view of the robot: frames, position, time, calls.

use bittybuzz_robot_spec::{OnFault, accepted_lists, accepting, idle_result};
use bittybuzz_vm_core::message::Fragment;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Argument, Axis, ByteCode, CallArguments, Calls, Fault, Host, Periods, Refusal, Reply,
    RobotFault, Sighting, Value,
};

use crate::engine::Io;

use super::call::{CallNumbers, Done, RobotCall};
use super::context::GroupContext;
use super::log::{LineKind, LogLine, Piece};
use super::queue::{InQueue, OutQueue};
use super::seen::{CallResult, Seen, SeenEvent};
use super::state::RobotContext;

/// A robot during a tick, as its machine accesses it. Frames wait in queues like those of the real
/// robots.
pub struct Platform<'a, 'io> {
    pub io: &'a mut Io<'io>,
    pub state: &'a mut RobotContext,
    pub inbox: &'a mut dyn InQueue,
    pub outbox: &'a mut dyn OutQueue,
    /// True if a frame, or a part of a message, may be in the inbox.
    pub has_mail: &'a mut bool,
    /// True if a frame is in the outbox.
    pub has_unsent: &'a mut bool,
}

/// Converts arguments to pieces of a log line.
fn pieces<P: Profile, C: ByteCode, const SLOTS: usize>(
    arguments: &CallArguments<'_, P, C, SLOTS>,
) -> Vec<Piece> {
    let items = (0..arguments.count()).map(|index| match arguments.item(index) {
        Argument::Nil => Piece::Nil,
        Argument::Int(value) => Piece::Int(value),
        Argument::Float(value) => Piece::Float(value),
        Argument::String(text) => match text.number() {
            Some(number) => Piece::Constant(number),
            None => Piece::Text(text.bytes().collect()),
        },
        Argument::Table(size) => Piece::Table(size),
        Argument::Function => Piece::Function,
    });
    items.collect()
}

/// Puts a frame into the queue of the link, and records an event if the queue is full.
#[cold] // Most runs are not watched.
fn send_observed(outbox: &mut dyn OutQueue, seen: &mut Seen, frame: &[u8]) {
    let dropped = outbox.dropped();
    outbox.push(frame);
    if outbox.dropped() != dropped {
        seen.events.push(SeenEvent::Unsent(frame.to_vec()));
    }
}

/// Returns the result of a call in the form for observers.
fn result_of<P: Profile>(reply: &Result<Reply<P>, RobotFault>) -> CallResult {
    match reply {
        Ok(Reply::Wait) => CallResult::Waiting,
        Ok(Reply::Value(value)) => {
            let int = value.as_int().map(Piece::Int);
            let number = int.or_else(|| value.as_f32().map(Piece::Float));
            CallResult::Returned(number.unwrap_or(Piece::Nil))
        }
        Err(fault) => CallResult::Refused(*fault),
    }
}

impl<P: Profile> Host<P> for Platform<'_, '_> {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: CallArguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        let Platform { io, state, .. } = self;
        let RobotContext { context, news, memory, refusal, seen, .. } = &mut **state;
        let Some((function, effect)) = context.function(function) else {
            return Err(RobotFault::Refused(Refusal::NotBuiltIn));
        };
        if let Err(fault) = accepting(&[function], &arguments) {
            *refusal = Some(accepted_lists(&[function]));
            if let Some(seen) = seen {
                seen.call(&function.name, || pieces(&arguments), CallResult::Refused(fault));
            }
            return Err(fault);
        }
        let number = |index| match arguments.item(index) {
            Argument::Int(value) => value as f32,
            Argument::Float(value) => value,
            _ => 0.0,
        };
        let count = arguments.count();
        let (mut few, mut many) = ([0.0; 4], Vec::new());
        let numbers = if let Some(few) = few.get_mut(..count) {
            few.iter_mut().enumerate().for_each(|(index, value)| *value = number(index));
            &*few
        } else {
            many.extend((0..count).map(number));
            &*many
        };
        let numbers = CallNumbers(numbers);
        let lines = memory.logged.len();
        let pieces = &|| pieces(&arguments);
        let done = effect(&mut RobotCall { io, memory, numbers, again, pieces });
        if memory.logged.len() > lines {
            news.note();
        }
        let reply = match done {
            Done::Nil => Ok(Reply::Value(Value::nil())),
            Done::Int(value) => Ok(Reply::Value(Value::int(value))),
            Done::Float(value) => Ok(Reply::Value(Value::float(value))),
            Done::Wait => Ok(Reply::Wait),
            Done::Idle => Ok(Reply::Value(idle_result(function))),
            Done::OutOfRange => Err(RobotFault::Refused(Refusal::OutOfRange)),
        };
        if let Some(seen) = seen {
            seen.log(&memory.logged[lines..]);
            // A function that waits is called in every run. Only its first and its last call are
            // recorded. No script calls those that read values.
            let goes_on = again && done == Done::Wait;
            if !goes_on && !function.is_reader() {
                seen.call(&function.name, pieces, result_of(&reply));
            }
        }
        reply
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: CallArguments<'_, P, C, SLOTS>) {
        let (tick, program) = (self.io.now, self.state.context.program);
        let line = LogLine { tick, program, pieces: pieces(&arguments), kind: LineKind::Logged };
        match &mut self.state.asked {
            Some(lines) => lines.push(line),
            None => self.state.log(line),
        }
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        let now = self.io.clock.time_us(self.io.now) / 1000;
        let awake = &mut self.state.awake;
        if !again {
            // A negative time is over at once.
            *awake = now + u64::from(ms.max(0).unsigned_abs());
        }
        *awake <= now
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        let pose = self.io.sensors.estimate()?;
        Some(match axis {
            Axis::X => pose.x,
            Axis::Y => pose.y,
            Axis::Z => pose.z,
            Axis::Orientation => pose.heading.to_degrees(),
        })
    }

    fn periods(&self) -> Periods {
        self.state.context.periods
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        if !*self.has_mail {
            return None;
        }
        let Some((length, received)) = self.inbox.pop(frame) else {
            *self.has_mail = self.inbox.is_assembling();
            return None;
        };
        let GroupContext { ids, neighbor_unit_mm, .. } = &*self.state.context;
        // An adversary has no id for scripts.
        let sender = received.robot.and_then(|robot| ids.get(usize::from(robot.0)));
        let place = received.place().map(|[distance_mm, azimuth, elevation]| {
            [distance_mm / neighbor_unit_mm, azimuth, elevation].map(Value::float)
        });
        *sighting = Sighting { robot: sender.copied(), place };
        Some(length)
    }

    fn receive_content(&mut self, content: &mut [u8]) -> usize {
        self.inbox.take_content(content)
    }

    fn send_content(&mut self, robot: u16, content: &[u8]) -> bool {
        *self.has_unsent = true;
        let dropped = self.outbox.dropped();
        let is_sent = self.outbox.push_content(robot, content);
        if let Some(seen) = self.state.seen_frames()
            && self.outbox.dropped() != dropped
        {
            let (content, number) = (content.get(..1).unwrap_or(&[]), 0);
            let first = Fragment { robot, number, index: 0, last: false, content };
            seen.events.push(SeenEvent::Unsent([&first.head(), content].concat()));
        }
        is_sent
    }

    fn send(&mut self, frame: &[u8]) {
        *self.has_unsent = true;
        match self.state.seen_frames() {
            None => self.outbox.push(frame),
            Some(seen) => send_observed(self.outbox, seen, frame),
        }
    }

    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        fault: &Fault,
        calls: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        let Platform { io, state, .. } = self;
        if state.context.on_fault == OnFault::Stop {
            return false;
        }
        // The robot has called a listener and no entry of the script. A listener that is not a
        // function has no position.
        let memory = state.memory_after(fault, calls.machine());
        let is_further = state.keeps_fault_of(io.now);
        let content = if is_further { None } else { state.content_after(calls.machine()) };
        let mut record = state.record(io.now, *fault, calls.collect(), None);
        record.memory = memory;
        state.add_fault(record, content);
        true
    }
}
