//! `stigmergy`: tables that all robots share, each in a replica of its own.
//!
//! The network loses, duplicates and delays messages; robots are switched off, and groups of them
//! are out of reach for minutes. Nevertheless a stigmergy must become equal on all robots, without
//! a coordinator and with room for a few entries only.
//!
//! # Last writer wins, in a total order
//! Each entry carries a stamp: clock, value and robot ([`crate::stamp`]). Of two entries for one
//! key the greater stamp wins, on every robot. Stamps are totally ordered, so merging is
//! idempotent, commutative and associative: replicas that have seen the same entries are equal,
//! in whatever order and however often these arrived. The clock is a Lamport clock, a serial
//! number of 22 bits that is one greater than the latest that the robot has seen; a script's
//! handler of conflicts only decides between entries of equal clocks.
//!
//! # Deletion
//! A deleted entry stays as an entry without a value, since a replica that missed the deletion
//! would bring the old value back. After all robots had time to receive the deletion
//! ([`FORGOTTEN`]), its place is free again.
//!
//! # Restarts
//! A robot that was switched off remembers no clock. Entries that it put before come back from the
//! others with later clocks than those of its new puts, and would win. The robot recognizes them by
//! its own id and puts its new value again, with a later clock. [`RECLAIMED_MAX`] bounds the number
//! of these puts, since two robots with the same id would repeat them for ever.
//!
//! # A full store
//! If the store is full, a put by the robot's own script is a fault, which the script can see. An
//! entry of another robot is not kept, but relayed at a low rate, so that this robot does not
//! separate the others.
//!
//! # Two numbers
//! Messages of the first three stigmergies fit one frame. So that a script may choose any numbers,
//! the image has a table of those that change places with 0, 1 and 2. All numbers here are those of
//! the messages, except for the argument of `stigmergy.create` and for numbers that are shown.
//!
//! The module [`super::advertise`] decides when and how entries are sent.

use core::cmp::Ordering;

