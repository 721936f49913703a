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
            slot.is_stale = true;
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
    /// From a step that is over.
    is_stale: bool,
    bytes: [u8; BYTES],
}

impl<const BYTES: usize> Slot<BYTES> {
    fn frame(&self) -> &[u8] {
        self.bytes.get(..self.length.into()).unwrap_or(&[])
    }

    /// 0 is the lowest.
    fn priority(&self) -> u8 {
        self.bytes.first().map_or(0, |first| priority(*first))
    }
}

/// Frames in slots, which never move; a new queue is all zeros.
#[derive(Debug, Clone)]
struct Queue<P, const BYTES: usize, const FRAMES: usize> {
    slots: [Slot<BYTES>; FRAMES],
    /// The next frame to go is the oldest.
    by_age: bool,
    counters: Counters,
    profile: PhantomData<P>,
}

/// How well a slot suits a new frame: the same waits there; one that the new frame replaces; nothing. Below, the priority of what
/// waits there decides.
const SAME: u8 = 255;
const REPLACED: u8 = 254;
const EMPTY: u8 = 253;
const HIGHEST_PRIORITY: u8 = 250;

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Queue<P, BYTES, FRAMES> {
    const EMPTY: Self = {
        assert!(BYTES < 256, "lengths are bytes");
        Queue {
            slots: [Slot { age: 0, length: 0, is_stale: false, bytes: [0; BYTES] }; FRAMES],
            by_age: false,
            counters: Counters { dropped: 0, duplicates: 0 },
            profile: PhantomData,
        }
    };

    fn len(&self) -> usize {
        self.slots.iter().filter(|slot| slot.age != 0).count()
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
        let mut best: Option<(u8, usize, &mut Slot<BYTES>)> = None;
        for (place, slot) in self.slots.iter_mut().enumerate() {
            let mut suits = EMPTY;
            if slot.age != 0 {
                slot.age = slot.age.saturating_add(1);
                suits = HIGHEST_PRIORITY - slot.priority();
                if slot.frame() == frame {
                    suits = SAME;
                } else if replaces::<P>(frame, slot.frame(), slot.is_stale) {
                    suits = REPLACED;
                }
            }
            let this = (suits, place, slot);
            best = match best {
                None => Some(this),
                Some(other) => {
                    let is_better = (this.0, this.2.age) > (other.0, other.2.age);
                    let (better, worse) = if is_better { (this, other) } else { (other, this) };
                    if worse.0 == REPLACED {
                        worse.2.age = 0;
                    }
                    Some(better)
                }
            };
        }
        let (suits, place, slot) = best?;
        match suits {
            SAME => count(&mut self.counters.duplicates),
            REPLACED => {}
            EMPTY => slot.age = 1,
            _ => {
                count(&mut self.counters.dropped);
                if slot.priority() > kind as u8 {
                    return None;
                }
                slot.age = 1;
            }
        }
        slot.length = frame.len() as u8;
        slot.is_stale = false;
        for (to, from) in slot.bytes.iter_mut().zip(frame) {
            *to = *from;
        }
        Some(place)
    }

    /// Takes the next frame out of its slot, where it can be read until the next one comes in.
    fn pop(&mut self) -> Option<(usize, &[u8])> {
        let by_age = self.by_age;
        let mut best = None;
        let mut first = (0, 0);
        for (place, slot) in self.slots.iter_mut().enumerate() {
            let order = (if by_age { 0 } else { slot.priority() }, slot.age);
            if slot.age != 0 && order > first {
                first = order;
                best = Some((place, slot));
            }
        }
        let (place, slot) = best?;
        slot.age = 0;
        self.by_age = !by_age;
        Some((place, slot.frame()))
    }
}

/// Of a frame with that type byte.
#[inline(never)]
fn priority(first: u8) -> u8 {
    Kind::of(first).map_or(0, |kind| kind as u8)
}

/// One more, as far as the counter goes.
fn count(counter: &mut u16) {
    *counter = counter.saturating_add(1);
}
