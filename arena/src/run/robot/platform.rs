//! The machine's view of the robot: frames, position, time, calls.

use bittybuzz_comms::queue::{Inbox, Outbox};
use bittybuzz_robot_spec::OnFault;
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Calls, Fault, Host, Item, Periods, Reply, RobotFault, Sighting,
    Value,
};

use crate::engine::{self, Io};

use super::log::{LogLine, Piece};
use super::{State, call};

/// The body of a robot during a tick, and what it is doing.
pub struct Deck<'a, 'io, 'p> {
    pub io: &'a mut Io<'io>,
    pub state: &'a mut State<'p>,
}

/// A robot during a tick. Frames wait in queues like the real robots'.
pub struct Platform<'a, 'io, 'p, P: Profile, const FRAME: usize, const IN: usize, const OUT: usize>
{
    pub deck: Deck<'a, 'io, 'p>,
    pub inbox: &'a mut Inbox<P, engine::Sighting, FRAME, IN>,
    pub outbox: &'a mut Outbox<P, FRAME, OUT>,
    /// A frame may be in the inbox.
    pub has_mail: &'a mut bool,
    /// A frame is in the outbox.
    pub has_unsent: &'a mut bool,
}

impl Deck<'_, '_, '_> {
    /// Milliseconds since the world began.
    pub fn milliseconds(&self) -> u64 {
        self.io.milliseconds()
    }

    /// Keeps what was logged, and tells the run that there is something.
    pub fn write<P: Profile, C: ByteCode, const SLOTS: usize>(
        &mut self,
        mut pieces: Vec<Piece>,
        arguments: &Arguments<'_, P, C, SLOTS>,
    ) {
        pieces.extend((0..arguments.count()).map(|index| match arguments.item(index) {
            Item::Nil => Piece::Nil,
            Item::Int(value) => Piece::Int(value),
            Item::Float(value) => Piece::Float(value),
            Item::String(text) => match text.number() {
                Some(number) => Piece::Constant(number),
                None => Piece::Text(text.bytes().collect()),
            },
            Item::Table(size) => Piece::Table(size),
            Item::Function => Piece::Function,
        }));
        self.state.logged.push(LogLine { tick: self.io.now, pieces });
        self.state.cast.note();
    }
}

impl<P: Profile, const FRAME: usize, const IN: usize, const OUT: usize> Host<P>
    for Platform<'_, '_, '_, P, FRAME, IN, OUT>
{
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        call::call(&mut self.deck, function, &arguments, again)
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: Arguments<'_, P, C, SLOTS>) {
        self.deck.write(Vec::new(), &arguments);
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        let now = self.deck.milliseconds();
        let awake = &mut self.deck.state.awake;
        if !again {
            *awake = now + u64::try_from(ms).unwrap_or(0);
        }
        *awake <= now
    }

    fn position(&mut self, axis: Axis) -> Option<f32> {
        let pose = self.deck.io.sensors.estimate()?;
        Some(match axis {
            Axis::X => pose.x,
            Axis::Y => pose.y,
            Axis::Z => pose.z,
            Axis::Orientation => pose.heading.to_degrees(),
        })
    }

    fn periods(&self) -> Periods {
        self.deck.state.cast.periods
    }

    fn receive(&mut self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        if !*self.has_mail {
            return None;
        }
        let Some((bytes, heard)) = self.inbox.pop() else {
            *self.has_mail = false;
            return None;
        };
        let length = bytes.len().min(frame.len());
        frame[..length].copy_from_slice(&bytes[..length]);
        let ids = self.deck.state.cast.ids;
        let sender = heard.robot.and_then(|robot| ids.get(usize::from(robot.0)));
        let place = heard.place.map(|place| place.map(Value::float));
        *sighting = Sighting { robot: sender.copied(), place };
        Some(length)
    }

    fn send(&mut self, frame: &[u8]) {
        self.outbox.push(frame);
        *self.has_unsent = true;
    }

    fn contain<C: ByteCode, const SLOTS: usize>(
        &mut self,
        fault: &Fault,
        calls: Calls<'_, P, C, SLOTS>,
    ) -> bool {
        let Deck { io, state } = &mut self.deck;
        if state.cast.on_fault == OnFault::Stop {
            return false;
        }
        // A listener that is no function has no position: the robot has called the script, no entry of it.
        let record = state.record(io.now, *fault, calls.collect(), None);
        state.faults().contain(record);
        true
    }
}
