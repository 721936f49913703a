//! Memory that grows on demand and is shared between copies, for the machines of robots that need
//! no chip.
//!
//! Such a machine has up to 65,520 slots, of which most scripts use few. Its slots lie in pages. A
//! page exists from the first write of a value other than nil on, so unused slots take no memory. A
//! copy of the machine shares all pages. A write to a shared page replaces it by a copy in that
//! machine.
//!
//! Slots are atomic numbers only because this is the safe way to write to memory that an [`Arc`]
//! keeps. A page is written by its one owner, which a plain load and store show to it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicU32, AtomicU64, Ordering::Relaxed};

use bittybuzz_vm_core::number::Profile;
use bittybuzz_vm_core::{ByteCode, SLOTS_MAX, Slots, Value};

use crate::robot::context::KeptImage;

/// The slots of a page, which takes 640 bytes.
const PAGE: usize = 128;

/// An image for a machine whose memory grows on demand.
#[derive(Clone, Copy)]
pub struct GrowingImage(KeptImage);

impl From<KeptImage> for GrowingImage {
    fn from(image: KeptImage) -> Self {
        GrowingImage(image)
    }
}

impl ByteCode for GrowingImage {
    type Slots<P: Profile, const SLOTS: usize> = PagedSlots;

    #[inline]
    fn len(&self) -> usize {
        ByteCode::len(&self.0)
    }

    #[inline]
    fn byte(&self, at: usize) -> u8 {
        self.0.byte(at)
    }

    #[inline]
    fn word(&self, at: usize) -> u16 {
        self.0.word(at)
    }
}

/// The slots of a machine. A page that does not exist is nil.
pub struct PagedSlots {
    pages: Vec<Option<Arc<Page>>>,
    /// Bit i of these words is set if no copy of the machine shares page i. A copy clears the bits
    /// of both machines.
    own: OwnBits,
}

type OwnBits = [AtomicU64; SLOTS_MAX.div_ceil(64 * PAGE)];

/// Tags and payloads, which lie apart because a slot then takes 5 bytes.
struct Page {
    payloads: [AtomicU32; PAGE],
    tags: [AtomicU8; PAGE],
}

impl Page {
    fn empty() -> Page {
        Page {
            payloads: [const { AtomicU32::new(0) }; PAGE],
            tags: [const { AtomicU8::new(0) }; PAGE],
        }
    }

    #[inline]
    fn get(&self, at: usize) -> (u8, u32) {
        (self.tags[at % PAGE].load(Relaxed), self.payloads[at % PAGE].load(Relaxed))
    }

    #[inline]
    fn set(&self, at: usize, (tag, payload): (u8, u32)) {
        self.tags[at % PAGE].store(tag, Relaxed);
        self.payloads[at % PAGE].store(payload, Relaxed);
    }

    fn copy(&self) -> Page {
        let page = Page::empty();
        (0..PAGE).for_each(|at| page.set(at, self.get(at)));
        page
    }
}

impl Clone for PagedSlots {
    fn clone(&self) -> Self {
        self.own.iter().for_each(|word| word.store(0, Relaxed));
        PagedSlots { pages: self.pages.clone(), own: no_bits() }
    }
}

/// Returns the bits of a machine that owns no page.
const fn no_bits() -> OwnBits {
    [const { AtomicU64::new(0) }; SLOTS_MAX.div_ceil(64 * PAGE)]
}

impl PagedSlots {
    /// Returns the word and the bit of the page of a slot in `own`.
    #[inline]
    fn own_bit(at: usize) -> (usize, u64) {
        (at / PAGE / 64, 1 << (at / PAGE % 64))
    }

