//! Frames that wait: for the script's next step, or for the link.
//!
//! Queues have a fixed size and no allocator. What is in them is worth having: doubles are dropped, an entry of a stigmergy
//! takes the place of the older one of its key that still waits, a broadcast of the one on its topic of a step that is over. If
//! there still is no place, the oldest frame of the lowest priority goes, and is counted. Priorities are those of [`FrameKind`];
//! but a robot's own beacon, which it sends only after a long silence, has the highest one, so that no flood of entries
//! hides the robot.
//!
//! There is no critical section inside: who shares a queue with an interrupt handler has to guard it.

use core::hash::{Hash, Hasher};
use core::marker::PhantomData;
use core::ops::Deref;

use bittybuzz_vm_core::message::{FrameKind, replaces};
use bittybuzz_vm_core::number::Profile;

/// The frames that a queue has not passed on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counters {
    /// Frames for which there was no place, that were too long, or of no known type.
    pub dropped: u16,
    /// Frames of which the same already waited.
    pub duplicates: u16,
}

/// A frame, and zeros after it up to the longest one.
#[derive(Debug, Clone, Copy)]
// A Cortex-M0 copies words, where it knows that they are aligned.
#[cfg_attr(not(target_arch = "avr"), repr(C, align(4)))]
pub struct QueuedFrame<const BYTES: usize> {
    bytes: [u8; BYTES],
    length: u8,
}

impl<const BYTES: usize> QueuedFrame<BYTES> {
    const EMPTY: Self = QueuedFrame { bytes: [0; BYTES], length: 0 };

    /// Copies the frame with all of its room, which takes less time than the frame alone, and
    /// returns its length.
    #[inline(always)]
    pub fn copy_to(&self, room: &mut [u8; BYTES]) -> usize {
        *room = self.bytes;
        self.length.into()
    }

    /// The first bytes, which a Cortex-M0 compares at once. Zeros follow a shorter frame.
    #[inline(always)]
    fn head(&self) -> [u8; HEAD] {
        self.bytes.first_chunk().copied().unwrap_or([0; HEAD])
    }
}

impl<const BYTES: usize> Deref for QueuedFrame<BYTES> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.bytes.get(..self.length.into()).unwrap_or(&[])
    }
}

