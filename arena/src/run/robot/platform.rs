//! The machine's view of the robot: frames, position, time, calls.

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Host, Item, Periods, Reply, RobotFault, Sighting, Value,
};

use crate::engine::{Io, TICK_US};

use super::log::{LogLine, Piece};
use super::{State, call};

/// A robot during a tick.
pub struct Platform<'a, 'io, 'p> {
    pub io: &'a mut Io<'io>,
    /// Frames of this tick that were handed to the machine.
    pub heard: usize,
    pub state: &'a mut State<'p>,
}

impl Platform<'_, '_, '_> {
    /// Milliseconds since the world began.
    pub fn milliseconds(&self) -> u64 {
        self.io.now * u64::from(TICK_US / 1000)
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

impl<P: Profile> Host<P> for Platform<'_, '_, '_> {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        function: u16,
        arguments: Arguments<'_, P, C, SLOTS>,
        again: bool,
    ) -> Result<Reply<P>, RobotFault> {
        call::call(self, function, &arguments, again)
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, arguments: Arguments<'_, P, C, SLOTS>) {
        self.write(Vec::new(), &arguments);
    }

    fn delay_is_over(&mut self, ms: i32, again: bool) -> bool {
        let now = self.milliseconds();
        if !again {
            self.state.awake = now + u64::try_from(ms).unwrap_or(0);
        }
        self.state.awake <= now
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
        self.state.cast.periods
    }

    fn receive(&mut self, frame: &mut [u8]) -> Option<(usize, Sighting<P>)> {
        let heard = self.io.inbox.iter().nth(self.heard)?;
        self.heard += 1;
        let length = heard.bytes.len().min(frame.len());
        frame[..length].copy_from_slice(&heard.bytes[..length]);
        let ids = self.state.cast.ids;
        let sender = heard.sighting.robot.and_then(|robot| ids.get(usize::from(robot.0)));
        let place = heard.sighting.place.map(|place| place.map(Value::float));
        Some((length, Sighting { robot: sender.copied(), place }))
    }

    fn send(&mut self, frame: &[u8]) {
        if self.io.outbox.push(frame).is_err() {
            self.state.dropped += 1;
        }
    }
}
