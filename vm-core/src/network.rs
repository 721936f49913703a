//! Types of the network that hosts use, too: the machine's memory for other robots, the link's
//! knowledge of a sender, the periods of sending, and the counters of frames that were not used.
//! The network itself is a part of the machine.

use crate::arena::SLOTS_MAX;
use crate::message::FRAGMENTS_MAX;
use crate::number::Profile;
use crate::number::wide::IS_WIDE;
use crate::value::{Tag, Value};

/// A number of entries of stigmergies, or of the place of one. Chips with little memory, which are
/// those whose instructions cannot exchange a word of memory in one go, count them in bytes.
#[cfg(any(target_arch = "avr", not(target_has_atomic = "32")))]
pub type Places = u8;
/// A number of entries of stigmergies, or of the place of one.
#[cfg(not(any(target_arch = "avr", not(target_has_atomic = "32"))))]
pub type Places = u16;

/// True if a machine may have more entries than stigmergies. It is a constant, so that chips with
/// little memory have no code for it.
pub(crate) const HAS_MANY_PLACES: bool = size_of::<Places>() > 1;

/// The largest number of entries of all stigmergies together.
pub const ENTRIES_MAX: Places =
    if HAS_MANY_PLACES { (SLOTS_MAX / (ENTRY + 2)) as Places } else { STIGMERGIES_MAX as Places };

/// The largest number of stigmergies.
pub const STIGMERGIES_MAX: u8 = 100;

/// The memory of a machine for other robots. The size 0 leaves a part out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sizes {
    /// The greatest number of neighbors.
    pub neighbors: u8,
    /// True if the link measures the direction of a neighbor. Else azimuth and elevation are 0.0.
    pub bearings: bool,
    /// The greatest number of entries of all stigmergies together, at most [`ENTRIES_MAX`], and also
    /// of stigmergies, which have a limit of their own.
    pub entries: Places,
    /// The number of swarms that the script can create; at most 8.
    pub swarms: u8,
}

/// Slots of an entry: key, value, robot, clock, digest.
pub(crate) const ENTRY: usize = 5;

impl Sizes {
    /// No neighbors, no swarms, no stigmergies.
    pub const NONE: Sizes = Sizes { neighbors: 0, bearings: false, entries: 0, swarms: 0 };

    /// Returns the sizes limited to the numbers that the slots can represent.
    pub(crate) fn clamped(self) -> Sizes {
        Sizes { entries: self.entries.min(ENTRIES_MAX), swarms: self.swarms.min(8), ..self }
    }

    /// Returns the number of slots of the arena that the network takes.
    pub const fn slots(&self) -> usize {
        self.entries as usize * ENTRY
            + self.stigmergies() as usize
            + self.swarms as usize
            + self.neighbors as usize * self.neighbor()
            + if self.have_index() { self.chains() + self.entries as usize } else { 0 }
    }

    /// Returns the greatest number of stigmergies. Each has a slot after those of the entries.
    #[allow(clippy::unnecessary_cast, reason = "places are bytes on some chips")]
    pub const fn stigmergies(&self) -> u8 {
        if HAS_MANY_PLACES && self.entries > STIGMERGIES_MAX as Places {
            STIGMERGIES_MAX
        } else {
            self.entries as u8
        }
    }

    /// Returns true if an index finds the entries. With few entries it takes less time to search
    /// all, and no chip has more.
    pub(crate) const fn have_index(&self) -> bool {
        IS_WIDE && self.entries as usize > 255
    }

    /// Returns the number of chains of the index.
    pub(crate) const fn chains(&self) -> usize {
        self.entries as usize / 4
    }

    /// Returns the number of slots of a neighbor: robot and distance, and with bearings also
    /// azimuth and elevation.
    pub(crate) const fn neighbor(&self) -> usize {
        2 + 2 * self.bearings as usize
    }
}

/// The link's knowledge of a frame's sender.
#[derive(Clone, Copy, Debug)]
pub struct Sighting<P: Profile> {
    /// The sender, if the link itself knows it. Otherwise only the frame may name it.
    pub robot: Option<u16>,
    /// Distance in mm, and azimuth and elevation in radians as the receiver measures the sender: 0
    /// is ahead, anticlockwise and up are positive. All are floats. `None` if they are unknown.
    pub place: Option<[Value<P>; 3]>,
}

impl<P: Profile> Sighting<P> {
    /// Returns the sighting of a link that measures the distance, a float in mm, but no direction.
    #[inline]
    pub fn at(distance: Value<P>) -> Self {
        let zero = Value::new(Tag::FLOAT, P::ZERO);
        Sighting { robot: None, place: Some([distance, zero, zero]) }
    }
}

impl<P: Profile> Default for Sighting<P> {
    /// Returns the sighting of a sender about which the link knows nothing.
    fn default() -> Self {
        Sighting { robot: None, place: None }
    }
}

/// The periods of messages that the machine sends on its own, in steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Periods {
    /// Steps without a frame of its own after which a robot sends a beacon.
    pub beacon: u8,
    /// Steps without a frame after which a neighbor is forgotten, at most 126; half of them if
    /// only one frame was received.
    pub forget: u8,
    /// Steps between two advertisements of stigmergy entries if nothing changes, at most 150.
    pub advertise: u8,
}

impl Periods {
    /// At ten steps per second: a beacon after one second, neighbors forgotten after three, an
    /// advertisement every two.
    pub const DEFAULT: Periods = Periods { beacon: 10, forget: 30, advertise: 20 };
}

/// Counters of frames that were received and not used, and of other harmless errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct NetworkCounters {
    /// Messages of another script.
    pub foreign: u16,
    /// Invalid frames, and values of a class that the script never sends under that name.
    pub malformed: u16,
    /// Messages from a robot with this robot's id.
    pub own_id: u16,
    /// Entries of stigmergies that were not kept, since the store is full.
    pub not_kept: u16,
    /// Messages in fragments that were dropped: a fragment was missing, another message came
    /// between, or there was no memory.
    pub incomplete: u16,
    /// Conflicts that the handler did not decide.
    pub undecided: u16,
    /// Messages whose listener or handler ended with a fault.
    pub failed: u16,
}

/// A byte array that lies on the processor's stack or in the machine.
pub trait Buffer: AsMut<[u8]> + AsRef<[u8]> + Copy + core::fmt::Debug {
    /// All zeros.
    const ZERO: Self;
}

impl<const BYTES: usize> Buffer for [u8; BYTES] {
    const ZERO: Self = [0; BYTES];
}

/// Returns the bytes of all fragments of a message with frames of this length.
pub(crate) const fn content_bytes(frame: usize) -> usize {
    FRAGMENTS_MAX as usize * (frame - crate::message::FRAGMENT_HEAD)
}
