//! Checks of the invariants of memory, for tests. See feature `torture`.

use super::{GLOBALS, OVERLAYS, Vm, VmState};
use crate::arena::CELL;
use crate::bytecode::ByteCode;
use crate::heap::{FREE, LIVE};
use crate::network::ENTRY;
use crate::number::Profile;
use crate::value::{Tag, Value};

impl<P: Profile, C: ByteCode, const SLOTS: usize> Vm<P, C, SLOTS> {
    /// Returns the number of accesses to slots since the machine was made, without those of the
    /// collector. It measures the time that instructions take.
    pub fn accesses(&self) -> u64 {
        self.arena.accesses()
    }

    /// Returns the number of steps of collections since the machine was made, if they may pause. A
    /// step visits a cell or a root.
    pub fn collector_steps(&self) -> u64 {
        self.arena.steps
    }

    /// Collects, and returns the first error in the memory of a script that has not stopped.
    pub fn audit(&mut self) -> Result<(), &'static str> {
        if self.loaded().is_none() || matches!(self.state, VmState::Faulted(_)) {
            return Ok(());
        }
        self.end_pause();
        self.audit_stack()?;
        self.collect();
        self.audit_stack()?;
        if self.digest() != self.sum_of_entries() {
            return Err("the digest is not the sum over the entries");
        }
        self.audit_heap()
    }

    fn audit_stack(&self) -> Result<(), &'static str> {
        let (sp, reserved) = (usize::from(self.sp), usize::from(self.arena.reserved));
        if sp > reserved {
            return Err("the stack is above its reservation");
        }
        if self.arena.reserved > self.arena.bottom {
            return Err("stack and heap overlap");
        }
        let (mut fp, mut end) = (usize::from(self.fp), sp);
        while end > self.base() {
            if fp < self.base() || fp >= end {
                return Err("a frame is not below the one that it called");
            }
            end = fp;
            fp -= usize::from(self.arena.get(fp).tag().byte());
        }
        Ok(())
    }

    /// Checks the heap after a collection. Every cell in use can be reached then, so every cell
    /// that it refers to must be in use, too.
    fn audit_heap(&self) -> Result<(), &'static str> {
        let arena = &self.arena;
        if !(arena.top() - usize::from(arena.bottom)).is_multiple_of(CELL) {
            return Err("the heap is no whole number of cells");
        }
        let mut free = 0;
        for cell in (usize::from(arena.bottom)..arena.top()).step_by(CELL) {
            match arena.get(cell).tag() {
                FREE => free += 1,
                LIVE => {
                    if arena.link(cell) != 0 && !self.is_cell(arena.link(cell)) {
                        return Err("a cell's link leads to no cell in use");
                    }
                    for slot in cell + 1..cell + CELL {
                        self.audit_value(arena.get(slot))?;
                    }
                }
                _ => return Err("a cell's header is wrong after a collection"),
            }
        }
        let mut cell = usize::from(arena.free);
        while cell != 0 {
            if arena.get(cell).tag() != FREE || free == 0 {
                return Err("the list of free cells is wrong");
            }
            free -= 1;
            cell = arena.link(cell);
        }
        if free != 0 {
            return Err("a free cell is not in the list");
        }
        for slot in OVERLAYS..self.base() {
            self.audit_value(arena.get(slot))?;
        }
        for entry in 0..usize::from(self.sizes().entries) {
            let at = self.entries_at() + entry * ENTRY;
            self.audit_value(arena.get(at))?;
            self.audit_value(arena.get(at + 1))?;
        }
        let (mut fp, mut end) = (usize::from(self.fp), usize::from(self.sp));
        while end > self.base() {
            for slot in fp + 1..end {
                self.audit_value(arena.get(slot))?;
            }
            end = fp;
            fp -= usize::from(arena.get(fp).tag().byte());
        }
        Ok(())
    }

    /// Returns the first slot of the stack.
    fn base(&self) -> usize {
        GLOBALS + self.header().map_or(0, |header| usize::from(header.globals()))
    }

    fn audit_value(&self, value: Value<P>) -> Result<(), &'static str> {
        if !value.is_heap()
            || value.index() == 0 && value.is(Tag::CHAIN)
            || self.is_cell(value.index())
        {
            return Ok(());
        }
        Err("a value refers to no cell in use")
    }

    fn is_cell(&self, at: usize) -> bool {
        let bottom = usize::from(self.arena.bottom);
        at >= bottom
            && at < self.arena.top()
            && (at - bottom).is_multiple_of(CELL)
            && self.arena.get(at).tag() == LIVE
    }
}
