//! Long messages: messages whose values do not fit one frame, on their way through the queues.
//!
//! The machine passes and takes whole contents. The sender's queue cuts a content into fragments
//! when the link asks for the next frame, and the receiver's queue joins the fragments as they
//! arrive. So fragments take no place that frames need, and a message enters or leaves a queue as a
//! whole.

use core::hash::{Hash, Hasher};

use bittybuzz_vm_core::Buffer;
use bittybuzz_vm_core::message::{
    FRAGMENT_HEAD, FRAGMENTS_MAX, Fragment, is_broadcast, replaces_content,
};
use bittybuzz_vm_core::number::Profile;

use crate::queue::count;

/// Returns the number of bytes of a content that a fragment carries.
#[inline(always)]
fn fragment_bytes<P: Profile>() -> usize {
    size_of::<P::Frame>() - FRAGMENT_HEAD
}

/// A long message of which fragments have arrived, without its content.
#[derive(Debug, Clone, Copy)]
struct Assembly<E: Copy> {
    robot: u16,
    /// The length of the content; 0 until the last fragment has arrived.
    length: u16,
    number: u8,
    /// Bit i is set if fragment i has arrived, or if the message has no such fragment: 0 in a free
    /// place, and [`COMPLETE`] if none is missing.
    present: u8,
    /// The number of the last fragment.
    fragment: u8,
    /// The link's data about the latest fragment.
    extra: E,
}

/// The bits of all fragments.
const COMPLETE: u8 = 0xff;

/// Received long messages, at most `MESSAGES` at once. A new list is all zeros, if `nothing` is.
#[derive(Debug, Clone)]
pub(crate) struct Assemblies<P: Profile, E: Copy, const MESSAGES: usize> {
    /// They lie next to each other, so that a search touches little memory.
    places: [Assembly<E>; MESSAGES],
    contents: [P::Content; MESSAGES],
    /// 1 + the place of the message whose content is taken next; 0 if there is none.
    taken: u8,
    /// The number of complete messages.
    complete: u8,
    /// The number of fragments that have arrived, modulo 256.
    fragments: u8,
    /// The number of places that are not used.
    unused: u8,
}

// How suitable a place is. Less suitable than these is the place of a message after whose last
// fragment that many others have arrived.
/// The place of the same message, or of one that the same sender has given up.
const SAME: u8 = 255;
const FREE: u8 = 254;

impl<P: Profile, E: Copy, const MESSAGES: usize> Assemblies<P, E, MESSAGES> {
    pub const fn new(nothing: E) -> Self {
        let free =
            Assembly { robot: 0, length: 0, number: 0, present: 0, fragment: 0, extra: nothing };
        let contents = [P::Content::ZERO; MESSAGES];
        Assemblies {
            places: [free; MESSAGES],
            contents,
            taken: 0,
            complete: 0,
            fragments: 0,
            unused: 0,
        }
    }

    /// Returns an empty list for at most `messages` messages.
    pub fn with_room(nothing: E, messages: usize) -> Self {
        Assemblies { unused: MESSAGES.saturating_sub(messages) as u8, ..Self::new(nothing) }
    }

    /// Returns true if no fragment of a message has arrived, and no content is to be taken.
    pub fn is_unused(&self) -> bool {
        self.taken == 0 && !self.is_assembling()
    }

    /// Returns true if fragments of a message have arrived.
    pub fn is_assembling(&self) -> bool {
        self.places.iter().any(|place| place.present != 0)
    }

    /// Adds a fragment to the others of its message. Counts a message that is given up, and a
    /// fragment for which there is no place.
    ///
    /// A message gets the place of another one after whose last fragment as many others have
    /// arrived as there are places, the longest ago. A sender that finishes what it has begun sends
    /// its next fragment before. So robots that begin messages and do not finish them, or that do
    /// not exist, keep no place from others for long. Until then, a repetition may complete the
    /// message.
    pub fn push(&mut self, frame: &[u8], extra: E, incomplete: &mut u16) {
        if self.add(frame, extra).is_none_or(|gives_up| gives_up) {
            count(incomplete);
        }
    }

