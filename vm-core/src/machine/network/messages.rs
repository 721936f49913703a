//! Messages: received messages are handled before a step, and changes are sent when an entry point
//! ends.
//!
//! A step begins with a frame of its own, in which [`Vm::next_message`] takes one message after the
//! other from the host and calls listeners and handlers of conflicts. When no message is left,
//! `step()` takes the frame's place.

use super::protocol::{Conflict, Count};
use crate::builtin::{self, Feature, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::image::{Entry as EntryOf, FORM_CLASSES};
use crate::machine::{GLOBALS, Native, Vm, VmState};
use crate::message::content::Head;
use crate::message::frame::Frame;
use crate::message::{
    FrameKind, Ignored, ScriptIdentity, StigmergyEntry, TOPIC_BYTES, Topics, topic_set,
};
use crate::network::{NetworkCounters, Sighting};
use crate::number::Profile;
use crate::part::Part;
use crate::stamp::Stamp;
use crate::value::{Tag, Value};

// Locals of the frame for messages. Those of a conflict are set while its handler runs.
/// The stigmergy of the conflict, and the highest bits of the clock.
const CONFLICT: i8 = 1;
/// The other bits of the clock.
const CLOCK: i8 = 2;
/// The key of the conflict.
const KEY: i8 = 3;
/// The value of this robot that lost the conflict.
pub(super) const LOST: i8 = 4;
/// The robot that put the other value, that value, and its digest. The default rule needs them if
/// the handler ends with a fault.
const THEIR_ROBOT: i8 = 5;
const THEIR_VALUE: i8 = 6;
const THEIR_DIGEST: i8 = 7;
/// The number of locals.
const LOCALS: usize = 7;

/// The most messages that a step handles, so that a flood of messages cannot delay it for ever.
const MESSAGES_MAX: u8 = 32;

/// The features of images that use the network.
pub(super) const NETWORK_FEATURES: u8 =
    Feature::Neighbors as u8 | Feature::Swarm as u8 | Feature::Stigmergy as u8;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the counters of messages that were received and not used.
    pub fn counters(&self) -> NetworkCounters {
        let [foreign, malformed, own_id, not_kept, incomplete, undecided, failed] =
            self.protocol.counters;
        NetworkCounters { foreign, malformed, own_id, not_kept, incomplete, undecided, failed }
    }

    /// Returns the topics to which the script does not listen. The queue of received frames may drop
    /// messages on them before others. A topic stays listened to until the script restarts.
    pub fn unwanted_topics(&self) -> Topics {
        !self.protocol.topics
    }

    /// Begins a step with the handling of messages. A fault is reported by the next run.
    #[one_copy]
    pub(in crate::machine) fn begin_messages(&mut self) {
        self.state = VmState::Running;
        let _ = self.enter_messages();
    }

    fn enter_messages(&mut self) -> Result<(), Stopped> {
        let base = usize::from(self.sp);
        self.ensure(base + 1 + crate::machine::NATIVE_ROOM)?;
        self.arena.set(base, crate::machine::record(0, Native::EXIT.position()));
        self.sp = (base + 1 + LOCALS) as u16;
        self.arena.fill(base + 1, self.sp.into());
        self.protocol.messages_left = MESSAGES_MAX;
        // Messages often come in the order in which their senders were first received, see
        // [`Vm::hear`].
        self.protocol.last_sender = 0;
        self.pc = Native::MESSAGES.position() as u16;
        if Self::has(Part::Neighbors) {
            self.age_neighbors();
        }
        Ok(())
    }

    /// Handles the next message, or begins `step()` if there is none.
    #[one_copy]
    pub(in crate::machine) fn next_message<H: Host<P>>(
        &mut self,
        host: &mut H,
    ) -> Result<(), Stopped> {
        let base = self.fp;
        self.protocol.in_message = true;
        if Self::has(Part::Conflicts) && self.protocol.conflict != Conflict::None {
            // A fault of the handler leaves the conflict to the default rule.
            let is_asked_again = self.end_conflict(host)?;
            self.protocol.conflict =
                if is_asked_again { Conflict::Exchanged } else { Conflict::None };
            if self.fp != base {
                return Ok(());
            }
        }
        self.drop_operands();
        let (mut frame, mut sighting) = (Frame::EMPTY, Sighting::default());
        if self.protocol.messages_left != 0
            && let Some(length) = host.receive(frame.bytes_mut(), &mut sighting)
        {
            self.protocol.messages_left -= 1;
            return self.handle(host, &mut frame, length, &sighting);
        }
        self.protocol.in_message = false;
        self.keep_in_touch(host);
        if self.protocol.is_resting {
            self.pc = Native::EXIT.position() as u16;
            return Ok(());
        }
        let point = self.header.entry(EntryOf::Step);
        if !self.enter_function(point, usize::from(base)) {
            self.sp = base + 1;
            self.push(self.entry_value(point));
            self.pc = Native::START.position() as u16;
        }
        Ok(())
    }

    /// Confines a fault to the message that was being handled, so that the script continues with
    /// the next message. Returns false if no message was being handled, or if the fault stops the
    /// script nevertheless.
    #[one_copy]
    pub(in crate::machine) fn contain<H: Host<P>>(&mut self, host: &mut H) -> bool {
        let VmState::Faulted(fault) = &self.state else { return false };
        if !self.protocol.in_message
            || fault.code == FaultCode::AssertFailed
            || !host.contain(fault, self.calls())
        {
            return false;
        }
        self.protocol.count(Count::Failed);
        if self.protocol.conflict != Conflict::None {
            self.protocol.conflict = Conflict::Failed;
        }
        // The frame in which messages are handled is the outermost one, directly above the globals.
        self.fp = (GLOBALS + usize::from(self.header.globals())) as u16;
        self.drop_operands();
        self.pc = Native::MESSAGES.position() as u16;
        self.state = VmState::Running;
        true
    }

    /// Ends a conflict whose handler has returned, with its result on top, or has failed. Returns
    /// true if the handler is called again.
    fn end_conflict<H: Host<P>>(&mut self, host: &mut H) -> Result<bool, Stopped> {
        let [low, high] = (self.local(CLOCK).index() as u16).to_le_bytes();
        let [stigmergy, highest] = (self.local(CONFLICT).index() as u16).to_le_bytes();
        let theirs = Stamp {
            clock: u32::from_le_bytes([low, high, highest, 0]),
            robot: self.local(THEIR_ROBOT).index() as u16,
            value: self.local(THEIR_VALUE),
            digest: self.local(THEIR_DIGEST).index() as u16,
        };
        self.settle(host, self.protocol.conflict, stigmergy, self.local(KEY), &theirs)
    }

    /// Removes all operands of the frame for messages.
    pub(super) fn drop_operands(&mut self) {
        self.sp = self.fp + 1 + LOCALS as u16;
    }

    pub(super) fn script(&self) -> ScriptIdentity {
        ScriptIdentity { hash: self.header.hash(), strings: string::COUNT + self.header.strings() }
    }

    #[hot]
    fn handle<H: Host<P>>(
        &mut self,
        host: &mut H,
        frame: &mut Frame<P>,
        length: usize,
        sighting: &Sighting<P>,
    ) -> Result<(), Stopped> {
        let kind = match frame.open(length, &self.script()) {
            Ok(kind) => kind,
            Err(why) => {
                self.protocol.count(match why {
                    Ignored::Foreign => Count::Foreign,
                    Ignored::Malformed => Count::Malformed,
                });
                return Ok(());
            }
        };
        let robot = frame.robot();
        let sender = if kind == FrameKind::Entry { sighting.robot } else { Some(robot) };
        if let Some(sender) = sender {
            if sender == self.robot_id {
                self.protocol.count(Count::OwnId);
                return Ok(());
            }
            if Self::has(Part::Neighbors) {
                self.hear(sender, sighting, host.periods().forget);
            }
        }
        let (topic, value) = match kind {
            FrameKind::Broadcast if Self::has(Part::Messages) => {
                let (topic, value) = frame.broadcast();
                (Value::string(topic), value)
            }
            FrameKind::Fragment if Self::has(Part::LongMessages) => {
                if !self.receive_long(host)? {
                    return Ok(());
                }
                // Topic and value stay on the stack below the arguments.
                (self.top(2), self.top(1))
            }
            FrameKind::Entry if Self::has(Part::Stigmergy) => {
                return self.merge(host, &mut frame.entry(), 0);
            }
            FrameKind::Beacon | FrameKind::Digest if Self::has(Part::Stigmergy) => {
                self.compare((kind == FrameKind::Digest).then(|| frame.digest()));
                return Ok(());
            }
            FrameKind::Swarms if Self::has(Part::Swarms) && Self::has(Part::Neighbors) => {
                for (number, is_member) in frame.swarms().iter() {
                    let swarm = self.find_swarm(number);
                    if swarm < self.sizes().swarms {
                        self.note_swarm(swarm, is_member);
                    }
                }
                return Ok(());
            }
            _ => return Ok(()),
        };
        let listener = self.registered(topic);
        if listener.is_nil() {
            return Ok(());
        }
        if !self.expects(topic, value) {
            return Ok(());
        }
        let top = usize::from(self.sp);
        self.arena.set_fast(top, topic);
        self.arena.set_fast(top + 1, value);
        self.arena.set_fast(top + 2, Value::indexed(Tag::INT, robot));
        self.sp = top as u16 + 3;
        self.call_back(host, listener, 3)
    }

    /// Returns true if the script may have sent a value of that class on that topic or under that
    /// key. Otherwise counts the message as malformed: no robot with this script sends it.
    #[hot]
    pub(super) fn expects(&mut self, name: Value<P>, value: Value<P>) -> bool {
        // Most values are numbers, and most scripts send numbers under all names.
        let takes_numbers = self.header.features() & Feature::Numbers as u8 != 0;
        if takes_numbers && value.is_number() || self.may_send(name, value) {
            return true;
        }
        self.protocol.count(Count::Malformed);
        false
    }

    /// Returns true if the script may send a value of that class on that topic or under that key.
    #[one_copy]
    pub(super) fn may_send(&self, name: Value<P>, value: Value<P>) -> bool {
        if self.header.form() & FORM_CLASSES == 0 {
            return true;
        }
        let Some(program) = self.program() else { return false };
        program.classes(name) >> value.class_bit() & 1 != 0
    }

    /// Stores the values with which the next call of [`Vm::next_message`] ends the conflict.
    pub(super) fn begin_conflict(&mut self, stigmergy: u8, key: Value<P>, theirs: &Stamp<P>) {
        let [low, high, highest, _] = theirs.clock.to_le_bytes();
        let conflict = u16::from_le_bytes([stigmergy, highest]);
        self.protocol.conflict = Conflict::Open;
        self.set_local(CONFLICT, Value::indexed(Tag::INT, conflict));
        self.set_local(CLOCK, Value::indexed(Tag::INT, u16::from_le_bytes([low, high])));
        self.set_local(KEY, key);
        self.set_local(THEIR_ROBOT, Value::indexed(Tag::INT, theirs.robot));
        self.set_local(THEIR_VALUE, theirs.value);
        self.set_local(THEIR_DIGEST, Value::indexed(Tag::INT, theirs.digest));
    }

    /// Executes `neighbors.broadcast`, `listen` or `ignore`.
    #[one_copy]
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
            // A topic that is ignored later stays one: the machine then ignores its messages.
            self.protocol.topics |= self.topic(topic);
        } else if topic.is(Tag::STRING) && b.is_plain() {
            let mut frame = Frame::EMPTY;
            if frame.put_broadcast(self.robot_id, topic.index() as u16, b).is_some() {
                self.send(host, &mut frame);
            }
        } else if Self::has(Part::LongMessages) {
            self.send_long(host, Head::Broadcast, topic, b)?;
        } else {
            return Err(self.fail_on(FaultCode::NotSendable, b, b));
        }
        Ok(Value::nil())
    }

    /// Returns the set of the topic, see [`Topics`].
    fn topic(&self, topic: Value<P>) -> Topics {
        if P::FULL && topic.is(Tag::TEXT) {
            let view = self.view();
            let text = view.text_bytes(topic).take(TOPIC_BYTES);
            return topic_set(text.fold(view.text_length(topic) as u8, u8::wrapping_add));
        }
        topic_set((topic.index() as u8).wrapping_add(self.header.hash() as u8))
    }

    /// Seals and sends an open frame.
    #[one_copy]
    pub(super) fn send<H: Host<P>>(&mut self, host: &mut H, frame: &mut Frame<P>) {
        let Some(length) = frame.seal(&self.script()) else { return };
        host.send(frame.bytes(length));
        self.protocol.silent = 0;
    }

    /// Sends an entry of a stigmergy, as a long message if it does not fit a frame. If there is no
    /// memory now to walk through its value, the entry is not sent until its next turn. Returns
    /// false if the host has no room for it.
    #[one_copy]
    pub(super) fn send_entry<H: Host<P>>(
        &mut self,
        host: &mut H,
        entry: &StigmergyEntry<P>,
        digest: u16,
    ) -> bool {
        let mut frame = Frame::EMPTY;
        if frame.put_entry(entry, digest).is_none() {
            // A machine without this part has no such entries: see `sendable`.
            if Self::has(Part::LongMessages) {
                let StigmergyEntry { stigmergy, owner, clock, key, value } = *entry;
                let (sp, state) = (self.sp, self.state);
                let head = Head::Entry { stigmergy, owner, clock, digest };
                return self.send_long(host, head, key, value).unwrap_or_else(|_| {
                    self.sp = sp;
                    self.state = state;
                    self.protocol.count(Count::Incomplete);
                    true
                });
            }
            return true;
        }
        // The frame does not name its sender, so it does not replace a beacon.
        let silent = self.protocol.silent;
        self.send(host, &mut frame);
        self.protocol.silent = silent;
        true
    }
}
