//! The use of the memory of a virtual machine, and the part that is left for scripts. The queues of
//! messages, which the firmware has next to the machine, count as well.

use bittybuzz_vm_core::message::{FRAGMENT_HEAD, FRAGMENTS_MAX, FULL_FRAME, TINY_FRAME};
use bittybuzz_vm_core::{Places, Sighting, Sizes, Value, number};

use crate::{NumberProfile, Robot, VmSizes};

/// Registers of the machine and its data about the image: on the ATmega328P, and on Cortex-M, where
/// fields are aligned. The build of the firmware checks this number.
const REGISTERS: [u32; 2] = [84, 100];

/// Bytes of a collection that stops and goes on between slices, in the full profile.
const COLLECTION: [u32; 2] = [30, 32];

/// Bytes of the protocol: the times of messages to be sent, and counters.
const PROTOCOL: u32 = 66;
/// Bytes that a queue adds to a frame: the number of the next frame, and the priority, which
/// includes whether the frame is stale.
const QUEUED: u32 = 2;
/// Bytes of a queue: the counts of dropped and double messages, and the place of the oldest frame.
/// On Cortex-M also the alignment, the protection between tasks, and the queue's half of the signal
/// that wakes the sending task.
const QUEUE: [u32; 2] = [5, 18];
/// Bytes that the queue adds to the content of a long message that arrives: sender, length, number,
/// fragments and the number of the last one; and to one that waits to be sent: its length.
const ARRIVING: u32 = 7;
const LEAVING: u32 = 2;
/// Bytes for the turns of long messages in both queues, the counts of incomplete and unwanted ones,
/// and the numbers of the unwanted ones. On Cortex-M also for the unwanted topics.
const TURNS: [u32; 2] = [24, 32];

/// The first letters of the names of AVR chips.
const AVR: [&str; 2] = ["ATmega", "ATtiny"];

impl Robot {
    /// Returns true if the chip packs bytes without alignment. A robot without a chip counts as the
    /// smallest one.
    fn is_packed(&self) -> bool {
        let is_avr = |chip: &String| AVR.iter().any(|family| chip.starts_with(family));
        self.chip.as_ref().is_none_or(is_avr)
    }

    /// Returns the number for the robot's chip, out of one for the ATmega328P and one for Cortex-M.
    fn of_chip(&self, [packed, aligned]: [u32; 2]) -> u32 {
        if self.is_packed() { packed } else { aligned }
    }

    /// Returns the size in bytes of a slot of the machine's arena. On 32-bit chips, a slot has the
    /// size that is fast to access. A robot without a chip counts as the smallest one.
    pub fn slot_bytes(&self) -> u32 {
        let bytes = match self.profile {
            // `size_of` is that of a larger chip, because this program runs on one.
            NumberProfile::Tiny if !self.is_packed() => size_of::<Value<number::Tiny>>(),
            NumberProfile::Tiny => Value::<number::Tiny>::SLOT_BYTES,
            NumberProfile::Full if !self.is_packed() => size_of::<Value<number::Full>>(),
            NumberProfile::Full => Value::<number::Full>::SLOT_BYTES,
        };
        bytes as u32
    }

    /// Returns the sizes of the memory for data about other robots.
    pub fn sizes(&self) -> Sizes {
        const REFUSED: &str = "robot files with more are refused";
        let byte = |count| u8::try_from(count).expect(REFUSED);
        Sizes {
            neighbors: byte(self.vm.neighbors),
            bearings: self.vm.bearings,
            entries: Places::try_from(self.vm.stigmergy_entries).expect(REFUSED),
            swarms: byte(self.vm.swarms),
        }
    }

    /// Returns the size of a frame in bytes: its type and a message.
    pub fn frame_bytes(&self) -> u32 {
        let bytes = match self.profile {
            NumberProfile::Tiny => TINY_FRAME,
            NumberProfile::Full => FULL_FRAME,
        };
        bytes as u32
    }

    /// Returns the size in bytes of the link's data about the sender of a waiting frame: its
    /// distance in mm, or its place.
    pub fn sighting_bytes(&self) -> u32 {
        let bytes = match (self.vm.bearings, self.profile) {
            (false, _) => 1,
            (true, NumberProfile::Tiny) => size_of::<Sighting<number::Tiny>>(),
            (true, NumberProfile::Full) => size_of::<Sighting<number::Full>>(),
        };
        bytes as u32
    }

    /// Returns the bytes for waiting messages, which the firmware has next to the machine.
    pub fn queue_memory(&self) -> u32 {
        let VmSizes { in_queue, out_queue, .. } = self.vm;
        // A frame is stored with its length. On Cortex-M it is aligned to words.
        let frame = self.frame_bytes() + 1;
        let frame = self.of_chip([frame, frame.next_multiple_of(4)]);
        (in_queue + out_queue) * (frame + QUEUED)
            + in_queue * self.sighting_bytes()
            + 2 * self.of_chip(QUEUE)
            + self.long_memory()
    }

    /// Returns the bytes of the queues for long messages.
    pub fn long_memory(&self) -> u32 {
        let VmSizes { in_long, out_long, .. } = self.vm;
        let content = u32::from(FRAGMENTS_MAX) * (self.frame_bytes() - FRAGMENT_HEAD as u32);
        let arriving = ARRIVING + self.sighting_bytes();
        in_long * (content + self.of_chip([arriving, arriving.next_multiple_of(4)]))
            + out_long * (content + LEAVING)
            + self.of_chip(TURNS)
    }

    /// Returns the bytes for neighbors, messages, stigmergies and swarms. A listener or a conflict
    /// handler is a value of the script and does not count.
    fn swarm_memory(&self) -> u32 {
        self.sizes().slots() as u32 * self.slot_bytes() + self.queue_memory() + PROTOCOL
    }

    /// Returns the largest number of slots for scripts that the memory has room for.
    pub fn most_slots(&self) -> u32 {
        self.vm.memory.saturating_sub(self.taken()) / self.slot_bytes()
    }

    /// Returns the least memory, in bytes, that has room for the robot's slots.
    pub fn least_memory(&self) -> u32 {
        self.taken() + self.vm.slots * self.slot_bytes()
    }

    /// Returns the bytes of the memory that are not slots.
    fn taken(&self) -> u32 {
        let collection = match self.profile {
            NumberProfile::Tiny => 0,
            NumberProfile::Full => self.of_chip(COLLECTION),
        };
        self.of_chip(REGISTERS) + collection + self.swarm_memory()
    }
}
