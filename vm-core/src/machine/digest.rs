//! A hash of the machine's state, by which hosts compare runs. Firmware calls nothing here, so it
//! takes no flash.

use core::hash::{Hash, Hasher};
use core::ops::Range;

use super::network::Protocol;
use super::{Vm, VmState};
use crate::bytecode::ByteCode;
use crate::heap::CollectionState;
use crate::number::{Profile, TextWork};
use crate::slots::Slots;
use crate::value::Tag;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Hashes everything except the image that determines how the machine continues: globals,
    /// frames, heap, random numbers, its knowledge of other robots, and messages that it still has
    /// to send. A hasher that takes `isize` at the same width everywhere returns the same number on
    /// every host.
    pub fn hash_state<H: Hasher>(&self, hasher: &mut H) {
        let Vm { pc, fp, sp, robot_id, rng, state, network_base, uses_network, .. } = self;
        // Between entries `pc` keeps the position at which the loop ended. It has no effect.
        let pc = if *state == VmState::Running { *pc } else { 0 };
        (pc, fp, sp, robot_id, rng, state, network_base, uses_network).hash(hasher);
        let mut work = self.work;
        work.take().hash(hasher);
        self.protocol.hash_state(hasher);
        let arena = &self.arena;
        (arena.top() as u16, arena.bottom, arena.free, arena.reserved).hash(hasher);
        (arena.floor, arena.pressed, arena.allocated).hash(hasher);
        if self.pauses() {
            arena.collection.get().hash(hasher);
        }
        let network = self.network_base();
        // Slots between frames and heap are written before they are read.
        self.hash_slots(0..usize::from(*sp), hasher);
        self.hash_slots(usize::from(arena.bottom)..arena.top(), hasher);
        self.hash_slots(network..network + self.sizes().slots(), hasher);
    }

    fn hash_slots<H: Hasher>(&self, range: Range<usize>, hasher: &mut H) {
        for at in range {
            let value = self.arena.slots.get(at);
            let (tag, mut raw) = (value.tag(), value.raw());
            if tag == Tag::FLOAT && P::float_to_f32(raw).is_nan() {
                raw = P::NAN;
            }
            let payload = P::int_to_i32(raw) as u32;
            hasher.write_u64(u64::from(tag.byte()) << 32 | u64::from(payload));
        }
    }
}

impl Protocol {
    fn hash_state<H: Hasher>(&self, hasher: &mut H) {
        let Protocol { sizes, stigmergies, step, last_sender, shares, has_dirty_entries, .. } =
            self;
        (sizes, stigmergies, step, last_sender, shares, has_dirty_entries).hash(hasher);
        let Protocol { messages_left, topics, in_message, conflict, is_resting, silent, .. } = self;
        (messages_left, topics, in_message, *conflict as u8, is_resting, silent).hash(hasher);
        let Protocol { interval, timers, newest, flags, advertised, .. } = self;
        (interval, timers, newest, flags, advertised).hash(hasher);
        let Protocol { relayed, answers, .. } = self;
        (relayed, answers).hash(hasher);
        let Protocol { reclaimed, age, turn, unadvertised, .. } = self;
        (reclaimed, age, turn, unadvertised).hash(hasher);
        // The digest follows from the entries, and some machines add them up later than others.
        let Protocol { clock, jitter, counters, .. } = self;
        (clock, jitter, counters).hash(hasher);
    }
}
