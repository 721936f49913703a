//! The collector: mark and sweep over cells of equal size, in constant memory.
//!
//! Tables, closures and long strings consist of cells of equal size, which never move. A free list is
//! therefore enough for allocation, and any cell fits where another one was freed. References are plain
//! slot numbers and stay valid. A copying collector would need half of the memory for its copies, and
//! reference counting would need a counter in each cell and would not free cycles.
//!
//! # Marking without a stack
//! A structure of a script may be as deep as its memory, and this machine has no memory to spare for a
//! stack of cells that still have to be visited. Marking therefore reverses pointers (Deutsch, Schorr
//! and Waite). While a slot of a cell is followed, that slot holds the way back to the previous cell,
//! and the tag of the cell's header holds the number of the slot. On the way back each slot gets its
//! own value again. A cell that is reached for the first time costs two writes more than its mark: one
//! for the reversed pointer, one to restore it. The processor's stack does not grow.
//!
//! A marked header has the same tag bit as a reference, so one test, [`Arena::leads_on`], answers both
//! "is this a reference?" and "is this cell marked?".
//!
//! # Sweeping
//! The sweep visits all cells from the lowest to the highest, frees those without a mark and removes
//! the marks. Free cells at the lower end of the heap become stack space again. The free list gives the
//! highest cell first, so that the heap stays at the top and leaves room for calls.
//!
//! # When the machine collects
//! * An allocation finds no free cell, or the heap has grown by a quarter of the memory since the last
//!   collection ([`Arena::set_floor`]), or into the room that an entry leaves to calls
//!   ([`Arena::leave_room_for_calls`]).
//! * A call needs stack space that heap cells occupy.
//! * An entry point ends after it allocated something, and less than a quarter of the memory is unused.
//! * The script restarts after a fault.
//!
//! A collection may therefore happen at any call and at any allocation, and a value that an instruction
//! still needs must lie in a slot. Roots are the globals, the frames, and the keys and values of the
//! stigmergies; `Vm::collect` passes them to [`Arena::mark`] one by one. `docs/performance.md` has the
//! longest slice of a script with a full heap on each chip. [`super::pausing`] has the collector of
//! chips with much memory.

use super::{FREE, LIVE};
use crate::arena::{Arena, CELL};
use crate::number::Profile;
use crate::slots::Slots;
use crate::value::{Tag, Value};

/// The header tag of a marked cell. The payload of a header is its link, so a marked header looks
/// like a reference to the linked cell, and marking follows it like any other reference.
pub(super) const MARKED: u8 = LIVE.byte() | Tag::HEAP_BIT;
/// The first bit in the header's tag of the number, 0 to 6, of the slot that is being followed.
pub(super) const FOLLOWED_SHIFT: u8 = 5;

impl<P: Profile, S: Slots<P>> Arena<P, S> {
    /// Returns true if the slot holds a reference to a cell, or the header of a marked cell.
    #[hot]
    pub(super) fn leads_on(&self, at: usize) -> bool {
        self.slots.tag_at(at).byte() & Tag::HEAP_BIT != 0
    }

    /// Marks every cell that can be reached from a value.
    #[one_copy]
    pub(crate) fn mark(&mut self, root: Value<P>) {
        if !root.is_heap() {
            return;
        }
        let mut cell = root.index();
        if self.leads_on(cell) {
            return;
        }
        let mut before = 0;
        let mut at = cell;
        self.slots.set_tag(cell, Tag::of(MARKED));
        loop {
            let mut child = 0;
            while at < cell + CELL {
                if self.leads_on(at) {
                    child = self.slots.index_at(at);
                    if child != 0 && !self.leads_on(child) {
                        break;
                    }
                }
                at += 1;
            }
            if at < cell + CELL {
                let number = (at - cell) as u8;
                self.slots.set_tag(cell, Tag::of(MARKED | number << FOLLOWED_SHIFT));
                self.slots.set_index(at, before);
                before = cell;
                cell = child;
                at = cell;
                self.slots.set_tag(cell, Tag::of(MARKED));
                continue;
            }
            if before == 0 {
                return;
            }
            // Go back to the previous cell. The slot that was followed gets its own value again.
            at = before + usize::from(self.slots.tag_at(before).byte() >> FOLLOWED_SHIFT);
            let back = self.slots.index_at(at);
            self.slots.set_index(at, cell);
            cell = before;
            before = back;
            at += 1;
        }
    }

