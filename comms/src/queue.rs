//! Frames that wait: for the script's next step, or for the link.
//!
//! Queues have a fixed size and no allocator. What is in them is worth having: doubles are dropped, an entry of a stigmergy
//! takes the place of the older one of its key that still waits, a broadcast of the one on its topic of a step that is over. If
//! there still is no place, the oldest frame of the lowest priority goes, and is counted. Priorities are those of [`Kind`].
//!
//! There is no critical section inside: who shares a queue with an interrupt handler has to guard it.

use core::marker::PhantomData;

use bittybuzz_vm_core::message::{Kind, replaces};
use bittybuzz_vm_core::number::Profile;

/// What a queue has not passed on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Frames for which there was no place, that were too long, or of no known type.
    pub dropped: u16,
    /// Frames of which the same already waited.
    pub duplicates: u16,
}

/// Frames that were received, at most `FRAMES` of at most `BYTES` bytes, each with what the link knows of it.
#[derive(Debug, Clone)]
pub struct Inbox<P: Profile, E: Copy, const BYTES: usize, const FRAMES: usize> {
    queue: Queue<P, BYTES, FRAMES>,
    extras: [E; FRAMES],
}

/// Frames that are to be sent, at most `FRAMES` of at most `BYTES` bytes.
#[derive(Debug, Clone)]
pub struct Outbox<P: Profile, const BYTES: usize, const FRAMES: usize> {
    queue: Queue<P, BYTES, FRAMES>,
}

impl<P: Profile, E: Copy, const BYTES: usize, const FRAMES: usize> Inbox<P, E, BYTES, FRAMES> {
    /// An empty one; `nothing` is what the link knows of no frame.
    pub const fn new(nothing: E) -> Self {
        Inbox { queue: Queue::EMPTY, extras: [nothing; FRAMES] }
    }

    /// How many frames wait.
    pub fn len(&self) -> usize {
        self.queue.len()
    }

    /// Whether no frame waits.
    pub fn is_empty(&self) -> bool {
        self.queue.len() == 0
    }

    /// What was not passed on.
    pub fn counters(&self) -> Counters {
        self.queue.counters
    }

    /// A frame was received. Where the same one waits, that is what the link knows of it now.
    pub fn push(&mut self, frame: &[u8], extra: E) {
        if let Some(place) = self.queue.push(frame)
            && let Some(there) = self.extras.get_mut(place)
        {
            *there = extra;
        }
    }

