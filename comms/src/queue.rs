//! Queues of frames that wait for the script's next step or for the link.
//!
//! A queue has a fixed size and no allocator. It keeps the frames that are most useful:
//!
//! * A duplicate of a waiting frame is dropped.
//! * An entry of a stigmergy replaces an older entry of the same key, and a beacon an older one of
//!   the same robot.
//! * A broadcast to be sent replaces one on the same topic from an earlier step.
//! * A received broadcast on a topic to which the script does not listen has the lowest priority of
//!   all, and replaces an earlier one of the same robot: it only shows that its sender is there.
//! * If the queue is still full, it drops and counts the oldest frame of the lowest priority.
//!
//! Long messages have places of their own ([`crate::long`]): fragments are joined when they arrive
//! and cut when they leave. An outbox finishes the message that it has begun, and then sends as many
//! frames as the message had fragments before it begins another one.
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

use bittybuzz_vm_core::message::{
    FRAGMENT, FRAGMENT_HEAD, FRAGMENTS_MAX, FrameKind, Topics, replaces, topic_of,
};
use bittybuzz_vm_core::number::Profile;

use crate::long::{Assemblies, Departures};

/// The numbers of frames that a queue did not pass on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct QueueCounters {
    /// Frames that found no room, were too long, or had an unknown type.
    pub dropped: u16,
    /// Frames that were equal to a waiting one.
    pub duplicates: u16,
    /// Received long messages that were given up before they were complete, and fragments of
    /// messages for which there was no place. An outbox counts none.
    pub incomplete: u16,
    /// Received broadcasts on topics to which the script does not listen. An outbox counts none.
    pub unwanted: u16,
}

/// The state of an empty queue. A host stores it instead of the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct EmptyQueue {
    /// The counts of frames that were not passed on.
    pub counters: QueueCounters,
    is_by_age: bool,
    frames_first: u8,
    departures: (u16, u8),
    kept_out: [u8; KEPT_OUT],
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
    fn copy_to(&self, room: &mut [u8; BYTES]) -> usize {
        *room = self.bytes;
        self.length.into()
    }
}

impl<const BYTES: usize> Deref for QueuedFrame<BYTES> {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        self.bytes.get(..self.length.into()).unwrap_or(&[])
    }
}

/// The received frames, at most `FRAMES` of at most `BYTES` bytes, and at most `MESSAGES` long
/// messages, each with data `E` from the link.
#[derive(Debug, Clone)]
pub struct Inbox<
    P: Profile,
    E: Copy,
    const BYTES: usize,
    const FRAMES: usize,
    const MESSAGES: usize,
> {
    queue: Queue<P, BYTES, FRAMES>,
    extras: [E; FRAMES],
    messages: Assemblies<P, E, MESSAGES>,
    incomplete: u16,
    unwanted: u16,
    /// For the robots whose ids are i modulo [`KEPT_OUT`], the number of the long message that one of
    /// them began last, if it is unwanted; else 0.
    kept_out: [u8; KEPT_OUT],
}

/// What is to be sent: at most `FRAMES` frames of at most `BYTES` bytes, and at most `MESSAGES` long
/// messages.
#[derive(Debug, Clone)]
pub struct Outbox<P: Profile, const BYTES: usize, const FRAMES: usize, const MESSAGES: usize> {
    queue: Queue<P, BYTES, FRAMES>,
    messages: Departures<P, MESSAGES>,
    /// The number of frames that go before the next long message.
    frames_first: u8,
}

