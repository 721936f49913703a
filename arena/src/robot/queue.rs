//! The queues of frames between a machine and its link.

mod on_demand;

use std::hash::Hash;

use bittybuzz_comms::queue::{Inbox, Outbox, QueueCounters};
use bittybuzz_robot_spec::LONG_MAX;
use bittybuzz_vm_core::message::{FULL_FRAME, TINY_FRAME, Topics};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

use crate::engine::{Digest, FrameSighting};
use on_demand::OnDemand;

/// A queue of received frames, of any length.
pub trait InQueue {
    /// Returns a copy with its frames.
    fn copy(&self) -> Box<dyn InQueue + Send>;

    /// Adds the frames that wait to a digest.
    fn add_to(&self, digest: &mut Digest);

    /// Returns true if fragments of a message have arrived.
    fn is_assembling(&self) -> bool;

    /// Adds a received frame. `unwanted` are the topics to which the script does not listen.
    fn push(&mut self, frame: &[u8], sighting: FrameSighting, unwanted: Topics);

    /// Removes the next frame and copies it. Returns its length, and the position of its sender as
    /// far as the link knows it.
    fn pop(&mut self, frame: &mut [u8]) -> Option<(usize, FrameSighting)>;

    /// Copies the content of the long message that [`InQueue::pop`] has returned last, and returns
    /// its length.
    fn take_content(&mut self, content: &mut [u8]) -> usize;

    /// Returns the numbers of frames and messages that were not passed on.
    fn counters(&self) -> QueueCounters;

    /// Returns the capacity of the queue in frames, and the frames that wait, oldest first.
    fn waiting(&self) -> (usize, Vec<Vec<u8>>);
}

/// A queue of frames that are to be sent, of any length.
pub trait OutQueue {
    /// Returns a copy with its frames.
    fn copy(&self) -> Box<dyn OutQueue + Send>;

    /// Adds the frames that wait to a digest.
    fn add_to(&self, digest: &mut Digest);

    /// Marks the beginning of a step.
    fn begin_step(&mut self);

    /// Adds a frame that is to be sent.
    fn push(&mut self, frame: &[u8]);

    /// Adds the content of a long message from that robot. Returns false if there is no room for it.
    fn push_content(&mut self, robot: u16, content: &[u8]) -> bool;

    /// Removes the next frame and copies it. Returns its length; 0 if there is none.
    fn pop(&mut self, frame: &mut [u8]) -> usize;

    /// Returns true if no frame waits.
    fn is_empty(&self) -> bool;

    /// Returns true if the next frame continues a long message.
    fn is_within_message(&self) -> bool;

    /// Returns the number of frames for which there was no room.
    fn dropped(&self) -> u16;

    /// Returns the capacity of the queue in frames, and the frames that wait, oldest first.
    fn waiting(&self) -> (usize, Vec<Vec<u8>>);
}

/// A number profile, and queues for 1 to [`QUEUED_MAX`] of its frames and up to [`LONG_MAX`] long
/// messages.
pub trait QueueProfile: Profile {
    /// Returns a queue for received frames.
    fn inbox(length: usize, messages: usize) -> Box<dyn InQueue + Send>;

    /// Returns a queue for frames that are to be sent.
    fn outbox(length: usize, messages: usize) -> Box<dyn OutQueue + Send>;
}

/// The largest capacity of a queue in frames.
pub const QUEUED_MAX: usize = bittybuzz_robot_spec::QUEUED_MAX as usize;

/// A queue for at most `length` frames, which may be less than the capacity of its type.
///
/// A type for each length would add 63 copies of the code of each queue, for which the playground's
/// module has no room.
#[derive(Clone)]
pub struct Bounded<Q> {
    queue: Q,
    length: usize,
}

impl<P: Profile, const FRAME: usize, const PLACES: usize, const LONG: usize>
    Bounded<Inbox<P, FrameSighting, FRAME, PLACES, LONG>>
{
    /// Returns an empty queue.
    pub fn inbox(length: usize, messages: usize) -> Self {
        let length = length.min(PLACES);
        Bounded { queue: Inbox::with_room(FrameSighting::default(), length, messages), length }
    }
}

impl<P: Profile, const FRAME: usize, const PLACES: usize, const LONG: usize>
    Bounded<Outbox<P, FRAME, PLACES, LONG>>
{
    /// Returns an empty queue.
    pub fn outbox(length: usize, messages: usize) -> Self {
        let length = length.min(PLACES);
        Bounded { queue: Outbox::with_room(length, messages), length }
    }
}

impl<P: Profile, const FRAME: usize, const PLACES: usize, const LONG: usize> InQueue
    for Bounded<Inbox<P, FrameSighting, FRAME, PLACES, LONG>>
