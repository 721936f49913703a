//! The network: neighbors, swarms, stigmergies, and the messages that carry them.
//!
//! # Seam
//! Interpreter and network are parts of one machine. The network uses the machine's memory, frames
//! and faults. The interpreter reaches the network only through the functions below. They are
//! `pub(in crate::machine)` or stand in this file; everything else in the folder is `pub(super)`.
//!
//! | Moment | Functions |
//! |---|---|
//! | An image is loaded | [`Vm::reset_network`] |
//! | The robot gets its id | [`Vm::identify_network`] |
//! | A step begins | [`Vm::begin_messages`], then [`Vm::next_message`] for each message |
//! | A fault while a message is handled | [`Vm::contain`] |
//! | The robot was stopped | [`Vm::come_back`] |
//! | An entry point ends | [`Vm::send_changes`] |
//! | The script restarts after a fault | [`Vm::rest_network`], [`Vm::forget_entries_on_heap`], later [`Vm::end_rest`] |
//! | The collector marks | [`Vm::mark_entries`] |
//! | A built-in is called | [`Vm::neighbor_builtin`], [`Vm::swarm_builtin`], [`Vm::stigmergy_builtin`], [`Vm::object_id`] |
//! | A built-in iterates | [`Vm::need_source`], [`Vm::next_known`], [`Vm::is_chosen`], [`Vm::is_in_swarm`] |
//!
//! # Memory
//! Neighbors, entries, stigmergies and swarms are slots of the arena from [`Vm::network_base`] on,
//! after those of the script, in this order, and with many entries their index. [`Sizes`] holds their numbers; it is set before an
//! image is loaded.

mod advertise;
mod conflicts;
mod entries;
mod index;
mod inspect;
mod merging;
mod messages;
mod neighbors;
mod protocol;
mod serial;
mod stigmergy;
mod swarms;

use super::{Vm, VmState};
use crate::builtin::{self, Library};
use crate::bytecode::ByteCode;
use crate::fault::Stopped;
use crate::host::Host;
use crate::network::{ENTRY, Sizes};
use crate::number::Profile;
use crate::part::Part;
use crate::value::{Tag, Value};
pub(super) use advertise::NEWS_MAX;
pub use inspect::{KnownSwarm, Neighbor, StoredEntry, Trigger};
pub(super) use protocol::Protocol;
use swarms::object_number;

