//! The words of the network that a host uses, too: how much a machine remembers of other robots, the position that a link gives of
//! a sender, how often a robot sends, and the frames that it could not use. The network itself is a part of the machine.

use crate::message::FRAGMENTS_MAX;
use crate::number::Profile;
use crate::value::{Tag, Value};

/// The memory of a machine for other robots. A size of 0 leaves the part out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Sizes {
    /// Neighbours at a time.
    pub neighbors: u8,
    /// True if the link measures the direction of a neighbour; else azimuth and elevation are 0.0.
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

    /// Returns the sizes limited to those that a byte can count.
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

/// The link's knowledge of a frame's sender.
#[derive(Clone, Copy, Debug)]
pub struct Sighting<P: Profile> {
    /// The sender, if the link itself knows it; else it is in the frame, if at all.
    pub robot: Option<u16>,
    /// Distance in mm, azimuth and elevation in radians as the receiver sees the sender: 0 ahead, anticlockwise and up
    /// positive; floats. `None` where it is not known.
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
    /// Nothing is known.
    fn default() -> Self {
        Sighting { robot: None, place: None }
    }
}

/// The periods of messages that the machine sends on its own, in steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Periods {
    /// A robot that has sent nothing for this time sends a beacon.
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

/// Counters of frames that were received and not used, and of other harmless errors.
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

/// Bytes on the stack of the processor.
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
