//! The memory of a script: an array of slots, each a tag byte and a payload.
//!
//! ```text
//! 0            base          sp                 bottom            top
//! | globals    | frames ->   |      free        |   <- heap cells  |
//! ```
//! Globals come first. Frames grow upwards after them, and heap cells grow downwards from the top;
//! the heap may use all slots that the stack does not use. A heap cell consists of [`CELL`] slots
//! and never moves. It is named by the index of its first slot, so 0 is no cell. [`crate::heap`]
//! describes the contents of cells.

#[cfg(feature = "torture")]
use core::cell::Cell;
use core::marker::PhantomData;
use core::num::NonZeroUsize;

use crate::heap::{CollectionState, NoCell};
use crate::number::Profile;
use crate::number::wide::IS_WIDE;
use crate::slots::Slots;
#[cfg(test)]
use crate::slots::Stored;
use crate::value::{Tag, Value};

/// The number of slots of a heap cell: a header and six others.
pub(crate) const CELL: usize = 7;

/// The largest number of slots of a machine: slots are numbered in 16 bits, and numbers from 0xfff0
/// on stand for no slot.
pub const SLOTS_MAX: usize = 0xfff0;

/// A larger memory may be collected before its heap has grown by a quarter of it.
const LARGE: usize = 4096;

/// The memory of a script, see the module. The slots come last, so that the AVR reaches the other
/// fields with short instructions.
#[repr(C)]
#[derive(Clone)]
pub(crate) struct Arena<P: Profile, S> {
    /// The number of slots in use, at most those that are stored.
    top: u16,
    /// The lowest cell that is in use or in the list of free cells; `top` if there is none.
    pub(crate) bottom: u16,
    /// The head of the list of free cells above `bottom`, 0 if the list is empty.
    pub(crate) free: u16,
    /// No cell may be placed below this slot: the end of the slots that frames may have used since
    /// the last collection.
    pub(crate) reserved: u16,
    /// No cell may be placed below this slot before the next collection. Otherwise garbage would
    /// drive the heap down into the space for calls, and a cell that stays in use there would block
    /// it.
    pub(crate) floor: u16,
    /// True while an allocation is tried again after its collection. It may then go below the
    /// floor.
    pub(crate) pressed: bool,
    /// True if a cell was taken since the last collection.
    pub(crate) allocated: bool,
    /// The collection that is running, on a machine that [`Arena::PAUSES`].
    pub(crate) collection: P::Collection,
    /// The number of accesses to slots, without those of the collector. It measures time in a way
    /// that is the same on every host.
    #[cfg(feature = "torture")]
    accesses: Cell<u64>,
    /// The number of steps of collections that pause.
    #[cfg(feature = "torture")]
    pub(crate) steps: u64,
    pub(crate) slots: S,
    pub(crate) profile: PhantomData<P>,
}

/// An arena with `N` slots of its own.
#[cfg(test)]
pub(crate) type TestArena<P, const N: usize> = Arena<P, <P as Stored>::Slots<N>>;

impl<P: Profile, S: Slots<P>> Arena<P, S> {
    /// Returns an arena, of all zeros, which has no slots before [`Arena::reset`].
    pub(crate) const fn new() -> Self {
        const { assert!(S::COUNT <= SLOTS_MAX, "slots are numbered in 16 bits") }
        Arena {
            top: 0,
            bottom: 0,
            free: 0,
            reserved: 0,
            floor: 0,
            pressed: false,
            allocated: false,
            collection: P::Collection::NONE,
            #[cfg(feature = "torture")]
            accesses: Cell::new(0),
            #[cfg(feature = "torture")]
            steps: 0,
            slots: S::EMPTY,
            profile: PhantomData,
        }
    }

    /// Returns an arena with all slots in use.
    #[cfg(test)]
    pub(crate) fn full() -> Self {
        Arena { top: S::COUNT as u16, bottom: S::COUNT as u16, ..Self::new() }
    }

    /// Forgets everything and uses only the first `slots` slots, or all if there are fewer.
    #[one_copy]
    pub(crate) fn reset(&mut self, slots: usize) {
        self.top = slots.min(S::COUNT) as u16;
        self.bottom = self.top;
        self.free = 0;
        self.reserved = 0;
        self.set_floor(0);
        self.pressed = false;
        self.allocated = false;
        self.collection = P::Collection::NONE;
        self.plan(0);
        self.fill(0, self.top as usize);
    }

    /// Sets the limit for the growth of the heap: a quarter of the memory more than the slots
    /// `in_use`. With a large memory it is as many more as are in use, since garbage would take
    /// memory of the host for nothing.
    pub(crate) fn set_floor(&mut self, in_use: usize) {
        let mut growth = self.top() / 4;
        if S::COUNT > LARGE {
            growth = growth.min(in_use.max(LARGE / 4));
        }
        let room = in_use + growth;
        self.floor = self.top().saturating_sub(room) as u16;
    }

    /// Leaves an eighth of the memory to calls when an entry begins, whose stack begins at slot
    /// `from`, unless cells lie there. After a collection at the fullest moment of the entry before,
    /// garbage might fill all that moment has needed; cells never move, so a table that stays in the
    /// lowest place would keep calls from the room of all above it.
    #[one_copy]
    pub(crate) fn leave_room_for_calls(&mut self, from: usize) {
        let limit = from + self.top() / 8;
        if !Self::PAUSES && limit <= usize::from(self.bottom) {
            self.floor = self.floor.max(limit as u16);
        }
    }