impl<P: Profile, E: Copy, const BYTES: usize, const FRAMES: usize, const MESSAGES: usize>
    Inbox<P, E, BYTES, FRAMES, MESSAGES>
{
    /// Returns an empty queue; `nothing` fills the link data of the free places.
    pub const fn new(nothing: E) -> Self {
        Inbox {
            queue: Queue::EMPTY,
            extras: [nothing; FRAMES],
            messages: Assemblies::new(nothing),
            incomplete: 0,
            unwanted: 0,
            kept_out: [0; KEPT_OUT],
        }
    }

    /// Returns an empty queue for at most `frames` frames and `messages` long messages, fewer than
    /// its type has places for. [`Inbox::len`] counts the unused places too. This function is for
    /// hosts, where one type serves queues of all lengths.
    pub fn with_room(nothing: E, frames: usize, messages: usize) -> Self {
        Inbox {
            queue: Queue::with_room(frames),
            extras: [nothing; FRAMES],
            messages: Assemblies::with_room(nothing, messages),
            ..Self::new(nothing)
        }
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
        QueueCounters {
            incomplete: self.incomplete,
            unwanted: self.unwanted,
            ..self.queue.counters()
        }
    }

    /// Hashes the waiting frames in their order, and the long messages; `extra` hashes the link data
    /// of one frame. Only hosts call this function.
    pub fn hash_state<H: Hasher>(&self, hasher: &mut H, extra: impl Fn(&E, &mut H)) {
        self.queue.hash_state(hasher, |place, hasher| {
            self.extras.get(place).into_iter().for_each(|known| extra(known, hasher));
        });
        self.messages.hash_state(hasher, extra);
        hasher.write(&self.kept_out);
    }

    /// Passes the waiting frames to `show`, oldest first, and then the fragments that have arrived,
    /// for programs that inspect the queue.
    pub fn show(&self, mut show: impl FnMut(&[u8])) {
        self.queue.frames().for_each(&mut show);
        self.messages.show::<BYTES>(show);
    }

    /// Returns the state of the queue if it is empty. Only hosts call this function.
    pub fn as_empty(&self) -> Option<EmptyQueue> {
        let is_empty = self.queue.is_empty() && self.messages.is_unused();
        let state = || EmptyQueue {
            counters: self.counters(),
            kept_out: self.kept_out,
            ..self.queue.empty_state()
        };
        is_empty.then(state)
    }

    /// Gives a new queue the state of another one. Only hosts call this function.
    pub fn resume(&mut self, state: EmptyQueue) {
        self.queue.resume(state);
        self.incomplete = state.counters.incomplete;
        self.unwanted = state.counters.unwanted;
        self.kept_out = state.kept_out;
    }

    /// Returns true if fragments of a message have arrived. Only hosts call this function.
    pub fn is_assembling(&self) -> bool {
        self.messages.is_assembling()
    }

    /// Adds a received frame. If an equal frame already waits, `extra` replaces its link data.
    pub fn push(&mut self, frame: &[u8], extra: E) {
        self.push_except(frame, extra, 0);
    }

    /// Adds a received frame as [`Inbox::push`] does. `unwanted` are the topics to which the script
    /// does not listen.
    ///
    /// Of a long message on such a topic, the first fragment waits as a frame, and the others are
    /// dropped.
    pub fn push_except(&mut self, frame: &[u8], extra: E, unwanted: Topics) {
        let is_unwanted = topic_of::<P>(frame) & unwanted != 0;
        if let [first @ 0x10..=0x1f, rest @ ..] = frame {
            let [robot, _, number] = *rest.first_chunk().unwrap_or(&[0; 3]);
            let kept_out = &mut self.kept_out[usize::from(robot) % KEPT_OUT];
            let is_first = first % FRAGMENTS_MAX == 0;
            if is_first {
                *kept_out = if is_unwanted { number } else { 0 };
            }
            if *kept_out != number || number == 0 {
                return self.messages.push(frame, extra, &mut self.incomplete);
            }
            if !is_first {
                return;
            }
        }
        let mut role = Role::Received;
        if is_unwanted {
            count(&mut self.unwanted);
            role = Role::Unwanted;
        }
        if let Some(place) = self.queue.push(frame, role)
            && let Some(there) = self.extras.get_mut(place)
        {
            *there = extra;
        }
    }

    /// Removes a frame, writes it to `room` with zeros after it, and returns its length: alternately
    /// the oldest one of the highest priority and the oldest one of all.
    ///
    /// Complete long messages go first. The first [`FRAGMENT_HEAD`] bytes of a fragment stand for
    /// the message, and [`Inbox::take_content`] returns its content.
    pub fn pop(&mut self, room: &mut [u8; BYTES]) -> Option<(usize, &E)> {
        if MESSAGES != 0
            && self.messages.is_waiting()
            && let Some(place) = self.messages.pop(room)
        {
            return Some((FRAGMENT_HEAD, self.messages.extra(place)?));
        }
        let (place, frame) = self.queue.pop()?;
        Some((frame.copy_to(room), self.extras.get(place)?))
    }

    /// Copies the content of the long message that [`Inbox::pop`] has returned last, and returns its
    /// length; 0 if there is none.
    pub fn take_content(&mut self, room: &mut [u8]) -> usize {
        self.messages.take_content(room)
    }
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize, const MESSAGES: usize>
    Outbox<P, BYTES, FRAMES, MESSAGES>
{
    /// Returns an empty queue.
    pub const fn new() -> Self {
        Outbox { queue: Queue::EMPTY, messages: Departures::new(), frames_first: 0 }
    }

    /// Returns an empty queue for at most `frames` frames and `messages` long messages; see
    /// [`Inbox::with_room`].
    pub fn with_room(frames: usize, messages: usize) -> Self {
        Outbox {
            queue: Queue::with_room(frames),
            messages: Departures::with_room(messages),
            frames_first: 0,
        }
    }

    /// Returns the number of waiting frames.
    pub fn len(&self) -> usize {
        self.queue.len()
    }

    /// Returns true if no frame and no long message waits.
    pub fn is_empty(&self) -> bool {
        self.queue.is_empty() && self.messages.is_empty()
    }

    /// Returns true if some fragments of a message were sent, and others not. The link sends the
    /// next one soon, so that few other robots begin a message meanwhile.
    pub fn is_within_message(&self) -> bool {
        MESSAGES != 0 && self.messages.is_within()
    }

    /// Returns the counts of frames that were not passed on.
    pub fn counters(&self) -> QueueCounters {
        self.queue.counters()
    }

    /// Hashes the waiting frames in their order, and the long messages. Only hosts call this
    /// function.
    pub fn hash_state(&self, hasher: &mut impl Hasher) {
        self.queue.hash_state(hasher, |_, _| ());
        self.messages.hash_state(hasher);
        hasher.write_u8(self.frames_first);
    }

    /// Passes the waiting frames to `show`, oldest first, and then the fragments of long messages,
    /// for programs that inspect the queue.
    pub fn show(&self, mut show: impl FnMut(&[u8])) {
        self.queue.frames().for_each(&mut show);
        self.messages.show::<BYTES>(show);
    }

    /// Returns the state of the queue if it is empty. Only hosts call this function.
    pub fn as_empty(&self) -> Option<EmptyQueue> {
        let departures = self.messages.empty_state()?;
        let state = || EmptyQueue {
            departures,
            frames_first: self.frames_first,
            ..self.queue.empty_state()
        };
        self.queue.is_empty().then(state)
    }

    /// Gives a new queue the state of another one. Only hosts call this function.
    pub fn resume(&mut self, state: EmptyQueue) {
        self.queue.resume(state);
        self.messages.resume(state.departures);
        self.frames_first = state.frames_first;
    }

    /// Marks the waiting broadcasts as stale at the beginning of a step: newer ones replace them.
    pub fn begin_step(&mut self) {
        for rank in &mut self.queue.ranks {
            *rank |= STALE;
        }
        self.messages.begin_step();
    }

    /// Adds a frame to be sent.
    pub fn push(&mut self, frame: &[u8]) {
        self.queue.push(frame, Role::Own);
    }

    /// Adds the content of a long message from that robot. Returns false if there is no room for it:
    /// a broadcast then counts as dropped, and an entry of a stigmergy is to be added later.
    pub fn push_content(&mut self, robot: u16, content: &[u8]) -> bool {
        MESSAGES != 0 && self.messages.push(robot, content, &mut self.queue.dropped)
    }

    /// Removes the next frame, writes it to `room`, which is all zeros, and returns its length: the
    /// next fragment of the message that was begun; else alternately the oldest frame of the highest
    /// priority and the oldest one of all, or the first fragment of the next message.
    pub fn pop(&mut self, room: &mut [u8; BYTES]) -> Option<usize> {
        let is_turn = self.frames_first == 0 || self.queue.is_empty();
        if MESSAGES != 0
            && (is_turn || self.messages.is_within())
            && let Some(length) = self.messages.pop(room)
        {
            // The index of a fragment is the number of those before it.
            self.frames_first = room.first().map_or(0, |first| first % FRAGMENTS_MAX) + 1;
            return Some(length);
        }
        let (_, frame) = self.queue.pop()?;
        self.frames_first = self.frames_first.saturating_sub(1);
        Some(frame.copy_to(room))
    }

    /// Returns a frame that [`Outbox::pop`] has returned last, and that the link could not send.
    pub fn unpop(&mut self, frame: &[u8]) {
        if MESSAGES != 0 && is_fragment(frame) {
            self.messages.unpop(frame);
        } else {
            self.push(frame);
        }
    }
}

/// The role of a frame that is added to a queue.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Received,
    /// A received broadcast on a topic to which the script does not listen.
    Unwanted,
    /// A frame to be sent.
    Own,
}

