//! The queues of frames between a machine and its link.

use std::hash::Hash;

use bittybuzz_comms::queue::{Inbox, Outbox};
use bittybuzz_vm_core::message::{FULL_FRAME, TINY_FRAME};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

use crate::engine::{Digest, FrameSighting};

/// A queue of received frames, of any length.
pub trait InQueue {
    /// Returns a copy with its frames.
    fn copy(&self) -> Box<dyn InQueue + Send>;

    /// Adds the frames that wait to a digest.
    fn add_to(&self, digest: &mut Digest);

    /// Adds a received frame.
    fn push(&mut self, frame: &[u8], sighting: FrameSighting);

    /// Removes the next frame and copies it. Returns its length, and the position of its sender as
    /// far as the link knows it.
    fn pop(&mut self, frame: &mut [u8]) -> Option<(usize, FrameSighting)>;

    /// Returns the number of frames for which there was no room.
    fn dropped(&self) -> u16;

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

    /// Removes the next frame and copies it. Returns its length; 0 if there is none.
    fn pop(&mut self, frame: &mut [u8]) -> usize;

    /// Returns true if no frame waits.
    fn is_empty(&self) -> bool;

    /// Returns the number of frames for which there was no room.
    fn dropped(&self) -> u16;

    /// Returns the capacity of the queue in frames, and the frames that wait, oldest first.
    fn waiting(&self) -> (usize, Vec<Vec<u8>>);
}

/// A number profile, and queues for 1 to [`QUEUED_MAX`] of its frames.
pub trait QueueProfile: Profile {
    /// Returns a queue for received frames.
    fn inbox(length: usize) -> Box<dyn InQueue + Send>;

    /// Returns a queue for frames that are to be sent.
    fn outbox(length: usize) -> Box<dyn OutQueue + Send>;
}

/// The largest capacity of a queue in frames.
pub const QUEUED_MAX: usize = 32;

/// A queue for at most `length` frames, which may be less than the capacity of its type.
///
/// A type for each length would add 31 copies of the code of each queue, for which the playground's
/// module has no room.
#[derive(Clone)]
pub struct Bounded<Q> {
    queue: Q,
    length: usize,
}

impl<P: Profile, const FRAME: usize, const PLACES: usize>
    Bounded<Inbox<P, FrameSighting, FRAME, PLACES>>
{
    /// Returns an empty queue.
    pub fn inbox(length: usize) -> Self {
        let length = length.min(PLACES);
        Bounded { queue: Inbox::with_room(FrameSighting::default(), length), length }
    }
}

impl<P: Profile, const FRAME: usize, const PLACES: usize> Bounded<Outbox<P, FRAME, PLACES>> {
    /// Returns an empty queue.
    pub fn outbox(length: usize) -> Self {
        let length = length.min(PLACES);
        Bounded { queue: Outbox::with_room(length), length }
    }
}

impl<P: Profile, const FRAME: usize, const PLACES: usize> InQueue
    for Bounded<Inbox<P, FrameSighting, FRAME, PLACES>>
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

    fn push(&mut self, frame: &[u8], sighting: FrameSighting) {
        self.queue.push(frame, sighting);
    }

    fn pop(&mut self, frame: &mut [u8]) -> Option<(usize, FrameSighting)> {
        let (bytes, sighting) = self.queue.pop()?;
        let length = bytes.len().min(frame.len());
        frame[..length].copy_from_slice(&bytes[..length]);
        Some((length, *sighting))
    }

    fn dropped(&self) -> u16 {
        self.queue.counters().dropped
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        (self.length, self.queue.frames().map(<[u8]>::to_vec).collect())
    }
}

impl<P: Profile, const FRAME: usize, const PLACES: usize> OutQueue
    for Bounded<Outbox<P, FRAME, PLACES>>
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

    fn pop(&mut self, frame: &mut [u8]) -> usize {
        // No frame of the machine is longer than the longest frame of the link.
        self.queue.pop().map_or(0, |next| {
            frame.iter_mut().zip(&**next).for_each(|(to, from)| *to = *from);
            next.len()
        })
    }

    fn is_empty(&self) -> bool {
        // The length of the inner queue includes the places that are not used.
        self.queue.frames().next().is_none()
    }

    fn dropped(&self) -> u16 {
        self.queue.counters().dropped
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        (self.length, self.queue.frames().map(<[u8]>::to_vec).collect())
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

    fn push(&mut self, frame: &[u8], sighting: FrameSighting) {
        (**self).push(frame, sighting);
    }

    fn pop(&mut self, frame: &mut [u8]) -> Option<(usize, FrameSighting)> {
        (**self).pop(frame)
    }

    fn dropped(&self) -> u16 {
        (**self).dropped()
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

    fn pop(&mut self, frame: &mut [u8]) -> usize {
        (**self).pop(frame)
    }

    fn is_empty(&self) -> bool {
        (**self).is_empty()
    }

    fn dropped(&self) -> u16 {
        (**self).dropped()
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        (**self).waiting()
    }
}

macro_rules! queues {
    ($profile:ty, $frame:expr) => {
        impl QueueProfile for $profile {
            fn inbox(length: usize) -> Box<dyn InQueue + Send> {
                Box::new(Bounded::<Inbox<$profile, _, { $frame }, QUEUED_MAX>>::inbox(length))
            }

            fn outbox(length: usize) -> Box<dyn OutQueue + Send> {
                Box::new(Bounded::<Outbox<$profile, { $frame }, QUEUED_MAX>>::outbox(length))
            }
        }
    };
}

queues!(Tiny, TINY_FRAME);
queues!(Full, FULL_FRAME);
