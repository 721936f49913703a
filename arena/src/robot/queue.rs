//! The frames that wait for a machine and for its link.

use std::hash::Hash;

use bittybuzz_comms::queue::{Inbox, Outbox};
use bittybuzz_vm_core::message::{FULL_FRAME, TINY_FRAME};
use bittybuzz_vm_core::number::{Full, Profile, Tiny};

use crate::engine::{Digest, Sighting};

/// Frames that were heard, of any length of queue.
pub trait InQueue {
    /// Returns a copy with its frames.
    fn copy(&self) -> Box<dyn InQueue + Send>;

    /// Adds the frames that wait to a digest.
    fn add_to(&self, digest: &mut Digest);

    /// Adds a frame that was heard.
    fn push(&mut self, frame: &[u8], sighting: Sighting);

    /// Copies the next frame; returns its length, and its sender's position as far as the link knows it.
    fn pop(&mut self, frame: &mut [u8]) -> Option<(usize, Sighting)>;

    /// Returns the number of frames for which there was no room.
    fn dropped(&self) -> u16;

    /// Returns the number of frames that fit, and those that wait, oldest first.
    fn waiting(&self) -> (usize, Vec<Vec<u8>>);
}

/// Frames that are to be sent, of any length of queue.
pub trait OutQueue {
    /// Returns a copy with its frames.
    fn copy(&self) -> Box<dyn OutQueue + Send>;

    /// Adds the frames that wait to a digest.
    fn add_to(&self, digest: &mut Digest);

    /// A step begins.
    fn begin_step(&mut self);

    /// Adds a frame that is to be sent.
    fn push(&mut self, frame: &[u8]);

    /// Copies the next frame; returns its length, 0 if there is none.
    fn pop(&mut self, frame: &mut [u8]) -> usize;

    /// Returns true if no frame waits.
    fn is_empty(&self) -> bool;

    /// Returns the number of frames for which there was no room.
    fn dropped(&self) -> u16;

    /// Returns the number of frames that fit, and those that wait, oldest first.
    fn waiting(&self) -> (usize, Vec<Vec<u8>>);
}

/// A number profile, and queues for 1 to [`MOST`] of its frames.
pub trait QueueProfile: Profile {
    /// Returns a queue for frames that were heard.
    fn inbox(length: usize) -> Box<dyn InQueue + Send>;

    /// Returns a queue for frames that are to be sent.
    fn outbox(length: usize) -> Box<dyn OutQueue + Send>;
}

/// Most frames of a queue.
pub const MOST: usize = 32;

impl<P: Profile, const FRAME: usize, const LENGTH: usize> InQueue
    for Inbox<P, Sighting, FRAME, LENGTH>
where
    Self: Send,
{
    fn copy(&self) -> Box<dyn InQueue + Send> {
        Box::new(self.clone())
    }

    fn add_to(&self, digest: &mut Digest) {
        self.hash_state(digest, |sighting, digest| {
            let (robot, place) = (sighting.robot, sighting.place());
            (robot, place.is_some()).hash(digest);
            place.iter().flatten().for_each(|part| digest.float(*part));
        });
    }

    fn push(&mut self, frame: &[u8], sighting: Sighting) {
        self.push(frame, sighting);
    }

    fn pop(&mut self, frame: &mut [u8]) -> Option<(usize, Sighting)> {
        let (bytes, sighting) = self.pop()?;
        let length = bytes.len().min(frame.len());
        frame[..length].copy_from_slice(&bytes[..length]);
        Some((length, *sighting))
    }

    fn dropped(&self) -> u16 {
        self.counters().dropped
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        (LENGTH, self.frames().map(<[u8]>::to_vec).collect())
    }
}

impl<P: Profile, const FRAME: usize, const LENGTH: usize> OutQueue for Outbox<P, FRAME, LENGTH>
where
    Self: Send,
{
    fn copy(&self) -> Box<dyn OutQueue + Send> {
        Box::new(self.clone())
    }

    fn add_to(&self, digest: &mut Digest) {
        self.hash_state(digest);
    }

    fn begin_step(&mut self) {
        self.begin_step();
    }

    fn push(&mut self, frame: &[u8]) {
        self.push(frame);
    }

    fn pop(&mut self, frame: &mut [u8]) -> usize {
        // No frame of the machine is longer than the link's.
        self.pop().map_or(0, |next| {
            frame.iter_mut().zip(&**next).for_each(|(to, from)| *to = *from);
            next.len()
        })
    }

    fn is_empty(&self) -> bool {
        self.is_empty()
    }

    fn dropped(&self) -> u16 {
        self.counters().dropped
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        (LENGTH, self.frames().map(<[u8]>::to_vec).collect())
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

    fn push(&mut self, frame: &[u8], sighting: Sighting) {
        (**self).push(frame, sighting);
    }

    fn pop(&mut self, frame: &mut [u8]) -> Option<(usize, Sighting)> {
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

/// Queues of a profile, of these lengths.
macro_rules! lengths {
    ($profile:ty, $frame:expr, $($length:literal)*) => {
        impl QueueProfile for $profile {
            fn inbox(length: usize) -> Box<dyn InQueue + Send> {
                let nothing = Sighting::default();
                match length {
                    $($length => Box::new(Inbox::<$profile, _, { $frame }, $length>::new(nothing)),)*
                    _ => Box::new(Inbox::<$profile, _, { $frame }, MOST>::new(nothing)),
                }
            }

            fn outbox(length: usize) -> Box<dyn OutQueue + Send> {
                match length {
                    $($length => Box::new(Outbox::<$profile, { $frame }, $length>::new()),)*
                    _ => Box::new(Outbox::<$profile, { $frame }, MOST>::new()),
                }
            }
        }
    };
}

lengths!(Tiny, TINY_FRAME, 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31);
lengths!(Full, FULL_FRAME, 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31);