use super::advertise::FORGOTTEN;
use super::messages::LOST;
use super::protocol::{Count, Timer};
use super::swarms::{NEWS, object, object_number};
use crate::builtin::{self, Library, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::machine::Vm;
use crate::message::StigmergyEntry;
use crate::network::ENTRY;
use crate::number::Profile;
use crate::part::Part;
use crate::stamp::{Stamp, is_earlier, next};
use crate::value::{Tag, Type, Value};

// Slots of an entry. `ROBOT` holds the robot that put the value, with 1 + the place of the
// stigmergy in place of a tag; it is nil if there is no entry. `CLOCK` holds the low bits of the
// clock, with the high ones and `OWN` in place of a tag. `DIGEST` holds the digest of key and
// value, or the age of a deleted entry.
const KEY: usize = 0;
const VALUE: usize = 1;
const ROBOT: usize = 2;
pub(super) const CLOCK: usize = 3;
const DIGEST: usize = 4;

/// The most entries from before a restart that a robot puts again. One more is allowed every 256
/// steps. Without this limit two robots with the same id would do so for ever.
const RECLAIMED_MAX: u8 = 16;

/// A bit next to the high bits of the clock: the robot has put the value itself since it was
/// switched on.
pub(super) const OWN: u8 = 0x40;

/// The tag of a stigmergy's number after a restart of the script, until the script creates the
/// stigmergy again.
const KEPT: Tag = Tag::NIL;

/// Numbers of libraries that no script has. With the stigmergy's number they are the keys of its
/// handlers, in the same table as the listeners.
pub(super) const ON_CONFLICT: u8 = 0xfe;
pub(super) const ON_CONFLICT_LOST: u8 = 0xfd;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the first slot of the entry at that place.
    #[one_copy]
    pub(super) fn entry_slot(&self, place: u8) -> usize {
        self.entries_at() + usize::from(place) * ENTRY
    }

    /// Returns the slot of the number of the stigmergy at that place.
    fn stigmergy_slot(&self, place: u8) -> usize {
        self.entry_slot(self.sizes().entries) + usize::from(place)
    }

    /// Returns the number in messages of the stigmergy at that place.
    pub(super) fn number_of_stigmergy(&self, place: u8) -> u16 {
        self.arena.index_at(self.stigmergy_slot(place)) as u16
    }

    /// Returns the stamp of an entry. The stamp of a deleted entry has digest 0.
    #[one_copy]
    pub(super) fn stamp(&self, at: usize) -> Stamp<P> {
        let clock = self.arena.get(at + CLOCK);
        let [low, high] = (clock.index() as u16).to_le_bytes();
        let value = self.arena.get(at + VALUE);
        let digest = if value.is_nil() { 0 } else { self.arena.index_at(at + DIGEST) as u16 };
        Stamp {
            clock: u32::from_le_bytes([low, high, clock.tag().byte() & !OWN, 0]),
            robot: self.arena.index_at(at + ROBOT) as u16,
            value,
            digest,
        }
    }

    /// Sets the stamp of an entry, which is then to be sent. `own` is [`OWN`] or 0.
    fn set_stamp(&mut self, at: usize, stigmergy: u8, stamp: &Stamp<P>, own: u8) {
        let [low, high, highest, _] = stamp.clock.to_le_bytes();
        let state = (stigmergy + 1) | NEWS;
        self.arena.set(at + VALUE, stamp.value);
        self.arena.set(at + ROBOT, Value::marked(state, P::raw_from_u16(stamp.robot)));
        let clock = Value::marked(highest | own, P::raw_from_u16(u16::from_le_bytes([low, high])));
        self.arena.set(at + CLOCK, clock);
        // For a deleted entry this slot is the age.
        let digest = if stamp.value.is_nil() { 0 } else { stamp.digest };
        self.arena.set(at + DIGEST, Value::indexed(Tag::INT, digest));
        self.protocol.has_dirty_entries = true;
        self.protocol.digest = 0;
        self.hurry(at);
    }

    /// Increases the age of all deleted entries by one. Entries that are old enough free their
    /// places.
    pub(super) fn forget_deleted(&mut self) {
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if self.entry_state(at) == 0 || !self.arena.get(at + VALUE).is_nil() {
                continue;
            }
            let age = self.arena.index_at(at + DIGEST) as u16 + 1;
            self.arena.set(at + DIGEST, Value::indexed(Tag::INT, age));
            if age >= FORGOTTEN {
                self.arena.fill(at, at + ENTRY);
                // There is room again for entries of others.
                self.protocol.has_dropped = false;
            }
        }
    }

    /// Forgets entries with keys or values on the heap, to make room. Neighbors send them again,
    /// since the digests differ.
    pub(in crate::machine) fn forget_entries_on_heap(&mut self) {
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if self.arena.get(at + KEY).is_heap() || self.arena.get(at + VALUE).is_heap() {
                self.arena.fill(at, at + ENTRY);
            }
        }
        self.protocol.digest = 0;
    }

    /// Returns the clock of a put after `clock`, and remembers it.
    #[one_copy]
    fn tick(&mut self, clock: u32) -> u32 {
        let clock = next(clock);
        self.note_clock(clock);
        clock
    }

    /// Remembers a clock if it is the latest one.
    #[one_copy]
    fn note_clock(&mut self, clock: u32) {
        if is_earlier(self.protocol.clock, clock) {
            self.protocol.clock = clock;
        }
    }

    /// Returns 1 + the place of the entry's stigmergy, with the bit [`NEWS`], or 0 if there is no
    /// entry.
    #[one_copy]
    pub(super) fn entry_state(&self, at: usize) -> u8 {
        self.arena.get(at + ROBOT).tag().byte()
    }

    /// Returns true if there is an entry of that stigmergy.
    fn is_of(&self, at: usize, stigmergy: u8) -> bool {
        self.entry_state(at) & !NEWS == stigmergy + 1
    }

    /// Sets the state of an entry, see [`Vm::entry_state`].
    pub(super) fn set_entry_state(&mut self, at: usize, state: u8) {
        let robot = self.arena.get(at + ROBOT).raw();
        self.arena.set(at + ROBOT, Value::marked(state, robot));
    }

    /// Returns an entry as it is sent, and its digest.
    #[one_copy]
    pub(super) fn entry_message(&self, at: usize) -> (StigmergyEntry<P>, u16) {
        let stamp = self.stamp(at);
        let place = (self.entry_state(at) & !NEWS).wrapping_sub(1);
        let entry = StigmergyEntry {
            stigmergy: self.number_of_stigmergy(place),
            owner: stamp.robot,
            clock: stamp.clock,
            key: self.arena.get(at + KEY),
            value: stamp.value,
        };
        (entry, stamp.digest)
    }

    /// Returns the number of a stigmergy in messages from its number in the script, or the other
    /// way round.
    #[one_copy]
    pub fn other_stigmergy_number(&self, number: u16) -> u16 {
        self.program().map_or(number, |program| program.other_stigmergy_number(number))
    }

    /// Returns the place of the stigmergy that this object stands for. Fails if it is no stigmergy.
    pub(super) fn need_stigmergy(&mut self, value: Value<P>) -> Result<u8, Stopped> {
        if value.is(Tag::LIBRARY) && value.index() as u8 == Library::StigmergyObject as u8 {
            return Ok(object_number(value));
        }
        Err(self.wrong_type(value, value))
    }

    /// Returns the number of a swarm or stigmergy.
    pub(in crate::machine) fn object_id(&self, value: Value<P>, member: u8) -> Value<P> {
        let place = object_number(value);
        let number = match member {
            builtin::SWARM_OBJECT_ID => self.arena.index_at(self.swarm_slot(place)) as u16,
            _ => self.other_stigmergy_number(self.number_of_stigmergy(place)),
        };
        Value::indexed(Tag::INT, number)
    }

    /// Returns the payload of a slot as an integer, whatever is in place of its tag.
    pub(super) fn number_at(&self, at: usize) -> Value<P> {
        Value::indexed(Tag::INT, self.arena.index_at(at) as u16)
    }

    /// Returns the place of the stigmergy of that number in messages, or the number of stigmergies
    /// if there is none.
    pub(super) fn find_stigmergy(&self, number: u16) -> u8 {
        let mut place = 0;
        while place < self.protocol.stigmergies && self.number_of_stigmergy(place) != number {
            place += 1;
        }
        place
    }

    /// Returns the first slot of an entry, 0 if there is none.
    #[one_copy]
    pub(super) fn find_entry(&self, stigmergy: u8, key: Value<P>) -> usize {
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if self.is_of(at, stigmergy) {
                let here = self.arena.get(at + KEY);
                if here.same(key) || self.arena.same_text(here, key) {
                    return at;
                }
            }
        }
        0
    }

    /// Prepares a new entry with that key, clock 0 and no value, and returns its first slot; 0 if
    /// there is no room. The place counts as free until the entry gets a stamp.
    fn new_entry(&mut self, key: Value<P>) -> usize {
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if self.entry_state(at) == 0 {
                self.arena.set(at + KEY, key);
                self.arena.set(at + VALUE, Value::nil());
                self.arena.set(at + CLOCK, Value::nil());
                return at;
            }
        }
        0
    }

    /// Pushes the key, a copy of the value, and the robot of the next entry. Slot `at` holds the
    /// position of the iteration. Returns false if there is no next entry.
    pub(super) fn next_entry(&mut self, stigmergy: u8, at: usize) -> Result<bool, Stopped> {
        let next = self.arena.get(at);
        let from = if next.is_nil() { 0 } else { next.index() as u8 };
        for place in from..self.sizes().entries {
            let entry = self.entry_slot(place);
            let value = self.arena.get(entry + VALUE);
            if self.is_of(entry, stigmergy) && !value.is_nil() {
                self.arena.set(at, Value::int(i32::from(place) + 1));
                self.push(self.arena.get(entry + KEY));
                let copy = self.copied(value)?;
                self.push(copy);
                self.push(self.number_at(entry + ROBOT));
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Computes a function of `stigmergy` or of a stigmergy, except those of kind `Calls`; `a` is
    /// the first argument.
    #[one_copy]
    pub(in crate::machine) fn stigmergy_builtin<H: Host<P>>(
        &mut self,
        host: &mut H,
        number: u8,
        count: u8,
        a: Value<P>,
    ) -> Result<Value<P>, Stopped> {
        if number == builtin::STIGMERGY_CREATE {
            let number = self.need_id(a)?;
            let stigmergy = self.create_stigmergy(self.other_stigmergy_number(number))?;
            return Ok(object(Library::StigmergyObject, stigmergy));
        }
        let stigmergy = self.need_stigmergy(a)?;
        let b = self.argument(1, count);
        match number {
            builtin::STIGMERGY_SIZE => {
                let mut size = 0;
                for place in 0..self.sizes().entries {
                    let at = self.entry_slot(place);
                    if self.is_of(at, stigmergy) && !self.arena.get(at + VALUE).is_nil() {
                        size += 1;
                    }
                }
                return Ok(Value::int(size));
            }
            builtin::STIGMERGY_ONCONFLICT if Self::has(Part::Conflicts) => {
                self.set_handler(handler(ON_CONFLICT, stigmergy), b)?;
                return Ok(Value::nil());
            }
            builtin::STIGMERGY_ONCONFLICTLOST if Self::has(Part::Conflicts) => {
                self.set_handler(handler(ON_CONFLICT_LOST, stigmergy), b)?;
                return Ok(Value::nil());
            }
            _ => {}
        }
        let key = self.key(a, b)?;
        let mut at = self.find_entry(stigmergy, key);
        if number == builtin::STIGMERGY_GET {
            if at != 0 {
                return self.copied(self.arena.get(at + VALUE));
            }
            // Ask the other robots for the entry.
            let stigmergy = self.number_of_stigmergy(stigmergy);
            let owner = self.robot_id;
            let question = StigmergyEntry { stigmergy, owner, clock: 0, key, value: Value::nil() };
            self.send_entry(host, &question, 0);
            return Ok(Value::nil());
        }
        let value = self.argument(2, count);
        if value.is(Tag::UNSET) {
            return Err(self.fail(FaultCode::MissingArgument));
        }
        if at == 0 && value.is_nil() {
            return Ok(value);
        }
        let (value, digest) = self.sendable(stigmergy, key, value)?;
        // A key that is new here may be a deleted entry that was forgotten here, but not yet
        // elsewhere. Its clock must exceed all others.
        let mut clock = self.protocol.clock;
        if at == 0 {
            at = self.new_entry(key);
            if at == 0 {
                return Err(self.fail(FaultCode::StoreFull));
            }
        } else {
            clock = self.stamp(at).clock;
        }
        clock = self.tick(clock);
        self.set_stamp(at, stigmergy, &Stamp { clock, robot: self.robot_id, value, digest }, OWN);
        Ok(Value::nil())
    }

    /// Returns the place of the stigmergy of that number in messages, and empties its replica.
    /// Creates the stigmergy if there is none.
    fn create_stigmergy(&mut self, number: u16) -> Result<u8, Stopped> {
        let stigmergy = self.find_stigmergy(number);
        if stigmergy == self.sizes().entries {
            return Err(self.fail(FaultCode::TooMany));
        }
        if stigmergy == self.protocol.stigmergies {
            self.protocol.stigmergies += 1;
            self.protocol.shares = true;
            // The first comparison is due at once.
            self.protocol.set_timer(Timer::Digest, 0);
            self.protocol.has_dropped = false;
        }
        let at = self.stigmergy_slot(stigmergy);
        // The entries that were kept over a restart are shared with the swarm, so only a second
        // call empties the replica.
        let is_kept = self.arena.get(at).tag() == KEPT;
        self.arena.set(at, Value::indexed(Tag::INT, number));
        if is_kept {
            return Ok(stigmergy);
        }
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if self.is_of(at, stigmergy) {
                self.arena.fill(at, at + ENTRY);
                self.protocol.has_dropped = false;
            }
        }
        self.protocol.digest = 0;
        Ok(stigmergy)
    }

    /// Keeps the stigmergies and their entries while the script starts again.
    pub(super) fn keep_stigmergies(&mut self) {
        for place in 0..self.protocol.stigmergies {
            let at = self.stigmergy_slot(place);
            self.arena.set(at, Value::indexed(KEPT, self.number_of_stigmergy(place)));
        }
    }

    /// Sets a listener or handler; nil removes it.
    #[one_copy]
    pub(super) fn set_handler(&mut self, key: Value<P>, function: Value<P>) -> Result<(), Stopped> {
        if !function.is_nil() && function.type_of() != Type::Closure {
            return Err(self.wrong_type(function, function));
        }
        let handlers = self.overlays()?;
        self.table_set(handlers, key, function)
    }

    /// Merges a received entry. If a handler has to decide, begins its call.
    #[one_copy]
    pub(super) fn merge<H: Host<P>>(
        &mut self,
        host: &mut H,
        remote: &StigmergyEntry<P>,
        digest: u16,
    ) -> Result<(), Stopped> {
        let StigmergyEntry { owner: robot, clock, key, value, .. } = *remote;
        let stigmergy = self.find_stigmergy(remote.stigmergy);
        if stigmergy == self.protocol.stigmergies {
            // The sender has entries that this robot's digest cannot cover.
            self.protocol.has_dropped |= clock != 0;
            return Ok(());
        }
        // An entry with clock 0 asks for the value and changes nothing.
        if clock != 0 && !self.expects(key, value) {
            return Ok(());
        }
        self.note_clock(clock);
        let theirs = Stamp { clock, robot, value, digest };
        let mut at = self.find_entry(stigmergy, key);
        if at == 0 {
            // The sender asks for an entry that this robot does not have.
            if clock == 0 {
                return Ok(());
            }
            at = self.new_entry(key);
            if at == 0 {
                self.relay(host, remote, digest);
                return Ok(());
            }
            // The deletion of a key that is unknown here has no effect.
            if value.is_nil() {
                return Ok(());
            }
        }
        let mut mine = self.stamp(at);
        // A robot that was switched off knows its earlier puts only from others. A put since then
        // is the later value, whatever its clock: OSPF treats a router's own announcements in the
        // same way (RFC 2328, 13.4).
        if robot == self.robot_id
            && self.arena.get(at + CLOCK).tag().byte() & OWN != 0
            && theirs.order(&mine) == Ordering::Greater
            && self.protocol.reclaimed < RECLAIMED_MAX
        {
            self.protocol.reclaimed += 1;
            mine.clock = self.tick(clock);
            self.set_stamp(at, stigmergy, &mine, OWN);
            return Ok(());
        }
        if Self::has(Part::Conflicts) && mine.clock == theirs.clock && mine.robot != theirs.robot {
            let decides = self.registered(handler(ON_CONFLICT, stigmergy));
            if !decides.is_nil() {
                self.begin_conflict(stigmergy, key, &theirs);
                self.push(key);
                self.push_stamp(&mine)?;
                self.push_stamp(&theirs)?;
                return self.call_back(host, decides, 3);
            }
        }
        self.take_greater(host, at, stigmergy, &theirs)
    }

    /// Ends a conflict by the default rule, which keeps the greater stamp. The entry may have
    /// changed before the handler failed.
    pub(super) fn settle_by_default<H: Host<P>>(
        &mut self,
        host: &mut H,
        stigmergy: u8,
        key: Value<P>,
        theirs: &Stamp<P>,
    ) -> Result<(), Stopped> {
        let at = self.find_entry(stigmergy, key);
        if at == 0 {
            return Ok(());
        }
        self.take_greater(host, at, stigmergy, theirs)
    }

    /// Keeps the greater one of an entry's stamp and a neighbor's. If `onconflictlost` has to run,
    /// begins its call.
    #[one_copy]
    fn take_greater<H: Host<P>>(
        &mut self,
        host: &mut H,
        at: usize,
        stigmergy: u8,
        theirs: &Stamp<P>,
    ) -> Result<(), Stopped> {
        let mine = self.stamp(at);
        match theirs.order(&mine) {
            Ordering::Greater => return self.adopt(host, at, stigmergy, theirs, &mine),
            // The neighbor has an older entry.
            Ordering::Less => self.answer(at),
            // The neighbor has this entry, so advertising is less urgent.
            Ordering::Equal => {
                if self.protocol.interval < host.periods().advertise {
                    self.protocol.interval += 1;
                }
            }
        }
        Ok(())
    }

    /// Replaces the stamp of an entry by the winner. If `onconflictlost` has to run, begins its
    /// call.
    #[one_copy]
    fn adopt<H: Host<P>>(
        &mut self,
        host: &mut H,
        at: usize,
        stigmergy: u8,
        winner: &Stamp<P>,
        mine: &Stamp<P>,
    ) -> Result<(), Stopped> {
        self.set_stamp(at, stigmergy, winner, 0);
        if Self::has(Part::Conflicts)
            && mine.clock == winner.clock
            && mine.robot == self.robot_id
            && mine.robot != winner.robot
        {
            // In this slot a collection finds the value.
            self.set_local(LOST, mine.value);
            return self.call_lost_handler(host, stigmergy, self.arena.get(at + KEY), mine);
        }
        Ok(())
    }

    /// Pushes a table of robot, data and timestamp.
    fn push_stamp(&mut self, stamp: &Stamp<P>) -> Result<(), Stopped> {
        let clock = stamp.clock.min(P::INT_MAX as u32) as i32;
        // A collection finds the value on the stack.
        let data = self.copied(stamp.value)?;
        self.push(data);
        let table = self.record(
            [string::ROBOT, string::DATA, string::TIMESTAMP],
            [Value::indexed(Tag::INT, stamp.robot), data, Value::int(clock)],
        )?;
        self.pop();
        self.push(table);
        Ok(())
    }

    /// Ends a conflict with the handler's result: stores and sends the winner. If `onconflictlost`
    /// has to run, begins its call.
    #[one_copy]
    pub(super) fn settle<H: Host<P>>(
        &mut self,
        host: &mut H,
        verdict: Value<P>,
        stigmergy: u8,
        key: Value<P>,
        clock: u32,
    ) -> Result<(), Stopped> {
        let mut robot = Value::nil();
        let mut data = Value::nil();
        if verdict.is(Tag::TABLE) {
            robot = self.arena.table_get(verdict.index(), Value::string(string::ROBOT));
            data = self.arena.table_get(verdict.index(), Value::string(string::DATA));
        }
        let at = self.find_entry(stigmergy, key);
        if !robot.is(Tag::INT) || at == 0 {
            self.protocol.count(Count::Undecided);
            return Ok(());
        }
        let mine = self.stamp(at);
        // The handler itself may have put another value.
        if mine.clock != clock {
            return Ok(());
        }
        let (value, digest) = self.sendable(stigmergy, key, data)?;
        let winner = Stamp { clock, robot: robot.index() as u16, value, digest };
        if winner.order(&mine) == Ordering::Equal {
            // The neighbor has an older entry.
            self.answer(at);
            return Ok(());
        }
        self.adopt(host, at, stigmergy, &winner, &mine)
    }

    /// Calls `onconflictlost`, if there is one, with the robot's own entry that lost.
    fn call_lost_handler<H: Host<P>>(
        &mut self,
        host: &mut H,
        stigmergy: u8,
        key: Value<P>,
        lost: &Stamp<P>,
    ) -> Result<(), Stopped> {
        let callback = self.registered(handler(ON_CONFLICT_LOST, stigmergy));
        if callback.is_nil() {
            return Ok(());
        }
        self.push(key);
        self.push_stamp(lost)?;
        self.call_back(host, callback, 2)
    }
}

/// Returns the key of a stigmergy's handler in the table of listeners.
fn handler<P: Profile>(library: u8, stigmergy: u8) -> Value<P> {
    Value::indexed(Tag::LIBRARY, u16::from_le_bytes([library, stigmergy]))
}
