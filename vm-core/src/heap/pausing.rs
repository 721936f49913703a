//! The collector of machines with much memory, which stops and goes on between slices.
//!
//! Marking and sweeping are those of [`super::collect`], cut into steps of one cell each. The script
//! stands still from the first step to the last one, so nothing changes what was already marked, and
//! the script's accesses to memory need no barriers. The robot's other tasks run between the slices.
//!
//! # When a collection begins
//! It may begin between any two instructions, but not within one. So it begins early, while there
//! are still [`RESERVE`] cells for the next instruction, or half of the cells that the last
//! collection found if these are few. The heap takes its free cells first and then grows downwards,
//! so most of this reserve is also room for calls. An instruction that needs more is undone, and
//! executed again after the collection ([`Repeat`]). Only those that cannot be undone collect at once,
//! as on machines with little memory: calls of the robot's functions, functions of libraries except
//! `string`, and messages.

use super::collect::{FOLLOWED_SHIFT, MARKED};
use super::{FREE, LIVE};
use crate::arena::{Arena, CELL};
use crate::number::Profile;
use crate::number::wide::IS_WIDE;
use crate::slots::Slots;
use crate::value::{Tag, Value};

/// Machines with more slots pause their collections. With fewer slots a collection is shorter than
/// half a slice of a Cortex-M.
const SLOTS_AT_ONCE: usize = 2048;

/// The cells that are left for the next instruction when a collection begins. A text of 255
/// characters takes 12 of them.
const RESERVE: u16 = 32;

/// The part of a collection that is running.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[repr(u8)]
pub(crate) enum Phase {
    /// There is no collection.
    None = 0,
    /// The cells that can be reached are marked.
    Mark,
    /// All other cells are freed.
    Sweep,
    /// There is no collection, but the changes of the script are sent, one by one.
    Send,
}

/// The reaction of the running instruction to a lack of memory.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[repr(u8)]
pub(crate) enum Repeat {
    /// It collects at once.
    Never = 0,
    /// It changes nothing before its last allocation, so it can be executed again after a
    /// collection.
    Possible,
    /// It has to be executed again.
    Wanted,
    /// It is executed again. If it lacks memory nevertheless, it collects at once.
    Running,
}

/// The registers of a collection, and the plan for the next one. It is all zeros at first.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Collection {
    pub(crate) progress: Progress,
    pub(crate) repeat: Repeat,
    /// The number of cells that can be taken before the next collection begins.
    left: u16,
    /// The number of cells that can be taken after that.
    reserve: u16,
    /// The part of `left` that is kept for a message: a collection begins before its reception.
    for_message: u16,
}

/// The registers of a collection that is running.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub(crate) struct Progress {
    pub(crate) phase: Phase,
    /// The number of keys and values of entries that are still to be marked, or of entries that may
    /// still be sent.
    pub(crate) entry_slots: u16,
    /// The slot above the next root on the stack; or the place of the next entry.
    pub(crate) slot: u16,
    /// The record of the frame in which this slot lies, and the position at which it continues.
    pub(crate) fp: u16,
    pub(crate) pc: u16,
    /// The end of the slots that the frames visited so far may use.
    pub(crate) reserved: u16,
    /// The cell that is being marked, 0 between two roots; the cell that is being swept.
    cell: u16,
    /// The cell from which the marked one was reached, 0 if it was a root; or the head of the new
    /// list of free cells.
    before: u16,
    /// The next slot of the marked cell; or the lowest cell in use.
    at: u16,
    /// The numbers of cells that the sweep has found in use, and free.
    in_use: u16,
    free: u16,
}

impl Progress {
    /// No collection.
    pub(crate) const NONE: Self = Progress {
        phase: Phase::None,
        entry_slots: 0,
        slot: 0,
        fp: 0,
        pc: 0,
        reserved: 0,
        cell: 0,
        before: 0,
        at: 0,
        in_use: 0,
        free: 0,
    };

