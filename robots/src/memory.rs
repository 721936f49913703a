//! What the memory of a virtual machine is for, and how much of it is left for scripts. The queues of messages, which the
//! firmware has beside the machine, count as well.

use bittybuzz_vm_core::{Value, number};

use crate::{Profile, Robot};

/// Registers of the machine and what it knows of the image, on the chip where they are largest: 72 bytes on the
/// ATmega328P, 84 on Cortex-M. The firmware's build checks it.
const REGISTERS: u32 = 88;

/// Fragments of the longest value that one message cannot hold.
const MOST_FRAGMENTS: u32 = 8;
/// What a fragment has before its part of the value: type, robot, number of the message.
const FRAGMENT_HEADER: u32 = 4;
/// When what is to be sent, counters, and which fragments are here.
const PROTOCOL: u32 = 30;
/// Length of a frame in a queue, and how far its sender is.
const QUEUED: u32 = 2;
/// First and number of a queue's messages, and how many were dropped.
const QUEUE: u32 = 4;

/// How chips of the AVR family are named.
const AVR: [&str; 2] = ["ATmega", "ATtiny"];

impl Robot {
    /// Bytes of a slot of the machine's arena. On 32-bit chips slots are as large as is fast to reach. A robot without a chip
    /// counts as the smallest one.
    pub fn slot_bytes(&self) -> u32 {
        let is_avr = |chip: &String| AVR.iter().any(|family| chip.starts_with(family));
        let is_packed = self.chip.as_ref().is_none_or(is_avr);
        let bytes = match self.profile {
            // This program itself runs on a larger chip.
            Profile::Tiny if !is_packed => size_of::<Value<number::Tiny>>(),
            Profile::Tiny => Value::<number::Tiny>::SLOT_BYTES,
            Profile::Full => Value::<number::Full>::SLOT_BYTES,
        };
        bytes as u32
    }

    /// Bytes of a frame: the type byte and a message.
    pub fn frame_bytes(&self) -> u32 {
        1 + self.message_bytes
    }

    /// Bytes of all fragments of a message.
    pub fn content_bytes(&self) -> u32 {
        MOST_FRAGMENTS * (self.frame_bytes() - FRAGMENT_HEADER)
    }

    /// Bytes for neighbours, messages, stigmergies and swarms. A listener or a conflict handler is a value of the script.
    pub fn swarm_memory(&self) -> u32 {
        let vm = self.vm;
        // Fields of 32-bit chips begin at multiples of their size.
        let (number, value, align) = match (self.profile, self.slot_bytes()) {
            (Profile::Tiny, 3) => (2, 3, 1),
            (Profile::Tiny, _) => (2, 4, 4),
            (Profile::Full, _) => (4, 8, 4),
        };
        // Robot, steps, swarms, distance; azimuth and elevation.
        let bearing = if vm.bearings { 2 * number } else { 0 };
        let neighbor = 2 + 1 + 1 + number + bearing;
        // Key, value, clock, robot, which stigmergy; at most as many stigmergies as entries, each with its number.
        let entry = (2 * value + 4 + 2 + 1u32).next_multiple_of(align) + 2;
        // Number; state.
        let swarm = (2 + 1u32).next_multiple_of(align.min(2));
        vm.neighbors * neighbor
            + (vm.in_queue + vm.out_queue) * (self.frame_bytes() + QUEUED)
            + 2 * QUEUE
            + vm.stigmergy_entries * entry
            + vm.swarms * swarm
            + self.content_bytes()
            + PROTOCOL
    }

    /// The most slots that are left for scripts.
    pub fn most_slots(&self) -> u32 {
        self.vm.memory.saturating_sub(REGISTERS + self.swarm_memory()) / self.slot_bytes()
    }
}
