//! What a host may see of the robot's knowledge, for tests and simulations.

use crate::bytecode::ByteCode;
use crate::machine::Vm;
use crate::number::Profile;
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// How many robots were heard of late.
    pub fn neighbor_count(&self) -> usize {
        self.count_neighbors()
    }

    /// Slots that neither the script's stack nor its heap uses, garbage not counted as unused.
    pub fn free_slots(&self) -> usize {
        self.arena.unused()
    }

    /// What a table has under a key, nil if nothing; `None` if the value is no table.
    pub fn field(&self, table: Value<P>, key: Value<P>) -> Option<Value<P>> {
        table.is(Tag::TABLE).then(|| self.arena.table_get(table.index(), key))
    }

    /// Returns the number of entries of stigmergies that take a place, deleted ones included.
    pub fn entry_count(&self) -> usize {
        let has_entry = |place: &u8| self.entry_state(self.entry_slot(*place)) != 0;
        (0..self.sizes().entries).filter(has_entry).count()
    }

    /// What this robot knows to be in a stigmergy. nil if the entry was deleted.
    pub fn replica(&self, stigmergy: u16, key: Value<P>) -> Option<Value<P>> {
        let place = self.find_stigmergy(stigmergy);
        if place == self.protocol.stigmergies {
            return None;
        }
        match self.find_entry(place, key) {
            0 => None,
            at => Some(self.stamp(at).value),
        }
    }
}
