//! The layout of slots in memory and of values in registers, chosen for speed on each chip.
//!
//! [`Split`] stores tags and payloads in two arrays. There is no padding, and the AVR needs no
//! multiplication by an odd size to reach a slot, which would double the code. [`Joined`] stores
//! each tag next to its payload. In the tiny profile on a 32-bit chip a slot then takes four bytes
//! instead of three, but is reached by one address and fits one register, a [`SlotWord`]. In the full
//! profile it takes eight bytes instead of five, but one instruction reads or writes all of it. A
//! Cortex-M0, the only ARM core here without atomic instructions, has no memory for that.

use core::fmt::Debug;

use crate::arena::CELL;
use crate::number::{Full, Profile, Tiny};
use crate::value::{Tag, Value};

/// The storage types of a profile's machine.
pub trait Stored: Sized {
    /// `N` slots.
    type Slots<const N: usize>: Slots<Self>
    where
        Self: Profile;
    /// A value in registers.
    type Pair: Pair<Self>
    where
        Self: Profile;
}

/// A tag and a payload in registers.
pub trait Pair<P: Profile>: Copy + Debug {
    /// nil, which is all zeros.
    const NIL: Self;
    /// Makes a pair.
    fn new(tag: Tag, raw: P::Raw) -> Self;
    /// Returns the tag.
    fn tag(self) -> Tag;
    /// Returns the payload.
    fn raw(self) -> P::Raw;
    /// Returns true if it has this tag.
    fn is(self, tag: Tag) -> bool;
    /// Returns true if tags and payloads are equal.
    fn same(self, other: Self) -> bool;
}

/// A tag and a payload in registers of their own.
#[cfg(not(target_has_atomic = "ptr"))]
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Apart<P: Profile> {
    // The payload comes first, so that an AVR returns it in a pair of registers that move together.
    raw: P::Raw,
    tag: Tag,
}

#[cfg(not(target_has_atomic = "ptr"))]
impl<P: Profile> Pair<P> for Apart<P> {
    const NIL: Self = Apart { tag: Tag::NIL, raw: P::ZERO };

    #[hot]
    fn new(tag: Tag, raw: P::Raw) -> Self {
        Apart { tag, raw }
    }

    #[hot]
    fn tag(self) -> Tag {
        self.tag
    }

    #[hot]
    fn raw(self) -> P::Raw {
        self.raw
    }

    #[hot]
    fn is(self, tag: Tag) -> bool {
        self.tag == tag
    }

    #[hot]
    fn same(self, other: Self) -> bool {
        self.tag == other.tag && self.raw == other.raw
    }
}

/// A tag in the lower half of a register, and a payload of 16 bits in the upper half.
#[cfg(not(target_arch = "avr"))]
#[derive(Clone, Copy, Debug)]
pub struct SlotWord(u32);

#[cfg(not(target_arch = "avr"))]
impl Pair<Tiny> for SlotWord {
    const NIL: Self = SlotWord(0);

    #[hot]
    fn new(tag: Tag, raw: u16) -> Self {
        SlotWord(u32::from(tag.byte()) | u32::from(raw) << 16)
    }

    #[hot]
    fn tag(self) -> Tag {
        Tag::of(self.0 as u8)
    }

    #[hot]
    fn raw(self) -> u16 {
        (self.0 >> 16) as u16
    }

    #[hot]
    fn is(self, tag: Tag) -> bool {
        self.0 as u16 == u16::from(tag.byte())
    }

    #[hot]
    fn same(self, other: Self) -> bool {
        self.0 == other.0
    }
}

/// A tag in the lower half of a computer's register or in the first of a chip's two, and a payload of
/// 32 bits in the upper half or the second. It is aligned as on the chips, since robot files are checked
/// against their layout.
#[cfg(target_has_atomic = "ptr")]
#[derive(Clone, Copy, Debug)]
#[repr(C, packed(4))]
pub struct Long(u64);

#[cfg(target_has_atomic = "ptr")]
impl Pair<Full> for Long {
    const NIL: Self = Long(0);

    #[hot]
    fn new(tag: Tag, raw: u32) -> Self {
        Long(u64::from(tag.byte()) | u64::from(raw) << 32)
    }

    #[hot]
    fn tag(self) -> Tag {
        Tag::of(self.0 as u8)
    }

