//! The entries of stigmergies in the arena: their slots, their room, and deletions that are
//! forgotten.

use super::advertise::FORGOTTEN;
use super::protocol::{Flag, Timer};
use super::swarms::NEWS;
use crate::bytecode::ByteCode;
use crate::machine::Vm;
use crate::network::{ENTRY, Places};
use crate::number::Profile;
use crate::number::wide::IS_WIDE;
use crate::stamp::{Stamp, is_earlier};
use crate::value::Value;

// Slots of an entry. `ROBOT` holds the robot that put the value, with 1 + the place of the
// stigmergy in place of a tag; it is nil if there is no entry. `CLOCK` holds the low bits of the
// clock, with the high ones and `OWN` in place of a tag. `DIGEST` holds the digest of key and
// value, or the age of a deleted entry, with the number of `CHOICES_MAX` in place of a tag.
pub(super) const KEY: usize = 0;
pub(super) const VALUE: usize = 1;
pub(super) const ROBOT: usize = 2;
pub(super) const CLOCK: usize = 3;
pub(super) const DIGEST: usize = 4;

/// A bit next to the high bits of the clock: the robot has put the value itself since it was
/// switched on.
pub(super) const OWN: u8 = 0x40;

/// Another bit there, of machines with many entries: a neighbor has sent the entry as it is here, so
/// the robot need not advertise it in this round.
const HEARD: u8 = if IS_WIDE { 0x80 } else { 0 };

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the first slot of the entry at that place.
    #[one_copy]
    pub(super) fn entry_slot(&self, place: Places) -> usize {
        self.entries_at() + usize::from(place) * ENTRY
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
    pub(super) fn set_stamp(&mut self, at: usize, stigmergy: u8, stamp: &Stamp<P>, own: u8) {
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
    pub(super) fn free_entry(&mut self, at: usize) {
        if self.sizes().have_index() {
            self.unlink_entry(at);
        }
        self.subtract_entry(at);
        self.arena.fill(at, at + ENTRY);
    }

    /// Notes that a neighbor has sent an entry as it is here.
    #[hot]
    pub(super) fn mark_heard(&mut self, at: usize) {
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
                let differs = self.protocol.has(Flag::Differs);
                if differs && self.protocol.timer(Timer::Meeting) == 0 {
                    self.protocol.clear(Flag::Complete);
                }
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

    /// Returns 1 + the place of the entry's stigmergy, with the bit [`NEWS`], or 0 if there is no
    /// entry.
    #[one_copy]
    pub(super) fn entry_state(&self, at: usize) -> u8 {
        self.arena.get(at + ROBOT).tag().byte()
    }

    /// Returns true if there is an entry of that stigmergy.
    pub(super) fn is_of(&self, at: usize, stigmergy: u8) -> bool {
        self.entry_state(at) & !NEWS == stigmergy + 1
    }

    /// Sets the state of an entry, see [`Vm::entry_state`].
    pub(super) fn set_entry_state(&mut self, at: usize, state: u8) {
        let robot = self.arena.get(at + ROBOT).raw();
        self.arena.set(at + ROBOT, Value::marked(state, robot));
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
    pub(super) fn find_room(&self) -> usize {
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
    pub(super) fn new_entry(&mut self, at: usize, key: Value<P>) {
        self.forget_deletion(at);
        self.arena.set(at + KEY, key);
        self.arena.set(at + VALUE, Value::nil());
        self.arena.set(at + CLOCK, Value::nil());
    }
}
