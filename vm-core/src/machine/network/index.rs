//! The index of entries, for machines that have thousands of them.
//!
//! Entries lie at the first free places, so that few entries take little memory of a host, on which
//! memory grows on demand. The index finds them by their keys. It is a hash table with chains: a slot
//! for the head of each chain, and a slot for each entry that leads to the next one of its chain. A
//! slot holds 1 + the place of an entry, or nil at the end.
//!
//! Machines with few entries search all places, which takes less time and memory.

use super::entries::KEY;
use super::swarms::NEWS;
use crate::bytecode::ByteCode;
use crate::machine::Vm;
use crate::network::{ENTRY, Places};
use crate::number::Profile;
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the slot of the first chain's head, after the swarms.
    fn heads_at(&self) -> usize {
        self.swarm_slot(self.sizes().swarms)
    }

    /// Returns the slot that leads to the entry after the one at that slot.
    fn link_slot(&self, at: usize) -> usize {
        let place = at.wrapping_sub(self.entries_at()) / ENTRY;
        self.heads_at() + self.sizes().chains() + place
    }

    /// Returns the slot of the head of an entry's chain.
    fn head_slot(&self, stigmergy: u8, key: Value<P>) -> usize {
        let mut hash = u32::from(stigmergy);
        let mut add = |bits: u32| hash = (hash ^ bits).wrapping_mul(0x9e37_79b1).rotate_left(15);
        if P::FULL && key.is(Tag::TEXT) {
            let mut text = self.arena.text_start(key.index());
            while let Some(byte) = self.arena.text_next(&mut text) {
                add(byte.into());
            }
        } else {
            add(key.tag().byte().into());
            add(P::int_to_i32(key.raw()) as u32);
        }
        let chain = (u64::from(hash) * self.sizes().chains() as u64) >> 32;
        self.heads_at() + chain as usize
    }

    /// Returns the first slot of the entry to which a slot of the index leads; 0 at the end.
    fn linked(&self, link: usize) -> usize {
        match self.arena.index_at(link) {
            0 => 0,
            next => self.entry_slot((next - 1) as Places),
        }
    }

    /// Returns the first slot of an entry, 0 if there is none.
    pub(super) fn find_by_index(&self, stigmergy: u8, key: Value<P>) -> usize {
        let mut at = self.linked(self.head_slot(stigmergy, key));
        while at != 0 && !self.is_entry(at, stigmergy, key) {
            at = self.linked(self.link_slot(at));
        }
        at
    }

    /// Adds the entry at a slot, whose key is there, to the index.
    pub(super) fn link_entry(&mut self, at: usize, stigmergy: u8) {
        let head = self.head_slot(stigmergy, self.arena.get(at + KEY));
        self.arena.copy(head, self.link_slot(at));
        let place = at.wrapping_sub(self.entries_at()) / ENTRY;
        self.arena.set(head, Value::indexed(Tag::INT, place as u16 + 1));
    }

    /// Removes the entry at a slot from the index.
    pub(super) fn unlink_entry(&mut self, at: usize) {
        let stigmergy = (self.entry_state(at) & !NEWS).wrapping_sub(1);
        let mut link = self.head_slot(stigmergy, self.arena.get(at + KEY));
        loop {
            match self.linked(link) {
                0 => return,
                here if here == at => return self.arena.copy(self.link_slot(at), link),
                here => link = self.link_slot(here),
            }
        }
    }
}