    /// Writes a slot of a page that is shared or does not exist.
    #[cold]
    fn set_slowly(&mut self, at: usize, parts: (u8, u32)) {
        let there = self.pages.get(at / PAGE).and_then(Option::as_ref);
        if at >= SLOTS_MAX || there.map_or((0, 0), |page| page.get(at)) == parts {
            return;
        }
        if self.pages.len() <= at / PAGE {
            self.pages.resize(at / PAGE + 1, None);
        }
        let page = self.pages[at / PAGE].get_or_insert_with(|| Arc::new(Page::empty()));
        if Arc::get_mut(page).is_none() {
            *page = Arc::new(page.copy());
        }
        page.set(at, parts);
        let (word, bit) = Self::own_bit(at);
        *self.own[word].get_mut() |= bit;
    }
}

impl<P: Profile> Slots<P> for PagedSlots {
    const COUNT: usize = SLOTS_MAX;
    const EMPTY: Self = PagedSlots { pages: Vec::new(), own: no_bits() };

    #[inline]
    fn get(&self, at: usize) -> Value<P> {
        match self.pages.get(at / PAGE) {
            Some(Some(page)) => {
                let (tag, payload) = page.get(at);
                Value::from_parts(tag, payload)
            }
            _ => Value::nil(),
        }
    }

    #[inline]
    fn set(&mut self, at: usize, value: Value<P>) {
        let (word, bit) = Self::own_bit(at);
        match (self.pages.get(at / PAGE), self.own.get(word)) {
            (Some(Some(page)), Some(own)) if own.load(Relaxed) & bit != 0 => {
                page.set(at, value.parts());
            }
            _ => self.set_slowly(at, value.parts()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bittybuzz_vm_core::number::Full;

    fn empty() -> PagedSlots {
        <PagedSlots as Slots<Full>>::EMPTY
    }

    fn get(slots: &PagedSlots, at: usize) -> Option<i32> {
        Slots::<Full>::get(slots, at).as_int()
    }

    fn set(slots: &mut PagedSlots, at: usize, number: i32) {
        slots.set(at, Value::<Full>::int(number));
    }

    fn pages(slots: &PagedSlots) -> usize {
        slots.pages.iter().flatten().count()
    }

    #[test]
    fn a_page_exists_from_its_first_value_on() {
        let mut slots = empty();
        (0..SLOTS_MAX).for_each(|at| slots.set(at, Value::<Full>::nil()));
        assert_eq!((pages(&slots), get(&slots, 7)), (0, None));
        set(&mut slots, SLOTS_MAX - 1, 1);
        set(&mut slots, SLOTS_MAX - 2, 2);
        assert_eq!(pages(&slots), 1);
        assert_eq!(
            [SLOTS_MAX - 3, SLOTS_MAX - 2, SLOTS_MAX - 1].map(|at| get(&slots, at)),
            [None, Some(2), Some(1)]
        );
        // Beyond the end.
        set(&mut slots, usize::MAX, 3);
        assert_eq!((pages(&slots), get(&slots, usize::MAX)), (1, None));
    }

    #[test]
    fn copies_share_pages_until_one_writes() {
        let mut first = empty();
        (0..10 * PAGE).step_by(PAGE).for_each(|at| set(&mut first, at, at as i32));
        let mut second = first.clone();
        let shared = |first: &PagedSlots, second: &PagedSlots| {
            let both = first.pages.iter().flatten().zip(second.pages.iter().flatten());
            both.filter(|(one, other)| Arc::ptr_eq(one, other)).count()
        };
        assert_eq!(shared(&first, &second), 10);
        // The same value again changes nothing.
        set(&mut first, 0, 0);
        assert_eq!(shared(&first, &second), 10);
        set(&mut first, 1, 5);
        set(&mut second, PAGE, 6);
        assert_eq!(shared(&first, &second), 8);
        assert_eq!([0, 1, PAGE].map(|at| get(&first, at)), [Some(0), Some(5), Some(PAGE as i32)]);
        assert_eq!([0, 1, PAGE].map(|at| get(&second, at)), [Some(0), None, Some(6)]);
        // Without the copy, no page is copied.
        drop(second);
        let before = Arc::as_ptr(first.pages[2].as_ref().unwrap());
        set(&mut first, 2 * PAGE, 9);
        assert_eq!(Arc::as_ptr(first.pages[2].as_ref().unwrap()), before);
    }
}
