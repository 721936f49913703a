//! What the memory of a virtual machine is for, and how much of it is left for scripts.
//!
//! The machine has no neighbours, queues, stigmergies and swarms yet. What they need is calculated here, so that a script
//! that fits today fits when they come; then the sizes of the structures themselves take the place of these sums.

use bittybuzz_vm_core::{Value, number};

use crate::{Profile, Robot};

/// Registers of the machine and what it knows of the image, on the chip where they are largest: 72 bytes on the
/// ATmega328P, 84 on Cortex-M. The firmware's build checks it.
const REGISTERS: u32 = 96;

/// Fragments of the longest value that one message cannot hold.
const MOST_FRAGMENTS: u32 = 8;
/// What a fragment has before its part of the value: kind and tags, bits of the script hash, robot, number and count.
const FRAGMENT_HEADER: u32 = 5;
/// What is kept of a value that is not complete: robot, number of the message, which fragments are there.
const FRAGMENT_STATE: u32 = 4;
/// Own clock, time to the next beacon, next entry to advertise, and counters of what was dropped or not understood.
const PROTOCOL: u32 = 16;
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

    /// Bytes for neighbours, messages, stigmergies and swarms. A listener or a conflict handler is a value of the script.
    pub fn swarm_memory(&self) -> u32 {
        let (vm, message_bytes) = (self.vm, self.message_bytes);
        let number = match self.profile {
            Profile::Tiny => 2,
            Profile::Full => 4,
        };
        // Its type beside it.
        let value = 1 + number;
        // Robot, steps since it was heard, a bit for each swarm; distance, azimuth, elevation.
        let neighbor = 2 + 1 + 1 + 3 * number;
        // Length and content.
        let message = 1 + message_bytes;
        // Which stigmergy, robot, clock (864,000 puts in 24 hours take more than 16 bits); key and value. At most as
        // many stigmergies as entries, each with its number.
        let entry = 1 + 2 + 4 + 2 * value + 2;
        // Its number, and whether this robot is in it.
        let swarm = 2 + 1;
        let fragments = FRAGMENT_STATE + MOST_FRAGMENTS * (message_bytes - FRAGMENT_HEADER);
        vm.neighbors * neighbor
            + (vm.in_queue + vm.out_queue) * message
            + 2 * QUEUE
            + vm.stigmergy_entries * entry
            + vm.swarms * swarm
            + fragments
            + PROTOCOL
    }

    /// The most slots that are left for scripts.
    pub fn most_slots(&self) -> u32 {
        self.vm.memory.saturating_sub(REGISTERS + self.swarm_memory()) / self.slot_bytes()
    }
}