    #[hot]
    fn raw(self) -> u32 {
        (self.0 >> 32) as u32
    }

    #[hot]
    fn is(self, tag: Tag) -> bool {
        self.0 as u32 == u32::from(tag.byte())
    }

    #[hot]
    fn same(self, other: Self) -> bool {
        self.0 == other.0
    }
}

/// An array of slots. Verified code and the machine itself never access a slot beyond its end. Such
/// a slot reads as an arbitrary value, and writing it has no effect.
///
/// A host may store slots in a way of its own, see [`ByteCode::Slots`](crate::ByteCode::Slots).
/// Such a storage has only [`Slots::get`] and [`Slots::set`] to implement, by [`Value::parts`].
pub trait Slots<P: Profile>: Clone {
    /// The number of slots.
    const COUNT: usize;
    /// All nil, which is all zeros.
    const EMPTY: Self;

    /// Returns slot `at`.
    fn get(&self, at: usize) -> Value<P>;
    /// Writes slot `at`.
    fn set(&mut self, at: usize, value: Value<P>);
    /// Returns the payload of slot `at` as an index.
    #[hot]
    fn index_at(&self, at: usize) -> usize {
        self.get(at).index()
    }
    /// Puts an index into slot `at` without changing its tag.
    #[hot]
    fn set_index(&mut self, at: usize, index: usize) {
        self.set(at, Value::indexed(self.get(at).tag(), index as u16));
    }
    /// Returns the tag of slot `at`.
    #[hot]
    fn tag_at(&self, at: usize) -> Tag {
        self.get(at).tag()
    }
    /// Puts a tag on slot `at` without changing its payload.
    #[hot]
    fn set_tag(&mut self, at: usize, tag: Tag) {
        self.set(at, Value::new(tag, self.get(at).raw()));
    }
    /// Sets the slots of the cell at `at` to nil, with a few wide instructions, for computers.
    fn clear_cell(&mut self, at: usize) {
        for slot in at..at.wrapping_add(CELL) {
            self.set(slot, Value::NIL);
        }
    }

    /// Returns the first slot in `from..end` whose tag has the bit of references to the heap; `end`
    /// if there is none.
    #[hot]
    fn next_on_heap(&self, from: usize, end: usize) -> usize {
        let mut at = from;
        while at < end && self.tag_at(at).byte() & Tag::HEAP_BIT == 0 {
            at += 1;
        }
        at
    }

    /// Returns the first two slots of each group of `GROUP` slots between two slots. For computers, which then check the bounds once
    /// for all groups.
    #[hot]
    fn groups<const GROUP: usize>(
        &self,
        from: usize,
        end: usize,
    ) -> impl Iterator<Item = [Value<P>; 2]> {
        (from..end).step_by(GROUP).map(|at| [self.get(at), self.get(at + 1)])
    }
}

impl Stored for Full {
    #[cfg(not(target_has_atomic = "ptr"))]
    type Slots<const N: usize> = Split<Self, N>;
    #[cfg(target_has_atomic = "ptr")]
    type Slots<const N: usize> = Joined<Self, N>;
    #[cfg(not(target_has_atomic = "ptr"))]
    type Pair = Apart<Self>;
    #[cfg(target_has_atomic = "ptr")]
    type Pair = Long;
}

impl Stored for Tiny {
    #[cfg(target_arch = "avr")]
    type Slots<const N: usize> = Split<Self, N>;
    #[cfg(not(target_arch = "avr"))]
    type Slots<const N: usize> = Joined<Self, N>;
    #[cfg(target_arch = "avr")]
    type Pair = Apart<Self>;
    #[cfg(not(target_arch = "avr"))]
    type Pair = SlotWord;
}

/// All tags, followed by all payloads.
#[cfg(not(target_has_atomic = "ptr"))]
#[derive(Clone)]
pub struct Split<P: Profile, const N: usize> {
    tags: [Tag; N],
    payloads: [P::Raw; N],
}

#[cfg(not(target_has_atomic = "ptr"))]
impl<P: Profile, const N: usize> Slots<P> for Split<P, N> {
    const COUNT: usize = N;
    const EMPTY: Self = Split { tags: [Tag::NIL; N], payloads: [P::ZERO; N] };

