//! The interface between the engine and a robot's controller.

use core::any::Any;

use super::TICK_US;
use super::body::BodyBlock;
use super::geometry::{Area, Pose};
use super::herd::{Herd, HerdId};
use super::id::RobotId;
use super::light::{self, Lamp, Lighting};
use super::link::{DeliveredFrame, FrameSighting, Late, SentFrame, Transmissions};
use super::obstacle::Obstacle;
use super::oscillator::Oscillator;
use super::paint::WHITE;
use super::ranger::Sight;
use super::ray::{Ray, Side};
use super::shadow::Shadows;

/// The controller of a robot: a virtual machine, an emulated image, or a few lines of a test.
///
/// The world is generic over one brain type; a world with different brains uses an enum or
/// `Box<dyn Brain>`.
pub trait Brain: Send {
    /// Runs one tick of 100 ms.
    fn tick(&mut self, io: &mut Io<'_>);

    /// Returns true if the brain has a frame to send. It is called after each tick and each frame.
    fn has_frame(&self) -> bool {
        false
    }

    /// Returns true if the next frame continues a long message. It is called after each frame.
    fn is_within_message(&self) -> bool {
        false
    }

    /// Writes the newest frame, type byte and payload, and returns its length in bytes; 0 sends
    /// nothing. The engine calls this when the channel is free and the transmission starts. `frame`
    /// is as long as the longest frame of the link and filled with zeros; infrared sends all of it.
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

    fn is_within_message(&self) -> bool {
        (**self).is_within_message()
    }

    fn next_frame(&mut self, frame: &mut [u8]) -> usize {
        (**self).next_frame(frame)
    }
}

/// The inputs and outputs of a robot during one tick.
#[derive(Debug)]
pub struct Io<'a> {
    /// The robot's id.
    pub id: RobotId,
    /// Ticks since the world began.
    pub now: u64,
    /// The robot's own clock.
    pub clock: Oscillator,
    /// The frames received since the last tick.
    pub inbox: TickFrames<'a>,
    /// Light, distances, neighbors and position.
    pub sensors: Sensors<'a>,
    /// Color of the LED: the sum of 1 red, 2 green, 4 blue.
    pub led: &'a mut u8,
    pub(crate) body: Controls<'a>,
}

/// Access to the body of a robot for its brain.
#[derive(Debug)]
pub(crate) struct Controls<'a> {
    pub(crate) block: &'a mut (dyn BodyBlock + 'static),
    pub(crate) index: usize,
}

impl Io<'_> {
    /// Returns the milliseconds since the world began.
    #[must_use]
    pub fn milliseconds(&self) -> u64 {
        self.now * u64::from(TICK_US / 1000)
    }

    /// Returns the motor commands of the robot, if its body has commands of that type. Motors keep
    /// the last command.
    pub fn controls<T: Any>(&mut self) -> Option<&mut T> {
        self.body.block.controls(self.body.index).downcast_mut()
    }

    /// Switches the motors off.
    pub fn halt(&mut self) {
        self.body.block.halt(self.body.index);
    }
}

/// A frame that a robot received.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceivedFrame<'a> {
    /// Type byte and payload; on infrared always 10 bytes, padded with zeros.
    pub bytes: &'a [u8],
    /// The position and distance of the sender.
    pub sighting: FrameSighting,
}

/// The frames that a robot received since the last tick, in the order in which they ended.
#[derive(Clone, Copy, Debug)]
pub struct TickFrames<'a> {
    pub(crate) received: &'a [DeliveredFrame],
    pub(crate) air: &'a Transmissions,
    pub(crate) late: Option<&'a Late>,
}

impl<'a> TickFrames<'a> {
    /// Returns the number of frames.
    #[must_use]
    pub fn len(&self) -> usize {
        self.received.len() + usize::from(self.late.is_some())
    }

    /// Returns true if no frame was received.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns all frames, the oldest first. A frame that was held back comes last.
    pub fn iter(&self) -> impl Iterator<Item = ReceivedFrame<'a>> + use<'a> {
        let TickFrames { received, air, late, .. } = *self;
        received
            .iter()
            .map(|received| ReceivedFrame {
                bytes: air.frame(received.transmission),
                sighting: received.sighting,
            })
            .chain(
                late.map(|late| ReceivedFrame {
                    bytes: late.frame.bytes(),
                    sighting: late.sighting,
                }),
            )
    }

    /// Returns the frame at an index of [`iter`](Self::iter) in the form for observers; `now` is
    /// the current tick.
    pub(crate) fn sent(&self, place: usize, now: u64) -> SentFrame {
        match self.received.get(place) {
            Some(received) => SentFrame::received_at(now, self.air, received.transmission),
            None => self.late.expect("the last index is that of a late frame").frame.clone(),
        }
    }
}