/// Returns true for a fragment of a long message.
#[inline(always)]
fn is_fragment(frame: &[u8]) -> bool {
    frame.first().is_some_and(|first| first & 0xf0 == FRAGMENT)
}

/// Returns true if other fragments of the same message follow a frame with that first byte.
#[inline(always)]
pub fn is_followed(first: u8) -> bool {
    // The bit of `FRAGMENTS_MAX` is set in the last fragment.
    first & (0xf0 | FRAGMENTS_MAX) == FRAGMENT
}

impl<P: Profile, const BYTES: usize, const FRAMES: usize, const MESSAGES: usize> Default
    for Outbox<P, BYTES, FRAMES, MESSAGES>
{
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
    dropped: u16,
    duplicates: u16,
    /// The place of the oldest frame, or [`NOWHERE`]. When the bit [`BY_AGE`] is set, the next
    /// `pop` takes the oldest frame instead of the one with the highest priority.
    oldest: u8,
    /// The place of the next younger frame, or [`NOWHERE`], for each frame.
    younger: [u8; FRAMES],
    /// The state of each place: [`FREE`], [`UNWANTED`], or the priority of the waiting [`FrameKind`]
    /// (0 is the lowest) plus [`LOWEST_RANK`], with the bit [`STALE`] if the frame is from an earlier step.
    ranks: [u8; FRAMES],
    frames: [QueuedFrame<BYTES>; FRAMES],
    profile: PhantomData<P>,
}

