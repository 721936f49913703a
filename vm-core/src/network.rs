//! What a robot knows of others: how much it may remember, when it speaks of itself, and what it could not use.
//!
//! Neighbours, swarms and entries of stigmergies are slots of the arena, above those of the script.

use crate::message::FRAGMENTS_MAX;
use crate::number::Profile;
use crate::value::{Tag, Value};

/// How much a machine remembers of other robots. What is 0 is left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Neighbours at a time.
    pub neighbors: u8,
    /// Whether it is known in which direction a neighbour is; else azimuth and elevation are 0.0.
    pub bearings: bool,
    /// Entries of all stigmergies together, and stigmergies; at most 100.
    pub entries: u8,
    /// Swarms that the script can create; at most 8.
    pub swarms: u8,
}

/// Slots of an entry: key, value, robot, clock, digest.
pub(crate) const ENTRY: usize = 5;

impl Sizes {
    /// No neighbours, no swarms, no stigmergies.
    pub const NONE: Sizes = Sizes { neighbors: 0, bearings: false, entries: 0, swarms: 0 };

    /// Within what a byte can count.
    pub(crate) fn clamped(self) -> Sizes {
        Sizes { entries: self.entries.min(100), swarms: self.swarms.min(8), ..self }
    }

    /// Slots of the arena that it takes.
    pub const fn slots(&self) -> usize {
        // A stigmergy beside each entry.
        self.entries as usize * (ENTRY + 1)
            + self.swarms as usize
            + self.neighbors as usize * self.neighbor()
    }

    /// Slots of a neighbour: robot, distance; azimuth, elevation.
    pub(crate) const fn neighbor(&self) -> usize {
        2 + 2 * self.bearings as usize
    }
}

/// What the link knows of who sent a frame.
#[derive(Clone, Copy, Debug)]
pub struct Sighting<P: Profile> {
    /// The sender, where the link itself tells it; else it is in the frame, if at all.
    pub robot: Option<u16>,
    /// Distance in mm, azimuth and elevation in radians as the receiver sees the sender: 0 ahead, anticlockwise and up
    /// positive; floats. `None` where it is not known.
    pub place: Option<[Value<P>; 3]>,
}

impl<P: Profile> Sighting<P> {
    /// Of a link that knows how far the sender is, a float in mm, but not in which direction.
    #[inline]
    pub fn at(distance: Value<P>) -> Self {
        let zero = Value::new(Tag::FLOAT, P::ZERO);
        Sighting { robot: None, place: Some([distance, zero, zero]) }
    }
}

impl<P: Profile> Default for Sighting<P> {
    /// Nothing is known.
    fn default() -> Self {
        Sighting { robot: None, place: None }
    }
}

/// How often a robot is heard without its script's doing, in steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Periods {
    /// A robot that has sent nothing for so long sends a beacon.
    pub beacon: u8,
    /// Steps without a frame after which a neighbour is forgotten, at most 126; half of them if only one was received.
    pub forget: u8,
    /// Between two advertisements of stigmergy entries where nothing changes, at most 150.
    pub advertise: u8,
}

impl Periods {
    /// A beacon after a second, forgotten after three, an advertisement every two.
    pub const DEFAULT: Periods = Periods { beacon: 10, forget: 30, advertise: 20 };
}

/// What was heard but could not be used, and what else went wrong without harm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Messages of another script.
    pub foreign: u16,
    /// Frames that make no sense, and values of a class that the script never sends under that name.
    pub malformed: u16,
    /// Messages from a robot with this robot's id.
    pub own_id: u16,
    /// Entries of stigmergies that were not kept, since the store is full.
    pub not_kept: u16,
    /// Messages in fragments that were given up: a fragment was missing, another message came between, or there was no memory.
    pub incomplete: u16,
    /// Conflicts that the handler did not decide.
    pub undecided: u16,
    /// Messages whose listener or handler ended with a fault.
    pub failed: u16,
}

/// Bit of [`Protocol::digest`] that is set until an entry changes. The sum itself has 24 bits.
pub(crate) const DIGEST_KNOWN: u32 = 1 << 31;

/// Which counter.
#[derive(Clone, Copy)]
pub(crate) enum Count {
    Foreign,
    Malformed,
    OwnId,
    NotKept,
    Incomplete,
    Undecided,
    Failed,
}

/// The state of a conflict that the script's handler is to decide.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(crate) enum Conflict {
    /// There is none.
    None = 0,
    /// The handler runs.
    Open,
    /// The handler ended with a fault: the default rule decides.
    Failed,
}