    /// Returns the start of the sending of at most `entries` changed entries.
    pub(crate) fn sending(entries: u16) -> Self {
        Progress { phase: Phase::Send, entry_slots: entries, ..Progress::NONE }
    }

    /// Returns the start of a collection with these roots: keys and values of entries, and the
    /// slots below `slot`, with the record of the innermost frame at `fp`.
    pub(crate) fn new(entry_slots: u16, slot: u16, fp: u16, pc: u16) -> Self {
        let phase = Phase::Mark;
        Progress { phase, entry_slots, slot, fp, pc, reserved: slot, ..Progress::NONE }
    }
}

/// The state that a profile's machine keeps of a collection.
pub trait CollectionState: Copy + core::fmt::Debug {
    /// No collection, which is all zeros.
    const NONE: Self;
    /// True if there is a state.
    const IS_KEPT: bool;

    /// Returns the state, or that of no collection.
    fn get(&self) -> Collection;

    /// Changes the state.
    fn change(&mut self, change: impl FnOnce(&mut Collection));
}

impl CollectionState for () {
    const NONE: Self = ();
    const IS_KEPT: bool = false;

    #[hot]
    fn get(&self) -> Collection {
        Collection::NONE
    }

    #[hot]
    fn change(&mut self, _: impl FnOnce(&mut Collection)) {}
}

impl CollectionState for Collection {
    const NONE: Self = Collection {
        progress: Progress::NONE,
        repeat: Repeat::Never,
        left: 0,
        reserve: 0,
        for_message: 0,
    };
    const IS_KEPT: bool = true;

    #[hot]
    fn get(&self) -> Collection {
        *self
    }

    #[hot]
    fn change(&mut self, change: impl FnOnce(&mut Collection)) {
        change(self);
    }
}

impl<P: Profile, S: Slots<P>> Arena<P, S> {
    /// True if collections stop and go on between slices. Computers need no pauses, and so a host
    /// may inspect a machine between any two slices.
    pub(crate) const PAUSES: bool = P::Collection::IS_KEPT
        && S::COUNT > SLOTS_AT_ONCE
        && (!IS_WIDE || cfg!(feature = "torture"));

    /// Counts a cell that was taken.
    #[hot]
    pub(crate) fn count_cell(&mut self) {
        if Self::PAUSES {
            self.collection.change(|state| state.left = state.left.saturating_sub(1));
        }
    }

    /// Plans the next collection, with that number of cells in the list of free ones.
    #[hot]
    pub(crate) fn plan(&mut self, free: u16) {
        if !Self::PAUSES {
            return;
        }
        let lowest = self.reserved.max(self.floor);
        let available = free + self.bottom.saturating_sub(lowest) / CELL as u16;
        let reserve = RESERVE.min(available / 2);
        let for_message = (available / 2).min(self.top() as u16 / 4 / CELL as u16);
        self.collection.change(|state| {
            state.left = available - reserve;
            state.reserve = reserve;
            state.for_message = for_message.saturating_sub(reserve);
        });
    }

    /// Returns true if a collection should begin before the next instruction, or before the
    /// reception of a message.
    #[hot]
    pub(crate) fn wants_collection(&self, is_for_message: bool) -> bool {
        if !Self::PAUSES || !self.allocated {
            return false;
        }
        let Collection { left, reserve, for_message, .. } = self.collection.get();
        let wanted = if is_for_message { for_message } else { 0 };
        if left <= wanted {
            return true;
        }
        // The stack has grown since the collection was planned.
        let lowest = usize::from(self.reserved.max(self.floor));
        let room = usize::from(wanted + reserve) * CELL;
        self.free == 0 && usize::from(self.bottom) < lowest + room
    }