    /// Sets slots `from..to` to nil.
    #[one_copy]
    pub(crate) fn fill(&mut self, from: usize, to: usize) {
        for at in from..to.min(S::COUNT) {
            self.set_fast(at, Value::nil());
        }
    }

    #[hot]
    fn count_access(&self) {
        #[cfg(feature = "torture")]
        self.accesses.set(self.accesses.get() + 1);
    }

    #[hot]
    pub(crate) fn count_step(&mut self) {
        #[cfg(feature = "torture")]
        {
            self.steps += 1;
        }
    }

    /// Returns the number of accesses to slots.
    #[cfg(feature = "torture")]
    pub(crate) fn accesses(&self) -> u64 {
        self.accesses.get()
    }

    /// Returns the number of slots in use.
    pub(crate) fn top(&self) -> usize {
        self.top as usize
    }

    /// Returns a slot. If there is no slot of that number the result is arbitrary, but verified
    /// code and the machine itself never read one. This function is for the few places where speed
    /// counts; elsewhere [`Arena::get`] takes less code.
    #[hot]
    pub(crate) fn get_fast(&self, at: usize) -> Value<P> {
        self.count_access();
        self.slots.get(at)
    }

    /// Returns slots `at` and `at + 1`, with one check for both.
    #[hot]
    pub(crate) fn pair_fast(&self, at: usize) -> [Value<P>; 2] {
        if S::COUNT.is_power_of_two() && !cfg!(target_arch = "avr")
            || at < S::COUNT.saturating_sub(1)
        {
            [self.get_fast(at), self.get_fast(at + 1)]
        } else {
            [Value::nil(); 2]
        }
    }

    /// Writes a slot; see [`Arena::get_fast`].
    #[hot]
    pub(crate) fn set_fast(&mut self, at: usize, value: Value<P>) {
        self.count_access();
        self.slots.set(at, value);
    }

    /// Returns a slot.
    #[one_copy]
    pub(crate) fn get(&self, at: usize) -> Value<P> {
        self.get_fast(at)
    }

    /// Writes a slot.
    #[one_copy]
    pub(crate) fn set(&mut self, at: usize, value: Value<P>) {
        self.set_fast(at, value);
    }

    /// Copies slot `from` to slot `to`.
    #[one_copy]
    pub(crate) fn copy(&mut self, from: usize, to: usize) {
        self.set_fast(to, self.get_fast(from));
    }

    /// Moves `count` slots, the first of which is `from`, down by `by` slots.
    #[one_copy]
    pub(crate) fn shift_down(&mut self, from: usize, count: usize, by: usize) {
        // This is a loop, because `copy_within` could panic.
        for at in from..from.wrapping_add(count) {
            self.copy(at, at.wrapping_sub(by));
        }
    }

    /// Returns the link of a cell: another cell, or 0.
    #[hot]
    pub(crate) fn link(&self, cell: usize) -> usize {
        self.index_at(cell)
    }

    /// Returns the payload of a slot as an index.
    #[hot]
    pub(crate) fn index_at(&self, at: usize) -> usize {
        self.count_access();
        self.slots.index_at(at)
    }

    /// Returns true if the slot holds nil. Reads the tag alone, which is faster than reading the
    /// value.
    #[hot]
    pub(crate) fn is_nil_at(&self, at: usize) -> bool {
        self.count_access();
        self.slots.tag_at(at) == Tag::NIL
    }

    /// Sets the link of a cell without changing the tag of its header.
    #[one_copy]
    pub(crate) fn set_link(&mut self, cell: usize, to: usize) {
        self.slots.set_index(cell, to);
    }

    /// Puts a number up to 254 in place of a slot's tag. This is a function of its own for the same
    /// reason as [`Value::marked`].
    #[one_copy]
    pub(crate) fn set_tag(&mut self, at: usize, number: u8) {
        self.slots.set_tag(at, Tag::of(number));
    }

    /// Takes a cell from the free list, or extends the heap downwards. All its slots are nil, so
    /// its header is already that of a cell in use. Fails if there is no cell before a collection.
    pub(crate) fn take_cell(&mut self) -> Result<NonZeroUsize, NoCell> {
        let mut cell = self.free;
        if cell != 0 {
            self.free = self.link(cell.into()) as u16;
        } else {
            cell = self.bottom.wrapping_sub(CELL as u16);
            if self.bottom < self.reserved + CELL as u16 || (cell < self.floor && !self.pressed) {
                return Err(NoCell);
            }
            self.bottom = cell;
        }
        self.allocated = true;
        self.count_cell();
        let cell = usize::from(cell);
        if IS_WIDE && !cfg!(feature = "torture") {
            self.slots.clear_cell(cell);
        } else {
            self.fill(cell, cell + CELL);
        }
        NonZeroUsize::new(cell).ok_or(NoCell)
    }

    /// Returns the number of slots that are between the stack's reservation and the heap, or in
    /// free cells.
    #[one_copy]
    pub(crate) fn unused(&self) -> usize {
        let mut count = usize::from(self.bottom.wrapping_sub(self.reserved));
        let mut cell = self.free as usize;
        while cell != 0 {
            count += CELL;
            cell = self.link(cell);
        }
        count
    }
}
