//! The collector: mark and sweep over uniform cells, exact at any depth in constant memory.
//!
//! Marking reverses pointers (Deutsch, Schorr and Waite): while a cell's slot is being followed, that slot leads back to
//! the cell before, and the header remembers which slot it is. The machine's own stack is not used, so no structure is
//! too deep.

use crate::arena::{Arena, CELL};
use crate::number::Profile;
use crate::value::{Tag, Value};

/// Header bit of a marked cell.
const MARK: u8 = 0x10;
/// Header bits that hold the number of the slot being followed; [`LINK`] stands for the header's own link.
const FOLLOWED_SHIFT: u8 = 5;
const LINK: usize = CELL;

impl<P: Profile, const SLOTS: usize> Arena<P, SLOTS> {
    fn marked(&self, cell: usize) -> bool {
        self.get_fast(cell).tag().0 & MARK != 0
    }

    fn set_header(&mut self, cell: usize, tag: u8) {
        let header = self.get_fast(cell);
        self.set_fast(cell, Value::new(Tag(tag), header.raw()));
    }

    /// The cell that slot `number` of `cell` leads to, 0 if none.
    #[inline(always)]
    fn child(&self, cell: usize, number: usize) -> usize {
        if number == LINK {
            return self.link(cell);
        }
        let value = self.get_fast(cell + number);
        if value.is_heap() { value.index() } else { 0 }
    }

    /// Makes slot `number` of `cell` lead to `to`, keeping its tag.
    fn redirect(&mut self, cell: usize, number: usize, to: usize) {
        let slot = if number == LINK { cell } else { cell + number };
        self.set_link(slot, to);
    }

    /// Marks everything that a value leads to.
    #[inline(never)]
    pub(crate) fn mark(&mut self, root: Value<P>) {
        if !root.is_heap() {
            return;
        }
        let mut cell = root.index();
        if self.marked(cell) {
            return;
        }
        let kind = |tag: Tag| tag.0 & (MARK - 1);
        let mut before = 0;
        let mut number = 1;
        self.set_header(cell, kind(self.get_fast(cell).tag()) | MARK);
        loop {
            while number <= LINK {
                let child = self.child(cell, number);
                if child != 0 && !self.marked(child) {
                    let tag = kind(self.get_fast(cell).tag()) | MARK;
                    self.set_header(cell, tag | ((number as u8) << FOLLOWED_SHIFT));
                    self.redirect(cell, number, before);
                    before = cell;
                    cell = child;
                    self.set_header(cell, kind(self.get_fast(cell).tag()) | MARK);
                    number = 1;
                } else {
                    number += 1;
                }
            }
            if before == 0 {
                return;
            }
            // Back to the cell before: the slot that was followed gets its own value again.
            number = (self.get_fast(before).tag().0 >> FOLLOWED_SHIFT) as usize;
            let back = if number == LINK {
                self.link(before)
            } else {
                self.get_fast(before + number).index()
            };
            self.redirect(before, number, cell);
            cell = before;
            before = back;
            number += 1;
        }
    }

    /// Frees every cell that is not marked, and forgets the marks. Free cells at the lower end of the heap become
    /// stack space again; the list holds the others, highest first, so that the heap keeps to the top.
    #[inline(never)]
    pub(crate) fn sweep(&mut self) {
        let mut cell = self.bottom as usize;
        let mut free = 0;
        let mut bottom = self.top();
        while cell < self.top() {
            let header = self.get_fast(cell);
            if header.tag().0 & MARK != 0 {
                self.set_fast(cell, Value::new(Tag(header.tag().0 & (MARK - 1)), header.raw()));
                bottom = bottom.min(cell);
            } else if bottom < cell {
                self.set_fast(cell, Value::indexed(Tag(0), free as u16));
                free = cell;
            }
            cell += CELL;
        }
        self.bottom = bottom as u16;
        self.free = free as u16;
    }
}
