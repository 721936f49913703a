//! The robot's knowledge of other robots, as hosts read it: neighbors, swarms, stigmergies,
//! handlers.

use super::conflicts::{ON_CONFLICT, ON_CONFLICT_LOST};
use super::entries::{CLOCK, OWN};
use super::neighbors::{AZIMUTH, DISTANCE, ELEVATION, LAST_STEP};
use super::swarms::{MEMBER, NEWS, object_number};
use crate::bytecode::ByteCode;
use crate::machine::{OVERLAYS, Vm};
use crate::message::ScriptIdentity;
use crate::network::Places;
use crate::number::Profile;
use crate::value::{Tag, Value};

/// A robot from which a frame was received recently.
#[derive(Clone, Copy, Debug)]
pub struct Neighbor<P: Profile> {
    pub id: u16,
    /// Distance in mm, azimuth and elevation in radians, as floats; `None` if the link did not
    /// measure them.
    pub place: Option<[Value<P>; 3]>,
    /// Steps after which it is forgotten if no further frame of it is received. Each frame resets
    /// them, so they show its age.
    pub steps_left: u8,
    /// Bit n is set if the neighbor has announced membership of the swarm at place n of
    /// [`Vm::swarms`].
    pub swarms: u8,
}

/// A swarm that the script has created.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct KnownSwarm {
    /// The number that the script gave it.
    pub number: u16,
    /// True if this robot is in the swarm.
    pub is_member: bool,
    /// True if this robot has joined or left, and will send that when the entry ends.
    pub is_unsent: bool,
}

/// An entry of a stigmergy, as this robot keeps it.
#[derive(Clone, Copy, Debug)]
pub struct StoredEntry<P: Profile> {
    /// The number that the script gave the stigmergy.
    pub stigmergy: u16,
    pub key: Value<P>,
    /// nil if the entry was deleted.
    pub value: Value<P>,
    /// The robot that put it.
    pub owner: u16,
    /// The time of the put, on Lamport's clock.
    pub clock: u32,
    /// The digest of key and value by which entries that do not fit a frame are compared; 0 for
    /// those that fit, `None` for a deleted entry.
    pub digest: Option<u16>,
    /// True if this robot has put the value since it was switched on.
    pub is_own: bool,
    /// True if the entry has changed and will be sent when an entry point ends.
    pub is_unsent: bool,
}

/// The event for which a function of the script is called.
#[derive(Clone, Copy, Debug)]
pub enum Trigger<P: Profile> {
    /// A message on that topic, a string.
    Message(Value<P>),
    /// A conflict in the stigmergy of that number.
    Conflict(u16),
    /// A conflict that this robot lost, in the stigmergy of that number.
    LostConflict(u16),
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the number of robots from which a message came recently.
    pub fn neighbor_count(&self) -> usize {
        self.count_neighbors()
    }

    /// Returns the robots from which a frame was received recently, by ascending id.
    pub fn neighbors(&self) -> impl Iterator<Item = Neighbor<P>> {
        let mut from = Some(0);
        core::iter::from_fn(move || {
            let at = self.neighbor_from(from?);
            if at == 0 {
                return None;
            }
            let id = self.arena.index_at(at) as u16;
            from = id.checked_add(1);
            Some(self.neighbor(at, id))
        })
    }

    /// Returns distance, azimuth and elevation of the neighbor at that slot, as scripts see them.
    fn neighbor_place(&self, at: usize) -> Option<[Value<P>; 3]> {
        let distance = self.arena.get(at + DISTANCE).raw();
        if distance == P::NAN {
            return None;
        }
        let zero = Value::new(Tag::FLOAT, P::ZERO);
        let bearings = match self.sizes().bearings {
            true => [AZIMUTH, ELEVATION].map(|slot| self.arena.get(at + slot)),
            false => [zero; 2],
        };
        Some([Value::new(Tag::FLOAT, distance), bearings[0], bearings[1]])
    }

    fn neighbor(&self, at: usize, id: u16) -> Neighbor<P> {
        let (end, step) = (self.end_step(at), self.protocol.step);
        let steps_left = if end < step { end + LAST_STEP - step } else { end - step };
        let in_swarm = |swarms, swarm| swarms | u8::from(self.is_kin(at, swarm)) << swarm;
        let swarms = (0..self.sizes().swarms).fold(0, in_swarm);
        Neighbor { id, place: self.neighbor_place(at), steps_left, swarms }
    }