    /// Adds a fragment. Returns true if another message is given up; `None` if there is no place for
    /// the fragment, or no robot sends it.
    #[inline(never)]
    fn add(&mut self, frame: &[u8], extra: E) -> Option<bool> {
        let piece = fragment_bytes::<P>();
        let Fragment { robot, number, index, last, content } = Fragment::parse(frame)?;
        // Only the last fragment may be shorter. Bytes after the longest fragment are ignored.
        let content = content.get(..piece).unwrap_or(content);
        if !last && content.len() < piece {
            return None;
        }
        self.fragments = self.fragments.wrapping_add(1);
        let (mut most, mut best) = (0, MESSAGES);
        let used = used::<MESSAGES>(self.unused);
        for (at, place) in self.places.iter().enumerate().take(used) {
            let is_same = place.robot == robot;
            let suits = match place.present {
                // A repetition of a message that waits.
                COMPLETE if is_same && place.number == number => return Some(false),
                COMPLETE => continue,
                0 => FREE,
                _ if is_same => SAME,
                _ => {
                    let others = self.fragments.wrapping_sub(place.fragment);
                    if others < used as u8 {
                        continue;
                    }
                    others.min(FREE - 1)
                }
            };
            if suits > most {
                (most, best) = (suits, at);
            }
        }
        let (place, room) = (self.places.get_mut(best)?, self.contents.get_mut(best)?);
        let is_other = most != SAME || place.number != number;
        let gives_up = is_other && place.present != 0;
        if is_other {
            (place.robot, place.number, place.present, place.length) = (robot, number, 0, 0);
        }
        let from = usize::from(index) * piece;
        let room = room.as_mut().get_mut(from..)?;
        room.iter_mut().zip(content).for_each(|(to, from)| *to = *from);
        let mut present = 1 << index;
        if last {
            place.length = (from + content.len()) as u16;
            present = COMPLETE << index;
        }
        place.fragment = self.fragments;
        place.present |= present;
        self.complete += u8::from(place.present == COMPLETE);
        place.extra = extra;
        Some(gives_up)
    }

    /// Returns true if a message is complete.
    #[inline(always)]
    pub fn is_waiting(&self) -> bool {
        self.complete != 0
    }

    /// Takes a message whose fragments have all arrived: writes the first bytes of a fragment, which
    /// stand for it, to `head`, and returns its place. [`Assemblies::take_content`] frees the place,
    /// or the next call of this function.
    pub fn pop(&mut self, head: &mut [u8]) -> Option<usize> {
        if self.taken != 0 {
            self.take_content(&mut []);
        }
        let at = self.places.iter().position(|place| place.present == COMPLETE)?;
        let Assembly { robot, number, .. } = self.places.get(at)?;
        let fragment =
            Fragment { robot: *robot, number: *number, index: 0, last: false, content: &[] };
        *head.first_chunk_mut()? = fragment.head();
        self.taken = at as u8 + 1;
        Some(at)
    }

    /// Returns the link's data about the message at that place.
    pub fn extra(&self, place: usize) -> Option<&E> {
        self.places.get(place).map(|place| &place.extra)
    }

    /// Copies the content of the message that [`Assemblies::pop`] has returned last, frees its
    /// place, and returns the length of the content; 0 if there is none.
    pub fn take_content(&mut self, room: &mut [u8]) -> usize {
        let taken = usize::from(core::mem::take(&mut self.taken)).wrapping_sub(1);
        let (Some(place), Some(content)) = (self.places.get_mut(taken), self.contents.get(taken))
        else {
            return 0;
        };
        place.present = 0;
        self.complete -= 1;
        let length = usize::from(place.length).min(room.len());
        room.iter_mut().zip(content.as_ref()).take(length).for_each(|(to, from)| *to = *from);
        length
    }

