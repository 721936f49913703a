//! What a host may see of the robot's knowledge, for tests and simulations.

use super::Vm;
use crate::bytecode::ByteCode;
use crate::network::Network;
use crate::number::Profile;
use crate::value::Value;

impl<P: Profile, C: ByteCode, const SLOTS: usize, N: Network<P>> Vm<P, C, SLOTS, N> {
    /// How many robots were heard of late.
    pub fn neighbor_count(&self) -> usize {
        let (neighbors, _) = self.network.known();
        neighbors.iter().filter(|neighbor| neighbor.steps_left != 0).count()
    }

    /// What this robot knows to be in a stigmergy. nil if the entry was deleted.
    pub fn replica(&self, stigmergy: u16, key: Value<P>) -> Option<Value<P>> {
        let (_, stigmergies) = self.network.known();
        let place = stigmergies.iter().position(|number| *number == stigmergy)?;
        let of_it = |entry: usize| self.network.entries().get(entry).map(|entry| entry.value);
        self.find_entry(u8::try_from(place).ok()?, key).and_then(of_it)
    }
}
