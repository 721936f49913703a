//! A robot's knowledge of others, with names.

use bittybuzz_vm_core::inspect::{StoredEntry, Trigger};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Vm};

use crate::reader::MachineReader;
use crate::value::ScriptValue;

/// A robot that was heard of late.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbor {
    /// Its id.
    pub id: u16,
    /// Distance in mm, azimuth and elevation in radians; `None` if the link did not measure them.
    pub place: Option<[f32; 3]>,
    /// Steps after which it is forgotten if nothing more is heard of it.
    pub steps_left: u8,
    /// Numbers of the swarms in which it is, as far as this robot has created them and heard of it.
    pub swarms: Vec<u16>,
}

/// A stigmergy, as this robot knows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Stigmergy {
    /// The number that scripts give it.
    pub number: u16,
    /// Its entries, deleted ones included, as they are stored.
    pub entries: Vec<StigmergyEntry>,
}

/// An entry of a stigmergy.
#[derive(Debug, Clone, PartialEq)]
pub struct StigmergyEntry {
    /// Its key.
    pub key: ScriptValue,
    /// Its value; nil if it was deleted.
    pub value: ScriptValue,
    /// The robot that put it.
    pub owner: u16,
    /// The time of the put, on Lamport's clock.
    pub clock: u32,
    /// The digest of key and value where they do not fit a frame, else 0; `None` of a deleted entry.
    pub digest: Option<u16>,
    /// This robot has put it since it was switched on.
    pub is_own: bool,
    /// It has changed, and will be sent when an entry point ends.
    pub is_unsent: bool,
}

/// A function that handles messages or conflicts.
#[derive(Debug, Clone, PartialEq)]
pub struct Handler {
    /// The event for which it is called.
    pub trigger: HandlerTrigger,
    /// The function.
    pub function: ScriptValue,
}

/// The event for which a handler is called.
#[derive(Debug, Clone, PartialEq)]
pub enum HandlerTrigger {
    /// A message on that topic.
    Message(ScriptValue),
    /// A conflict in the stigmergy of that number.
    Conflict(u16),
    /// A conflict that this robot lost, in the stigmergy of that number.
    LostConflict(u16),
}

/// The neighbors of a robot.
pub fn neighbors<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &Vm<P, C, SLOTS>,
) -> Vec<Neighbor> {
    let all = vm.neighbors().map(|neighbor| Neighbor {
        id: neighbor.id,
        place: neighbor.place.map(|place| place.map(|number| number.as_f32().unwrap_or(0.0))),
        steps_left: neighbor.steps_left,
        swarms: vm
            .swarms()
            .enumerate()
            .filter(|(place, _)| neighbor.swarms >> place & 1 != 0)
            .map(|(_, swarm)| swarm.number)
            .collect(),
    });
    all.collect()
}

/// The stigmergies of a robot.
pub fn stigmergies<P: Profile, C: ByteCode, const SLOTS: usize>(
    reader: &mut MachineReader<'_, P, C, SLOTS>,
) -> Vec<Stigmergy> {
    let vm = reader.vm;
    let all = vm.stigmergies().map(|number| {
        let entries = vm.stored_entries().filter(|entry| entry.stigmergy == number);
        let entries = entries.map(|entry| {
            let StoredEntry { key, value, owner, clock, digest, is_own, is_unsent, .. } = entry;
            let (key, value) = (reader.value(key), reader.value(value));
            StigmergyEntry { key, value, owner, clock, digest, is_own, is_unsent }
        });
        Stigmergy { number, entries: entries.collect() }
    });
    all.collect()
}

/// The handlers of a script.
pub fn handlers<P: Profile, C: ByteCode, const SLOTS: usize>(
    reader: &mut MachineReader<'_, P, C, SLOTS>,
) -> Vec<Handler> {
    let vm = reader.vm;
    let all = vm.handlers().map(|(trigger, function)| Handler {
        trigger: match trigger {
            Trigger::Message(topic) => HandlerTrigger::Message(reader.value(topic)),
            Trigger::Conflict(stigmergy) => HandlerTrigger::Conflict(stigmergy),
            Trigger::LostConflict(stigmergy) => HandlerTrigger::LostConflict(stigmergy),
        },
        function: reader.value(function),
    });
    all.collect()
}
