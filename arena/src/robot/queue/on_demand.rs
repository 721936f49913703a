//! Queues that take memory only while they hold something. A queue for 64 frames and 16 long
//! messages takes about 10 kB, and the copies of a run by which a session goes back in time contain
//! the queues of all robots.

use bittybuzz_comms::queue::{EmptyQueue, Inbox, Outbox, QueueCounters};
use bittybuzz_vm_core::message::Topics;
use bittybuzz_vm_core::number::Profile;

use super::{Bounded, InQueue, OutQueue};
use crate::engine::{Digest, FrameSighting};

/// A queue that an [`EmptyQueue`] can stand for.
pub trait Places: Clone + Send + 'static {
    /// Returns an empty queue for that many frames and long messages.
    fn with_room(length: usize, messages: usize) -> Self;

    /// Returns the state of the queue if it is empty.
    fn as_empty(&self) -> Option<EmptyQueue>;

    /// Gives a new queue the state of another one.
    fn resume(&mut self, state: EmptyQueue);
}

/// A queue whose places exist from the first frame on. A copy of an empty one has no places.
pub struct OnDemand<Q> {
    places: Option<Box<Q>>,
    /// The state of the queue while there are no places.
    empty: EmptyQueue,
    length: usize,
    messages: usize,
}

impl<Q: Places> OnDemand<Q> {
    pub fn new(length: usize, messages: usize) -> Self {
        OnDemand { places: None, empty: EmptyQueue::default(), length, messages }
    }

    fn new_places(&self) -> Q {
        let mut places = Q::with_room(self.length, self.messages);
        places.resume(self.empty);
        places
    }

    fn places(&mut self) -> &mut Q {
        if self.places.is_none() {
            self.places = Some(Box::new(self.new_places()));
        }
        self.places.as_mut().expect("they were made above")
    }

    /// Returns the places, or new ones in the same state.
    fn same_places(&self) -> Box<Q> {
        self.places.clone().unwrap_or_else(|| Box::new(self.new_places()))
    }
}

impl<Q: Places> Clone for OnDemand<Q> {
    fn clone(&self) -> Self {
        let copy = OnDemand::new(self.length, self.messages);
        match &self.places {
            None => OnDemand { empty: self.empty, ..copy },
            Some(places) => match places.as_empty() {
                Some(empty) => OnDemand { empty, ..copy },
                None => OnDemand { places: Some(places.clone()), ..copy },
            },
        }
    }
}

impl<P: Profile, const FRAME: usize, const PLACES: usize, const LONG: usize> Places
    for Bounded<Inbox<P, FrameSighting, FRAME, PLACES, LONG>>
where
    Self: Clone + Send + 'static,
{
    fn with_room(length: usize, messages: usize) -> Self {
        Self::inbox(length, messages)
    }

    fn as_empty(&self) -> Option<EmptyQueue> {
        self.queue.as_empty()
    }

    fn resume(&mut self, state: EmptyQueue) {
        self.queue.resume(state);
    }
}

impl<P: Profile, const FRAME: usize, const PLACES: usize, const LONG: usize> Places
    for Bounded<Outbox<P, FRAME, PLACES, LONG>>
where
    Self: Clone + Send + 'static,
{
    fn with_room(length: usize, messages: usize) -> Self {
        Self::outbox(length, messages)
    }

    fn as_empty(&self) -> Option<EmptyQueue> {
        self.queue.as_empty()
    }

    fn resume(&mut self, state: EmptyQueue) {
        self.queue.resume(state);
    }
}

impl<Q: Places + InQueue> InQueue for OnDemand<Q> {
    fn copy(&self) -> Box<dyn InQueue + Send> {
        Box::new(self.clone())
    }

    fn add_to(&self, digest: &mut Digest) {
        self.same_places().add_to(digest);
    }

    fn is_assembling(&self) -> bool {
        self.places.as_ref().is_some_and(|places| places.is_assembling())
    }

    fn push(&mut self, frame: &[u8], sighting: FrameSighting, unwanted: Topics) {
        self.places().push(frame, sighting, unwanted);
    }

    fn pop(&mut self, frame: &mut [u8]) -> Option<(usize, FrameSighting)> {
        self.places.as_mut()?.pop(frame)
    }

    fn take_content(&mut self, content: &mut [u8]) -> usize {
        self.places.as_mut().map_or(0, |places| places.take_content(content))
    }

    fn counters(&self) -> QueueCounters {
        self.places.as_ref().map_or(self.empty.counters, |places| places.counters())
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        self.places.as_ref().map_or((self.length, Vec::new()), |places| places.waiting())
    }
}

impl<Q: Places + OutQueue> OutQueue for OnDemand<Q> {
    fn copy(&self) -> Box<dyn OutQueue + Send> {
        Box::new(self.clone())
    }

    fn add_to(&self, digest: &mut Digest) {
        self.same_places().add_to(digest);
    }

    fn begin_step(&mut self) {
        if let Some(places) = &mut self.places {
            places.begin_step();
        }
    }

    fn push(&mut self, frame: &[u8]) {
        self.places().push(frame);
    }

    fn push_content(&mut self, robot: u16, content: &[u8]) -> bool {
        self.places().push_content(robot, content)
    }

    fn pop(&mut self, frame: &mut [u8]) -> usize {
        self.places.as_mut().map_or(0, |places| places.pop(frame))
    }

    fn is_empty(&self) -> bool {
        self.places.as_ref().is_none_or(|places| places.is_empty())
    }

    fn is_within_message(&self) -> bool {
        self.places.as_ref().is_some_and(|places| places.is_within_message())
    }

    fn dropped(&self) -> u16 {
        self.places.as_ref().map_or(self.empty.counters.dropped, |places| places.dropped())
    }

    fn waiting(&self) -> (usize, Vec<Vec<u8>>) {
        self.places.as_ref().map_or((self.length, Vec::new()), |places| places.waiting())
    }
}
