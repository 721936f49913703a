//! What a robot knows of others: neighbours, swarms, replicas of stigmergies, the message that is being put together.
//!
//! The machine is generic over this memory: [`SwarmMemory`] of the sizes that the robot file says, or [`Alone`], with
//! which neighbours, swarms and stigmergy are left out and cost nothing.

use crate::builtin::Feature;
use crate::message;
use crate::number::Profile;
use crate::value::Value;

/// What the link knows of who sent a frame.
#[derive(Clone, Copy, Debug)]
pub struct Sighting<P: Profile> {
    /// The sender, where the link itself tells it; else it is in the frame, if at all.
    pub robot: Option<u16>,
    /// Distance in mm, azimuth and elevation in radians as the receiver sees the sender: 0 ahead, anticlockwise and up
    /// positive. `None` where it is not known.
    pub place: Option<[Value<P>; 3]>,
}

/// How often a robot is heard without its script's doing, in steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Periods {
    /// A robot that has sent nothing for so long sends a beacon.
    pub beacon: u8,
    /// A neighbour that was not heard for so long is forgotten.
    pub forget: u8,
    /// Between two advertisements of stigmergy entries where nothing changes, at most 150.
    pub advertise: u8,
}

impl Periods {
    /// A beacon after a second, forgotten after three, an advertisement every two.
    pub const DEFAULT: Periods = Periods { beacon: 10, forget: 30, advertise: 20 };
}

/// A robot that was heard.
#[derive(Clone, Copy, Debug)]
pub struct Neighbor<P: Profile> {
    pub(crate) robot: u16,
    /// Steps until it is forgotten; 0: there is none.
    pub(crate) steps_left: u8,
    /// Bit i: it is in the swarm that is number i in [`SwarmMemory`].
    pub(crate) swarms: u8,
    /// Distance in mm, a float; not a number if the place is not known.
    pub(crate) distance: P::Raw,
}

/// An entry of a replica.
#[derive(Clone, Copy, Debug)]
pub struct Entry<P: Profile> {
    pub(crate) key: Value<P>,
    /// nil: deleted.
    pub(crate) value: Value<P>,
    /// Lamport clock, at most [`crate::message::CLOCK_MAX`].
    pub(crate) clock: u32,
    /// Who put it.
    pub(crate) robot: u16,
    /// 1 + the place of its stigmergy in [`SwarmMemory`]; 0: there is none. With [`NEWS`].
    pub(crate) state: u8,
}

/// In the state of an entry or a swarm: it is to be sent when the entry that is running ends.
pub(crate) const NEWS: u8 = 0x80;

impl<P: Profile> Entry<P> {
    /// Whether it is one of that stigmergy.
    pub(crate) fn is_of(&self, stigmergy: u8) -> bool {
        self.state & !NEWS == stigmergy + 1
    }
}

/// A swarm that the script has created.
#[derive(Clone, Copy, Debug)]
pub struct Swarm {
    pub(crate) number: u16,
    /// [`EXISTS`], [`MEMBER`] and [`NEWS`].
    pub(crate) state: u8,
}

/// In the state of a swarm: the script has created it.
pub(crate) const EXISTS: u8 = 1;
/// In the state of a swarm: the robot is in it.
pub(crate) const MEMBER: u8 = 2;

impl Swarm {
    pub(crate) fn exists(&self) -> bool {
        self.state != 0
    }

    pub(crate) fn has_member(&self) -> bool {
        self.state & MEMBER != 0
    }
}

/// What was heard but could not be used, and what else went wrong without harm.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Messages of another script.
    pub foreign: u16,
    /// Frames that make no sense.
    pub malformed: u16,
    /// Messages from a robot with this robot's id.
    pub own_id: u16,
    /// Entries of stigmergies that were passed on but not kept, since the store is full.
    pub not_kept: u16,
    /// Messages in fragments that were given up: a fragment was missing, another message came between, or there was no memory.
    pub incomplete: u16,
    /// Conflicts that the handler did not decide.
    pub undecided: u16,
}

/// When what is to be sent.
#[derive(Clone, Copy, Debug)]
pub struct Protocol {
    /// Steps since the last frame with the robot's own id.
    pub(crate) silent: u8,
    /// Steps between two advertisements of entries.
    pub(crate) interval: u8,
    /// Steps until the next.
    pub(crate) countdown: u8,
    /// The entry, or behind them the swarm, that was advertised last.
    pub(crate) advertised: u8,
    /// How many stigmergies the script has created.
    pub(crate) stigmergies: u8,
    /// What was passed on last without being kept.
    pub(crate) passed_on: u16,
    /// State of a generator that keeps robots from sending all at once.
    pub(crate) jitter: u16,
    pub(crate) counters: Counters,
}

