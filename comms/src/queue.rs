//! Queues of frames that wait for the script's next step or for the link.
//!
//! A queue has a fixed size and no allocator. It keeps the frames that are most useful:
//!
//! * A duplicate of a waiting frame is dropped.
//! * An entry of a stigmergy replaces an older entry of the same key, and a beacon an older one of
//!   the same robot.
//! * A broadcast to be sent replaces one on the same topic from an earlier step.
//! * If the queue is still full, it drops and counts the oldest frame of the lowest priority.
//!
//! Priorities are those of [`FrameKind`], with one exception: a robot sends its own beacon only
//! after a long silence, and that beacon has the highest priority, so that a flood of entries does
//! not hide the robot.
//!
//! The queues contain no critical section. A caller that shares one with an interrupt handler has
//! to guard it.

use core::hash::{Hash, Hasher};
use core::marker::PhantomData;
use core::ops::Deref;

use bittybuzz_vm_core::message::{FrameKind, replaces};
use bittybuzz_vm_core::number::Profile;

/// The numbers of frames that a queue did not pass on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct QueueCounters {
    /// Frames that found no room, were too long, or had an unknown type.
    pub dropped: u16,
    /// Frames that were equal to a waiting one.
    pub duplicates: u16,
}

/// A frame, padded with zeros to the maximum length.
#[derive(Debug, Clone, Copy)]
// The alignment lets a Cortex-M0 copy whole words.
#[cfg_attr(not(target_arch = "avr"), repr(C, align(4)))]
pub struct QueuedFrame<const BYTES: usize> {
    bytes: [u8; BYTES],
    length: u8,
}

impl<const BYTES: usize> QueuedFrame<BYTES> {
    const EMPTY: Self = QueuedFrame { bytes: [0; BYTES], length: 0 };

    /// Copies the frame with its padding, which takes less time than the frame alone, and returns
    /// the length of the frame.
    #[inline(always)]
    pub fn copy_to(&self, room: &mut [u8; BYTES]) -> usize {
        *room = self.bytes;
        self.length.into()
    }

    /// Returns the first bytes, which a Cortex-M0 compares in one operation.
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

/// The received frames, at most `FRAMES` of at most `BYTES` bytes, each with data `E` from the
/// link.
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
    /// Returns an empty queue; `nothing` fills the link data of the free places.
    pub const fn new(nothing: E) -> Self {
        Inbox { queue: Queue::EMPTY, extras: [nothing; FRAMES] }
    }

    /// Returns an empty queue for at most `frames` frames, fewer than its type has places for.
    /// [`Inbox::len`] counts the unused places too. This function is for hosts, where one type
    /// serves queues of all lengths.
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
    pub fn counters(&self) -> QueueCounters {
        self.queue.counters
    }

    /// Hashes the waiting frames in their order; `extra` hashes the link data of one frame. Only
    /// hosts call this function.
    pub fn hash_state<H: Hasher>(&self, hasher: &mut H, extra: impl Fn(&E, &mut H)) {
        self.queue.hash_state(hasher, |place, hasher| {
            self.extras.get(place).into_iter().for_each(|known| extra(known, hasher));
        });
    }

    /// Returns the waiting frames, oldest first, for programs that inspect the queue.
    pub fn frames(&self) -> impl Iterator<Item = &[u8]> {
        self.queue.frames()
    }

    /// Adds a received frame. If an equal frame already waits, `extra` replaces its link data.
    pub fn push(&mut self, frame: &[u8], extra: E) {
        if let Some(place) = self.queue.push(frame, false)
            && let Some(there) = self.extras.get_mut(place)
        {
            *there = extra;
        }
    }

