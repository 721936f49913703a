//! The state of the protocol: the timers for sending, and the counters.
//!
//! Neighbors, swarms and entries of stigmergies are not here: they are slots of the arena, above
//! those of the script.

use crate::message::Topics;
use crate::network::{Places, Sizes};

/// The bit of [`Protocol::digest`] that is set while the sum in the lower 24 bits is valid. A
/// change of an entry clears it. A machine that may have many entries keeps the sum valid instead,
/// since adding them all would take too long for a slice.
pub(in crate::machine) const DIGEST_KNOWN: u32 = 1 << 31;
/// The bits of the sum over all entries.
pub(super) const DIGEST_BITS: u32 = 0x00ff_ffff;

/// A [`Protocol::alone`] after which others may have forgotten deletions that the robot missed.
pub(super) const ALONE: u8 = super::advertise::FORGOTTEN as u8;
/// A [`Protocol::alone`] at which the robot has compared its entries with those of the others: 3 to
/// 5 s after the first frame.
pub(super) const COMPARED: u8 = ALONE + 4;

/// The index of a counter in [`Protocol::counters`].
#[derive(Clone, Copy)]
pub(in crate::machine) enum Count {
    Foreign,
    Malformed,
    OwnId,
    NotKept,
    Incomplete,
    Undecided,
    Failed,
}

/// The state of a conflict between two entries that the script's handler decides.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(in crate::machine) enum Conflict {
    /// There is none.
    None = 0,
    /// The handler runs.
    Open,
    /// The handler runs again, with the two entries exchanged.
    Exchanged,
    /// The handler ended with a fault, so the default rule decides.
    Failed,
}

/// The timers for sending, and the counters.
#[derive(Clone, Copy, Debug)]
pub(in crate::machine) struct Protocol {
    pub(in crate::machine) sizes: Sizes,
    /// The number of stigmergies that the script has created.
    pub(in crate::machine) stigmergies: u8,
    /// The number of the step, at which neighbors are forgotten: from 1 to `LAST_STEP`, then 1
    /// again.
    pub(in crate::machine) step: u8,
    /// 1 + the place of the neighbor that sent the last message. The next message often comes from
    /// the neighbor at the place after it.
    pub(in crate::machine) last_sender: u8,
    /// True if the script has created a swarm or a stigmergy.
    pub(in crate::machine) shares: bool,
    /// True if an entry or a swarm is to be sent when the running entry point returns.
    pub(in crate::machine) has_dirty_entries: bool,
    /// The number of messages that this step may still handle.
    pub(in crate::machine) messages_left: u8,
    /// The topics to which the script has listened since its start.
    pub(in crate::machine) topics: Topics,
    /// True while a message is handled: a fault then ends the handling, not the script.
    pub(in crate::machine) in_message: bool,
    pub(in crate::machine) conflict: Conflict,
    /// True while the script waits for its next start: messages are handled without it.
    pub(in crate::machine) is_resting: bool,
    /// Steps since the robot last sent a frame that names it as the sender.
    pub(in crate::machine) silent: u8,
    /// Steps between two advertisements of entries.
    pub(in crate::machine) interval: u8,
    /// The steps that are left of each [`Timer`].
    pub(in crate::machine) timers: [u8; 6],
    /// The first slot of the entry that changed last; 0 if none has changed.
    pub(in crate::machine) newest: u16,
    /// The set of [`Flag`]s, in one byte, since memory is scarce on a Kilobot.
    pub(in crate::machine) flags: u8,
    /// The place of the entry that was advertised last. Places after those of all entries stand for
    /// swarms.
    pub(in crate::machine) advertised: Places,
    /// The hash of the last entry that was relayed without being kept.
    pub(in crate::machine) relayed: u16,
    /// The number of answers to neighbors that may be sent at once.
    pub(in crate::machine) answers: u8,
    /// The number of entries from before a restart of this robot that it has recently put again.
    pub(in crate::machine) reclaimed: u8,
    /// Steps, counted modulo 65,536, for actions that are due only every few steps.
    pub(in crate::machine) age: u16,
    /// Turns of advertising, counted modulo 256.
    pub(in crate::machine) turn: u8,
    /// The number of entries that are still to be advertised because a neighbor's digest differs.
    pub(in crate::machine) unadvertised: Places,
    /// The low bits of the last digest of a neighbor that differs.
    pub(in crate::machine) differing: u16,
    /// Steps before the next help for that neighbor.
    pub(in crate::machine) help_pause: u8,
    /// The sum over all entries; see [`DIGEST_KNOWN`].
    pub(in crate::machine) digest: u32,
    /// The latest clock that was put or received, on any key.
    pub(in crate::machine) clock: u32,
    /// The low bits of that clock when a neighbor last had the same entries: others know the puts up
    /// to then.
    pub(in crate::machine) settled: u16,
    /// The latest clock of a deletion whose place was taken, here or at a robot with the same
    /// entries.
    pub(in crate::machine) floor: u32,
    /// Sixteens of steps since a beacon or an entry was received, up to [`ALONE`]; then, once one was
    /// received, more of them up to [`COMPARED`].
    pub(in crate::machine) alone: u8,
    /// The state of the random generator that keeps robots from sending at the same time.
    pub(in crate::machine) jitter: u16,
    /// The counters of [`NetworkCounters`](crate::network::NetworkCounters), by [`Count`].
    pub(in crate::machine) counters: [u16; 7],
}