    /// Passes the fragments that have arrived to `show`, as frames.
    pub fn show<const BYTES: usize>(&self, mut show: impl FnMut(&[u8])) {
        for (place, content) in self.places.iter().zip(&self.contents) {
            let Assembly { robot, number, present, length, .. } = *place;
            let (piece, length) = (fragment_bytes::<P>(), usize::from(length));
            let content = content.as_ref();
            for (index, all) in (0..FRAGMENTS_MAX).zip(content.chunks(piece)) {
                let from = usize::from(index) * piece;
                let is_known = length == 0 || from < length;
                if present >> index & 1 == 0 || !is_known {
                    continue;
                }
                let last = length != 0 && from + piece >= length;
                let content = if last { content.get(from..length) } else { None }.unwrap_or(all);
                let fragment = Fragment { robot, number, index, last, content };
                let mut frame = [0; BYTES];
                if let Some(length) = write_fragment(&fragment, &mut frame) {
                    show(frame.get(..length).unwrap_or(&[]));
                }
            }
        }
    }

    /// Hashes the messages; `extra` hashes the link's data of one. The places do not matter.
    pub fn hash_state<H: Hasher>(&self, hasher: &mut H, extra: impl Fn(&E, &mut H)) {
        for (place, content) in self.places.iter().zip(&self.contents) {
            let Assembly { robot, length, number, present, fragment, extra: known } = place;
            if *present != 0 {
                let others = self.fragments.wrapping_sub(*fragment);
                (robot, length, number, present, others).hash(hasher);
                hasher.write(content.as_ref());
                extra(known, hasher);
            }
        }
        hasher.write_u8(self.taken);
    }
}

/// Long messages to be sent, at most `MESSAGES`, which are sent in the order of their places. A new
/// list is all zeros.
#[derive(Debug, Clone)]
pub(crate) struct Departures<P: Profile, const MESSAGES: usize> {
    /// The lengths of the contents, 0 in a free place, and the contents.
    places: [(u16, P::Content); MESSAGES],
    /// Bit i is set if the message at place i is from an earlier step.
    stale: u16,
    /// The sender of all messages.
    robot: u16,
    /// The place of the message of which a fragment was sent last.
    latest: u8,
    /// The number of fragments of that message that were sent; 0 if all were sent.
    sent: u8,
    /// The number of places that are not used.
    unused: u8,
}

impl<P: Profile, const MESSAGES: usize> Departures<P, MESSAGES> {
    pub const fn new() -> Self {
        Departures {
            places: [(0, P::Content::ZERO); MESSAGES],
            stale: 0,
            robot: 0,
            latest: 0,
            sent: 0,
            unused: 0,
        }
    }

    /// Returns an empty list for at most `messages` messages.
    pub fn with_room(messages: usize) -> Self {
        Departures { unused: MESSAGES.saturating_sub(messages) as u8, ..Self::new() }
    }

    /// Marks the waiting messages as stale at the beginning of a step.
    pub fn begin_step(&mut self) {
        self.stale = !0;
    }

    /// Returns true if no message waits.
    pub fn is_empty(&self) -> bool {
        self.places.iter().all(|(length, _)| *length == 0)
    }

    /// Returns the sender and the latest place if no message waits.
    pub fn empty_state(&self) -> Option<(u16, u8)> {
        (self.is_empty() && self.sent == 0).then_some((self.robot, self.latest))
    }

    /// Gives a new list the state of another one.
    pub fn resume(&mut self, (robot, latest): (u16, u8)) {
        (self.robot, self.latest) = (robot, latest);
    }

    /// Returns true if some fragments of a message were sent, and others not.
    pub fn is_within(&self) -> bool {
        self.sent != 0
    }

    /// Adds a message. If there is no room for it, a broadcast drops the broadcast that would be
    /// sent last, and is dropped itself if there is none; either is counted. An entry of a
    /// stigmergy is not counted, because the machine sends it later. Returns false if the message
    /// is not added.
    ///
    /// A message of which a fragment was sent stays as it is, since receivers could not use the
    /// fragments of another content.
    #[inline(never)]
    pub fn push(&mut self, robot: u16, content: &[u8], dropped: &mut u16) -> bool {
        self.robot = robot;
        let is_broadcast = is_broadcast(content);
        let (mut chosen, mut has_room) = (MESSAGES, false);
        let mut at = self.latest;
        // The places in the order in which they are sent: the latest one is sent last.
        for _ in 0..self.used() {
            at = self.next(at);
            let place = usize::from(at);
            let Some((length, room)) = self.places.get(place) else { break };
            let (is_free, waiting) = (*length == 0, room.as_ref());
            if self.sent != 0 && at == self.latest {
                continue;
            }
            let is_same =
                !is_free && replaces_content::<P>(content, waiting, self.stale >> at & 1 != 0);
            let is_last = is_broadcast && self::is_broadcast(waiting);
            if is_same || !has_room && (is_free || is_last) {
                (chosen, has_room) = (place, is_same || is_free);
            }
            if is_same {
                break;
            }
        }
        if !has_room && is_broadcast {
            count(dropped);
        }
        let Some((length, room)) = self.places.get_mut(chosen) else { return false };
        self.stale &= !(1 << chosen);
        *length = content.len() as u16;
        room.as_mut().iter_mut().zip(content).for_each(|(to, from)| *to = *from);
        true
    }

