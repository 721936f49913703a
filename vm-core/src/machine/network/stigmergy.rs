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
//! handler of conflicts only decides between entries of equal clocks. It may decide otherwise on
//! each robot, so its decisions are bounded: see [`Vm::settle`].
//!
//! # Deletion
//! A deleted entry stays as an entry without a value, since a replica that missed the deletion
//! would bring the old value back. After all robots had time to receive the deletion
//! ([`FORGOTTEN`]), another key may take its place. Until then it answers robots that were away.
//!
//! Of the deletions without a place a robot remembers the latest clock, the floor. A key that is
//! unknown here and has no later clock was deleted, or its put has not arrived for 64 s. It is not
//! taken, but deleted once more, unless the script deletes no such key. Robots with equal digests
//! know the same keys, so the floor of one is that of the other; a robot that may lack some
//! deletes none. The new deletion names the robot that has
//! put the entry: if that put has never reached another robot, this robot puts it again, with a
//! clock above the floor.
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
use super::protocol::{Conflict, Count, Flag, Timer};
use super::swarms::{NEWS, object, object_number};
use crate::builtin::{self, Library, string};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::machine::Vm;
use crate::message::StigmergyEntry;
use crate::network::{ENTRY, Places};
use crate::number::Profile;
use crate::number::wide::IS_WIDE;
use crate::part::Part;
use crate::slots::Slots;
use crate::stamp::{Stamp, is_earlier, next};
use crate::value::{Tag, Type, Value};

// Slots of an entry. `ROBOT` holds the robot that put the value, with 1 + the place of the
// stigmergy in place of a tag; it is nil if there is no entry. `CLOCK` holds the low bits of the
// clock, with the high ones and `OWN` in place of a tag. `DIGEST` holds the digest of key and
// value, or the age of a deleted entry, with the number of `CHOICES_MAX` in place of a tag.
pub(super) const KEY: usize = 0;
const VALUE: usize = 1;
const ROBOT: usize = 2;
pub(super) const CLOCK: usize = 3;
const DIGEST: usize = 4;

/// The most entries from before a restart that a robot puts again. One more is allowed every 256
/// steps. Without this limit two robots with the same id would do so for ever.
const RECLAIMED_MAX: u8 = 16;

/// Part of [`RECLAIMED_MAX`] that the put of a merged value takes. Merged values meet others at the
/// same clock, and a handler may merge these again for ever.
const MERGED: u8 = 4;

/// The most choices of a handler against the order of stamps for one key and clock. Then the order
/// decides: a handler may choose in circles, or otherwise on each robot.
const CHOICES_MAX: u8 = 100;

/// A bit next to the high bits of the clock: the robot has put the value itself since it was
/// switched on.
pub(super) const OWN: u8 = 0x40;