    /// Removes and returns a frame: alternately the oldest one of the highest priority and the
    /// oldest one of all.
    pub fn pop(&mut self) -> Option<(&QueuedFrame<BYTES>, &E)> {
        let (place, frame) = self.queue.pop()?;
        Some((frame, self.extras.get(place)?))
    }
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Outbox<P, BYTES, FRAMES> {
    /// Returns an empty queue.
    pub const fn new() -> Self {
        Outbox { queue: Queue::EMPTY }
    }

    /// Returns an empty queue for at most `frames` frames; see [`Inbox::with_room`].
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
    pub fn counters(&self) -> QueueCounters {
        self.queue.counters
    }

    /// Hashes the waiting frames in their order. Only hosts call this function.
    pub fn hash_state(&self, hasher: &mut impl Hasher) {
        self.queue.hash_state(hasher, |_, _| ());
    }

    /// Returns the waiting frames, oldest first, for programs that inspect the queue.
    pub fn frames(&self) -> impl Iterator<Item = &[u8]> {
        self.queue.frames()
    }

    /// Marks the waiting broadcasts as stale at the beginning of a step: newer ones replace them.
    pub fn begin_step(&mut self) {
        for rank in &mut self.queue.ranks {
            *rank |= STALE;
        }
    }

    /// Adds a frame to be sent.
    pub fn push(&mut self, frame: &[u8]) {
        self.queue.push(frame, true);
    }

    /// Removes and returns a frame: alternately the oldest one of the highest priority and the
    /// oldest one of all.
    pub fn pop(&mut self) -> Option<&QueuedFrame<BYTES>> {
        self.queue.pop().map(|(_, frame)| frame)
    }
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Default for Outbox<P, BYTES, FRAMES> {
    fn default() -> Self {
        Self::new()
    }
}

/// Frames in fixed places, with a linked list from the oldest to the youngest. A new queue is all
/// zeros.
///
/// Places are numbered from 1.
#[derive(Debug, Clone)]
struct Queue<P, const BYTES: usize, const FRAMES: usize> {
    counters: QueueCounters,
    /// The place of the oldest frame, or [`NOWHERE`]. When the bit [`BY_AGE`] is set, the next
    /// `pop` takes the oldest frame instead of the one with the highest priority.
    oldest: u8,
    /// The place of the next younger frame, or [`NOWHERE`], for each frame.
    younger: [u8; FRAMES],
    /// The state of each place: [`FREE`], or the priority of the waiting [`FrameKind`] (0 is the
    /// lowest) plus 1, with the bit [`STALE`] if the frame is from an earlier step.
    ranks: [u8; FRAMES],
    frames: [QueuedFrame<BYTES>; FRAMES],
    profile: PhantomData<P>,
}

/// The link to no frame.
const NOWHERE: u8 = 0;
/// A bit in `Queue::oldest`.
const BY_AGE: u8 = 1 << 7;

const FREE: u8 = 0;
const HIGHEST_RANK: u8 = FrameKind::Broadcast as u8 + 1;
/// A bit in a rank: the frame is from an earlier step.
const STALE: u8 = 1 << 7;

/// The number of leading bytes, in which most frames differ.
const HEAD: usize = 4;

/// Frames that replace no other are searched by `search_quickly`. An AVR lacks the flash for this
/// second search.
const IS_QUICK: bool = cfg!(not(target_arch = "avr"));

/// The fitness of a place for a new frame: an equal frame waits there, or one that the new frame
/// replaces. In other places the fitness is `OF_NO_RANK` minus the rank of the waiting frame.
const SAME: u8 = 255;
const REPLACED: u8 = 254;
const OF_NO_RANK: u8 = 253;

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Queue<P, BYTES, FRAMES> {
    const EMPTY: Self = {
        assert!(BYTES < 256 && FRAMES < BY_AGE as usize, "lengths and places are bytes");
        Queue {
            counters: QueueCounters { dropped: 0, duplicates: 0 },
            oldest: NOWHERE,
            younger: [NOWHERE; FRAMES],
            ranks: [FREE; FRAMES],
            frames: [QueuedFrame::EMPTY; FRAMES],
            profile: PhantomData,
        }
    };

    /// Returns a queue for `frames` frames. The other places count as taken, but no frame is linked
    /// there.
    fn with_room(frames: usize) -> Self {
        let mut queue = Self::EMPTY;
        queue.ranks.iter_mut().skip(frames).for_each(|rank| *rank = HIGHEST_RANK);
        queue
    }

    fn len(&self) -> usize {
        self.ranks.iter().filter(|rank| **rank & !STALE != FREE).count()
    }

    /// Hashes the frames from the oldest to the youngest. The places do not matter for the
    /// behavior.
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

    /// Sets the successor of the frame at `place`; if `place` is [`NOWHERE`], sets the oldest
    /// frame.
    fn link(&mut self, place: u8, younger: u8) {
        match self.younger.get_mut(index(place)) {
            Some(link) => *link = younger,
            None => self.oldest = self.oldest & BY_AGE | younger,
        }
    }

    /// Removes the frame at `place`; `older` is the next older one, or [`NOWHERE`].
    #[cfg_attr(not(target_arch = "avr"), inline(always))]
    fn take_out(&mut self, older: u8, place: u8) {
        let at = index(place);
        if let (Some(rank), Some(younger)) = (self.ranks.get_mut(at), self.younger.get_mut(at)) {
            *rank = FREE;
            let younger = core::mem::take(younger);
            self.link(older, younger);
        }
    }

    /// Adds a frame and returns its index; `None` if the frame is dropped.
    ///
    /// Replaced frames are removed. The oldest of them leaves its position in the list to the new
    /// frame; otherwise an entry that changes all the time would always stay last.
    fn push(&mut self, frame: &[u8], is_own: bool) -> Option<usize> {
        let kind = frame.first().and_then(|first| FrameKind::of(*first));
        let (Some(kind), true) = (kind, frame.len() <= BYTES) else {
            count(&mut self.counters.dropped);
            return None;
        };
        let is_beacon = matches!(kind, FrameKind::Beacon | FrameKind::Digest);
        let new_rank = if is_own && is_beacon { HIGHEST_RANK } else { kind as u8 + 1 };
        // Broadcasts replace only stale frames, and an inbox has none.
        let replaces_none = match kind {
            FrameKind::Swarms | FrameKind::Fragment => true,
            FrameKind::Broadcast => !is_own,
            FrameKind::Beacon | FrameKind::Digest | FrameKind::Entry => false,
        };
        let (suits, older, mut place, mut youngest) = 'search: loop {
            if IS_QUICK && replaces_none {
                break self.search_quickly(frame);
            }
            // The fitness of the best place, the next older frame, and the place.
            let mut best = (0, NOWHERE, NOWHERE);
            let (mut older, mut place) = (NOWHERE, self.oldest());
            while let Some(waiting) = self.frames.get(index(place)) {
                let rank = self.ranks.get(index(place)).copied().unwrap_or(FREE);
                let is_stale = rank & STALE != 0;
                let mut suits = OF_NO_RANK - (rank & !STALE);
                // The comparison is short, since most frames differ in the first bytes.
                if waiting.iter().eq(frame) {
                    suits = SAME;
                } else if replaces::<P>(kind, frame, waiting, is_stale) {
                    suits = REPLACED;
                }
                if suits >= REPLACED && best.0 >= REPLACED {
                    // Two frames are replaced: one of them is removed, and the search restarts.
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

    /// Does the search of [`Queue::push`] for a frame that replaces none: returns the fitness, the
    /// next older frame, the place and the youngest frame.
    #[inline(never)]
    fn search_quickly(&self, frame: &[u8]) -> (u8, u8, u8, u8) {
        let mut head = [0; HEAD];
        match frame.first_chunk() {
            Some(first) => head = *first,
            None => head.iter_mut().zip(frame).for_each(|(to, byte)| *to = *byte),
        }
        // The frame that is next older than the oldest of the lowest rank.
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

    /// Removes the next frame and returns its index. The bytes stay readable until a frame is
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

    /// Returns the oldest frame of the highest priority, preceded by the next older one. A
    /// Cortex-M0 has too few registers to inline this function.
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

/// Returns the array index of a place; it is beyond the end of the array for [`NOWHERE`].
#[inline(always)]
fn index(place: u8) -> usize {
    usize::from(place.wrapping_sub(1))
}

/// Increments a counter, up to its maximum.
#[cfg_attr(target_arch = "avr", inline(never))]
#[cfg_attr(not(target_arch = "avr"), inline(always))]
fn count(counter: &mut u16) {
    *counter = counter.saturating_add(1);
}
