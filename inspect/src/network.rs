//! A robot's knowledge of other robots, with names.

use bittybuzz_vm_core::inspect::{StoredEntry, Trigger};
use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, Vm};

use crate::reader::MachineReader;
use crate::value::ScriptValue;

/// A robot whose frames were received recently.
#[derive(Debug, Clone, PartialEq)]
pub struct InspectedNeighbor {
    /// The id of the robot.
    pub id: u16,
    /// Distance in mm, azimuth and elevation in radians; `None` if the link did not measure them.
    pub place: Option<[f32; 3]>,
    /// The number of steps after which the neighbor is removed if nothing more is received from it.
    pub steps_left: u8,
    /// The numbers of its swarms, as far as this robot has created them and has been informed.
    pub swarms: Vec<u16>,
}

/// A stigmergy, as this robot knows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Stigmergy {
    /// The number by which scripts refer to it.
    pub number: u16,
    /// The entries in the order in which they are stored, including deleted ones.
    pub entries: Vec<InspectedEntry>,
}

/// An entry of a stigmergy.
#[derive(Debug, Clone, PartialEq)]
pub struct InspectedEntry {
    pub key: ScriptValue,
    /// The value; nil if the entry was deleted.
    pub value: ScriptValue,
    /// The id of the robot that wrote the value.
    pub owner: u16,
    /// The Lamport clock of the write.
    pub clock: u32,
    /// The digest of key and value if they do not fit into a frame, otherwise 0; `None` for a
    /// deleted entry.
    pub digest: Option<u16>,
    /// True if this robot wrote the entry since it was switched on.
    pub is_own: bool,
    /// True if the entry has changed and will be sent when an entry point ends.
    pub is_unsent: bool,
}

/// A function that handles messages or conflicts.
#[derive(Debug, Clone, PartialEq)]
pub struct Handler {
    pub trigger: HandlerTrigger,
    pub function: ScriptValue,
}

/// The event for which a handler is called.
#[derive(Debug, Clone, PartialEq)]
pub enum HandlerTrigger {
    /// A message on this topic.
    Message(ScriptValue),
    /// A conflict in the stigmergy with this number.
    Conflict(u16),
    /// A conflict that this robot lost, in the stigmergy with this number.
    LostConflict(u16),
}

/// Returns the neighbors of a robot.
pub fn neighbors<P: Profile, C: ByteCode, const SLOTS: usize>(
    vm: &Vm<P, C, SLOTS>,
) -> Vec<InspectedNeighbor> {
    let all = vm.neighbors().map(|neighbor| InspectedNeighbor {
        id: neighbor.id,
        place: neighbor.place.map(|place| {
            place.map(|number| number.as_f32().expect("the machine stores places as floats"))
        }),
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

/// Returns the stigmergies of a robot.
pub fn stigmergies<P: Profile, C: ByteCode, const SLOTS: usize>(
    reader: &mut MachineReader<'_, P, C, SLOTS>,
) -> Vec<Stigmergy> {
    let vm = reader.vm;
    let all = vm.stigmergies().map(|number| {
        let entries = vm.stored_entries().filter(|entry| entry.stigmergy == number);
        let entries = entries.map(|entry| {
            let StoredEntry { key, value, owner, clock, digest, is_own, is_unsent, .. } = entry;
            let (key, value) = (reader.value(key), reader.value(value));
            InspectedEntry { key, value, owner, clock, digest, is_own, is_unsent }
        });
        Stigmergy { number, entries: entries.collect() }
    });
    all.collect()
}

/// Returns the handlers of a script.
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