    /// Marks cells from the registers on until no cell is left to be visited, or all work is done.
    #[one_copy]
    pub(crate) fn mark_on(&mut self, progress: &mut Progress, work: &mut usize) {
        let mut cell = usize::from(progress.cell);
        let mut before = usize::from(progress.before);
        let mut at = usize::from(progress.at);
        while cell != 0 && *work != 0 {
            *work -= 1;
            self.count_step();
            let end = cell + CELL;
            let mut child = 0;
            at = self.slots.next_on_heap(at, end);
            while at < end {
                child = self.slots.index_at(at);
                if child != 0 && !self.leads_on(child) {
                    break;
                }
                at = self.slots.next_on_heap(at + 1, end);
            }
            if at < end {
                let number = (at - cell) as u8;
                self.slots.set_tag(cell, Tag::of(MARKED | number << FOLLOWED_SHIFT));
                self.slots.set_index(at, before);
                before = cell;
                cell = child;
                at = cell;
                self.slots.set_tag(cell, Tag::of(MARKED));
            } else if before == 0 {
                cell = 0;
            } else {
                at = before + usize::from(self.slots.tag_at(before).byte() >> FOLLOWED_SHIFT);
                let back = self.slots.index_at(at);
                self.slots.set_index(at, cell);
                cell = before;
                before = back;
                at += 1;
            }
        }
        progress.cell = cell as u16;
        progress.before = before as u16;
        progress.at = at as u16;
    }

    /// Begins to mark what can be reached from a root.
    #[hot]
    pub(crate) fn mark_root(&mut self, progress: &mut Progress, root: Value<P>) {
        if root.is_heap() && !self.leads_on(root.index()) {
            self.slots.set_tag(root.index(), Tag::of(MARKED));
            progress.cell = root.index() as u16;
            progress.before = 0;
            progress.at = progress.cell;
        }
    }

    /// Begins the sweep.
    pub(crate) fn begin_sweep(&mut self, progress: &mut Progress) {
        progress.phase = Phase::Sweep;
        progress.cell = self.bottom;
        progress.before = 0;
        progress.at = self.top() as u16;
        progress.in_use = 0;
        progress.free = 0;
    }

