//! A robot's end of the air: the frames that it has received and those that it wants to send.

use std::collections::VecDeque;

use bittybuzz_comms::queue::{Inbox, Outbox};
use bittybuzz_vm_core::message::FULL_FRAME;
use bittybuzz_vm_core::number::Profile;

/// A frame that a robot received.
#[derive(Debug, Clone, PartialEq)]
pub struct Received {
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// The sender's id, if the link knows it.
    pub sender: Option<u16>,
    /// Distance in mm, azimuth and elevation in radians, if the link knows them.
    pub place: Option<[f32; 3]>,
}

impl Received {
    /// A frame of a sender of which the link knows nothing.
    pub fn new(bytes: &[u8]) -> Self {
        Received { bytes: bytes.to_vec(), sender: None, place: None }
    }
}

/// Frames in both directions.
pub trait Link {
    /// A step begins.
    fn begin_step(&mut self);
    /// The air delivers a frame.
    fn push(&mut self, frame: Received);
    /// The machine takes a frame.
    fn pop(&mut self) -> Option<Received>;
    /// The machine sends a frame.
    fn send(&mut self, frame: &[u8]);
    /// The air takes a frame.
    fn pop_sent(&mut self) -> Option<Vec<u8>>;
}

/// Lists without a limit, first in, first out: whatever is sent arrives.
#[derive(Debug, Default)]
pub struct Direct {
    received: VecDeque<Received>,
    sent: VecDeque<Vec<u8>>,
}

impl Link for Direct {
    fn begin_step(&mut self) {}

    fn push(&mut self, frame: Received) {
        self.received.push_back(frame);
    }

    fn pop(&mut self) -> Option<Received> {
        self.received.pop_front()
    }

    fn send(&mut self, frame: &[u8]) {
        self.sent.push_back(frame.to_vec());
    }

    fn pop_sent(&mut self) -> Option<Vec<u8>> {
        self.sent.pop_front()
    }
}

/// The queues of the robots' firmware, with room for `IN` and `OUT` frames.
pub struct Queues<P: Profile, const IN: usize, const OUT: usize> {
    received: Inbox<P, Seen, FULL_FRAME, IN>,
    sent: Outbox<P, FULL_FRAME, OUT>,
}

/// Sender and place of a frame that waits.
type Seen = (Option<u16>, Option<[f32; 3]>);

impl<P: Profile, const IN: usize, const OUT: usize> Default for Queues<P, IN, OUT> {
    fn default() -> Self {
        Queues { received: Inbox::new((None, None)), sent: Outbox::new() }
    }
}

impl<P: Profile, const IN: usize, const OUT: usize> Link for Queues<P, IN, OUT> {
    fn begin_step(&mut self) {
        self.sent.begin_step();
    }

    fn push(&mut self, frame: Received) {
        self.received.push(&frame.bytes, (frame.sender, frame.place));
    }

    fn pop(&mut self) -> Option<Received> {
        let (frame, (sender, place)) = self.received.pop()?;
        Some(Received { bytes: frame.to_vec(), sender: *sender, place: *place })
    }

    fn send(&mut self, frame: &[u8]) {
        self.sent.push(frame);
    }

    fn pop_sent(&mut self) -> Option<Vec<u8>> {
        self.sent.pop().map(|frame| frame.to_vec())
    }
}