/// Returns true for a function of `neighbors` that iterates over them.
pub(super) fn is_of_neighbors(number: u8) -> bool {
    (builtin::NEIGHBORS_FOREACH..=builtin::NEIGHBORS_NONKIN).contains(&number)
}

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// True if the machine has a part that needs messages.
    pub(super) const HAS_NETWORK: bool =
        Self::HAS_SHARED_STATE || Self::has(Part::Neighbors) || Self::has(Part::Messages);

    /// True if the machine has a part whose state is shared between robots.
    pub(super) const HAS_SHARED_STATE: bool = Self::has(Part::Stigmergy) || Self::has(Part::Swarms);

    /// True if scripts can iterate over neighbors.
    pub(super) const ITERATES_NEIGHBORS: bool =
        Self::has(Part::Neighbors) && Self::has(Part::Iteration);

    /// Sets how many other robots, entries and swarms the machine remembers, which takes
    /// [`Sizes::slots`] of its slots. Removes the program, so it must be called before an image is
    /// loaded.
    pub fn set_network_capacity(&mut self, sizes: Sizes) {
        self.code = None;
        self.state = VmState::Empty;
        self.protocol.sizes = sizes.clamped();
    }

    /// Returns the number of robots, entries and swarms that the machine remembers.
    #[hot]
    pub(super) fn sizes(&self) -> &Sizes {
        match &C::SIZES {
            Some(sizes) => sizes,
            None if Self::HAS_NETWORK => &self.protocol.sizes,
            None => &Sizes::NONE,
        }
    }

    /// Returns the first slot of the network, after those of the script.
    #[hot]
    pub(super) fn network_base(&self) -> usize {
        match C::SIZES {
            Some(sizes) => SLOTS.saturating_sub(sizes.slots()),
            None => usize::from(self.network_base),
        }
    }

    /// Returns the first slot of the entries, after the neighbors.
    #[hot]
    pub(super) fn entries_at(&self) -> usize {
        let sizes = self.sizes();
        self.network_base() + usize::from(sizes.neighbors) * sizes.neighbor()
    }

    /// Forgets everything that belongs to another image. The slots of the network are emptied
    /// together with all others.
    #[hot]
    pub(super) fn reset_network(&mut self) {
        if Self::HAS_NETWORK {
            self.uses_network = self.header.features() & messages::NETWORK_FEATURES != 0;
            self.protocol.forget();
        }
    }

    /// Derives the times of sending from the robot's id.
    #[hot]
    pub(super) fn identify_network(&mut self, robot_id: u16) {
        if Self::HAS_NETWORK {
            self.protocol.jitter = robot_id;
            // Robots that are switched on at the same time then send their first beacons one after
            // the other.
            self.protocol.silent = robot_id as u8 & 7;
        }
    }

    /// Sends the entries and swarms that changed, after an entry point has ended.
    #[hot]
    pub(super) fn send_changes<H: Host<P>>(&mut self, host: &mut H) {
        if Self::HAS_SHARED_STATE && self.protocol.has_dirty_entries {
            self.flush_stigmergy(host);
        }
    }

    /// Returns true if entries or swarms have changed, and takes note that they are sent now.
    #[hot]
    pub(super) fn has_changes(&mut self) -> bool {
        Self::HAS_SHARED_STATE && core::mem::take(&mut self.protocol.has_dirty_entries)
    }

    /// Takes note that changes are not sent yet.
    #[hot]
    pub(super) fn keep_changes(&mut self) {
        self.protocol.has_dirty_entries = true;
    }

    /// Keeps the robot in the network while its script rests after a fault, but leaves all swarms.
    #[hot]
    pub(super) fn rest_network(&mut self) {
        if Self::HAS_NETWORK {
            if self.uses_network {
                self.state = VmState::Idle;
            }
            self.protocol.rest();
            if Self::HAS_SHARED_STATE {
                self.keep_stigmergies();
                self.leave_swarms();
            }
        }
    }

    /// Lets steps run the script again.
    #[hot]
    pub(super) fn end_rest(&mut self) {
        if Self::HAS_NETWORK {
            self.protocol.is_resting = false;
        }
    }

    /// Takes note that the robot neither ran nor heard others for a while: it compares its entries
    /// with those of the others before it sends them, since they may have been deleted.
    pub fn come_back(&mut self) {
        if Self::has(Part::Stigmergy) {
            self.protocol.alone = protocol::ALONE;
        }
    }

    /// Marks the keys and values of all entries for the collector.
    #[hot]
    pub(super) fn mark_entries(&mut self) {
        let mut entry = self.entries_at();
        for _ in 0..self.sizes().entries {
            // Key and value.
            self.arena.mark(self.arena.get(entry));
            self.arena.mark(self.arena.get(entry + 1));
            entry += ENTRY;
        }
    }

    /// Fails unless `source` is the swarm, snapshot or stigmergy that the built-in needs.
    pub(super) fn need_source(&mut self, number: u8, source: Value<P>) -> Result<(), Stopped> {
        match number {
            builtin::SWARM_EXEC if Self::has(Part::Swarms) => self.need_swarm(source).map(|_| ()),
            builtin::STIGMERGY_FOREACH..=builtin::STIGMERGY_REDUCE => {
                self.need_stigmergy(source).map(|_| ())
            }
            _ if is_of_neighbors(number) || source.is(Tag::SNAPSHOT) => Ok(()),
            _ => Err(self.wrong_type(source, source)),
        }
    }

    /// Pushes the next neighbor, or the next entry of a stigmergy. Slot `at` holds the position of
    /// the iteration. Returns false if there is no next one.
    #[hot]
    pub(super) fn next_known(&mut self, source: Value<P>, at: usize) -> Result<bool, Stopped> {
        if Self::ITERATES_NEIGHBORS && source.index() as u8 == Library::Neighbors as u8 {
            Ok(self.next_neighbor(at)? != 0)
        } else {
            self.next_entry(object_number(source), at)
        }
    }

    /// Returns true if the robot is in that swarm.
    #[hot]
    pub(super) fn is_in_swarm(&self, swarm: Value<P>) -> bool {
        self.is_member(object_number(swarm))
    }
}
