//! The memory in use.

use super::super::{GLOBALS, Native, Vm, VmState};
use crate::bytecode::ByteCode;
use crate::number::Profile;
use crate::value::Value;

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the number of slots that globals and frames take, including those that the running
    /// functions may still use.
    pub fn stack_slots(&self) -> usize {
        let mut slots = usize::from(self.sp);
        if self.state != VmState::Running {
            return slots;
        }
        let (mut pc, mut fp) = (usize::from(self.pc), usize::from(self.fp));
        while pc != Native::EXIT.position() {
            slots = slots.max(fp + 1 + self.frame_room(pc));
            (pc, fp) = self.caller(fp);
        }
        slots
    }

    /// Returns the number of slots of the heap that are in use, including garbage.
    pub fn heap_slots(&self) -> usize {
        let others = usize::from(self.arena.reserved) + self.arena.unused();
        self.arena.top().saturating_sub(others)
    }

    /// Returns numbers of which one changes when a slot of the heap is taken into use, and when a
    /// collection frees some.
    pub fn heap_state(&self) -> [u16; 3] {
        [self.arena.bottom, self.arena.free, self.arena.floor]
    }

    /// Returns the number of slots that the script needs to continue: globals, frames, and the part
    /// of the heap that it can still reach. A copy of the machine collects garbage to count them.
    pub fn needed_slots(&self) -> usize {
        let mut copy = self.clone();
        copy.collect();
        copy.arena.top().saturating_sub(copy.arena.unused())
    }

    /// Returns the number of slots of the heap that the script can reach only through this global.
    pub fn slots_held_by(&self, global: u16) -> usize {
        self.slots_reached(Some(global)).saturating_sub(self.slots_reached(None))
    }

    /// Returns the number of slots in use if the script could reach nothing but this global. A copy
    /// of the machine forgets the other globals and all running functions.
    fn slots_reached(&self, global: Option<u16>) -> usize {
        let mut copy = self.clone();
        let count = copy.header().map_or(0, |header| header.globals());
        for other in (0..count).filter(|other| Some(*other) != global) {
            copy.arena.set(GLOBALS + usize::from(other), Value::nil());
        }
        copy.state = VmState::Idle;
        copy.sp = GLOBALS as u16 + count;
        copy.needed_slots()
    }
}