    /// Returns the swarms that the script has created, by their places, which are in the order of
    /// their creation.
    pub fn swarms(&self) -> impl Iterator<Item = KnownSwarm> {
        let all = (0..self.sizes().swarms).map(|place| self.arena.get(self.swarm_slot(place)));
        all.filter(|swarm| swarm.tag() != Tag::NIL).map(|swarm| KnownSwarm {
            number: swarm.index() as u16,
            is_member: swarm.tag().byte() & MEMBER != 0,
            is_unsent: swarm.tag().byte() & NEWS != 0,
        })
    }

    /// Returns the numbers of the stigmergies that the script has created, in the order of their
    /// creation.
    pub fn stigmergies(&self) -> impl Iterator<Item = u16> {
        (0..self.protocol.stigmergies).map(|place| self.shown_number(place))
    }

    /// Returns the entries of all stigmergies, deleted ones included, as they are stored.
    pub fn stored_entries(&self) -> impl Iterator<Item = StoredEntry<P>> {
        let slots = (0..self.sizes().entries).map(|place| self.entry_slot(place));
        slots.filter(|at| self.entry_state(*at) != 0).map(|at| {
            let (entry, digest) = self.entry_message(at);
            StoredEntry {
                stigmergy: self.other_stigmergy_number(entry.stigmergy),
                key: entry.key,
                value: entry.value,
                owner: entry.owner,
                clock: entry.clock,
                digest: Some(digest).filter(|_| !entry.value.is_nil()),
                is_own: self.arena.get(at + CLOCK).tag().byte() & OWN != 0,
                is_unsent: self.entry_state(at) & NEWS != 0,
            }
        })
    }

    /// Returns the functions that handle messages and conflicts, in the order in which the script
    /// has set them.
    pub fn handlers(&self) -> impl Iterator<Item = (Trigger<P>, Value<P>)> {
        self.entries(self.arena.get(OVERLAYS)).filter_map(|[key, function]| {
            let trigger = match key.tag() {
                Tag::STRING | Tag::TEXT => Trigger::Message(key),
                Tag::LIBRARY => {
                    let stigmergy = self.shown_number(object_number(key));
                    match key.index() as u8 {
                        ON_CONFLICT => Trigger::Conflict(stigmergy),
                        ON_CONFLICT_LOST => Trigger::LostConflict(stigmergy),
                        // These are changes of the script in a library.
                        _ => return None,
                    }
                }
                _ => return None,
            };
            Some((trigger, function))
        })
    }

    /// Returns the identity of the script, with which tools decode messages that wait in a queue;
    /// `None` without a script.
    pub fn message_script(&self) -> Option<ScriptIdentity> {
        self.header().map(|_| self.script())
    }

    /// Returns the number that the script gave to the swarm that this value is.
    pub(in crate::machine) fn swarm_number(&self, swarm: Value<P>) -> u16 {
        self.arena.index_at(self.swarm_slot(object_number(swarm))) as u16
    }

    /// Returns the number that the script gave to the stigmergy that this value is.
    pub(in crate::machine) fn stigmergy_number(&self, stigmergy: Value<P>) -> u16 {
        self.shown_number(object_number(stigmergy))
    }

    /// Returns the number that the script gave to the stigmergy at that place.
    fn shown_number(&self, place: u8) -> u16 {
        self.other_stigmergy_number(self.number_of_stigmergy(place))
    }

    /// Returns the number of slots that neither the script's stack nor its heap uses. Garbage
    /// counts as used.
    pub fn free_slots(&self) -> usize {
        self.arena.unused()
    }

    /// Returns a table's value under a key, nil if there is none; `None` if the value is no table.
    pub fn field(&self, table: Value<P>, key: Value<P>) -> Option<Value<P>> {
        table.is(Tag::TABLE).then(|| self.arena.table_get(table.index(), key))
    }

    /// Returns the number of stored entries of all stigmergies, including deleted ones until
    /// another entry may take their places.
    pub fn entry_count(&self) -> usize {
        let has_entry = |place: &Places| self.is_shared(self.entry_slot(*place));
        (0..self.sizes().entries).filter(has_entry).count()
    }

    /// Returns the value that this robot knows of a stigmergy's key; nil if the entry was deleted.
    /// The number is that of the script.
    pub fn replica(&self, stigmergy: u16, key: Value<P>) -> Option<Value<P>> {
        let place = self.find_stigmergy(self.other_stigmergy_number(stigmergy));
        if place == self.protocol.stigmergies {
            return None;
        }
        match self.find_entry(place, key) {
            0 => None,
            at => Some(self.stamp(at).value),
        }
    }
}