    /// Sweeps cells from the registers on. Returns true after the last one.
    #[one_copy]
    pub(crate) fn sweep_on(&mut self, progress: &mut Progress, work: &mut usize) -> bool {
        let top = self.top() as u16;
        let Progress { mut cell, mut before, mut at, mut in_use, mut free, .. } = *progress;
        while cell < top {
            if *work == 0 {
                *progress = Progress { cell, before, at, in_use, free, ..*progress };
                return false;
            }
            *work -= 1;
            self.count_step();
            if self.leads_on(cell.into()) {
                self.slots.set_tag(cell.into(), LIVE);
                at = at.min(cell);
                in_use += 1;
            } else if at < cell {
                self.slots.set(cell.into(), Value::indexed(FREE, before));
                before = cell;
                free += 1;
            }
            cell += CELL as u16;
        }
        self.bottom = at;
        self.free = before;
        self.reserved = progress.reserved;
        self.set_floor(usize::from(in_use) * CELL);
        self.plan(free);
        self.allocated = false;
        true
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::arena::TestArena;
    use crate::number::Full;
    use std::boxed::Box;
    use std::vec::Vec;

    /// A whole number of cells, and some slots below them.
    const SLOTS: usize = 300 * CELL + 3;
    type Memory = TestArena<Full, SLOTS>;

    /// Returns the next number of a small generator, so that runs are the same everywhere.
    fn random(state: &mut u32, below: usize) -> usize {
        *state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (*state >> 16) as usize % below
    }

    /// Collects in slices of so many steps as `slice` returns, and calls `between` after each.
    fn collect(
        memory: &mut Memory,
        roots: &[Value<Full>],
        mut slice: impl FnMut() -> usize,
        mut between: impl FnMut(&Memory, &Progress),
    ) {
        let mut progress = Progress::new(0, 0, 0, 0);
        for root in roots {
            memory.mark_root(&mut progress, *root);
            while progress.cell != 0 {
                memory.mark_on(&mut progress, &mut slice());
                between(memory, &progress);
            }
        }
        memory.begin_sweep(&mut progress);
        while !memory.sweep_on(&mut progress, &mut slice()) {
            between(memory, &progress);
        }
    }

    fn assert_same(a: &Memory, b: &Memory, round: usize) {
        assert_eq!((a.bottom, a.free, a.floor), (b.bottom, b.free, b.floor), "round {round}");
        for at in usize::from(a.bottom)..a.top() {
            assert!(a.get(at).same(b.get(at)), "round {round}: slot {at}");
        }
    }

    /// Returns a memory full of tables that refer to each other in arrays, pairs and bound
    /// functions, and some of the tables.
    fn graph(state: &mut u32) -> (Box<Memory>, Vec<Value<Full>>) {
        let mut memory = Box::new(Memory::full());
        let count = 2 + random(state, 60);
        let nodes: Vec<_> = (0..count).map(|_| memory.new_table().unwrap()).collect();
        for edge in 0..random(state, 3 * count) {
            let (from, to) = (random(state, count), random(state, count));
            let value = match random(state, 3) {
                0 => {
                    let cell = memory.new_table().unwrap().index();
                    memory.bound(cell, Value::nil(), nodes[to])
                }
                _ => nodes[to],
            };
            let key = match random(state, 2) {
                0 => Value::int(memory.table_size(nodes[from].index()) as i32),
                _ => Value::string(edge as u16),
            };
            memory.table_set(nodes[from].index(), key, value).unwrap();
        }
        let roots = (0..random(state, 4)).map(|_| nodes[random(state, count)]).collect();
        (memory, roots)
    }

    /// The collector that does not pause is the model.
    #[test]
    fn pauses_change_no_collection() {
        let mut state = 3;
        for round in 0..300 {
            let (memory, roots) = graph(&mut state);
            let mut expected = memory.clone();
            roots.iter().for_each(|root| expected.mark(*root));
            expected.sweep();
            let mut paused = memory.clone();
            match round % 3 {
                0 => collect(&mut paused, &roots, || usize::MAX, |_, _| {}),
                1 => collect(&mut paused, &roots, || 1, |_, _| {}),
                _ => collect(&mut paused, &roots, || 1 + random(&mut state, 9), |_, _| {}),
            }
            assert_same(&expected, &paused, round);
        }
    }

    /// A copy that is made at any pause continues as the original does.
    #[test]
    fn a_copy_continues_at_every_pause() {
        let mut state = 8;
        for round in 0..20 {
            let (memory, roots) = graph(&mut state);
            let Some(root) = roots.first() else { continue };
            let mut expected = memory.clone();
            expected.mark(*root);
            expected.sweep();
            let mut copies = Vec::new();
            let mut original = memory.clone();
            let keep = |memory: &Memory, progress: &Progress| {
                copies.push((Box::new(memory.clone()), *progress));
            };
            collect(&mut original, &[*root], || 1, keep);
            assert!(copies.len() > 3, "round {round}: {} pauses", copies.len());
            for (mut copy, mut progress) in copies {
                let mut work = usize::MAX;
                if progress.phase == Phase::Mark {
                    copy.mark_on(&mut progress, &mut work);
                    copy.begin_sweep(&mut progress);
                }
                assert!(copy.sweep_on(&mut progress, &mut work));
                assert_same(&expected, &copy, round);
            }
        }
    }

    #[test]
    fn a_step_visits_one_cell() {
        let mut memory = Box::new(Memory::full());
        let mut list = Value::nil();
        for _ in 0..SLOTS / CELL {
            let node = memory.new_table().unwrap();
            memory.table_set(node.index(), Value::string(0), list).unwrap();
            list = node;
        }
        // Each cell is visited on the way in and on the way back, and once more by the sweep.
        let mut steps = 0;
        collect(&mut memory, &[list], || 1, |_, _| steps += 1);
        assert!((SLOTS / CELL..=3 * (SLOTS / CELL)).contains(&steps), "{steps}");
    }
}