/// Received frames, at most `FRAMES` of at most `BYTES` bytes, each with the link's facts about it.
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
    /// An empty queue; `nothing` stands for the facts about no frame.
    pub const fn new(nothing: E) -> Self {
        Inbox { queue: Queue::EMPTY, extras: [nothing; FRAMES] }
    }

    /// An empty one for at most `frames` frames, fewer than its type has places for. [`Inbox::len`] counts the other places too.
    /// For hosts, so that one type serves queues of all lengths.
    pub fn with_room(nothing: E, frames: usize) -> Self {
        Inbox { queue: Queue::with_room(frames), extras: [nothing; FRAMES] }
    }

    /// Returns the number of waiting frames.
    pub fn len(&self) -> usize {
        self.queue.len()
    }

    /// Returns true if no frame waits.
    pub fn is_empty(&self) -> bool {
        self.queue.len() == 0
    }

    /// Returns the counts of frames that were not passed on.
    pub fn counters(&self) -> Counters {
        self.queue.counters
    }

    /// Hashes the frames that wait, in their order; `extra` hashes the link's knowledge of one. For
    /// hosts: firmware does not call it.
    pub fn hash_state<H: Hasher>(&self, hasher: &mut H, extra: impl Fn(&E, &mut H)) {
        self.queue.hash_state(hasher, |place, hasher| {
            self.extras.get(place).into_iter().for_each(|known| extra(known, hasher));
        });
    }

    /// The frames that wait, oldest first: for programs that look at the queue.
    pub fn frames(&self) -> impl Iterator<Item = &[u8]> {
        self.queue.frames()
    }

    /// Adds a received frame. If the same frame waits, `extra` replaces the link's facts about it.
    pub fn push(&mut self, frame: &[u8], extra: E) {
        if let Some(place) = self.queue.push(frame, false)
            && let Some(there) = self.extras.get_mut(place)
        {
            *there = extra;
        }
    }

    /// Takes a frame out: in turn the oldest of the highest priority, and the oldest.
    pub fn pop(&mut self) -> Option<(&QueuedFrame<BYTES>, &E)> {
        let (place, frame) = self.queue.pop()?;
        Some((frame, self.extras.get(place)?))
    }
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Outbox<P, BYTES, FRAMES> {
    /// An empty one.
    pub const fn new() -> Self {
        Outbox { queue: Queue::EMPTY }
    }

    /// An empty one for at most `frames` frames, as [`Inbox::with_room`].
    pub fn with_room(frames: usize) -> Self {
        Outbox { queue: Queue::with_room(frames) }
    }

    /// Returns the number of waiting frames.
    pub fn len(&self) -> usize {
        self.queue.len()
    }

    /// Returns true if no frame waits.
    pub fn is_empty(&self) -> bool {
        self.queue.len() == 0
    }

    /// Returns the counts of frames that were not passed on.
    pub fn counters(&self) -> Counters {
        self.queue.counters
    }

    /// Hashes the frames that wait, in their order. For hosts: firmware does not call it.
    pub fn hash_state(&self, hasher: &mut impl Hasher) {
        self.queue.hash_state(hasher, |_, _| ());
    }

    /// The frames that wait, oldest first: for programs that look at the queue.
    pub fn frames(&self) -> impl Iterator<Item = &[u8]> {
        self.queue.frames()
    }

    /// A step begins: broadcasts that wait are stale as soon as there are newer ones.
    pub fn begin_step(&mut self) {
        for rank in &mut self.queue.ranks {
            *rank |= STALE;
        }
    }

    /// A frame is to be sent.
    pub fn push(&mut self, frame: &[u8]) {
        self.queue.push(frame, true);
    }

    /// Takes a frame out: in turn the oldest of the highest priority, and the oldest.
    pub fn pop(&mut self) -> Option<&QueuedFrame<BYTES>> {
        self.queue.pop().map(|(_, frame)| frame)
    }
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Default for Outbox<P, BYTES, FRAMES> {
    fn default() -> Self {
        Self::new()
    }
}

/// Frames in places that they keep, in a list from the oldest to the youngest; a new queue is all zeros.
///
/// Places are numbered from 1.
#[derive(Debug, Clone)]
struct Queue<P, const BYTES: usize, const FRAMES: usize> {
    counters: Counters,
    /// The place of the oldest, or [`NOWHERE`]. With [`BY_AGE`], the next to go is the oldest.
    oldest: u8,
    /// For each frame the place of the next younger one, or [`NOWHERE`].
    younger: [u8; FRAMES],
    /// For each place [`FREE`], or 1 more than the priority of the [`FrameKind`] that waits there, of which 0 is the lowest, with
    /// [`STALE`].
    ranks: [u8; FRAMES],
    frames: [QueuedFrame<BYTES>; FRAMES],
    profile: PhantomData<P>,
}

/// There is no frame.
const NOWHERE: u8 = 0;
/// With the place of the oldest.
const BY_AGE: u8 = 1 << 7;

const FREE: u8 = 0;
const HIGHEST_RANK: u8 = FrameKind::Broadcast as u8 + 1;
/// In a rank: the frame is from an earlier step.
const STALE: u8 = 1 << 7;

/// Bytes in which most frames differ.
const HEAD: usize = 4;

/// Frames that replace none have a search of their own. An AVR has no flash for it.
const IS_QUICK: bool = cfg!(not(target_arch = "avr"));

/// The fitness of a place for a new frame: the same frame waits there, or one that the new frame
/// replaces. Below these values, the rank of the waiting frame decides.
const SAME: u8 = 255;
const REPLACED: u8 = 254;
const OF_NO_RANK: u8 = 253;

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Queue<P, BYTES, FRAMES> {
    const EMPTY: Self = {
        assert!(BYTES < 256 && FRAMES < BY_AGE as usize, "lengths and places are bytes");
        Queue {
            counters: Counters { dropped: 0, duplicates: 0 },
            oldest: NOWHERE,
            younger: [NOWHERE; FRAMES],
            ranks: [FREE; FRAMES],
            frames: [QueuedFrame::EMPTY; FRAMES],
            profile: PhantomData,
        }
    };

    /// Places beyond the first `frames` count as taken, and no frame is linked there.
    fn with_room(frames: usize) -> Self {
        let mut queue = Self::EMPTY;
        queue.ranks.iter_mut().skip(frames).for_each(|rank| *rank = HIGHEST_RANK);
        queue
    }

    fn len(&self) -> usize {
        self.ranks.iter().filter(|rank| **rank & !STALE != FREE).count()
    }

    /// Hashes the frames from the oldest to the youngest. The places in which they lie decide nothing.
    fn hash_state<H: Hasher>(&self, hasher: &mut H, extra: impl Fn(usize, &mut H)) {
        hasher.write_u8(self.oldest & BY_AGE);
        let mut place = self.oldest();
        while let (Some(frame), Some(rank)) =
            (self.frames.get(index(place)), self.ranks.get(index(place)))
        {
            (*rank, frame.length).hash(hasher);
            hasher.write(frame);
            extra(index(place), hasher);
            place = self.younger(place);
        }
        hasher.write_u8(FREE);
    }

    fn frames(&self) -> impl Iterator<Item = &[u8]> {
        let mut place = self.oldest();
        core::iter::from_fn(move || {
            let frame = self.frames.get(index(place))?;
            place = self.younger(place);
            Some(&**frame)
        })
    }

    #[inline(always)]
    fn oldest(&self) -> u8 {
        self.oldest & !BY_AGE
    }

    #[inline(always)]
    fn younger(&self, place: u8) -> u8 {
        self.younger.get(index(place)).copied().unwrap_or(NOWHERE)
    }

    #[inline(always)]
    fn rank(&self, place: u8) -> u8 {
        self.ranks.get(index(place)).copied().unwrap_or(FREE) & !STALE
    }

    /// Sets the successor of the frame there, or, for no frame, the oldest one.
    fn link(&mut self, place: u8, younger: u8) {
        match self.younger.get_mut(index(place)) {
            Some(link) => *link = younger,
            None => self.oldest = self.oldest & BY_AGE | younger,
        }
    }

    /// Takes out the frame at that place, next to that older one.
    #[cfg_attr(not(target_arch = "avr"), inline(always))]
    fn take_out(&mut self, older: u8, place: u8) {
        let at = index(place);
        if let (Some(rank), Some(younger)) = (self.ranks.get_mut(at), self.younger.get_mut(at)) {
            *rank = FREE;
            let younger = core::mem::take(younger);
            self.link(older, younger);
        }
    }

    /// Adds a frame and returns its place; `None` if it is dropped.
    ///
    /// Replaced frames go. One of them, the oldest, leaves its place to the new frame, so that an
    /// entry that changes all the
    /// time is not always the last.
    fn push(&mut self, frame: &[u8], is_own: bool) -> Option<usize> {
        let kind = frame.first().and_then(|first| FrameKind::of(*first));
        let (Some(kind), true) = (kind, frame.len() <= BYTES) else {
            count(&mut self.counters.dropped);
            return None;
        };
        let is_beacon = matches!(kind, FrameKind::Beacon | FrameKind::Digest);
        let new_rank = if is_own && is_beacon { HIGHEST_RANK } else { kind as u8 + 1 };
        // Broadcasts replace stale ones, which are in no inbox.
        let replaces_none = match kind {
            FrameKind::Swarms | FrameKind::Fragment => true,
            FrameKind::Broadcast => !is_own,
            FrameKind::Beacon | FrameKind::Digest | FrameKind::Entry => false,
        };
        let (suits, older, mut place, mut youngest) = 'search: loop {
            if IS_QUICK && replaces_none {
                break self.search_quickly(frame);
            }
            // How well the best place suits, the next older frame, and the place.
            let mut best = (0, NOWHERE, NOWHERE);
            let (mut older, mut place) = (NOWHERE, self.oldest());
            while let Some(waiting) = self.frames.get(index(place)) {
                let rank = self.ranks.get(index(place)).copied().unwrap_or(FREE);
                let is_stale = rank & STALE != 0;
                let mut suits = OF_NO_RANK - (rank & !STALE);
                // Most differ in the first bytes.
                if waiting.iter().eq(frame) {
                    suits = SAME;
                } else if replaces::<P>(kind, frame, waiting, is_stale) {
                    suits = REPLACED;
                }
                if suits >= REPLACED && best.0 >= REPLACED {
                    // One place is enough.
                    if suits == SAME {
                        (older, place) = (best.1, best.2);
                    }
                    self.take_out(older, place);
                    continue 'search;
                }
                if suits > best.0 {
                    best = (suits, older, place);
                }
                (older, place) = (place, self.younger(place));
            }
            break (best.0, best.1, best.2, older);
        };
        if suits == SAME {
            count(&mut self.counters.duplicates);
            if IS_QUICK {
                *self.ranks.get_mut(index(place))? = new_rank;
                return Some(index(place));
            }
        } else if suits != REPLACED {
            if let Some(free) = self.ranks.iter().position(|rank| rank & !STALE == FREE) {
                place = free as u8 + 1;
            } else {
                count(&mut self.counters.dropped);
                if OF_NO_RANK - suits > new_rank {
                    return None;
                }
                self.take_out(older, place);
                if youngest == place {
                    youngest = older;
                }
            }
            self.link(youngest, place);
        }
        let at = index(place);
        *self.ranks.get_mut(at)? = new_rank;
        let room = self.frames.get_mut(at)?;
        *room = QueuedFrame::EMPTY;
        room.length = frame.len() as u8;
        if let Some(to) = room.bytes.get_mut(..frame.len()) {
            to.copy_from_slice(frame);
        }
        Some(at)
    }

    /// Searches as [`Queue::push`] does, for a frame that replaces none.
    #[inline(never)]
    fn search_quickly(&self, frame: &[u8]) -> (u8, u8, u8, u8) {
        let mut head = [0; HEAD];
        match frame.first_chunk() {
            Some(first) => head = *first,
            None => head.iter_mut().zip(frame).for_each(|(to, byte)| *to = *byte),
        }
        // The frame next to the oldest of the lowest rank.
        let mut below = NOWHERE;
        let mut lowest = OF_NO_RANK;
        let (mut older, mut place) = (NOWHERE, self.oldest());
        while let Some(waiting) = self.frames.get(index(place)) {
            if waiting.head() == head
                && usize::from(waiting.length) == frame.len()
                && waiting.get(HEAD..) == frame.get(HEAD..)
            {
                return (SAME, NOWHERE, place, NOWHERE);
            }
            let rank = self.rank(place);
            if rank < lowest {
                (lowest, below) = (rank, older);
            }
            (older, place) = (place, self.younger(place));
        }
        let place = if below == NOWHERE { self.oldest() } else { self.younger(below) };
        (OF_NO_RANK - lowest, below, place, older)
    }

    /// Takes the next frame out, and returns its place: it can be read until the next frame is
    /// added.
    fn pop(&mut self) -> Option<(usize, &QueuedFrame<BYTES>)> {
        let (mut older, mut place) = (NOWHERE, self.oldest());
        if place == NOWHERE {
            return None;
        }
        if self.oldest & BY_AGE == 0 && self.rank(place) != HIGHEST_RANK {
            (older, place) = self.foremost();
        }
        self.oldest ^= BY_AGE;
        self.take_out(older, place);
        Some((index(place), self.frames.get(index(place))?))
    }

    /// Returns the oldest frame of the highest priority, after the next older one. A Cortex-M0 has
    /// too few registers to inline this.
    #[cfg_attr(not(target_arch = "avr"), inline(never))]
    fn foremost(&self) -> (u8, u8) {
        let (mut older, mut place) = (NOWHERE, self.oldest());
        let (mut highest, mut foremost) = (FREE, (older, place));
        while place != NOWHERE {
            let rank = self.rank(place);
            if rank > highest {
                (highest, foremost) = (rank, (older, place));
            }
            (older, place) = (place, self.younger(place));
        }
        foremost
    }
}

/// Returns the index in an array; beyond its end for [`NOWHERE`].
#[inline(always)]
fn index(place: u8) -> usize {
    usize::from(place.wrapping_sub(1))
}

/// One more, as far as the counter goes.
#[cfg_attr(target_arch = "avr", inline(never))]
#[cfg_attr(not(target_arch = "avr"), inline(always))]
fn count(counter: &mut u16) {
    *counter = counter.saturating_add(1);
}
