//! Messages: those that came are handled before a step, what is to be sent goes out when an entry ends.
//!
//! A step begins with a frame of its own, in which [`Vm::next_message`] takes one message after the other from the host;
//! listeners and handlers of conflicts are called from there. When none is left, `step()` takes the frame's place.

use super::swarms::NEWS;
use super::{Flow, Native, State, Vm};
use crate::builtin::{self, Feature, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::image::{Entry as EntryOf, EntryPoint};
use crate::message::{Entry, Ignored, Message, Script, Swarms};
use crate::network::{Buffer, Count, Counters, Sighting};
use crate::number::Profile;
use crate::value::{Tag, Value};

// Locals of the frame.
/// How many messages this step may still take.
const LEFT: isize = 1;
/// nil, or the conflict whose handler runs: its stigmergy, and the highest bits of its clock.
const CONFLICT: isize = 2;
/// The other bits of the clock.
const CLOCK: isize = 3;
/// Its key.
const KEY: isize = 4;
/// The robot's own value that lost the conflict.
pub(super) const LOST: isize = 5;
/// How many locals there are.
const LOCALS: usize = 5;

/// Most messages that a step takes, so that a flood cannot hold it up for ever.
const MOST: i32 = 32;

/// The shortest time between two advertisements, in steps.
const SHORTEST_INTERVAL: u8 = 2;
/// From here on entries take turns.
const LONG_INTERVAL: u8 = 10;

/// The parts that need messages.
pub(super) const SOCIAL: u8 =
    Feature::Neighbors as u8 | Feature::Swarm as u8 | Feature::Stigmergy as u8;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    fn features(&self) -> u8 {
        self.program.as_ref().map_or(0, |program| program.header().features())
    }

    /// What was heard but could not be used.
    pub fn counters(&self) -> Counters {
        let [foreign, malformed, own_id, not_kept, incomplete, undecided] = self.protocol.counters;
        Counters { foreign, malformed, own_id, not_kept, incomplete, undecided }
    }

    /// Begins a step: messages first. A fault is reported by the next run.
    #[inline(never)]
    pub(super) fn begin_messages(&mut self) {
        self.state = State::Running;
        let _ = self.enter_messages();
    }

    fn enter_messages(&mut self) -> Result<(), Stopped> {
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
        let base = self.fp;
        let conflict = self.local(CONFLICT);
        if !conflict.is_nil() {
            self.set_local(CONFLICT, Value::nil());
            let [low, high] = (self.local(CLOCK).index() as u16).to_le_bytes();
            let [stigmergy, highest] = (conflict.index() as u16).to_le_bytes();
            let clock = u32::from_le_bytes([low, high, highest, 0]);
            // The handler's result is on top.
            self.settle(host, self.top(1), stigmergy, self.local(KEY), clock)?;
            if self.fp != base {
                return Ok(Flow::Continue);
            }
        }
        self.sp = base + 1 + LOCALS as u16;
        let left = self.local(LEFT).index() as u16;
        let mut frame = P::Frame::ZERO;
        if left != 0
            && let Some((length, sighting)) = host.receive(frame.as_mut())
        {
            self.set_local(LEFT, Value::indexed(Tag::INT, left - 1));
            let frame = frame.as_ref().get(..length).unwrap_or(&[]);
            self.handle(host, frame, &sighting)?;
        } else {
            self.keep_in_touch(host)?;
            self.sp = base + 1;
            self.push(self.step_function());
            self.pc = Native::START.position() as u16;
        }
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

    #[inline(never)]
    fn handle<H: Host<P>>(
        &mut self,
        host: &mut H,
        frame: &[u8],
        sighting: &Sighting<P>,
    ) -> Result<(), Stopped> {
        let message = match Message::decode(frame, self.script()) {
            Ok(message) => message,
            Err(why) => {
                self.protocol.count(match why {
                    Ignored::Foreign => Count::Foreign,
                    Ignored::Malformed => Count::Malformed,
                });
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
                self.protocol.count(Count::OwnId);
                return Ok(());
            }
            self.hear(robot, sighting, host.periods().forget);
        }
        match message {
            Message::Broadcast { robot, topic, value } => {
                self.tell_listener(host, Value::string(topic), value, robot)
            }
            Message::Entry(entry) => self.merge(host, &entry),
            Message::Swarms { robot, swarms } => {
                for (number, is_member) in swarms.iter() {
                    let swarm = self.find_swarm(number);
                    if swarm < self.protocol.sizes.swarms {
                        self.note_swarm(robot, swarm, is_member);
                    }
                }
                Ok(())
            }
            Message::Fragment(fragment) => self.assemble(host, &fragment),
            Message::Beacon { .. } => Ok(()),
        }
    }

    /// Calls the listener of a topic: f(topic, value, robot). A value on the heap is on the stack, too.
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
        self.push(Value::indexed(Tag::INT, robot));
        self.call(host, listener, 3, 0)
    }

    /// Remembers what the next call of [`Vm::next_message`] needs to end a conflict.
    pub(super) fn begin_conflict(&mut self, stigmergy: u8, remote: &Entry<P>) {
        let [low, high, highest, _] = remote.clock.to_le_bytes();
        let conflict = u16::from_le_bytes([stigmergy, highest]);
        self.set_local(CONFLICT, Value::indexed(Tag::INT, conflict));
        self.set_local(CLOCK, Value::indexed(Tag::INT, u16::from_le_bytes([low, high])));
        self.set_local(KEY, remote.key);
    }

    /// `neighbors.broadcast`, `listen` and `ignore`.
    #[inline(never)]
    pub(super) fn talk<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        topic: Value<P>,
        b: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        let mut b = b;
        if number == builtin::NEIGHBORS_IGNORE {
            b = Value::nil();
        }
        if topic.is(Tag::UNSET) || b.is(Tag::UNSET) {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        if !matches!(topic.tag(), Tag::STRING | Tag::TEXT) {
            return Err(self.wrong_type(topic, topic));
        }
        if number != builtin::NEIGHBORS_BROADCAST {
            self.set_handler(topic, b)?;
        } else if topic.is(Tag::STRING) && b.is_plain() {
            let (robot, topic) = (self.robot_id, topic.index() as u16);
            self.send(host, &Message::Broadcast { robot, topic, value: b });
        } else {
            self.broadcast_long(host, topic, b)?;
        }
        Ok(Value::nil())
    }

    /// Sends a message that fits a frame. False if it does not.
    #[inline(never)]
    pub(super) fn send<H: Host<P>>(&mut self, host: &mut H, message: &Message<'_, P>) -> bool {
        let mut frame = P::Frame::ZERO;
        let Some(length) = message.encode(self.script(), frame.as_mut()) else { return false };
        host.send(frame.as_ref().get(..length).unwrap_or(&[]));
        if !matches!(message, Message::Entry(_)) {
            self.protocol.silent = 0;
        }
        true
    }

    /// Sends an entry of a stigmergy, in fragments if need be.
    #[inline(never)]
    pub(super) fn send_entry<H: Host<P>>(
        &mut self,
        host: &mut H,
        entry: &Entry<P>,
    ) -> Result<(), Stopped> {
        if self.send(host, &Message::Entry(*entry)) {
            return Ok(());
        }
        self.send_long_entry(host, entry)
    }

    /// An entry that finds no place here goes to the neighbours, once.
    pub(super) fn pass_on<H: Host<P>>(
        &mut self,
        host: &mut H,
        entry: &Entry<P>,
    ) -> Result<(), Stopped> {
        self.protocol.count(Count::NotKept);
        let [low, high, ..] = entry.clock.to_le_bytes();
        let clock = u16::from_le_bytes([low, high]);
        let digest = entry.owner ^ clock ^ (entry.key.index() as u16).wrapping_mul(3);
        if self.protocol.passed_on == digest {
            return Ok(());
        }
        self.protocol.passed_on = digest;
        self.send_entry(host, entry)
    }

    /// An entry has changed, or a neighbour is behind: for a while it is advertised often.
    pub(super) fn hurry(&mut self, at: usize) {
        self.protocol.newest = at as u16;
        self.protocol.interval = SHORTEST_INTERVAL;
        self.protocol.countdown = self.protocol.countdown.min(SHORTEST_INTERVAL);
    }

    /// Sends what has changed in the entry point that ends.
    #[inline(never)]
    pub(super) fn send_news<H: Host<P>>(&mut self, host: &mut H) -> Result<(), Stopped> {
        for place in 0..self.protocol.sizes.entries {
            let at = self.entry_slot(place);
            let state = self.entry_state(at);
            if state & NEWS != 0 {
                self.set_entry_state(at, state & !NEWS);
                self.send_entry(host, &self.entry_message(at))?;
            }
        }
        for place in 0..self.protocol.sizes.swarms {
            let at = self.swarm_slot(place);
            let swarm = self.arena.get(at);
            let state = swarm.tag().byte();
            if state & NEWS != 0 {
                self.arena.set(at, Value::marked(state & !NEWS, swarm.raw()));
                self.send_swarm(host, place);
            }
        }
        Ok(())
    }

    /// Tells whether the robot is in the swarm at that place.
    fn send_swarm<H: Host<P>>(&mut self, host: &mut H, place: u8) {
        let mut swarms = Swarms::default();
        let number = self.arena.index_at(self.swarm_slot(place)) as u16;
        swarms.push(number, self.is_member(place));
        let robot = self.robot_id;
        self.send(host, &Message::Swarms { robot, swarms });
    }

    /// What is due once a step: an advertisement, a beacon, the end of patience with a message.
    #[inline(never)]
    fn keep_in_touch<H: Host<P>>(&mut self, host: &mut H) -> Result<(), Stopped> {
        let periods = host.periods();
        let protocol = &mut self.protocol;
        protocol.assembly.steps_left = protocol.assembly.steps_left.saturating_sub(1);
        protocol.silent = protocol.silent.saturating_add(1);
        protocol.countdown = protocol.countdown.saturating_sub(1);
        let advertises = protocol.countdown == 0;
        if advertises {
            // Ever more seldom, and not all robots at once.
            let interval = protocol.interval.max(SHORTEST_INTERVAL);
            protocol.jitter = protocol.jitter.wrapping_mul(25173).wrapping_add(13849);
            let [_, random] = protocol.jitter.to_le_bytes();
            protocol.countdown = interval.wrapping_add(random & (interval >> 1));
            protocol.interval = (interval + (random & 1)).min(periods.advertise);
        }
        let is_silent = protocol.silent >= periods.beacon;
        if is_silent && self.features() & (Feature::Neighbors as u8 | Feature::Swarm as u8) != 0 {
            let robot = self.robot_id;
            self.send(host, &Message::Beacon { robot });
        }
        if advertises { self.advertise(host) } else { Ok(()) }
    }

    /// Sends the newest entry as long as not enough neighbours are known to have it; and the next of all entries and
    /// swarms, in turn, so that news about one do not keep the others back.
    fn advertise<H: Host<P>>(&mut self, host: &mut H) -> Result<(), Stopped> {
        let newest = usize::from(self.protocol.newest);
        let mut sent = 0;
        if newest != 0 && self.protocol.interval < LONG_INTERVAL && self.entry_state(newest) != 0 {
            self.send_entry(host, &self.entry_message(newest))?;
            sent = newest;
        }
        let entries = self.protocol.sizes.entries;
        let all = entries + self.protocol.sizes.swarms;
        for _ in 0..all {
            let mut place = self.protocol.advertised + 1;
            if place >= all {
                place = 0;
            }
            self.protocol.advertised = place;
            if place >= entries {
                let place = place - entries;
                if self.arena.get(self.swarm_slot(place)).tag() != Tag::NIL {
                    self.send_swarm(host, place);
                    break;
                }
            } else {
                let at = self.entry_slot(place);
                if self.entry_state(at) != 0 && at != sent {
                    return self.send_entry(host, &self.entry_message(at));
                }
            }
        }
        Ok(())
    }
}