/// A message of which some fragments are here.
#[derive(Clone, Copy, Debug)]
pub struct Assembly {
    pub(crate) robot: u16,
    pub(crate) number: u8,
    /// Bit i: fragment i is here.
    pub(crate) present: u8,
    /// How many there are, 0 as long as the last is not here.
    pub(crate) count: u8,
    /// Bytes of the last.
    pub(crate) last_bytes: u8,
    /// Steps until it is given up; 0: there is none.
    pub(crate) steps_left: u8,
}

mod sealed {
    pub trait Sealed {}
}

/// Memory for what a robot knows of others.
pub trait Network<P: Profile>: sealed::Sealed {
    /// Without any knowledge. All zeros.
    const EMPTY: Self;
    /// The bits of [`Feature`] that it serves.
    const FEATURES: u8;
    /// Room for a frame.
    type Frame: Buffer;
    /// Room for the contents of all fragments of a message.
    type Content: Buffer;

    #[doc(hidden)]
    fn neighbors(&mut self) -> &mut [Neighbor<P>];
    /// Neighbours and the numbers of stigmergies, for hosts that look at a robot.
    #[doc(hidden)]
    fn known(&self) -> (&[Neighbor<P>], &[u16]);
    #[doc(hidden)]
    fn bearings(&mut self) -> &mut [[P::Raw; 2]];
    #[doc(hidden)]
    fn entries(&self) -> &[Entry<P>];
    #[doc(hidden)]
    fn entries_mut(&mut self) -> &mut [Entry<P>];
    #[doc(hidden)]
    fn stigmergies(&self) -> &[u16];
    #[doc(hidden)]
    fn stigmergies_mut(&mut self) -> &mut [u16];
    #[doc(hidden)]
    fn swarms(&self) -> &[Swarm];
    #[doc(hidden)]
    fn swarms_mut(&mut self) -> &mut [Swarm];
    #[doc(hidden)]
    fn protocol(&mut self) -> Option<&mut Protocol>;
    #[doc(hidden)]
    fn assembly(&mut self) -> Option<(&mut Assembly, &mut [u8])>;
}

/// Bytes on the stack of the processor.
pub trait Buffer: AsMut<[u8]> + AsRef<[u8]> {
    /// All zeros.
    const ZERO: Self;
}

impl<const BYTES: usize> Buffer for [u8; BYTES] {
    const ZERO: Self = [0; BYTES];
}

/// Memory for `NEIGHBORS` neighbours and as many `BEARINGS`, or none on a robot that measures distances only; for `ENTRIES` entries of (at most as many) stigmergies, `SWARMS` swarms, at most 8; for
/// frames of at most `FRAME` bytes, and `CONTENT` bytes of a message in fragments: 8 times `FRAME - 4`.
#[derive(Clone, Copy, Debug)]
pub struct SwarmMemory<
    P: Profile,
    const NEIGHBORS: usize,
    const BEARINGS: usize,
    const ENTRIES: usize,
    const SWARMS: usize,
    const FRAME: usize,
    const CONTENT: usize,
> {
    neighbors: [Neighbor<P>; NEIGHBORS],
    bearings: [[P::Raw; 2]; BEARINGS],
    entries: [Entry<P>; ENTRIES],
    stigmergies: [u16; ENTRIES],
    swarms: [Swarm; SWARMS],
    protocol: Protocol,
    assembly: Assembly,
    content: [u8; CONTENT],
}

impl<
    P: Profile,
    const NEIGHBORS: usize,
    const BEARINGS: usize,
    const ENTRIES: usize,
    const SWARMS: usize,
    const FRAME: usize,
    const CONTENT: usize,
> sealed::Sealed for SwarmMemory<P, NEIGHBORS, BEARINGS, ENTRIES, SWARMS, FRAME, CONTENT>
{
}

impl<
    P: Profile,
    const NEIGHBORS: usize,
    const BEARINGS: usize,
    const ENTRIES: usize,
    const SWARMS: usize,
    const FRAME: usize,
    const CONTENT: usize,
