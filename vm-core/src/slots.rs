//! How slots lie in memory: what is fastest to reach on the chip at hand.
//!
//! [`Split`] keeps tags and payloads apart: no padding anywhere, and on the AVR no multiplication by an odd size to
//! reach a slot, which would double the code. [`Joined`] keeps them together: in the tiny profile on a 32-bit chip a slot then
//! takes four bytes instead of three, but is reached by one address.

use crate::number::{Full, Profile, Tiny};
use crate::value::{Tag, Value};

/// The slots of a profile's machine.
pub trait Stored: Sized {
    /// `N` slots.
    type Slots<const N: usize>: Slots<Self>
    where
        Self: Profile;
}

/// An array of slots. Verified code and the machine itself never ask for one beyond its end: it reads as nil, and
/// writing it does nothing.
pub trait Slots<P: Profile> {
    /// All nil.
    fn new() -> Self;
    /// Slot `at`.
    fn get(&self, at: usize) -> Value<P>;
    /// Writes slot `at`.
    fn set(&mut self, at: usize, value: Value<P>);
    /// The payload of slot `at` as an index.
    fn index_at(&self, at: usize) -> usize;
    /// Puts an index into slot `at` and leaves its tag.
    fn set_index(&mut self, at: usize, index: usize);
    /// The tag of slot `at`.
    fn tag_at(&self, at: usize) -> Tag;
    /// Puts a tag on slot `at` and leaves its payload.
    fn set_tag(&mut self, at: usize, tag: Tag);
}

impl Stored for Full {
    type Slots<const N: usize> = Split<Self, N>;
}

impl Stored for Tiny {
    #[cfg(target_arch = "avr")]
    type Slots<const N: usize> = Split<Self, N>;
    #[cfg(not(target_arch = "avr"))]
    type Slots<const N: usize> = Joined<Self, N>;
}

/// Tags, then payloads.
pub struct Split<P: Profile, const N: usize> {
    tags: [Tag; N],
    payloads: [P::Raw; N],
}

impl<P: Profile, const N: usize> Slots<P> for Split<P, N> {
    fn new() -> Self {
        Split { tags: [Tag::NIL; N], payloads: [P::Raw::default(); N] }
    }

    #[inline(always)]
    fn get(&self, at: usize) -> Value<P> {
        match (self.tags.get(at), self.payloads.get(at)) {
            (Some(tag), Some(payload)) => Value::new(*tag, *payload),
            _ => Value::nil(),
        }
    }

    #[inline(always)]
    fn set(&mut self, at: usize, value: Value<P>) {
        if let (Some(tag), Some(payload)) = (self.tags.get_mut(at), self.payloads.get_mut(at)) {
            *tag = value.tag();
            *payload = value.raw();
        }
    }

    #[inline(always)]
    fn index_at(&self, at: usize) -> usize {
        self.payloads.get(at).map_or(0, |payload| usize::from(P::raw_to_u16(*payload)))
    }

    #[inline(always)]
    fn set_index(&mut self, at: usize, index: usize) {
        if let Some(payload) = self.payloads.get_mut(at) {
            *payload = P::raw_from_u16(index as u16);
        }
    }

    #[inline(always)]
    fn tag_at(&self, at: usize) -> Tag {
        self.tags.get(at).copied().unwrap_or(Tag::NIL)
    }

    #[inline(always)]
    fn set_tag(&mut self, at: usize, tag: Tag) {
        if let Some(old) = self.tags.get_mut(at) {
            *old = tag;
        }
    }
}

/// Tag and payload side by side.
#[cfg(not(target_arch = "avr"))]
pub struct Joined<P: Profile, const N: usize>([Value<P>; N]);

#[cfg(not(target_arch = "avr"))]
impl<P: Profile, const N: usize> Slots<P> for Joined<P, N> {
    fn new() -> Self {
        Joined([Value::nil(); N])
    }

    #[inline(always)]
    fn get(&self, at: usize) -> Value<P> {
        match self.0.get(at) {
            Some(value) => *value,
            None => Value::nil(),
        }
    }

    #[inline(always)]
    fn set(&mut self, at: usize, value: Value<P>) {
        if let Some(slot) = self.0.get_mut(at) {
            *slot = value;
        }
    }

    #[inline(always)]
    fn index_at(&self, at: usize) -> usize {
        self.get(at).index()
    }

    #[inline(always)]
    fn set_index(&mut self, at: usize, index: usize) {
        if let Some(slot) = self.0.get_mut(at) {
            *slot = Value::indexed(slot.tag(), index as u16);
        }
    }

    #[inline(always)]
    fn tag_at(&self, at: usize) -> Tag {
        self.get(at).tag()
    }

    #[inline(always)]
    fn set_tag(&mut self, at: usize, tag: Tag) {
        if let Some(slot) = self.0.get_mut(at) {
            *slot = Value::new(tag, slot.raw());
        }
    }
}
