//! What the memory of a virtual machine is for, and how much of it is left for scripts. The queues of messages, which the
//! firmware has beside the machine, count as well.

use bittybuzz_vm_core::message::{FRAGMENT_HEAD, FRAGMENTS_MAX, FULL_FRAME, TINY_FRAME};
use bittybuzz_vm_core::{Sighting, Sizes, Value, number};

use crate::{Profile, Robot, VmSizes};

/// Registers of the machine and what it knows of the image: on the ATmega328P, and on Cortex-M, where fields are aligned. The
/// firmware's build checks it.
const REGISTERS: [u32; 2] = [84, 100];

/// The time of messages to be sent, counters, and the fragments that have arrived.
const PROTOCOL: u32 = 60;
/// Beside a frame in a queue: which comes next, and its priority with whether it is stale.
const QUEUED: u32 = 2;
/// For a queue: the counts of dropped and double frames, and the place of the oldest one. On
/// Cortex-M also the alignment, what guards it
/// between tasks, and its half of what wakes the sending one.
const QUEUE: [u32; 2] = [5, 18];

/// The names of chips of the AVR family begin with these.
const AVR: [&str; 2] = ["ATmega", "ATtiny"];

impl Robot {
    /// Returns true if its chip packs bytes without alignment. A robot without a chip counts as the
    /// smallest one.
    fn is_packed(&self) -> bool {
        let is_avr = |chip: &String| AVR.iter().any(|family| chip.starts_with(family));
        self.chip.as_ref().is_none_or(is_avr)
    }

    /// Returns the number for its chip, of one for the ATmega328P and one for Cortex-M.
    fn of_chip(&self, [packed, aligned]: [u32; 2]) -> u32 {
        if self.is_packed() { packed } else { aligned }
    }

    /// Bytes of a slot of the machine's arena. On 32-bit chips slots are as large as is fast to reach. A robot without a chip
    /// counts as the smallest one.
    pub fn slot_bytes(&self) -> u32 {
        let bytes = match self.profile {
            // This program itself runs on a larger chip.
            Profile::Tiny if !self.is_packed() => size_of::<Value<number::Tiny>>(),
            Profile::Tiny => Value::<number::Tiny>::SLOT_BYTES,
            Profile::Full => Value::<number::Full>::SLOT_BYTES,
        };
        bytes as u32
    }

    /// Returns the sizes of the memory for other robots.
    pub fn sizes(&self) -> Sizes {
        let byte = |count: u32| u8::try_from(count).unwrap_or(u8::MAX);
        Sizes {
            neighbors: byte(self.vm.neighbors),
            bearings: self.vm.bearings,
            entries: byte(self.vm.stigmergy_entries),
            swarms: byte(self.vm.swarms),
        }
    }

    /// Bytes of a frame: its type and a message.
    pub fn frame_bytes(&self) -> u32 {
        let bytes = match self.profile {
            Profile::Tiny => TINY_FRAME,
            Profile::Full => FULL_FRAME,
        };
        bytes as u32
    }

    /// Returns the bytes of the link's facts about the sender of a waiting frame: its distance in
    /// mm, or its place.
    pub fn sighting_bytes(&self) -> u32 {
        let bytes = match (self.vm.bearings, self.profile) {
            (false, _) => 1,
            (true, Profile::Tiny) => size_of::<Sighting<number::Tiny>>(),
            (true, Profile::Full) => size_of::<Sighting<number::Full>>(),
        };
        bytes as u32
    }

    /// Bytes for messages that wait, which the firmware has beside the machine.
    pub fn queue_memory(&self) -> u32 {
        let VmSizes { in_queue, out_queue, .. } = self.vm;
        // With its length. On Cortex-M it is aligned to words.
        let frame = self.frame_bytes() + 1;
        let frame = self.of_chip([frame, frame.next_multiple_of(4)]);
        (in_queue + out_queue) * (frame + QUEUED)
            + in_queue * self.sighting_bytes()
            + 2 * self.of_chip(QUEUE)
    }

    /// Bytes for neighbours, messages, stigmergies and swarms. A listener or a conflict handler is a value of the script.
    fn swarm_memory(&self) -> u32 {
        let content = u32::from(FRAGMENTS_MAX) * (self.frame_bytes() - FRAGMENT_HEAD as u32);
        self.sizes().slots() as u32 * self.slot_bytes() + self.queue_memory() + content + PROTOCOL
    }

    /// The most slots that are left for scripts.
    pub fn most_slots(&self) -> u32 {
        self.vm.memory.saturating_sub(self.taken()) / self.slot_bytes()
    }

    /// Returns the least memory, in bytes, in which its slots fit.
    pub fn least_memory(&self) -> u32 {
        self.taken() + self.vm.slots * self.slot_bytes()
    }

    /// Bytes of the memory that are no slots.
    fn taken(&self) -> u32 {
        self.of_chip(REGISTERS) + self.swarm_memory()
    }
}