where
    Self: Clone + Send + 'static,
{
    fn copy(&self) -> Box<dyn InQueue + Send> {
        Box::new(self.clone())
    }

    fn add_to(&self, digest: &mut Digest) {
        self.queue.hash_state(digest, |sighting, digest| {
            let (robot, place) = (sighting.robot, sighting.place());
            (robot, place.is_some()).hash(digest);
            place.iter().flatten().for_each(|part| digest.float(*part));
        });
    }

    fn is_assembling(&self) -> bool {
        self.queue.is_assembling()
    }

    fn push(&mut self, frame: &[u8], sighting: FrameSighting, unwanted: Topics) {
        self.queue.push_except(frame, sighting, unwanted);
    }

    fn pop(&mut self, frame: &mut [u8]) -> Option<(usize, FrameSighting)> {
        let room = frame.first_chunk_mut().expect("a machine reads its longest frame");
        let (length, sighting) = self.queue.pop(room)?;
        Some((length, *sighting))
    }

    fn take_content(&mut self, content: &mut [u8]) -> usize {
        self.queue.take_content(content)
    }

    fn counters(&self) -> QueueCounters {
        self.queue.counters()
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        let mut frames = Vec::new();
        self.queue.show(|frame| frames.push(frame.to_vec()));
        (self.length, frames)
    }
}

impl<P: Profile, const FRAME: usize, const PLACES: usize, const LONG: usize> OutQueue
    for Bounded<Outbox<P, FRAME, PLACES, LONG>>
where
    Self: Clone + Send + 'static,
{
    fn copy(&self) -> Box<dyn OutQueue + Send> {
        Box::new(self.clone())
    }

    fn add_to(&self, digest: &mut Digest) {
        self.queue.hash_state(digest);
    }

    fn begin_step(&mut self) {
        self.queue.begin_step();
    }

    fn push(&mut self, frame: &[u8]) {
        self.queue.push(frame);
    }

    fn push_content(&mut self, robot: u16, content: &[u8]) -> bool {
        self.queue.push_content(robot, content)
    }

    fn pop(&mut self, frame: &mut [u8]) -> usize {
        let mut next = [0; FRAME];
        // No frame of the machine is longer than the longest frame of the link.
        self.queue.pop(&mut next).map_or(0, |length| {
            frame[..length].copy_from_slice(&next[..length]);
            length
        })
    }

    fn is_empty(&self) -> bool {
        self.queue.is_empty()
    }

    fn is_within_message(&self) -> bool {
        self.queue.is_within_message()
    }

    fn dropped(&self) -> u16 {
        self.queue.counters().dropped
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        let mut frames = Vec::new();
        self.queue.show(|frame| frames.push(frame.to_vec()));
        (self.length, frames)
    }
}

impl Clone for Box<dyn InQueue + Send> {
    fn clone(&self) -> Self {
        (**self).copy()
    }
}

impl InQueue for Box<dyn InQueue + Send> {
    fn copy(&self) -> Box<dyn InQueue + Send> {
        (**self).copy()
    }

    fn add_to(&self, digest: &mut Digest) {
        (**self).add_to(digest);
    }

    fn is_assembling(&self) -> bool {
        (**self).is_assembling()
    }

    fn push(&mut self, frame: &[u8], sighting: FrameSighting, unwanted: Topics) {
        (**self).push(frame, sighting, unwanted);
    }

    fn pop(&mut self, frame: &mut [u8]) -> Option<(usize, FrameSighting)> {
        (**self).pop(frame)
    }

    fn take_content(&mut self, content: &mut [u8]) -> usize {
        (**self).take_content(content)
    }

    fn counters(&self) -> QueueCounters {
        (**self).counters()
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        (**self).waiting()
    }
}

impl Clone for Box<dyn OutQueue + Send> {
    fn clone(&self) -> Self {
        (**self).copy()
    }
}

impl OutQueue for Box<dyn OutQueue + Send> {
    fn copy(&self) -> Box<dyn OutQueue + Send> {
        (**self).copy()
    }

    fn add_to(&self, digest: &mut Digest) {
        (**self).add_to(digest);
    }

    fn begin_step(&mut self) {
        (**self).begin_step();
    }

    fn push(&mut self, frame: &[u8]) {
        (**self).push(frame);
    }

    fn push_content(&mut self, robot: u16, content: &[u8]) -> bool {
        (**self).push_content(robot, content)
    }

    fn pop(&mut self, frame: &mut [u8]) -> usize {
        (**self).pop(frame)
    }

    fn is_empty(&self) -> bool {
        (**self).is_empty()
    }

    fn is_within_message(&self) -> bool {
        (**self).is_within_message()
    }

    fn dropped(&self) -> u16 {
        (**self).dropped()
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        (**self).waiting()
    }
}

const LONG: usize = LONG_MAX as usize;

macro_rules! queues {
    ($profile:ty, $frame:expr) => {
        impl QueueProfile for $profile {
            fn inbox(length: usize, messages: usize) -> Box<dyn InQueue + Send> {
                type Queue = Inbox<$profile, FrameSighting, { $frame }, QUEUED_MAX, LONG>;
                Box::new(OnDemand::<Bounded<Queue>>::new(length, messages))
            }

            fn outbox(length: usize, messages: usize) -> Box<dyn OutQueue + Send> {
                type Queue = Outbox<$profile, { $frame }, QUEUED_MAX, LONG>;
                Box::new(OnDemand::<Bounded<Queue>>::new(length, messages))
            }
        }
    };
}

queues!(Tiny, TINY_FRAME);
queues!(Full, FULL_FRAME);
