//! Frames that wait: for the script's next step, or for the link.
//!
//! Queues have a fixed size and no allocator. What is in them is worth having: doubles are dropped, an entry of a stigmergy
//! replaces the older one of its key that still waits, a broadcast the one on its topic of a step that is over. If there still is
//! no place, the oldest frame of the lowest priority goes, and is counted. Priorities are those of [`Kind`].
//!
//! There is no critical section inside: who shares a queue with an interrupt handler has to guard it.

use core::marker::PhantomData;

use bittybuzz_vm_core::message::{Kind, has_same_topic, supersedes};
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
        self.queue.waiting.into()
    }

    /// Whether no frame waits.
    pub fn is_empty(&self) -> bool {
        self.queue.waiting == 0
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
        let place = self.queue.pop()?;
        let extra = *self.extras.get(place)?;
        Some((self.queue.slots.get(place)?.frame(), extra))
    }
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Outbox<P, BYTES, FRAMES> {
    /// An empty one.
    pub const fn new() -> Self {
        Outbox { queue: Queue::EMPTY }
    }

    /// How many frames wait.
    pub fn len(&self) -> usize {
        self.queue.waiting.into()
    }

    /// Whether no frame waits.
    pub fn is_empty(&self) -> bool {
        self.queue.waiting == 0
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
        let place = self.queue.pop()?;
        Some(self.queue.slots.get(place)?.frame())
    }
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Default for Outbox<P, BYTES, FRAMES> {
    fn default() -> Self {
        Self::new()
    }
}

#[derive(Debug, Clone, Copy)]
struct Slot<const BYTES: usize> {
    /// 1 for the frame that waits longest, and so on; 0 if there is none.
    rank: u8,
    length: u8,
    /// From a step that is over.
    is_stale: bool,
    bytes: [u8; BYTES],
}

impl<const BYTES: usize> Slot<BYTES> {
    fn frame(&self) -> &[u8] {
        self.bytes.get(..self.length.into()).unwrap_or(&[])
    }
}

/// Which frame comes first.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Order {
    /// The oldest.
    Age,
    /// The oldest of the highest priority.
    Highest,
    /// The oldest of the lowest priority.
    Lowest,
}

/// Frames in slots, which never move; a new queue is all zeros.
#[derive(Debug, Clone)]
struct Queue<P, const BYTES: usize, const FRAMES: usize> {
    slots: [Slot<BYTES>; FRAMES],
    waiting: u8,
    /// The next frame to go is the oldest.
    by_age: bool,
    counters: Counters,
    profile: PhantomData<P>,
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Queue<P, BYTES, FRAMES> {
    const EMPTY: Self = {
        assert!(FRAMES < 256 && BYTES < 256, "ranks and lengths are bytes");
        Queue {
            slots: [Slot { rank: 0, length: 0, is_stale: false, bytes: [0; BYTES] }; FRAMES],
            waiting: 0,
            by_age: false,
            counters: Counters { dropped: 0, duplicates: 0 },
            profile: PhantomData,
        }
    };

    /// Puts a frame into a slot and tells which; `None` if it is dropped.
    fn push(&mut self, frame: &[u8]) -> Option<usize> {
        let place = self.place_for(frame);
        let Some(slot) = place.and_then(|place| self.slots.get_mut(place)) else {
            count(&mut self.counters.dropped);
            return None;
        };
        slot.length = frame.len() as u8;
        slot.is_stale = false;
        for (to, from) in slot.bytes.iter_mut().zip(frame) {
            *to = *from;
        }
        place
    }

    /// Makes place for a frame: a slot with its rank.
    fn place_for(&mut self, frame: &[u8]) -> Option<usize> {
        let kind = Kind::of(*frame.first()?)?;
        if frame.len() > BYTES {
            return None;
        }
        let same = |slot: &Slot<BYTES>| slot.rank != 0 && slot.frame() == frame;
        if let Some(place) = self.slots.iter().position(same) {
            count(&mut self.counters.duplicates);
            return Some(place);
        }
        // The oldest whose place it takes, so that an entry that changes all the time is not always the last.
        let mut place: Option<usize> = None;
        for at in 0..FRAMES {
            let Some(slot) = self.slots.get(at) else { break };
            if slot.rank == 0 {
                continue;
            }
            if supersedes::<P>(frame, slot.frame()) {
                let (older, younger) = match place {
                    Some(other) if self.rank(other) < slot.rank => (other, Some(at)),
                    other => (at, other),
                };
                place = Some(older);
                if let Some(younger) = younger {
                    self.free(younger);
                }
            } else if slot.is_stale && has_same_topic::<P>(frame, slot.frame()) {
                self.free(at);
            }
        }
        if place.is_some() {
            return place;
        }
        if usize::from(self.waiting) == FRAMES {
            let lowest = self.first(Order::Lowest)?;
            if self.kind(lowest) > Some(kind) {
                return None;
            }
            self.free(lowest);
            count(&mut self.counters.dropped);
        }
        let place = self.slots.iter().position(|slot| slot.rank == 0)?;
        self.waiting = self.waiting.wrapping_add(1);
        self.slots.get_mut(place)?.rank = self.waiting;
        Some(place)
    }

    /// Takes the next frame out of its slot, where it can be read until the next one comes in.
    fn pop(&mut self) -> Option<usize> {
        let place = self.first(if self.by_age { Order::Age } else { Order::Highest })?;
        self.by_age = !self.by_age;
        self.free(place);
        Some(place)
    }

    /// The slot with the first frame of an order.
    #[inline(never)]
    fn first(&self, order: Order) -> Option<usize> {
        let waiting = (0..FRAMES).filter(|at| self.rank(*at) != 0);
        waiting.min_by_key(|at| {
            let priority = self.kind(*at).map_or(0, |kind| kind as u8);
            let group = match order {
                Order::Age => 0,
                Order::Highest => !priority,
                Order::Lowest => priority,
            };
            (group, self.rank(*at))
        })
    }

    /// Empties a slot.
    #[inline(never)]
    fn free(&mut self, place: usize) {
        let rank = self.rank(place);
        for slot in &mut self.slots {
            if slot.rank == rank {
                slot.rank = 0;
            } else if slot.rank > rank {
                slot.rank = slot.rank.wrapping_sub(1);
            }
        }
        self.waiting = self.waiting.wrapping_sub(1);
    }

    fn rank(&self, place: usize) -> u8 {
        self.slots.get(place).map_or(0, |slot| slot.rank)
    }

    fn kind(&self, place: usize) -> Option<Kind> {
        Kind::of(*self.slots.get(place)?.bytes.first()?)
    }
}

/// One more, as far as the counter goes.
fn count(counter: &mut u16) {
    *counter = counter.saturating_add(1);
}