    /// Returns the number of places that are used.
    fn used(&self) -> usize {
        used::<MESSAGES>(self.unused)
    }

    /// Returns the place after another one.
    fn next(&self, at: u8) -> u8 {
        let next = at + 1;
        if usize::from(next) < self.used() { next } else { 0 }
    }

    /// Writes the next fragment of the message that was begun, or else of the one at the next place,
    /// and returns its length; `None` if no message waits.
    #[inline(never)]
    pub fn pop(&mut self, frame: &mut [u8]) -> Option<usize> {
        if self.sent == 0 {
            for _ in 0..self.used() {
                self.latest = self.next(self.latest);
                let place = self.places.get(usize::from(self.latest));
                if place.is_some_and(|(length, _)| *length != 0) {
                    break;
                }
            }
        }
        let (length, content) = self.places.get_mut(usize::from(self.latest))?;
        let content = content.as_ref();
        let (index, piece) = (self.sent, fragment_bytes::<P>());
        let from = usize::from(index) * piece;
        let left = usize::from(*length).saturating_sub(from);
        if left == 0 {
            return None;
        }
        // The number of a message is a part of its check, so fragments of the same content complete
        // each other, whichever transmission they come from.
        let (robot, number, last) = (self.robot, *content.first()?, left <= piece);
        let part = content.get(from..from + left.min(piece))?;
        self.sent = index + 1;
        if last {
            (*length, self.sent) = (0, 0);
        }
        write_fragment(&Fragment { robot, number, index, last, content: part }, frame)
    }

    /// Takes back the fragment that was returned last. No message may have been added since. If it
    /// was the last one of its message, more bytes follow its content now, which receivers ignore.
    pub fn unpop(&mut self, frame: &[u8]) {
        if let Some(Fragment { index, .. }) = Fragment::parse(frame)
            && let Some((length, _)) = self.places.get_mut(usize::from(self.latest))
        {
            let end = (u16::from(index) + 1) * fragment_bytes::<P>() as u16;
            *length = end.max(*length);
            self.sent = index;
        }
    }

    /// Passes the fragments that are still to be sent to `show`, as frames.
    pub fn show<const BYTES: usize>(&self, mut show: impl FnMut(&[u8])) {
        let mut copy = self.clone();
        let mut frame = [0; BYTES];
        while let Some(length) = copy.pop(&mut frame) {
            show(frame.get(..length).unwrap_or(&[]));
        }
    }

    /// Hashes the messages.
    pub fn hash_state(&self, hasher: &mut impl Hasher) {
        (self.robot, self.latest, self.sent).hash(hasher);
        for (at, (length, content)) in self.places.iter().enumerate() {
            if *length != 0 {
                (at as u8, length, self.stale >> at & 1).hash(hasher);
                hasher.write(content.as_ref());
            }
        }
    }
}

/// Returns the number of places without those that are not used. A robot's queue uses all.
#[inline(always)]
fn used<const MESSAGES: usize>(unused: u8) -> usize {
    if cfg!(target_os = "none") { MESSAGES } else { MESSAGES - usize::from(unused) }
}

/// Writes a fragment into a frame and returns its length; `None` if there is no room for it.
fn write_fragment(fragment: &Fragment<'_>, frame: &mut [u8]) -> Option<usize> {
    let (head, rest) = frame.split_first_chunk_mut()?;
    *head = fragment.head();
    rest.iter_mut().zip(fragment.content).for_each(|(to, from)| *to = *from);
    Some(FRAGMENT_HEAD + fragment.content.len())
}
