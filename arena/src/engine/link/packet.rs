//! Frames as the engine keeps them.

use super::Medium;
use crate::engine::brain::Sighting;
use crate::engine::robot::RobotId;

/// Longest frame of all media.
const CAPACITY: usize = 49;

/// Most frames that a link keeps.
const SLOTS: usize = 3;

/// The bytes of a frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Packet {
    length: u8,
    bytes: [u8; CAPACITY],
}

impl Packet {
    const EMPTY: Packet = Packet { length: 0, bytes: [0; CAPACITY] };

    /// A frame of at least `padded` bytes; the caller has checked its length.
    pub(crate) fn new(frame: &[u8], padded: usize) -> Self {
        let mut packet = Packet::EMPTY;
        let length = frame.len().min(CAPACITY);
        packet.bytes[..length].copy_from_slice(&frame[..length]);
        packet.length = length.max(padded).min(CAPACITY) as u8;
        packet
    }

    pub(crate) fn bytes(&self) -> &[u8] {
        &self.bytes[..usize::from(self.length)]
    }
}

/// The frames that wait in a robot's link; the oldest first.
#[derive(Clone, Debug)]
pub(crate) struct Queue {
    packets: [Packet; SLOTS],
    length: u8,
}

impl Queue {
    pub(crate) const EMPTY: Queue = Queue { packets: [Packet::EMPTY; SLOTS], length: 0 };

    pub(crate) fn len(&self) -> usize {
        usize::from(self.length)
    }

    pub(crate) fn clear(&mut self) {
        self.length = 0;
    }

    /// The caller has seen that there is room.
    pub(crate) fn push(&mut self, packet: Packet) {
        if let Some(slot) = self.packets.get_mut(usize::from(self.length)) {
            *slot = packet;
            self.length += 1;
        }
    }

    pub(crate) fn pop(&mut self) -> Option<Packet> {
        let oldest = *self.packets[..usize::from(self.length)].first()?;
        self.packets.rotate_left(1);
        self.length -= 1;
        Some(oldest)
    }
}

const _: () = {
    let mut i = 0;
    while i < Medium::COUNT {
        assert!(Medium::ALL[i].frame_bytes() <= CAPACITY && Medium::ALL[i].queue() <= SLOTS);
        i += 1;
    }
};

/// A frame on its way.
#[derive(Clone, Debug)]
pub(crate) struct Transmission {
    /// When it began: microseconds after the window's beginning; negative if before.
    pub(crate) start: i32,
    pub(crate) from: RobotId,
    pub(crate) x: f32,
    pub(crate) y: f32,
    pub(crate) z: f32,
    /// Where its sender believes to be, as the frame tells it.
    pub(crate) claim: Option<[f32; 3]>,
    pub(crate) packet: Packet,
}

/// A frame that a robot heard in this window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Heard {
    pub(crate) transmission: u32,
    pub(crate) sighting: Sighting,
}

/// A frame that was held back on its way (an option for tests).
#[derive(Clone, Debug)]
pub(crate) struct Late {
    pub(crate) due: u64,
    pub(crate) packet: Packet,
    pub(crate) sighting: Sighting,
}
