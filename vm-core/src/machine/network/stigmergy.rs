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
//! ([`FORGOTTEN`](super::advertise::FORGOTTEN)), another key may take its place. Until then it
//! answers robots that were away.
//!
//! Of the deletions without a place a robot remembers the latest clock, the floor. A key that is
//! unknown here and has no later clock was deleted, or its put has not arrived for 64 s. It is not
//! taken, but deleted once more, unless the script deletes no such key. Robots with equal digests
//! know the same keys, so the floor of one is that of the other; a robot that may lack some
//! deletes none. The new deletion names the robot that has put the entry: if that put has never
//! reached another robot, this robot puts it again, with a clock above the floor.
//!
//! # Restarts
//! A robot that was switched off remembers no clock. Entries that it put before come back from the
//! others with later clocks than those of its new puts, and would win. The robot recognizes them by
//! its own id and puts its new value again, with a later clock.
//! [`RECLAIMED_MAX`](super::merging::RECLAIMED_MAX) bounds the number of these puts, since two
//! robots with the same id would repeat them for ever.
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
//! The slots of entries are in [`super::entries`], the treatment of received ones in
//! [`super::merging`], and the handlers in [`super::conflicts`]; [`super::advertise`] decides when
//! and how entries are sent.

use super::conflicts::{ON_CONFLICT, ON_CONFLICT_LOST, handler};
use super::entries::{KEY, OWN, ROBOT, VALUE};
use super::protocol::{Flag, Timer};
use super::swarms::{NEWS, object, object_number};
use crate::builtin::{self, Library};
use crate::bytecode::ByteCode;
use crate::fault::{FaultCode, Stopped};
use crate::host::Host;
use crate::machine::Vm;
use crate::message::StigmergyEntry;
use crate::network::Places;
use crate::number::Profile;
use crate::part::Part;
use crate::stamp::{Stamp, is_earlier, next};
use crate::value::{Tag, Type, Value};

/// The tag of a stigmergy's number after a restart of the script, until the script creates the
/// stigmergy again.
const KEPT: Tag = Tag::NIL;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the slot of the number of the stigmergy at that place.
    fn stigmergy_slot(&self, place: u8) -> usize {
        self.entry_slot(self.sizes().entries) + usize::from(place)
    }

    /// Returns the number in messages of the stigmergy at that place.
    pub(super) fn number_of_stigmergy(&self, place: u8) -> u16 {
        self.arena.index_at(self.stigmergy_slot(place)) as u16
    }

    /// Returns the clock of a put after `clock`, and remembers it.
    #[one_copy]
    pub(super) fn tick(&mut self, clock: u32) -> u32 {
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
            builtin::STIGMERGY_ONCONFLICTLOST if Self::has(Part::LostConflicts) => {
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
}