/// The sensors of a robot. A reading is computed when the brain asks for it.
#[derive(Clone, Copy, Debug)]
pub struct Sensors<'a> {
    pub(crate) id: RobotId,
    pub(crate) herd: HerdId,
    pub(crate) pose: &'a Pose,
    pub(crate) estimate: Option<&'a Pose>,
    /// The index of its first ground sensor in [`Scene::ground`].
    pub(crate) first_ground: usize,
    pub(crate) scene: &'a Scene<'a>,
}

/// The data that the sensors of all robots read.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene<'a> {
    pub(crate) sight: Sight<'a>,
    pub(crate) herds: &'a [Herd],
    pub(crate) ambient: f32,
    pub(crate) lights: &'a [Lamp],
    /// The values of all ground sensors; empty in a world without an environment.
    pub(crate) ground: &'a [f32],
}

impl<'a> Scene<'a> {
    fn lighting(&self) -> Lighting<'a> {
        let Sight { obstacles, crowd, .. } = self.sight;
        let shadows = Shadows { obstacles, movables: &crowd.movables };
        Lighting { ambient: self.ambient, lamps: self.lights, shadows }
    }
}

impl<'a> Sensors<'a> {
    /// Returns the area within the walls of the world, whose middle is the origin.
    #[must_use]
    pub fn area(&self) -> Area {
        self.scene.sight.area
    }

    /// Returns the obstacles that do not move, with their heights in mm, as on a map.
    pub fn obstacles(&self) -> impl Iterator<Item = (&'a Obstacle, f32)> + use<'a> {
        self.scene.sight.obstacles.with_heights()
    }

    /// Returns the true pose, for the sensors of robots that a tracking system measures.
    #[must_use]
    pub fn pose(&self) -> Pose {
        *self.pose
    }

    /// Returns the robot's estimate of its pose; `None` on a Kilobot or without a positioning
    /// system.
    #[must_use]
    pub fn estimate(&self) -> Option<Pose> {
        self.estimate.copied()
    }

    /// Returns the reading of the Crazyflie's Multi-ranger deck: the distance in mm from the
    /// robot's middle to the wall, obstacle or robot on that side, at the robot's height; `None` if
    /// nothing is in reach. The model is a line without noise, not the cone of the real sensor.
    #[must_use]
    pub fn range(&self, side: Side) -> Option<f32> {
        self.scene.sight.range(self.id, self.pose, side)
    }

    /// Returns the distance in mm from the robot's middle to the nearest wall, obstacle or robot in
    /// a direction relative to its heading, in radians; `None` if nothing is within `reach_mm`.
    #[must_use]
    pub fn beam(&self, direction_rad: f32, reach_mm: f32) -> Option<f32> {
        self.scene.sight.along(self.id, self.pose, Ray::towards(self.pose, direction_rad), reach_mm)
    }

    /// Returns the number of other robots within `reach_mm` that use the same medium, and the
    /// distance in mm and the direction in radians of the nearest one.
    #[must_use]
    pub fn neighbors(&self, reach_mm: f32) -> (usize, Option<[f32; 2]>) {
        let medium = self.scene.herds[usize::from(self.herd.0)].medium;
        let (mut count, mut nearest): (usize, Option<[f32; 2]>) = (0, None);
        self.scene.sight.crowd.within(self.id, self.pose, reach_mm, |herd, [dx, dy, dz]| {
            if self.scene.herds[usize::from(herd)].medium != medium {
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

    /// Returns the reading, 0 to 1023, of a light sensor that faces a direction relative to the
    /// heading, in radians. With `None`, the sensor covers all directions.
    #[must_use]
    pub fn brightness(&self, direction_rad: Option<f32>) -> f32 {
        let world_direction_rad =
            direction_rad.map(|direction_rad| self.pose.heading + direction_rad);
        light::brightness(self.pose, self.top_mm(), world_direction_rad, self.scene.lighting())
    }

    /// Returns the brightness of the ground below a ground sensor of the robot's model, 0 (black) to
    /// 1 (white).
    #[must_use]
    pub fn ground(&self, sensor: usize) -> f32 {
        let has_sensor = sensor < self.scene.herds[usize::from(self.herd.0)].ground_sensors.len();
        let value = has_sensor.then(|| self.scene.ground.get(self.first_ground + sensor));
        value.flatten().copied().unwrap_or(WHITE)
    }

    /// Returns the reading of the light sensor, 0 (dark) to 1023.
    #[must_use]
    pub fn light(&self) -> u16 {
        light::reading(self.pose, self.top_mm(), self.scene.lighting())
    }

    /// Returns the height of the robot's top over the ground, in mm.
    fn top_mm(&self) -> f32 {
        self.pose.z + self.scene.herds[usize::from(self.herd.0)].shape.height_mm
    }
}