> Network<P> for SwarmMemory<P, NEIGHBORS, BEARINGS, ENTRIES, SWARMS, FRAME, CONTENT>
{
    const EMPTY: Self = {
        assert!(BEARINGS == 0 || BEARINGS == NEIGHBORS, "all bearings or none");
        assert!(SWARMS <= 8, "a neighbour's swarms are the bits of a byte");
        assert!(ENTRIES <= 100, "entries are numbered in a byte");
        assert!(FRAME >= message::plain_max::<P>(), "every message but long values fits a frame");
        assert!(CONTENT == 8 * (FRAME - 4), "a message has at most 8 fragments");
        SwarmMemory {
            neighbors: [Neighbor { robot: 0, steps_left: 0, swarms: 0, distance: P::ZERO };
                NEIGHBORS],
            bearings: [[P::ZERO; 2]; BEARINGS],
            entries: [Entry { key: Value::NIL, value: Value::NIL, clock: 0, robot: 0, state: 0 };
                ENTRIES],
            stigmergies: [0; ENTRIES],
            swarms: [Swarm { number: 0, state: 0 }; SWARMS],
            protocol: Protocol {
                silent: 0,
                interval: 0,
                countdown: 0,
                advertised: 0,
                stigmergies: 0,
                passed_on: 0,
                jitter: 0,
                counters: Counters {
                    foreign: 0,
                    malformed: 0,
                    own_id: 0,
                    not_kept: 0,
                    incomplete: 0,
                    undecided: 0,
                },
            },
            assembly: Assembly {
                robot: 0,
                number: 0,
                present: 0,
                count: 0,
                last_bytes: 0,
                steps_left: 0,
            },
            content: [0; CONTENT],
        }
    };
    const FEATURES: u8 = (if NEIGHBORS > 0 { Feature::Neighbors as u8 } else { 0 })
        | (if SWARMS > 0 { Feature::Swarm as u8 } else { 0 })
        | (if ENTRIES > 0 { Feature::Stigmergy as u8 } else { 0 });
    type Frame = [u8; FRAME];
    type Content = [u8; CONTENT];

    fn neighbors(&mut self) -> &mut [Neighbor<P>] {
        &mut self.neighbors
    }

    fn bearings(&mut self) -> &mut [[P::Raw; 2]] {
        &mut self.bearings
    }

    fn known(&self) -> (&[Neighbor<P>], &[u16]) {
        (&self.neighbors, &self.stigmergies)
    }

    fn entries(&self) -> &[Entry<P>] {
        &self.entries
    }

    fn entries_mut(&mut self) -> &mut [Entry<P>] {
        &mut self.entries
    }

    fn stigmergies(&self) -> &[u16] {
        &self.stigmergies
    }

    fn stigmergies_mut(&mut self) -> &mut [u16] {
        &mut self.stigmergies
    }

    fn swarms(&self) -> &[Swarm] {
        &self.swarms
    }

    fn swarms_mut(&mut self) -> &mut [Swarm] {
        &mut self.swarms
    }

    fn protocol(&mut self) -> Option<&mut Protocol> {
        Some(&mut self.protocol)
    }

    fn assembly(&mut self) -> Option<(&mut Assembly, &mut [u8])> {
        Some((&mut self.assembly, &mut self.content))
    }
}

/// No memory: the machine has neither neighbours nor swarms nor stigmergies.
#[derive(Clone, Copy, Debug)]
pub struct Alone;

impl sealed::Sealed for Alone {}

impl<P: Profile> Network<P> for Alone {
    const EMPTY: Self = Alone;
    const FEATURES: u8 = 0;
    type Frame = [u8; 0];
    type Content = [u8; 0];

    fn neighbors(&mut self) -> &mut [Neighbor<P>] {
        &mut []
    }

    fn bearings(&mut self) -> &mut [[P::Raw; 2]] {
        &mut []
    }

    fn known(&self) -> (&[Neighbor<P>], &[u16]) {
        (&[], &[])
    }

    fn entries(&self) -> &[Entry<P>] {
        &[]
    }

    fn entries_mut(&mut self) -> &mut [Entry<P>] {
        &mut []
    }

    fn stigmergies(&self) -> &[u16] {
        &[]
    }

    fn stigmergies_mut(&mut self) -> &mut [u16] {
        &mut []
    }

    fn swarms(&self) -> &[Swarm] {
        &[]
    }

    fn swarms_mut(&mut self) -> &mut [Swarm] {
        &mut []
    }

    fn protocol(&mut self) -> Option<&mut Protocol> {
        None
    }

    fn assembly(&mut self) -> Option<(&mut Assembly, &mut [u8])> {
        None
    }
}