/// When what is to be sent, and the message of which some fragments are here.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Protocol<P: Profile> {
    pub(crate) sizes: Sizes,
    /// How many stigmergies the script has created.
    pub(crate) stigmergies: u8,
    /// Number of the step, on which neighbours are forgotten.
    pub(crate) step: u8,
    /// 1 + the place of the neighbour that was heard last: often the next message comes from the one behind it.
    pub(crate) heard: u8,
    /// The script has created a swarm or a stigmergy.
    pub(crate) shares: bool,
    /// An entry or a swarm is to be sent when the entry point that is running returns.
    pub(crate) has_news: bool,
    /// How many messages this step may still take.
    pub(crate) messages_left: u8,
    /// A message is being handled: a fault ends that, not the script.
    pub(crate) in_message: bool,
    pub(crate) conflict: Conflict,
    /// The script waits for its next start: messages are handled without it.
    pub(crate) is_resting: bool,
    /// Steps since the last frame with the robot's own id.
    pub(crate) silent: u8,
    /// Steps between two advertisements of entries.
    pub(crate) interval: u8,
    /// Steps until something happens, by [`Timer`].
    pub(crate) timers: [u8; 4],
    /// The first slot of the entry that has changed last; 0 before any has.
    pub(crate) newest: u16,
    /// The entry, or behind them the swarm, that was advertised last.
    pub(crate) advertised: u8,
    /// Hash of the entry that was relayed last without being kept.
    pub(crate) relayed: u16,
    /// Answers to neighbors that may be given at once.
    pub(crate) answers: u8,
    /// Entries of a former life of this robot that it has put again of late.
    pub(crate) reclaimed: u8,
    /// Steps, counted modulo 65,536, for what happens once in many.
    pub(crate) age: u16,
    /// Turns of advertising, counted modulo 256.
    pub(crate) turn: u8,
    /// Entries that are still to be advertised because a neighbor's digest differs.
    pub(crate) behind: u8,
    /// Entries were received that are not kept, so the digest says nothing.
    pub(crate) has_dropped: bool,
    /// A neighbor sends beacons without a digest: it may lack entries.
    pub(crate) meets_beacon: bool,
    /// The sum over all entries, with [`DIGEST_KNOWN`] until an entry changes.
    pub(crate) digest: u32,
    /// The latest clock that was put or received, on any key.
    pub(crate) clock: u32,
    /// State of a generator that keeps robots from sending all at once.
    pub(crate) jitter: u16,
    /// As in [`Counters`].
    pub(crate) counters: [u16; 7],
    pub(crate) assembly: Assembly<P>,
}

/// Counts steps down to zero.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(crate) enum Timer {
    /// Steps to the next advertisement of an entry.
    Advertise,
    /// Pause after an entry was relayed that is not kept.
    Relay,
    /// Steps to the next digest.
    Digest,
    /// Patience with the message of which some fragments are here; 0 if there is none.
    Assembly,
}

/// A message of which some fragments are here.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Assembly<P: Profile> {
    pub(crate) robot: u16,
    pub(crate) number: u8,
    /// Bit i: fragment i is here.
    pub(crate) present: u8,
    /// Those that have to be; 0 as long as the last is not here.
    pub(crate) all: u8,
    /// Bytes of the whole message.
    pub(crate) length: u16,
    /// Steps in which this robot begins no other message, since a fragment of another robot found no room.
    pub(crate) pause: u8,
    pub(crate) content: P::Content,
}

impl<P: Profile> Protocol<P> {
    /// All zeros.
    pub(crate) const EMPTY: Self = Protocol {
        sizes: Sizes::NONE,
        timers: [0; 4],
        stigmergies: 0,
        step: 0,
        heard: 0,
        shares: false,
        has_news: false,
        messages_left: 0,
        in_message: false,
        conflict: Conflict::None,
        is_resting: false,
        silent: 0,
        interval: 0,
        newest: 0,
        advertised: 0,
        relayed: 0,
        answers: 0,
        reclaimed: 0,
        age: 0,
        turn: 0,
        behind: 0,
        has_dropped: false,
        meets_beacon: false,
        digest: 0,
        clock: 0,
        jitter: 0,
        counters: [0; 7],
        assembly: Assembly {
            robot: 0,
            number: 0,
            present: 0,
            all: 0,
            length: 0,
            pause: 0,
            content: P::Content::ZERO,
        },
    };

    /// Forgets what was heard and said with another script. What only delays a message may stay.
    pub(crate) fn forget(&mut self) {
        self.stigmergies = 0;
        self.heard = 0;
        self.shares = false;
        self.has_news = false;
        self.in_message = false;
        self.conflict = Conflict::None;
        self.is_resting = false;
        self.newest = 0;
        self.behind = 0;
        self.has_dropped = false;
        self.digest = 0;
        self.clock = 0;
        self.set_timer(Timer::Assembly, 0);
    }

    /// Prepares a new start of the same script. Knowledge of others stays.
    pub(crate) fn rest(&mut self) {
        self.in_message = false;
        self.conflict = Conflict::None;
        self.is_resting = true;
    }

    /// Steps that are left of a timer.
    #[inline(always)]
    pub(crate) fn timer(&self, which: Timer) -> u8 {
        self.timers[which as usize]
    }

    #[inline(always)]
    pub(crate) fn set_timer(&mut self, which: Timer, steps: u8) {
        self.timers[which as usize] = steps;
    }

    /// Takes a step off all timers.
    pub(crate) fn tick(&mut self) {
        for timer in &mut self.timers {
            *timer -= u8::from(*timer != 0);
        }
    }

    #[inline(never)]
    pub(crate) fn count(&mut self, which: Count) {
        if let Some(counter) = self.counters.get_mut(which as usize)
            && *counter != u16::MAX
        {
            *counter += 1;
        }
    }
}

/// Bytes on the stack of the processor.
pub trait Buffer: AsMut<[u8]> + AsRef<[u8]> + Copy + core::fmt::Debug {
    /// All zeros.
    const ZERO: Self;
}

impl<const BYTES: usize> Buffer for [u8; BYTES] {
    const ZERO: Self = [0; BYTES];
}

/// Bytes of all fragments of a message whose frames have so many.
pub(crate) const fn content_bytes(frame: usize) -> usize {
    FRAGMENTS_MAX as usize * (frame - crate::message::FRAGMENT_HEAD)
}