    /// Takes a frame out: in turn the oldest of the highest priority, and the oldest.
    pub fn pop(&mut self) -> Option<(&[u8], E)> {
        let (place, frame) = self.queue.pop()?;
        Some((frame, *self.extras.get(place)?))
    }
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Outbox<P, BYTES, FRAMES> {
    /// An empty one.
    pub const fn new() -> Self {
        Outbox { queue: Queue::EMPTY }
    }

    /// How many frames wait.
    pub fn len(&self) -> usize {
        self.queue.len()
    }

    /// Whether no frame waits.
    pub fn is_empty(&self) -> bool {
        self.queue.len() == 0
    }

    /// What was not passed on.
    pub fn counters(&self) -> Counters {
        self.queue.counters
    }

    /// A step begins: broadcasts that wait are stale as soon as there are newer ones.
    pub fn begin_step(&mut self) {
        for slot in &mut self.queue.slots {
            slot.rank |= STALE;
        }
    }

    /// A frame is to be sent.
    pub fn push(&mut self, frame: &[u8]) {
        self.queue.push(frame);
    }

    /// Takes a frame out: in turn the oldest of the highest priority, and the oldest.
    pub fn pop(&mut self) -> Option<&[u8]> {
        self.queue.pop().map(|(_, frame)| frame)
    }
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Default for Outbox<P, BYTES, FRAMES> {
    fn default() -> Self {
        Self::new()
    }
}

#[derive(Debug, Clone, Copy)]
struct Slot<const BYTES: usize> {
    /// How many frames came since, and this one, as far as a byte goes; 0 if no frame waits here.
    age: u8,
    length: u8,
    /// Its priority, of which 0 is the lowest, with [`STALE`].
    rank: u8,
    bytes: [u8; BYTES],
}

/// In a rank: from a step that is over.
const STALE: u8 = 1 << 7;

impl<const BYTES: usize> Slot<BYTES> {
    fn frame(&self) -> &[u8] {
        self.bytes.get(..self.length.into()).unwrap_or(&[])
    }
}

/// Frames in slots, which never move; a new queue is all zeros.
#[derive(Debug, Clone)]
struct Queue<P, const BYTES: usize, const FRAMES: usize> {
    slots: [Slot<BYTES>; FRAMES],
    /// How many frames wait: behind these, slots need no look. With [`BY_AGE`], the next to go is the oldest.
    waiting: u8,
    counters: Counters,
    profile: PhantomData<P>,
}

/// In the number of frames that wait.
const BY_AGE: u8 = 1 << 7;

/// How well a slot suits a new frame: the same waits there; one that the new frame replaces; nothing. Below, the priority of what
/// waits there decides.
const SAME: u8 = 255;
const REPLACED: u8 = 254;
const EMPTY: u8 = 253;
const HIGHEST_PRIORITY: u8 = 250;

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Queue<P, BYTES, FRAMES> {
    const EMPTY: Self = {
        assert!(BYTES < 256 && FRAMES < BY_AGE as usize, "lengths and counts are bytes");
        Queue {
            slots: [Slot { age: 0, length: 0, rank: 0, bytes: [0; BYTES] }; FRAMES],
            waiting: 0,
            counters: Counters { dropped: 0, duplicates: 0 },
            profile: PhantomData,
        }
    };

    fn len(&self) -> usize {
        usize::from(self.waiting & !BY_AGE)
    }

    /// Puts a frame into a slot and tells which; `None` if it is dropped.
    ///
    /// Replaced frames go. One of them, the oldest, leaves its place to the new frame, so that an entry that changes all the
    /// time is not always the last.
    fn push(&mut self, frame: &[u8]) -> Option<usize> {
        let kind = frame.first().and_then(|first| Kind::of(*first));
        let (Some(kind), true) = (kind, frame.len() <= BYTES) else {
            count(&mut self.counters.dropped);
            return None;
        };
        // What suits best, and the age of the frame there.
        let (mut first, mut place) = (0, 0);
        let mut left = self.waiting & !BY_AGE;
        for (at, slot) in self.slots.iter_mut().enumerate() {
            if slot.age == 0 {
                if order(EMPTY, 0) > first {
                    (first, place) = (order(EMPTY, 0), at);
                }
                if left == 0 {
                    break;
                }
                continue;
            }
            left = left.wrapping_sub(1);
            slot.age = slot.age.saturating_add(1);
            let mut suits = HIGHEST_PRIORITY - (slot.rank & !STALE);
            // Most differ in the first bytes.
            if slot.frame().iter().eq(frame) {
                suits = SAME;
            } else if replaces::<P>(frame, slot.frame(), slot.rank & STALE != 0) {
                suits = REPLACED;
            }
            let order = order(suits, slot.age);
            if order > first {
                (first, place) = (order, at);
            }
            if suits == REPLACED {
                slot.age = 0;
                self.waiting = self.waiting.wrapping_sub(1);
            }
        }
        let [age, suits, ..] = first.to_le_bytes();
        let slot = self.slots.get_mut(place)?;
        match suits {
            SAME => count(&mut self.counters.duplicates),
            EMPTY | REPLACED => {
                self.waiting = self.waiting.wrapping_add(1);
                slot.age = age.max(1);
            }
            _ => {
                count(&mut self.counters.dropped);
                if slot.rank & !STALE > kind as u8 {
                    return None;
                }
                slot.age = 1;
            }
        }
        slot.length = frame.len() as u8;
        slot.rank = kind as u8;
        for (to, from) in slot.bytes.iter_mut().zip(frame) {
            *to = *from;
        }
        Some(place)
    }

    /// Takes the next frame out of its slot, where it can be read until the next one comes in.
    fn pop(&mut self) -> Option<(usize, &[u8])> {
        // By age, all have the same priority.
        let priority = if self.waiting & BY_AGE != 0 { 0 } else { !STALE };
        let (mut first, mut place) = (0, 0);
        let mut left = self.waiting & !BY_AGE;
        for (at, slot) in self.slots.iter().enumerate() {
            if left == 0 {
                break;
            }
            if slot.age == 0 {
                continue;
            }
            left = left.wrapping_sub(1);
            let order = order(slot.rank & priority, slot.age);
            if order > first {
                (first, place) = (order, at);
            }
        }
        if first == 0 {
            return None;
        }
        self.waiting = (self.waiting ^ BY_AGE).wrapping_sub(1);
        let slot = self.slots.get_mut(place)?;
        slot.age = 0;
        Some((place, slot.frame()))
    }
}

/// As a number of the processor's, by which slots are compared: by age if all else is the same.
#[inline(always)]
fn order(first: u8, age: u8) -> usize {
    usize::from(first) << 8 | usize::from(age)
}

/// One more, as far as the counter goes.
fn count(counter: &mut u16) {
    *counter = counter.saturating_add(1);
}