/// The number of long messages that an inbox can keep out.
const KEPT_OUT: usize = 8;

/// The link to no frame.
const NOWHERE: u8 = 0;
/// A bit in `Queue::oldest`.
const BY_AGE: u8 = 1 << 7;

const FREE: u8 = 0;
const UNWANTED: u8 = 1;
const LOWEST_RANK: u8 = 2;
const HIGHEST_RANK: u8 = FrameKind::Broadcast as u8 + LOWEST_RANK;
/// A bit in a rank: the frame is from an earlier step.
const STALE: u8 = 1 << 7;

/// The place of the byte in which most frames differ: the lower byte of the sender.
const ROBOT: usize = 1;

/// The fitness of a place for a new frame: an equal frame waits there, or one that the new frame
/// replaces. In other places the fitness is `OF_NO_RANK` minus the rank of the waiting frame.
const SAME: u8 = 255;
const REPLACED: u8 = 254;
const OF_NO_RANK: u8 = 253;

impl<P: Profile, const BYTES: usize, const FRAMES: usize> Queue<P, BYTES, FRAMES> {
    const EMPTY: Self = {
        assert!(BYTES < 256 && FRAMES < BY_AGE as usize, "lengths and places are bytes");
        Queue {
            dropped: 0,
            duplicates: 0,
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

    fn is_empty(&self) -> bool {
        self.oldest() == NOWHERE
    }

    fn counters(&self) -> QueueCounters {
        let Queue { dropped, duplicates, .. } = *self;
        QueueCounters { dropped, duplicates, ..QueueCounters::default() }
    }

    fn empty_state(&self) -> EmptyQueue {
        let is_by_age = self.oldest & BY_AGE != 0;
        EmptyQueue { counters: self.counters(), is_by_age, ..EmptyQueue::default() }
    }

    fn resume(&mut self, state: EmptyQueue) {
        self.dropped = state.counters.dropped;
        self.duplicates = state.counters.duplicates;
        self.oldest = if state.is_by_age { NOWHERE | BY_AGE } else { NOWHERE };
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
    #[inline(never)]
    fn remove(&mut self, older: u8, place: u8) {
        self.take_out(older, place);
    }

    /// Does what [`Queue::remove`] does, for a caller where time is scarcer than flash.
    #[inline(always)]
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
    fn push(&mut self, frame: &[u8], role: Role) -> Option<usize> {
        let kind = frame.first().and_then(|first| FrameKind::of(*first));
        let (Some(kind), true) = (kind, frame.len() <= BYTES) else {
            count(&mut self.dropped);
            return None;
        };
        let is_beacon = matches!(kind, FrameKind::Beacon | FrameKind::Digest);
        let new_rank = match role {
            Role::Own if is_beacon => HIGHEST_RANK,
            Role::Unwanted => UNWANTED,
            _ => kind as u8 + LOWEST_RANK,
        };
        // Broadcasts replace only stale frames, and an inbox has none.
        let replaces_none = kind == FrameKind::Broadcast && role != Role::Own;
        let robot = frame.get(ROBOT);
        let (suits, older, mut place, mut youngest) = 'search: loop {
            // The fitness of the best place, the next older frame, and the place.
            let mut best = (0, NOWHERE, NOWHERE);
            let (mut older, mut place) = (NOWHERE, self.oldest());
            while let Some(waiting) = self.frames.get(index(place)) {
                let rank = self.ranks.get(index(place)).copied().unwrap_or(FREE);
                let is_stale = rank & STALE != 0;
                let mut suits = OF_NO_RANK - (rank & !STALE);
                let is_of_robot = waiting.get(ROBOT) == robot;
                if is_of_robot && waiting.iter().eq(frame) {
                    suits = SAME;
                } else if is_of_robot && (rank | new_rank) == UNWANTED
                    || !replaces_none && replaces::<P>(kind, frame, waiting, is_stale)
                {
                    suits = REPLACED;
                }
                if suits >= REPLACED && best.0 >= REPLACED {
                    // Two frames are replaced: one of them is removed, and the search restarts.
                    if suits == SAME {
                        (older, place) = (best.1, best.2);
                    }
                    self.remove(older, place);
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
            count(&mut self.duplicates);
        } else if suits != REPLACED {
            if let Some(free) = self.ranks.iter().position(|rank| rank & !STALE == FREE) {
                place = free as u8 + 1;
            } else {
                count(&mut self.dropped);
                if OF_NO_RANK - suits > new_rank {
                    return None;
                }
                self.remove(older, place);
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
#[inline(never)]
pub(crate) fn count(counter: &mut u16) {
    *counter = counter.saturating_add(1);
}
