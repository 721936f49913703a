//! Messages: those that came are handled before a step, what is to be sent goes out when an entry ends.
//!
//! A step begins with a frame of its own, in which [`Vm::next_message`] takes one message after the other from the host;
//! listeners and handlers of conflicts are called from there. When none is left, `step()` takes the frame's place.

use super::{Flow, Native, Vm};
use crate::builtin::{self, Feature, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::image::{Entry as EntryOf, EntryPoint};
use crate::message::{self, Ignored, Message, Script, Swarms};
use crate::network::{Buffer, Counters, Entry, NEWS, Network, Sighting};
use crate::number::Profile;
use crate::value::{Tag, Value};

// Locals of the frame.
/// How many messages this step may still take.
const LEFT: isize = 1;
/// What was called: nil, or the stigmergy of a conflict.
const CONFLICT: isize = 2;
/// Of the conflict: key, and the halves of the clock.
const KEY: isize = 3;
const CLOCK_LOW: isize = 4;
const CLOCK_HIGH: isize = 5;
/// The robot's own value that lost the conflict.
pub(super) const LOST: isize = 6;
/// How many locals there are.
const LOCALS: usize = 6;

/// Most messages that a step takes, so that a flood cannot hold it up for ever.
const MOST: i32 = 32;

/// The shortest time between two advertisements, in steps.
const SHORTEST_INTERVAL: u8 = 2;

impl<P: Profile, C: ByteCode, const SLOTS: usize, N: Network<P>> Vm<P, C, SLOTS, N> {
    /// Whether the script has anything to do with other robots.
    #[inline(always)]
    pub(super) fn is_social(&self) -> bool {
        N::FEATURES != 0
            && self.program.as_ref().is_some_and(|p| p.header().features() & N::FEATURES != 0)
    }

    /// What was heard but could not be used.
    pub fn counters(&mut self) -> Counters {
        self.network.protocol().map_or(Counters::default(), |protocol| protocol.counters)
    }

    pub(super) fn count(&mut self, which: impl Fn(&mut Counters) -> &mut u16) {
        if let Some(protocol) = self.network.protocol() {
            let counter = which(&mut protocol.counters);
            *counter = counter.saturating_add(1);
        }
    }

    /// Begins a step: messages first.
    pub(super) fn begin_messages(&mut self) -> Result<(), Stopped> {
        let base = usize::from(self.sp);
        self.ensure(base + 1 + super::NATIVE_ROOM)?;
        self.push(super::record(0, Native::EXIT.position()));
        self.push(Value::int(MOST));
        self.reserve(LOCALS - 1)?;
        self.pc = Native::MESSAGES.position() as u16;
        self.age_neighbors();
        Ok(())
    }

    /// Handles the next message, or begins `step()` if there is none.
    #[inline(never)]
    pub(super) fn next_message<H: Host<P>>(&mut self, host: &mut H) -> Result<Flow, Stopped> {
        let base = usize::from(self.fp);
        let free = base + 1 + LOCALS;
        let conflict = self.local(CONFLICT);
        if !conflict.is_nil() {
            // The handler's result is on top.
            self.set_local(CONFLICT, Value::nil());
            let [c0, c1] = (self.local(CLOCK_LOW).index() as u16).to_le_bytes();
            let [c2, _] = (self.local(CLOCK_HIGH).index() as u16).to_le_bytes();
            let clock = u32::from_le_bytes([c0, c1, c2, 0]);
            let verdict = self.top(1);
            let key = self.local(KEY);
            if self.settle(host, verdict, conflict.index() as u8, key, clock)? {
                return Ok(Flow::Continue);
            }
        }
        self.sp = free as u16;
        let left = self.local(LEFT).as_int().unwrap_or(0);
        let mut frame = N::Frame::ZERO;
        let received = if left > 0 { host.receive(frame.as_mut()) } else { None };
        let Some((length, sighting)) = received else {
            self.keep_in_touch(host)?;
            self.sp = base as u16 + 1;
            let callee = self.step_function();
            self.push(callee);
            self.pc = Native::START.position() as u16;
            return Ok(Flow::Continue);
        };
        self.set_local(LEFT, Value::int(left - 1));
        let frame = frame.as_ref().get(..length).unwrap_or(&[]);
        self.handle(host, frame, &sighting)?;
        Ok(Flow::Continue)
    }

    fn step_function(&self) -> Value<P> {
        match self.program.as_ref().map(|program| program.header().entry(EntryOf::Step)) {
            Some(EntryPoint::Function(number)) => Value::indexed(Tag::FUNCTION, number),
            Some(EntryPoint::Global(number)) => {
                self.arena.get(super::GLOBALS + usize::from(number))
            }
            _ => Value::nil(),
        }
    }

    pub(super) fn script(&self) -> Script {
        self.program.as_ref().map_or(Script { hash: 0, strings: 0 }, |program| {
            let header = program.header();
            Script { hash: header.hash(), strings: string::COUNT + header.strings() }
        })
    }

    fn handle<H: Host<P>>(
        &mut self,
        host: &mut H,
        frame: &[u8],
        sighting: &Sighting<P>,
    ) -> Result<(), Stopped> {
        let message = match Message::decode(frame, self.script()) {
            Ok(message) => message,
            Err(Ignored::Foreign) => {
                self.count(|counters| &mut counters.foreign);
                return Ok(());
            }
            Err(Ignored::Malformed) => {
                self.count(|counters| &mut counters.malformed);
                return Ok(());
            }
        };
        let in_frame = match &message {
            Message::Broadcast { robot, .. }
            | Message::Beacon { robot }
            | Message::Swarms { robot, .. } => Some(*robot),
            Message::Fragment(fragment) => Some(fragment.robot),
            Message::Entry(_) => None,
        };
        if let Some(robot) = in_frame.or(sighting.robot) {
            if robot == self.robot_id {
                self.count(|counters| &mut counters.own_id);
                return Ok(());
            }
            self.hear(robot, sighting, host.periods().forget);
        }
        match message {
            Message::Broadcast { robot, topic, value } => {
                self.tell_listener(host, Value::string(topic), value, robot)
            }
            Message::Entry(entry) => self.merge(host, &entry).map(|_| ()),
            Message::Swarms { robot, swarms } => {
                self.note_swarms(robot, &swarms);
                Ok(())
            }
            Message::Fragment(fragment) => self.assemble(host, &fragment),
            Message::Beacon { .. } => Ok(()),
        }
    }

    /// Calls the listener of a topic: f(topic, value, robot). The value is on the stack, if it is on the heap.
    pub(super) fn tell_listener<H: Host<P>>(
        &mut self,
        host: &mut H,
        topic: Value<P>,
        value: Value<P>,
        robot: u16,
    ) -> Result<(), Stopped> {
        let listener = self.handler(topic);
        if listener.is_nil() {
            return Ok(());
        }
        self.push(topic);
        self.push(value);
        self.push(Value::int(i32::from(robot)));
        self.call(host, listener, 3, 0)
    }

    /// Remembers what the next call of [`Vm::next_message`] needs to end a conflict.
    pub(super) fn begin_conflict(&mut self, local: &Entry<P>, remote: &message::Entry<P>) {
        let [c0, c1, c2, _] = remote.clock.to_le_bytes();
        self.set_local(CONFLICT, Value::indexed(Tag::INT, u16::from((local.state & !NEWS) - 1)));
        self.set_local(KEY, local.key);
        self.set_local(CLOCK_LOW, Value::indexed(Tag::INT, u16::from_le_bytes([c0, c1])));
        self.set_local(CLOCK_HIGH, Value::indexed(Tag::INT, u16::from(c2)));
    }

    fn note_swarms(&mut self, robot: u16, swarms: &Swarms) {
        for (number, is_member) in swarms.iter() {
            let place = self.network.swarms().iter().position(|s| s.exists() && s.number == number);
            let Some(place) = place else { continue };
            for neighbor in self.network.neighbors() {
                if neighbor.steps_left != 0 && neighbor.robot == robot {
                    let bit = 1 << place;
                    neighbor.swarms =
                        if is_member { neighbor.swarms | bit } else { neighbor.swarms & !bit };
                }
            }
        }
    }

    /// `neighbors.broadcast`, `listen` and `ignore`.
    pub(super) fn talk<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        topic: Value<P>,
        b: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        if topic.is(Tag::UNSET) || b.is(Tag::UNSET) && number != builtin::NEIGHBORS_IGNORE {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        if !matches!(topic.tag(), Tag::STRING | Tag::TEXT) {
            return Err(self.wrong_type(topic, topic));
        }
        match number {
            builtin::NEIGHBORS_LISTEN => self.set_handler(topic, b)?,
            builtin::NEIGHBORS_IGNORE => self.set_handler(topic, Value::nil())?,
            _ => {
                let robot = self.robot_id;
                let is_plain = topic.is(Tag::STRING) && b.is_plain();
                let topic_number = topic.index() as u16;
                if is_plain {
                    let message = Message::Broadcast { robot, topic: topic_number, value: b };
                    self.send(host, &message);
                } else {
                    self.broadcast_long(host, topic, b)?;
                }
            }
        }
        Ok(Value::nil())
    }

    /// Sends a message that fits a frame. False if it does not.
    pub(super) fn send<H: Host<P>>(&mut self, host: &mut H, message: &Message<'_, P>) -> bool {
        let mut frame = N::Frame::ZERO;
        let Some(length) = message.encode(self.script(), frame.as_mut()) else { return false };
        host.send(frame.as_ref().get(..length).unwrap_or(&[]));
        if !matches!(message, Message::Entry(_))
            && let Some(protocol) = self.network.protocol()
        {
            protocol.silent = 0;
        }
        true
    }

    /// Sends an entry of a stigmergy, in fragments if need be.
    pub(super) fn send_entry<H: Host<P>>(
        &mut self,
        host: &mut H,
        entry: &Entry<P>,
    ) -> Result<(), Stopped> {
        let place = usize::from((entry.state & !NEWS).wrapping_sub(1));
        let stigmergy = self.network.stigmergies().get(place).copied().unwrap_or(0);
        let Entry { key, value, clock, robot, .. } = *entry;
        let entry = message::Entry { stigmergy, owner: robot, clock, key, value };
        self.send_in_any_form(host, &entry)
    }

    fn send_in_any_form<H: Host<P>>(
        &mut self,
        host: &mut H,
        entry: &message::Entry<P>,
    ) -> Result<(), Stopped> {
        if self.send(host, &Message::Entry(*entry)) {
            return Ok(());
        }
        self.send_long_entry(host, entry)
    }

    /// An entry that finds no place here goes to the neighbours.
    pub(super) fn pass_on<H: Host<P>>(
        &mut self,
        host: &mut H,
        entry: &message::Entry<P>,
    ) -> Result<(), Stopped> {
        self.count(|counters| &mut counters.not_kept);
        let [low, high, ..] = entry.clock.to_le_bytes();
        let clock = u16::from_le_bytes([low, high]);
        let digest = entry.owner ^ clock ^ (entry.key.index() as u16).wrapping_mul(3);
        let Some(protocol) = self.network.protocol() else { return Ok(()) };
        if protocol.passed_on == digest {
            return Ok(());
        }
        protocol.passed_on = digest;
        self.send_in_any_form(host, entry)
    }

    /// Something changed, or a neighbour is behind: entries are advertised more often for a while.
    pub(super) fn hurry(&mut self) {
        if let Some(protocol) = self.network.protocol() {
            protocol.interval = SHORTEST_INTERVAL;
            protocol.countdown = protocol.countdown.min(SHORTEST_INTERVAL);
        }
    }

    /// Sends what has changed in the entry that ends.
    #[inline(never)]
    pub(super) fn send_news<H: Host<P>>(&mut self, host: &mut H) -> Result<(), Stopped> {
        for place in 0..self.network.entries().len() {
            let Some(entry) = self.network.entries_mut().get_mut(place) else { break };
            if entry.state & NEWS != 0 {
                entry.state &= !NEWS;
                let entry = *entry;
                self.send_entry(host, &entry)?;
            }
        }
        let mut swarms = Swarms::default();
        for swarm in self.network.swarms_mut() {
            if swarm.state & NEWS != 0 && swarms.count() < Swarms::capacity::<P>() {
                swarm.state &= !NEWS;
                swarms.push(swarm.number, swarm.has_member());
            }
        }
        self.send_swarms(host, swarms);
        Ok(())
    }

    fn send_swarms<H: Host<P>>(&mut self, host: &mut H, swarms: Swarms) {
        if swarms.count() != 0 {
            let robot = self.robot_id;
            self.send(host, &Message::Swarms { robot, swarms });
        }
    }

    /// What is due once a step: an advertisement, a beacon, the end of patience with a message.
    #[inline(never)]
    fn keep_in_touch<H: Host<P>>(&mut self, host: &mut H) -> Result<(), Stopped> {
        let periods = host.periods();
        let features = self.program.as_ref().map_or(0, |program| program.header().features());
        if let Some((assembly, _)) = self.network.assembly() {
            assembly.steps_left = assembly.steps_left.saturating_sub(1);
        }
        let Some(protocol) = self.network.protocol() else { return Ok(()) };
        protocol.silent = protocol.silent.saturating_add(1);
        if protocol.silent >= periods.beacon
            && features & (Feature::Neighbors as u8 | Feature::Swarm as u8) != 0
        {
            let robot = self.robot_id;
            self.send(host, &Message::Beacon { robot });
        }
        let Some(protocol) = self.network.protocol() else { return Ok(()) };
        protocol.countdown = protocol.countdown.saturating_sub(1);
        if protocol.countdown != 0 {
            return Ok(());
        }
        // Where nothing changes, ever more seldom; and not all robots at once.
        let interval = protocol.interval.max(SHORTEST_INTERVAL);
        protocol.jitter = protocol.jitter.wrapping_mul(25173).wrapping_add(13849);
        let [_, random] = protocol.jitter.to_le_bytes();
        protocol.countdown = interval + (random & (interval >> 1));
        protocol.interval = (interval + (interval >> 2) + 1).min(periods.advertise);
        self.advertise(host)
    }

    /// Sends the next of all entries and swarms, in turn.
    fn advertise<H: Host<P>>(&mut self, host: &mut H) -> Result<(), Stopped> {
        let entries = self.network.entries().len();
        let all = entries + self.network.swarms().len();
        let Some(protocol) = self.network.protocol() else { return Ok(()) };
        let mut place = usize::from(protocol.advertised);
        for _ in 0..all {
            place += 1;
            if place >= all {
                place = 0;
            }
            if let Some(protocol) = self.network.protocol() {
                protocol.advertised = place as u8;
            }
            if let Some(entry) = self.network.entries().get(place).copied() {
                if entry.state != 0 {
                    return self.send_entry(host, &entry);
                }
            } else if let Some(swarm) = self.network.swarms().get(place.wrapping_sub(entries))
                && swarm.exists()
            {
                let mut swarms = Swarms::default();
                swarms.push(swarm.number, swarm.has_member());
                self.send_swarms(host, swarms);
                return Ok(());
            }
        }
        Ok(())
    }
}
