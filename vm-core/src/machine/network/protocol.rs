//! The state of the protocol: when the robot sends next, the message of which some fragments are here, and the counters.
//!
//! Neighbours, swarms and entries of stigmergies themselves are slots of the arena, above those of the script.

use crate::network::{Buffer, Sizes};
use crate::number::Profile;

/// Bit of [`Protocol::digest`] that is set until an entry changes. The sum itself has 24 bits.
pub(in crate::machine) const DIGEST_KNOWN: u32 = 1 << 31;

/// Which counter.
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

/// The state of a conflict that the script's handler is to decide.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(in crate::machine) enum Conflict {
    /// There is none.
    None = 0,
    /// The handler runs.
    Open,
    /// The handler ended with a fault: the default rule decides.
    Failed,
}

/// The times at which to send, and the message of which some fragments are here.
#[derive(Clone, Copy, Debug)]
pub(in crate::machine) struct Protocol<P: Profile> {
    pub(in crate::machine) sizes: Sizes,
    /// The number of stigmergies that the script has created.
    pub(in crate::machine) stigmergies: u8,
    /// Number of the step, on which neighbours are forgotten.
    pub(in crate::machine) step: u8,
    /// 1 + the place of the last sender: the next message often comes from the neighbour after it.
    pub(in crate::machine) heard: u8,
    /// The script has created a swarm or a stigmergy.
    pub(in crate::machine) shares: bool,
    /// An entry or a swarm is to be sent when the entry point that is running returns.
    pub(in crate::machine) has_dirty_entries: bool,
    /// The number of messages that this step may still take.
    pub(in crate::machine) messages_left: u8,
    /// A message is being handled: a fault ends that, not the script.
    pub(in crate::machine) in_message: bool,
    pub(in crate::machine) conflict: Conflict,
    /// The script waits for its next start: messages are handled without it.
    pub(in crate::machine) is_resting: bool,
    /// Steps since the last frame with the robot's own id.
    pub(in crate::machine) silent: u8,
    /// Steps between two advertisements of entries.
    pub(in crate::machine) interval: u8,
    /// Steps until something happens, by [`Timer`].
    pub(in crate::machine) timers: [u8; 4],
    /// The first slot of the entry that has changed last; 0 before any has.
    pub(in crate::machine) newest: u16,
    /// The entry, or after all entries the swarm, that was advertised last.
    pub(in crate::machine) advertised: u8,
    /// Hash of the entry that was relayed last without being kept.
    pub(in crate::machine) relayed: u16,
    /// Answers to neighbors that may be given at once.
    pub(in crate::machine) answers: u8,
    /// Entries of a former life of this robot that it has put again of late.
    pub(in crate::machine) reclaimed: u8,
    /// Steps, counted modulo 65,536, for actions that are due once in many.
    pub(in crate::machine) age: u16,
    /// Turns of advertising, counted modulo 256.
    pub(in crate::machine) turn: u8,
    /// Entries that are still to be advertised because a neighbor's digest differs.
    pub(in crate::machine) behind: u8,
    /// Entries were received that are not kept, so the digest says nothing.
    pub(in crate::machine) has_dropped: bool,
    /// A neighbor sends beacons without a digest: it may lack entries.
    pub(in crate::machine) meets_beacon: bool,
    /// The sum over all entries, with [`DIGEST_KNOWN`] until an entry changes.
    pub(in crate::machine) digest: u32,
    /// The latest clock that was put or received, on any key.
    pub(in crate::machine) clock: u32,
    /// State of a generator that keeps robots from sending all at once.
    pub(in crate::machine) jitter: u16,
    /// The counter of that name in [`Counters`].
    pub(in crate::machine) counters: [u16; 7],
    pub(in crate::machine) assembly: Assembly<P>,
}

/// Counts steps down to zero.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub(in crate::machine) enum Timer {
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
pub(in crate::machine) struct Assembly<P: Profile> {
    pub(in crate::machine) robot: u16,
    pub(in crate::machine) number: u8,
    /// Bit i: fragment i is here.
    pub(in crate::machine) present: u8,
    /// Those that have to be; 0 as long as the last is not here.
    pub(in crate::machine) all: u8,
    /// Bytes of the whole message.
    pub(in crate::machine) length: u16,
    /// Steps in which this robot begins no other message, since a fragment of another robot found no room.
    pub(in crate::machine) pause: u8,
    pub(in crate::machine) content: P::Content,
}

impl<P: Profile> Protocol<P> {
    /// All zeros.
    pub(in crate::machine) const EMPTY: Self = Protocol {
        sizes: Sizes::NONE,
        timers: [0; 4],
        stigmergies: 0,
        step: 0,
        heard: 0,
        shares: false,
        has_dirty_entries: false,
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

    /// Forgets all that was heard and said with another script. State that only delays a message may stay.
    pub(in crate::machine) fn forget(&mut self) {
        self.stigmergies = 0;
        self.heard = 0;
        self.shares = false;
        self.has_dirty_entries = false;
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
    pub(in crate::machine) fn rest(&mut self) {
        self.in_message = false;
        self.conflict = Conflict::None;
        self.is_resting = true;
    }

    /// Steps that are left of a timer.
    #[hot]
    pub(in crate::machine) fn timer(&self, which: Timer) -> u8 {
        self.timers[which as usize]
    }

    #[hot]
    pub(in crate::machine) fn set_timer(&mut self, which: Timer, steps: u8) {
        self.timers[which as usize] = steps;
    }

    /// Takes a step off all timers.
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
