//! The interface between the engine and a robot's controller.

use core::any::Any;

use super::TICK_US;
use super::body::Block;
use super::geometry::Pose;
use super::herd::{Herd, HerdId};
use super::id::RobotId;
use super::light::{self, Light};
use super::link::{Heard, Late, Medium, SentFrame, Sighting, Transmission};
use super::ranger::Sight;
use super::ray::{Ray, Side};

/// Decides the actions of a robot: a virtual machine, an emulated image, or a few lines of a test.
///
/// The world is generic over one brain type; a world of unlike brains takes an enum, or `Box<dyn
/// Brain>`.
pub trait Brain: Send {
    /// Runs one tick of 100 ms.
    fn tick(&mut self, io: &mut Io<'_>);

    /// Returns true if it has a frame to send; called after each tick and each frame.
    fn has_frame(&self) -> bool {
        false
    }

    /// The channel is free and the link begins to send: writes the newest frame, type byte and
    /// payload, and returns its length in bytes; 0 sends nothing. `frame` is as long as the link's
    /// longest, and all zeros; infrared
    /// sends all of it.
    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        let _ = frame;
        0
    }
}

impl<B: Brain + ?Sized> Brain for Box<B> {
    fn tick(&mut self, io: &mut Io<'_>) {
        (**self).tick(io);
    }

    fn has_frame(&self) -> bool {
        (**self).has_frame()
    }

    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        (**self).next_frame(frame)
    }
}

/// A robot's senses and limbs during one tick.
#[derive(Debug)]
pub struct Io<'a> {
    /// The robot's id.
    pub id: RobotId,
    /// Ticks since the world began.
    pub now: u64,
    /// The frames received since the last tick.
    pub inbox: Inbox<'a>,
    /// Light and position.
    pub sensors: Sensors<'a>,
    /// Colour of the LED: the sum of 1 red, 2 green, 4 blue.
    pub led: &'a mut u8,
    pub(crate) body: Controls<'a>,
}

/// The body of a robot, as its brain reaches it.
#[derive(Debug)]
pub(crate) struct Controls<'a> {
    pub(crate) block: &'a mut (dyn Block + 'static),
    pub(crate) index: usize,
}

impl Io<'_> {
    /// Milliseconds since the world began.
    #[must_use]
    pub fn milliseconds(&self) -> u64 {
        self.now * u64::from(TICK_US / 1000)
    }

    /// Returns the commands of the robot's motors, if its body has commands of that type. Motors keep the last one.
    pub fn controls<T: Any>(&mut self) -> Option<&mut T> {
        self.body.block.controls(self.body.index).downcast_mut()
    }

    /// Switches the motors off.
    pub fn halt(&mut self) {
        self.body.block.halt(self.body.index);
    }
}

/// A frame that was heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceivedFrame<'a> {
    /// Type byte and payload. On infrared always 10 bytes, padded with zeros.
    pub bytes: &'a [u8],
    /// The position and distance of the sender.
    pub sighting: Sighting,
}

/// The frames that a robot heard since the last tick, in the order in which they ended.
#[derive(Clone, Copy, Debug)]
pub struct Inbox<'a> {
    pub(crate) heard: &'a [Heard],
    pub(crate) air: &'a [Transmission],
    pub(crate) late: Option<&'a Late>,
    pub(crate) medium: Medium,
}

impl<'a> Inbox<'a> {
    /// Returns the number of frames.
    #[must_use]
    pub fn len(&self) -> usize {
        self.heard.len() + usize::from(self.late.is_some())
    }

    /// Returns true if no frame was received.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// All of them, the oldest first.
    pub fn iter(&self) -> impl Iterator<Item = ReceivedFrame<'a>> + use<'a> {
        let Inbox { heard, air, late, .. } = *self;
        heard
            .iter()
            .map(|heard| ReceivedFrame {
                bytes: air[heard.transmission as usize].packet.bytes(),
                sighting: heard.sighting,
            })
            .chain(
                late.map(|late| ReceivedFrame {
                    bytes: late.frame.bytes(),
                    sighting: late.sighting,
                }),
            )
    }

    /// Returns the frame at a place of [`iter`](Self::iter), as observers see it; `now` is the tick.
    pub(crate) fn sent(&self, place: usize, now: u64) -> Option<SentFrame> {
        match self.heard.get(place) {
            Some(heard) => {
                let transmission = self.air.get(heard.transmission as usize)?;
                Some(SentFrame::heard_at(now, self.medium, transmission))
            }
            None => self.late.map(|late| late.frame.clone()),
        }
    }
}

/// The sensors of a robot. A reading is computed when the brain asks for it.
#[derive(Clone, Copy, Debug)]
pub struct Sensors<'a> {
    pub(crate) id: RobotId,
    pub(crate) sight: Sight<'a>,
    pub(crate) herds: &'a [Herd],
    pub(crate) herd: HerdId,
    pub(crate) pose: &'a Pose,
    pub(crate) estimate: Option<&'a Pose>,
    pub(crate) ambient: f32,
    pub(crate) lights: &'a [Light],
}

impl Sensors<'_> {
    /// Returns the robot's estimate of its pose: `None` on a Kilobot, and without a positioning
    /// system.
    #[must_use]
    pub fn estimate(&self) -> Option<Pose> {
        self.estimate.copied()
    }

    /// Returns the reading of the Crazyflie's Multi-ranger deck: mm from the robot's middle to the
    /// wall, obstacle or robot ahead
    /// or beside, at its height; `None` if nothing is in reach. A line, not the sensor's cone, and
    /// without noise.
    #[must_use]
    pub fn range(&self, side: Side) -> Option<f32> {
        self.sight.range(self.id, self.pose, side)
    }

    /// Returns mm from the robot's middle to the next wall, obstacle or robot in a direction from its heading, in radians;
    /// `None` if nothing is within `reach`.
    #[must_use]
    pub fn beam(&self, direction: f32, reach: f32) -> Option<f32> {
        self.sight.along(self.id, self.pose, Ray::towards(self.pose, direction), reach)
    }

    /// Returns the number of other robots within `reach` mm that have the robot's medium, and distance in mm and direction in
    /// radians of the nearest one.
    #[must_use]
    pub fn neighbors(&self, reach: f32) -> (usize, Option<[f32; 2]>) {
        let medium = self.herds[usize::from(self.herd.0)].medium;
        let (mut count, mut nearest): (usize, Option<[f32; 2]>) = (0, None);
        self.sight.crowd.within(self.id, self.pose, reach, |herd, [dx, dy, dz]| {
            if self.herds[usize::from(herd)].medium != medium {
                return;
            }
            count += 1;
            let distance = (dx * dx + dy * dy + dz * dz).sqrt();
            if nearest.is_none_or(|[least, _]| distance < least) {
                let direction = super::wrap(libm::atan2f(dy, dx) - self.pose.heading);
                nearest = Some([distance, direction]);
            }
        });
        (count, nearest)
    }

    /// Returns the brightness that a sensor sees which looks in a direction from the heading, in radians, or in all of them,
    /// 0 to 1023.
    #[must_use]
    pub fn brightness(&self, direction: Option<f32>) -> f32 {
        let look = direction.map(|direction| self.pose.heading + direction);
        light::brightness(self.pose, look, self.ambient, self.lights)
    }

    /// Returns the reading of the light sensor, 0 (dark) to 1023.
    #[must_use]
    pub fn light(&self) -> u16 {
        light::reading(self.pose, self.ambient, self.lights)
    }
}