    #[hot]
    fn get(&self, at: usize) -> Value<P> {
        // On an AVR this takes less code than making a nil.
        let at = if at < N { at } else { 0 };
        match (self.tags.get(at), self.payloads.get(at)) {
            (Some(tag), Some(payload)) => Value::new(*tag, *payload),
            _ => Value::nil(),
        }
    }

    #[hot]
    fn set(&mut self, at: usize, value: Value<P>) {
        if let (Some(tag), Some(payload)) = (self.tags.get_mut(at), self.payloads.get_mut(at)) {
            *tag = value.tag();
            *payload = value.raw();
        }
    }

    #[hot]
    fn index_at(&self, at: usize) -> usize {
        self.payloads.get(at).map_or(0, |payload| usize::from(P::raw_to_u16(*payload)))
    }

    #[hot]
    fn set_index(&mut self, at: usize, index: usize) {
        if let Some(payload) = self.payloads.get_mut(at) {
            *payload = P::raw_from_u16(index as u16);
        }
    }

    #[hot]
    fn tag_at(&self, at: usize) -> Tag {
        self.tags.get(at).copied().unwrap_or(Tag::NIL)
    }

    #[hot]
    fn set_tag(&mut self, at: usize, tag: Tag) {
        if let Some(old) = self.tags.get_mut(at) {
            *old = tag;
        }
    }

    #[hot]
    fn next_on_heap(&self, from: usize, end: usize) -> usize {
        // One check of the bounds for all of them.
        let tags = self.tags.get(from..end).unwrap_or(&[]);
        let found = tags.iter().position(|tag| tag.byte() & Tag::HEAP_BIT != 0);
        found.map_or(end, |offset| from + offset)
    }

    #[hot]
    fn clear_cell(&mut self, at: usize) {
        let tags = self.tags.get_mut(at..).and_then(<[_]>::first_chunk_mut);
        let payloads = self.payloads.get_mut(at..).and_then(<[_]>::first_chunk_mut);
        if let (Some(tags), Some(payloads)) = (tags, payloads) {
            *tags = [Tag::NIL; CELL];
            *payloads = [P::ZERO; CELL];
        }
    }
}

/// Slots with tag and payload next to each other. If `N` is a power of two, indices wrap around,
/// which takes an instruction instead of a check.
#[derive(Clone)]
#[cfg(not(target_arch = "avr"))]
pub struct Joined<P: Profile, const N: usize>([Value<P>; N]);

#[cfg(not(target_arch = "avr"))]
impl<P: Profile, const N: usize> Joined<P, N> {
    #[hot]
    fn place(at: usize) -> usize {
        if N.is_power_of_two() { at & (N - 1) } else { at }
    }
}

#[cfg(not(target_arch = "avr"))]
impl<P: Profile, const N: usize> Slots<P> for Joined<P, N> {
    const COUNT: usize = N;
    const EMPTY: Self = Joined([Value::NIL; N]);

    #[hot]
    fn get(&self, at: usize) -> Value<P> {
        match self.0.get(Self::place(at)) {
            Some(value) => *value,
            None => Value::nil(),
        }
    }

    #[hot]
    fn set(&mut self, at: usize, value: Value<P>) {
        if let Some(slot) = self.0.get_mut(Self::place(at)) {
            *slot = value;
        }
    }

    #[hot]
    fn set_index(&mut self, at: usize, index: usize) {
        if let Some(slot) = self.0.get_mut(Self::place(at)) {
            *slot = Value::indexed(slot.tag(), index as u16);
        }
    }

    #[hot]
    fn set_tag(&mut self, at: usize, tag: Tag) {
        if let Some(slot) = self.0.get_mut(Self::place(at)) {
            *slot = Value::new(tag, slot.raw());
        }
    }

    #[hot]
    fn clear_cell(&mut self, at: usize) {
        if let Some(slots) = self.0.get_mut(at..).and_then(<[_]>::first_chunk_mut) {
            *slots = [Value::NIL; CELL];
        }
    }

    #[hot]
    fn groups<const GROUP: usize>(
        &self,
        from: usize,
        end: usize,
    ) -> impl Iterator<Item = [Value<P>; 2]> {
        let (groups, _) = self.0.get(from..end).unwrap_or(&[]).as_chunks::<GROUP>();
        groups.iter().map(|group| [group[0], group[1]])
    }
}