/// A property that holds or not. The numbers are bits of [`Protocol::flags`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(in crate::machine) enum Flag {
    /// [`Protocol::newest`] is a put of this robot that it has not yet received from
    /// another one: every neighbor may have missed it.
    Unheard = 1,
    /// Entries were received that are not kept, so that the digest is of no use.
    Dropped = 2,
    /// A neighbor sends beacons without a digest: it may lack entries.
    MeetsBeacon = 4,
    /// A neighbor had the same entries before the floor rose, and none was lost since: the robot
    /// knows all keys that are not later than the floor.
    Complete = 8,
    /// A neighbor has had other entries since one had the same.
    Differs = 16,
}

/// A timer, which counts steps down to zero.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(in crate::machine) enum Timer {
    /// Steps to the next advertisement of an entry.
    Advertise,
    /// Steps until another entry that is not kept may be relayed.
    Relay,
    /// Steps until a digest may be sent before an advertisement.
    Digest,
    /// Steps until a neighbor whose digest stays another one gets all entries again.
    Help,
    /// Steps in which a neighbor may still have entries that were deleted here.
    Distrust,
    /// Steps after a first difference in which the robot counts as one that has the same entries as
    /// a neighbor.
    Meeting,
}

impl Protocol {
    /// All zeros.
    pub(in crate::machine) const EMPTY: Self = Protocol {
        sizes: Sizes::NONE,
        timers: [0; 6],
        stigmergies: 0,
        step: 0,
        last_sender: 0,
        shares: false,
        has_dirty_entries: false,
        messages_left: 0,
        topics: 0,
        in_message: false,
        conflict: Conflict::None,
        is_resting: false,
        silent: 0,
        interval: 0,
        newest: 0,
        flags: 0,
        advertised: 0,
        relayed: 0,
        answers: 0,
        reclaimed: 0,
        age: 0,
        turn: 0,
        unadvertised: 0,
        differing: 0,
        help_pause: 0,
        digest: 0,
        clock: 0,
        settled: 0,
        floor: 0,
        alone: 0,
        jitter: 0,
        counters: [0; 7],
    };

    /// Forgets the exchange with other robots under another script. State that only delays a
    /// message may stay.
    pub(in crate::machine) fn forget(&mut self) {
        self.stigmergies = 0;
        self.last_sender = 0;
        self.shares = false;
        self.has_dirty_entries = false;
        self.topics = 0;
        self.in_message = false;
        self.conflict = Conflict::None;
        self.is_resting = false;
        self.newest = 0;
        self.flags = 0;
        self.unadvertised = 0;
        self.digest = 0;
        self.clock = 0;
        self.settled = 0;
        self.floor = 0;
        self.alone = 0;
    }

    /// Prepares a new start of the same script. Knowledge of other robots stays.
    pub(in crate::machine) fn rest(&mut self) {
        self.topics = 0;
        self.in_message = false;
        self.conflict = Conflict::None;
        self.is_resting = true;
    }

    #[hot]
    pub(in crate::machine) fn has(&self, flag: Flag) -> bool {
        self.flags & flag as u8 != 0
    }

    #[hot]
    pub(in crate::machine) fn set(&mut self, flag: Flag) {
        self.flags |= flag as u8;
    }

    #[hot]
    pub(in crate::machine) fn clear(&mut self, flag: Flag) {
        self.flags &= !(flag as u8);
    }

    /// Returns the steps that are left of a timer.
    #[hot]
    pub(in crate::machine) fn timer(&self, which: Timer) -> u8 {
        self.timers[which as usize]
    }

    #[hot]
    pub(in crate::machine) fn set_timer(&mut self, which: Timer, steps: u8) {
        self.timers[which as usize] = steps;
    }

    /// Counts all timers down by a step.
    pub(in crate::machine) fn tick(&mut self) {
        for timer in &mut self.timers {
            *timer -= u8::from(*timer != 0);
        }
    }

    #[one_copy]
    pub(in crate::machine) fn count(&mut self, which: Count) {
        if let Some(counter) = self.counters.get_mut(which as usize)
            && *counter != u16::MAX
        {
            *counter += 1;
        }
    }
}
