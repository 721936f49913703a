//! What an engine asks of a robot's brain, and what it gives to it.

use core::fmt;

use super::body::Actuators;
use super::geometry::Pose;
use super::light::{self, Light};
use super::link::{Heard, Late, Medium, Packet, Queue, Transmission};
use super::ranger::{Side, Sight};
use super::robot::RobotId;

/// Decides what a robot does: a virtual machine, an emulated image, or a few lines of a test.
///
/// The world is generic over one brain type; a world of unlike brains takes an enum, or `Box<dyn Brain>`.
pub trait Brain: Send {
    /// Runs one tick of 100 ms.
    fn tick(&mut self, io: &mut Io<'_>);
}

impl<B: Brain + ?Sized> Brain for Box<B> {
    fn tick(&mut self, io: &mut Io<'_>) {
        (**self).tick(io);
    }
}

/// A robot's senses and limbs during one tick.
#[derive(Debug)]
pub struct Io<'a> {
    /// Who this is.
    pub id: RobotId,
    /// Ticks since the world began.
    pub now: u64,
    /// What was heard since the last tick.
    pub inbox: Inbox<'a>,
    /// What is to be sent.
    pub outbox: Outbox<'a>,
    /// Light and position.
    pub sensors: Sensors<'a>,
    /// Motors keep what they were last told.
    pub actuators: Actuators<'a>,
    /// Colour of the LED: the sum of 1 red, 2 green, 4 blue.
    pub led: &'a mut u8,
}

/// What the link tells about who sent a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sighting {
    /// The sender, where the link's own frame names it (not on infrared).
    pub robot: Option<RobotId>,
    /// Distance in mm, azimuth and elevation in radians in (-pi, pi], in the receiver's frame: azimuth 0 is ahead,
    /// anticlockwise positive. A Kilobot measures the distance only, both angles are 0. `None` if unknown.
    pub place: Option<[f32; 3]>,
}

/// A frame that was heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame<'a> {
    /// Type byte and payload. On infrared always 10 bytes, padded with zeros.
    pub bytes: &'a [u8],
    /// Who sent it.
    pub sighting: Sighting,
}

/// The frames that a robot heard since the last tick, in the order in which they ended.
#[derive(Clone, Copy, Debug)]
pub struct Inbox<'a> {
    pub(crate) heard: &'a [Heard],
    pub(crate) air: &'a [Transmission],
    pub(crate) late: Option<&'a Late>,
}

impl<'a> Inbox<'a> {
    /// How many there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.heard.len() + usize::from(self.late.is_some())
    }

    /// Whether nothing was heard.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All of them, the oldest first.
    pub fn iter(&self) -> impl Iterator<Item = Frame<'a>> + use<'a> {
        let Inbox { heard, air, late } = *self;
        heard
            .iter()
            .map(|heard| Frame {
                bytes: air[heard.transmission as usize].packet.bytes(),
                sighting: heard.sighting,
            })
            .chain(late.map(|late| Frame { bytes: late.packet.bytes(), sighting: late.sighting }))
    }
}

/// Where frames go that are to be sent. The link sends them when it may; what does not fit waits in the brain.
#[derive(Debug)]
pub struct Outbox<'a> {
    pub(crate) queue: &'a mut Queue,
    pub(crate) medium: Medium,
}

/// Why a link did not take a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PushError {
    /// The link still has earlier frames to send.
    Full,
    /// Empty, or longer than the link's frames.
    Length,
}

impl fmt::Display for PushError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            PushError::Full => "the link has frames to send",
            PushError::Length => "the link has no frames of that length",
        })
    }
}

impl core::error::Error for PushError {}

impl Outbox<'_> {
    /// How many frames the link takes now.
    #[must_use]
    pub fn room(&self) -> usize {
        self.medium.queue() - self.queue.len()
    }

    /// Longest frame in bytes.
    #[must_use]
    pub fn frame_bytes(&self) -> usize {
        self.medium.frame_bytes()
    }

    /// Gives a frame (type byte and payload) to the link.
    pub fn push(&mut self, frame: &[u8]) -> Result<(), PushError> {
        if frame.is_empty() || frame.len() > self.frame_bytes() {
            return Err(PushError::Length);
        }
        if self.room() == 0 {
            return Err(PushError::Full);
        }
        let padded = if self.medium == Medium::Infrared { self.frame_bytes() } else { 0 };
        self.queue.push(Packet::new(frame, padded));
        Ok(())
    }
}

/// What a robot senses; nothing is computed that is not asked for.
#[derive(Clone, Copy, Debug)]
pub struct Sensors<'a> {
    pub(crate) id: RobotId,
    pub(crate) sight: Sight<'a>,
    pub(crate) pose: &'a Pose,
    pub(crate) estimate: Option<&'a Pose>,
    pub(crate) ambient: f32,
    pub(crate) lights: &'a [Light],
}

impl Sensors<'_> {
    /// Where the robot believes to be: `None` on a Kilobot, and where there is no positioning system.
    #[must_use]
    pub fn estimate(&self) -> Option<Pose> {
        self.estimate.copied()
    }

    /// What the Multi-ranger deck of a Crazyflie reads: mm from the robot's middle to the wall, obstacle or robot ahead
    /// or beside, at its height; `None` if nothing is in reach. A line, not the sensor's cone, and without noise.
    #[must_use]
    pub fn range(&self, side: Side) -> Option<f32> {
        self.sight.range(self.id, self.pose, side)
    }

    /// What the light sensor reads, 0 (dark) to 1023.
    #[must_use]
    pub fn light(&self) -> u16 {
        light::reading(self.pose, self.ambient, self.lights)
    }
}
