//! Frames in the representation of the engine.

use super::Medium;
use crate::engine::geometry::wrap;
use crate::engine::id::RobotId;

/// The information of a link about the sender of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameSighting {
    /// The sender, if the frame format of the link contains its id (not on infrared).
    pub robot: Option<RobotId>,
    /// The vector to the sender, if the link knows it.
    pub(crate) way: Option<Direction>,
}

impl FrameSighting {
    /// Returns the distance in mm, and the azimuth and elevation in radians in (-pi, pi], in the
    /// receiver's frame: azimuth 0 is ahead, anticlockwise positive. A Kilobot measures only the
    /// distance, and both angles are 0. `None` if the place is unknown.
    pub fn place(&self) -> Option<[f32; 3]> {
        self.way.map(|way| match way {
            Direction::Polar(place) => place,
            Direction::Straight(way, heading) => polar(way, heading),
        })
    }
}

/// The vector from a receiver to a sender.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Direction {
    /// Distance, azimuth and elevation, see [`FrameSighting::place`].
    Polar([f32; 3]),
    /// Lengths in mm along the axes of the world, with the receiver's heading. Angles are computed when the robot reads the frame,
    /// because a full queue drops many frames unread.
    Straight([f32; 3], f32),
}

/// Returns the distance, azimuth and elevation of a vector in mm for a robot with that heading.
pub(super) fn polar([dx, dy, dz]: [f32; 3], heading: f32) -> [f32; 3] {
    let flat = (dx * dx + dy * dy).sqrt();
    let distance = (flat * flat + dz * dz).sqrt();
    [distance, wrap(libm::atan2f(dy, dx) - heading), libm::atan2f(dz, flat)]
}

/// Length of the longest frame of all media in bytes.
const CAPACITY: usize = 49;

/// The bytes of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Packet {
    length: u8,
    bytes: [u8; CAPACITY],
}

impl Packet {
    /// Returns the packet that a brain writes for a link of that medium; `None` if it writes none.
    pub(crate) fn written(medium: Medium, write: impl FnOnce(&mut [u8]) -> usize) -> Option<Self> {
        let mut bytes = [0; CAPACITY];
        let frame = &mut bytes[..medium.frame_bytes()];
        let longest = frame.len();
        let length = match write(frame) {
            0 => return None,
            _ if medium == Medium::Infrared => longest,
            length => length.min(longest),
        };
        Some(Packet { length: length as u8, bytes })
    }

    /// Returns the packet of a frame that was on the air.
    pub(crate) fn copied(frame: &[u8]) -> Self {
        let mut bytes = [0; CAPACITY];
        bytes[..frame.len()].copy_from_slice(frame);
        Packet { length: frame.len() as u8, bytes }
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }
}

const _: () = {
    let mut i = 0;
    while i < Medium::COUNT {
        assert!(Medium::ALL[i].frame_bytes() <= CAPACITY);
        i += 1;
    }
};

/// A frame on the air, without its bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Transmission {
    /// The start time in microseconds after the beginning of the tick; negative if the frame
    /// started before.
    pub(crate) start: i32,
    pub(crate) from: RobotId,
    /// Index of the sender's link.
    pub(crate) link: u16,
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) z: f32,
    /// The sender's estimate of its position, as the frame carries it.
    pub(crate) claim: Option<[f32; 3]>,
}