/// Another bit there, of machines with many entries: a neighbor has sent the entry as it is here, so
/// the robot need not advertise it in this round.
const HEARD: u8 = if IS_WIDE { 0x80 } else { 0 };

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
    pub(super) fn entry_slot(&self, place: Places) -> usize {
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
            clock: u32::from_le_bytes([low, high, clock.tag().byte() & !(OWN | HEARD), 0]),
            robot: self.arena.index_at(at + ROBOT) as u16,
            value,
            digest,
        }
    }

    /// Sets the stamp of an entry, which is then to be sent. `own` is [`OWN`] or 0.
    fn set_stamp(&mut self, at: usize, stigmergy: u8, stamp: &Stamp<P>, own: u8) {
        if self.sizes().have_index() && self.entry_state(at) == 0 {
            self.link_entry(at, stigmergy);
        }
        self.subtract_entry(at);
        let [low, high, highest, _] = stamp.clock.to_le_bytes();
        let clock = u16::from_le_bytes([low, high]);
        if self.arena.index_at(at + CLOCK) as u16 != clock {
            self.arena.set_tag(at + DIGEST, 0);
        }
        let state = (stigmergy + 1) | NEWS;
        self.arena.set(at + VALUE, stamp.value);
        self.arena.set(at + ROBOT, Value::marked(state, P::raw_from_u16(stamp.robot)));
        self.arena.set(at + CLOCK, Value::marked(highest | own, P::raw_from_u16(clock)));
        // For a deleted entry this slot is the age.
        let digest = if stamp.value.is_nil() { 0 } else { stamp.digest };
        self.arena.set_link(at + DIGEST, digest.into());
        self.add_entry(at);
        self.protocol.has_dirty_entries = true;
        // A later put takes the place of an unconfirmed one, and so does the put of another robot
        // on the same key.
        if own != 0 || usize::from(self.protocol.newest) == at {
            self.protocol.clear(Flag::Unheard);
        }
        self.hurry(at);
        if own != 0 {
            self.protocol.set(Flag::Unheard);
        }
    }

    /// Forgets an entry.
    fn free_entry(&mut self, at: usize) {
        if self.sizes().have_index() {
            self.unlink_entry(at);
        }
        self.subtract_entry(at);
        self.arena.fill(at, at + ENTRY);
    }

    /// Notes that a neighbor has sent an entry as it is here.
    #[hot]
    fn mark_heard(&mut self, at: usize) {
        if self.sizes().have_index() {
            let clock = self.arena.get(at + CLOCK);
            self.arena.set(at + CLOCK, Value::marked(clock.tag().byte() | HEARD, clock.raw()));
        }
    }

    /// Returns true if a neighbor has sent an entry as it is here since the last call.
    #[hot]
    pub(super) fn take_heard(&mut self, at: usize) -> bool {
        if !self.sizes().have_index() {
            return false;
        }
        let clock = self.arena.get(at + CLOCK);
        self.arena.set(at + CLOCK, Value::marked(clock.tag().byte() & !HEARD, clock.raw()));
        clock.tag().byte() & HEARD != 0
    }

    /// Returns true if there is an entry that is advertised: a value, or a deletion that is not old.
    #[one_copy]
    pub(super) fn is_shared(&self, at: usize) -> bool {
        self.entry_state(at) != 0
            && !(self.arena.get(at + VALUE).is_nil()
                && self.arena.index_at(at + DIGEST) as u16 >= FORGOTTEN)
    }

    /// Increases the age of all deleted entries by one. Entries that are old enough leave their
    /// places to others; a key on the heap takes too much memory to stay.
    pub(super) fn forget_deleted(&mut self) {
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if !self.arena.get(at + VALUE).is_nil() || !self.is_shared(at) {
                continue;
            }
            let age = self.arena.index_at(at + DIGEST) as u16 + 1;
            self.arena.set_link(at + DIGEST, age.into());
            if age >= FORGOTTEN {
                if self.arena.get(at + KEY).is_heap() {
                    self.forget_deletion(at);
                }
                // There is room again for entries of others.
                self.protocol.clear(Flag::Dropped);
            }
        }
    }

    /// Frees the place of an old deletion, if there is an entry, and remembers its clock.
    fn forget_deletion(&mut self, at: usize) {
        if self.entry_state(at) != 0 {
            let clock = self.stamp(at).clock;
            if is_earlier(self.protocol.floor, clock) {
                self.protocol.floor = clock;
            }
            self.free_entry(at);
        }
    }

    /// Forgets entries with keys or values on the heap, to make room. Neighbors send them again,
    /// since the digests differ.
    pub(in crate::machine) fn forget_entries_on_heap(&mut self) {
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if self.arena.get(at + KEY).is_heap() || self.arena.get(at + VALUE).is_heap() {
                self.free_entry(at);
                self.protocol.clear(Flag::Complete);
            }
        }
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
    pub(super) fn note_clock(&mut self, clock: u32) {
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
        if self.sizes().have_index() {
            return self.find_by_index(stigmergy, key);
        }
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if self.is_entry(at, stigmergy, key) {
                return at;
            }
        }
        0
    }

    /// Returns true if the entry of that stigmergy and key is there.
    #[hot]
    pub(super) fn is_entry(&self, at: usize, stigmergy: u8, key: Value<P>) -> bool {
        if !self.is_of(at, stigmergy) {
            return false;
        }
        let here = self.arena.get(at + KEY);
        here.same(key) || self.arena.same_text(here, key)
    }

    /// Returns the first slot of a free place, or else that of an old deletion; 0 if there is no
    /// room.
    fn find_room(&self) -> usize {
        let mut room = 0;
        for place in 0..self.sizes().entries {
            let at = self.entry_slot(place);
            if !self.is_shared(at) {
                room = at;
                if self.entry_state(at) == 0 {
                    break;
                }
            }
        }
        room
    }

    /// Prepares a new entry with that key, clock 0 and no value, in the place that
    /// [`Vm::find_room`] has found. The place counts as free until the entry gets a stamp.
    fn new_entry(&mut self, at: usize, key: Value<P>) {
        self.forget_deletion(at);
        self.arena.set(at + KEY, key);
        self.arena.set(at + VALUE, Value::nil());
        self.arena.set(at + CLOCK, Value::nil());
    }

    /// Pushes the key, a copy of the value, and the robot of the next entry. Slot `at` holds the
    /// position of the iteration. Returns false if there is no next entry.
    pub(super) fn next_entry(&mut self, stigmergy: u8, at: usize) -> Result<bool, Stopped> {
        let next = self.arena.get(at);
        let from = if next.is_nil() { 0 } else { next.index() as Places };
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
            at = self.find_room();
            if at == 0 {
                return Err(self.fail(FaultCode::StoreFull));
            }
            self.new_entry(at, key);
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
        if stigmergy == self.sizes().stigmergies() {
            return Err(self.fail(FaultCode::TooMany));
        }
        if stigmergy == self.protocol.stigmergies {
            self.protocol.stigmergies += 1;
            self.protocol.shares = true;
            // The first comparison is due at once.
            self.protocol.set_timer(Timer::Digest, 0);
            self.protocol.clear(Flag::Dropped);
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
                self.free_entry(at);
                self.protocol.clear(Flag::Dropped);
            }
        }
        self.protocol.clear(Flag::Complete);
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
        remote: &mut StigmergyEntry<P>,
        digest: u16,
    ) -> Result<(), Stopped> {
        self.end_absence();
        let StigmergyEntry { owner: robot, clock, key, value, .. } = *remote;
        let stigmergy = self.find_stigmergy(remote.stigmergy);
        if stigmergy == self.protocol.stigmergies {
            // The sender has entries that this robot's digest cannot cover.
            self.drop_entry(clock != 0);
            return Ok(());
        }
        // An entry with clock 0 asks for the value and changes nothing.
        if clock != 0 && !self.expects(key, value) {
            return Ok(());
        }
        self.note_clock(clock);
        let theirs = Stamp { clock, robot, value, digest };
        let mut at = self.find_entry(stigmergy, key);
        let is_new = at == 0;
        if is_new || !self.is_shared(at) {
            // The sender asks for an entry that this robot does not have.
            if clock == 0 {
                return Ok(());
            }
            let floor = if is_new { self.protocol.floor } else { self.stamp(at).clock };
            if !is_earlier(floor, clock) && !value.is_nil() && self.may_send(key, Value::nil()) {
                if !is_new || self.protocol.has(Flag::Complete) {
                    self.delete_again(host, remote, floor);
                    return Ok(());
                }
                if self.protocol.timer(Timer::Distrust) != 0 {
                    return Ok(());
                }
            }
        }
        if is_new {
            at = self.find_room();
            if at == 0 {
                self.relay(host, remote, digest);
                return Ok(());
            }
            // The deletion of a key that is unknown here has no effect.
            if value.is_nil() {
                return Ok(());
            }
            self.new_entry(at, key);
        }
        let mut mine = self.stamp(at);
        // A robot that was switched off knows its earlier puts only from others. A put since then
        // is the later value, whatever its clock: OSPF treats a router's own announcements in the
        // same way (RFC 2328, 13.4).
        if robot == self.robot_id
            && self.arena.get(at + CLOCK).tag().byte() & OWN != 0
            && theirs.order(&mine) == Ordering::Greater
            && (!value.is_nil() || self.is_unsettled(mine.clock))
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
                return self.ask(host, decides, key, &mine, &theirs);
            }
        }
        self.take_greater(host, at, stigmergy, &theirs)
    }

    /// Returns true if nobody may know a put of this robot with that clock.
    #[hot]
    fn is_unsettled(&self, clock: u32) -> bool {
        (clock as u16).wrapping_sub(self.protocol.settled).wrapping_sub(1) < 0x7fff
    }

    /// Answers an entry that was deleted before: sends its deletion, in the name of its robot, with
    /// a clock after `clock`. That robot puts the entry again if nobody else can have deleted it.
    fn delete_again<H: Host<P>>(
        &mut self,
        host: &mut H,
        entry: &mut StigmergyEntry<P>,
        clock: u32,
    ) {
        if self.may_answer() {
            entry.clock = next(clock);
            entry.value = Value::nil();
            self.send_entry(host, entry, 0);
        }
    }

    /// Calls the handler of conflicts.
    fn ask<H: Host<P>>(
        &mut self,
        host: &mut H,
        handler: Value<P>,
        key: Value<P>,
        local: &Stamp<P>,
        remote: &Stamp<P>,
    ) -> Result<(), Stopped> {
        self.push(key);
        self.push_stamp(local)?;
        self.push_stamp(remote)?;
        self.call_back(host, handler, 3)
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
                self.mark_heard(at);
                if usize::from(self.protocol.newest) == at {
                    self.protocol.clear(Flag::Unheard);
                }
                if self.protocol.interval < host.periods().advertise
                    && !self.protocol.has(Flag::Unheard)
                {
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
        self.mark_heard(at);
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

    /// Ends a conflict with the handler's result, which is on top: stores and sends the winner. If
    /// `onconflictlost` has to run, begins its call. Returns true if the handler is called again.
    ///
    /// A choice of the greater stamp is final, since robots without a handler choose it, too. The
    /// handler must make any other choice again with the entries exchanged, as the other robot's
    /// handler sees them: otherwise each robot would keep its own value, or take that of the other,
    /// for ever.
    #[one_copy]
    pub(super) fn settle<H: Host<P>>(
        &mut self,
        host: &mut H,
        conflict: Conflict,
        stigmergy: u8,
        key: Value<P>,
        theirs: &Stamp<P>,
    ) -> Result<bool, Stopped> {
        // The handler itself may have put another value.
        let at = self.find_entry(stigmergy, key);
        let mine = self.stamp(at);
        if at == 0 || mine.clock != theirs.clock {
            return Ok(false);
        }
        // The result says whether to take their entry (`Greater`) or to keep the own one (`Less`).
        let order = theirs.order(&mine);
        let mut winner = order;
        if conflict != Conflict::Failed {
            let Some(choice) = self.choice(stigmergy, key, at, theirs)? else { return Ok(false) };
            let choices = self.arena.slots.tag_at(at + DIGEST).byte();
            if choice != order && choice != Ordering::Equal && choices != CHOICES_MAX {
                if conflict == Conflict::Open {
                    let decides = self.registered(handler(ON_CONFLICT, stigmergy));
                    self.drop_operands();
                    self.ask(host, decides, key, theirs, &mine)?;
                    return Ok(true);
                }
                self.arena.set_tag(at + DIGEST, choices + 1);
                winner = choice;
            } else if choice != order || conflict == Conflict::Exchanged {
                self.protocol.count(Count::Undecided);
            }
        }
        if winner == Ordering::Greater {
            self.adopt(host, at, stigmergy, theirs, &mine)?;
        } else {
            // The neighbor has an older entry.
            self.answer(at);
        }
        Ok(false)
    }

    /// Returns the choice of the handler, whose result is on top: `Greater` for their entry, `Less`
    /// for the robot's own one, `Equal` for none. Puts a merged value, and returns `None` then.
    #[one_copy]
    fn choice(
        &mut self,
        stigmergy: u8,
        key: Value<P>,
        at: usize,
        theirs: &Stamp<P>,
    ) -> Result<Option<Ordering>, Stopped> {
        let verdict = self.top(1);
        if !verdict.is(Tag::TABLE) {
            return Ok(Some(Ordering::Equal));
        }
        let data = self.arena.table_get(verdict.index(), Value::string(string::DATA));
        let mine = self.stamp(at);
        let digest = self.digest_of(stigmergy, key, data)?;
        // A robot that has read a table may write it in another order than the one that put it, so
        // the digests of the stamps say nothing here.
        let mut is = |stamp: &Stamp<P>| -> Result<bool, Stopped> {
            Ok(match stamp.value.is_heap() {
                true => data.is_heap() && self.digest_of(stigmergy, key, stamp.value)? == digest,
                false => data.same(stamp.value),
            })
        };
        let (is_mine, mut is_theirs) = (is(&mine)?, is(theirs)?);
        if is_mine && is_theirs {
            // The robots put the same value, so the robot says which entry it is.
            let robot = self.arena.table_get(verdict.index(), Value::string(string::ROBOT));
            is_theirs = robot.index() as u16 == theirs.robot;
        }
        if is_mine || is_theirs {
            return Ok(Some(if is_theirs { Ordering::Greater } else { Ordering::Less }));
        }
        if data.is_nil() || self.protocol.reclaimed > RECLAIMED_MAX - MERGED {
            return Ok(Some(Ordering::Equal));
        }
        self.protocol.reclaimed += MERGED;
        let value = self.copied(data)?;
        let (clock, robot) = (self.tick(theirs.clock), self.robot_id);
        self.set_stamp(at, stigmergy, &Stamp { clock, robot, value, digest }, OWN);
        Ok(None)
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