    /// Frees every cell that is not marked, and removes all marks. Free cells at the lower end of the
    /// heap become stack space again; the free list holds the others, the highest first.
    #[one_copy]
    pub(crate) fn sweep(&mut self) {
        let mut cell = self.bottom as usize;
        let mut free = 0;
        let mut bottom = self.top();
        let mut in_use = 0;
        while cell < self.top() {
            if self.leads_on(cell) {
                self.slots.set_tag(cell, LIVE);
                bottom = bottom.min(cell);
                in_use += CELL;
            } else if bottom < cell {
                self.slots.set(cell, Value::indexed(FREE, free as u16));
                free = cell;
            }
            cell += CELL;
        }
        self.bottom = bottom as u16;
        self.free = free as u16;
        self.set_floor(in_use);
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::arena::TestArena;
    use crate::number::Tiny;
    use std::boxed::Box;
    use std::vec::Vec;

    #[test]
    fn keeps_a_list_as_long_as_the_memory() {
        let mut memory: Box<TestArena<Tiny, 60_000>> = Box::new(Arena::full());
        let mut list = Value::nil();
        let mut length = 0;
        while let Ok(node) = memory.new_table() {
            memory.table_set(node.index(), Value::string(0), list).unwrap();
            list = node;
            length += 1;
        }
        assert_eq!(length, 60_000 / CELL);
        memory.mark(list);
        memory.sweep();
        assert_eq!(memory.free, 0);
        for _ in 0..length {
            assert!(list.is(Tag::TABLE));
            list = memory.table_get(list.index(), Value::string(0));
        }
        assert!(list.is_nil());
        // Without a root, the sweep frees all cells.
        memory.sweep();
        assert_eq!(usize::from(memory.bottom), memory.top());
    }

    #[test]
    fn keeps_exactly_what_can_be_reached() {
        let mut state = 5u32;
        let mut random = move |below: usize| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 16) as usize % below
        };
        for round in 0..200 {
            let mut memory: TestArena<Tiny, 3000> = Arena::full();
            let nodes: Vec<Value<Tiny>> = (0..40).map(|_| memory.new_table().unwrap()).collect();
            let mut edges: Vec<(usize, usize)> = Vec::new();
            for _ in 0..random(90) {
                let (from, to) = (random(40), random(40));
                // References in arrays, in pairs and in bound functions are all followed.
                let value = match random(3) {
                    0 => {
                        let cell = memory.new_table().unwrap().index();
                        memory.bound(cell, Value::nil(), nodes[to])
                    }
                    _ => nodes[to],
                };
                let size = memory.table_size(nodes[from].index());
                let key = if random(2) == 0 {
                    Value::int(size as i32)
                } else {
                    Value::string(size as u16)
                };
                if memory.table_get(nodes[from].index(), key).is_nil() {
                    memory.table_set(nodes[from].index(), key, value).unwrap();
                    edges.push((from, to));
                }
            }
            let mut reached = std::vec![0];
            let mut next = 0;
            while next < reached.len() {
                let from = reached[next];
                next += 1;
                for edge in edges.iter().filter(|edge| edge.0 == from) {
                    if !reached.contains(&edge.1) {
                        reached.push(edge.1);
                    }
                }
            }
            let before: Vec<Value<Tiny>> = (0..memory.top()).map(|at| memory.get(at)).collect();
            memory.mark(nodes[0]);
            for (number, node) in nodes.iter().enumerate() {
                assert_eq!(
                    memory.leads_on(node.index()),
                    reached.contains(&number),
                    "round {round}"
                );
            }
            memory.sweep();
            // The reversed pointers were restored.
            for node in reached.iter().map(|number| nodes[*number].index()) {
                for (slot, old) in before.iter().enumerate().skip(node).take(CELL) {
                    assert!(memory.get(slot).same(*old), "round {round}");
                }
            }
        }
    }
}
