//! The queues of swarm messages between the script's task and the link's. Received frames wait for
//! the script's next step, and frames of the script wait for the radio. [`bittybuzz_comms::queue`]
//! decides which frames are dropped when a queue is full.

use core::cell::RefCell;
use core::convert::Infallible;
use core::sync::atomic::{AtomicU32, Ordering};

use bittybuzz_comms::queue::{Inbox, Outbox, QueueCounters};
use bittybuzz_vm_core::Sighting;
use bittybuzz_vm_core::message::Topics;
use bittybuzz_vm_core::number::{Full, Profile, Rng};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer, with_timeout};

use crate::liveness::{BEAT, Pulse};

/// The range of the random pause before each frame, in µs: 10 ms on average, and seldom equal to
/// another robot's. Robots have no carrier sense, so frames that two robots send at once are lost,
/// and robots that were switched on together also step together.
const PAUSE_US: core::ops::Range<u32> = 2_000..18_000;

type Shared<T> = Mutex<CriticalSectionRawMutex, RefCell<T>>;

/// The queues of a link, as the script's task uses them.
pub trait MailQueues<P: Profile> {
    /// Takes the next received frame; see `bittybuzz_vm_core::Host::receive`. Returns `None` if
    /// `frame` is shorter than the longest frame.
    fn receive(&self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize>;

    /// Takes the content of a long message; see `bittybuzz_vm_core::Host::receive_content`.
    fn receive_content(&self, content: &mut [u8]) -> usize;

    /// Marks the beginning of a step: its broadcasts may replace waiting ones. Received messages on
    /// unwanted topics give way to others.
    fn begin_step(&self, unwanted: Topics);

    /// Queues a frame of the script.
    fn send(&self, frame: &[u8]);

    /// Queues a long message of the script. Returns false if there is no room for it.
    fn send_content(&self, robot: u16, content: &[u8]) -> bool;

    /// Returns the numbers of frames that the full queues dropped since the start: received ones,
    /// and ones to be sent.
    fn dropped(&self) -> [u16; 2];

    /// Returns the number of received long messages that were not completed.
    fn incomplete(&self) -> u16;
}

/// A robot without a link has no queues.
impl<P: Profile> MailQueues<P> for Infallible {
    fn receive(&self, _frame: &mut [u8], _sighting: &mut Sighting<P>) -> Option<usize> {
        match *self {}
    }

    fn receive_content(&self, _content: &mut [u8]) -> usize {
        match *self {}
    }

    fn begin_step(&self, _unwanted: Topics) {
        match *self {}
    }

    fn send(&self, _frame: &[u8]) {
        match *self {}
    }

    fn send_content(&self, _robot: u16, _content: &[u8]) -> bool {
        match *self {}
    }

    fn dropped(&self) -> [u16; 2] {
        match *self {}
    }

    fn incomplete(&self) -> u16 {
        match *self {}
    }
}

/// The queues of `IN` received frames and `OUT` frames to be sent, of at most `FRAME` bytes each,
/// and of `LONG_IN` and `LONG_OUT` long messages.
pub struct Mail<
    P: Profile,
    const FRAME: usize,
    const IN: usize,
    const OUT: usize,
    const LONG_IN: usize,
    const LONG_OUT: usize,
> {
    inbox: Shared<Inbox<P, Sighting<P>, FRAME, IN, LONG_IN>>,
    outbox: Shared<Outbox<P, FRAME, OUT, LONG_OUT>>,
    /// The topics to which the script does not listen.
    unwanted: AtomicU32,
    waiting: Signal<CriticalSectionRawMutex, ()>,
}

impl<
    P: Profile,
    const FRAME: usize,
    const IN: usize,
    const OUT: usize,
    const LONG_IN: usize,
    const LONG_OUT: usize,
> Mail<P, FRAME, IN, OUT, LONG_IN, LONG_OUT>
{
    /// Returns empty queues.
    pub const fn new() -> Self {
        let nobody = Sighting { robot: None, place: None };
        Mail {
            inbox: Mutex::new(RefCell::new(Inbox::new(nobody))),
            outbox: Mutex::new(RefCell::new(Outbox::new())),
            unwanted: AtomicU32::new(0),
            waiting: Signal::new(),
        }
    }

    /// Adds a frame that the link received.
    pub fn add_received(&self, frame: &[u8], sighting: Sighting<P>) {
        let unwanted = self.unwanted.load(Ordering::Relaxed);
        with(&self.inbox, |inbox| inbox.push_except(frame, sighting, unwanted));
    }

    /// Returns the counts of received frames that were not read.
    pub fn unread(&self) -> QueueCounters {
        with(&self.inbox, |inbox| inbox.counters()).unwrap_or_default()
    }

    /// Returns the counts of frames that were not sent.
    pub fn unsent(&self) -> QueueCounters {
        with(&self.outbox, |outbox| outbox.counters()).unwrap_or_default()
    }

    /// Runs the sending task: passes the frames to `transmit` one by one, with a random pause
    /// before each. The generators of robots must differ.
    pub async fn drain(&self, mut rng: Rng, pulse: Pulse, mut transmit: impl FnMut(&[u8])) -> ! {
        loop {
            pulse.beat();
            if with_timeout(BEAT, self.wait()).await.is_err() {
                continue;
            }
            loop {
                pulse.beat();
                Timer::after(pause(&mut rng)).await;
                let mut frame = [0; FRAME];
                let Some(length) = self.next_unsent(&mut frame) else { break };
                transmit(frame.get(..length).unwrap_or(&[]));
            }
        }
    }

    /// Waits until the script has sent a frame.
    pub async fn wait(&self) {
        self.waiting.wait().await;
    }

    /// Returns true if some fragments of a long message were sent, and others not.
    pub fn is_within_message(&self) -> bool {
        with(&self.outbox, |outbox| outbox.is_within_message()).unwrap_or(false)
    }

    /// Takes the next frame to be sent, and returns its length.
    pub fn next_unsent(&self, frame: &mut [u8; FRAME]) -> Option<usize> {
        with(&self.outbox, |outbox| outbox.pop(frame))?
    }
}

impl<
    P: Profile,
    const FRAME: usize,
    const IN: usize,
    const OUT: usize,
    const LONG_IN: usize,
    const LONG_OUT: usize,
> MailQueues<P> for Mail<P, FRAME, IN, OUT, LONG_IN, LONG_OUT>
{
    fn receive(&self, frame: &mut [u8], sighting: &mut Sighting<P>) -> Option<usize> {
        let frame = frame.first_chunk_mut()?;
        with(&self.inbox, |inbox| {
            let (length, from) = inbox.pop(frame)?;
            // The fields are copied one by one, which a Cortex-M0 does in place.
            (sighting.robot, sighting.place) = (from.robot, from.place);
            Some(length)
        })?
    }

    fn receive_content(&self, content: &mut [u8]) -> usize {
        with(&self.inbox, |inbox| inbox.take_content(content)).unwrap_or(0)
    }

    fn begin_step(&self, unwanted: Topics) {
        self.unwanted.store(unwanted, Ordering::Relaxed);
        with(&self.outbox, Outbox::begin_step);
    }

    fn send(&self, frame: &[u8]) {
        with(&self.outbox, |outbox| outbox.push(frame));
        self.waiting.signal(());
    }

    fn send_content(&self, robot: u16, content: &[u8]) -> bool {
        let is_queued = with(&self.outbox, |outbox| outbox.push_content(robot, content));
        self.waiting.signal(());
        is_queued.unwrap_or(true)
    }

    fn dropped(&self) -> [u16; 2] {
        [self.unread().dropped, self.unsent().dropped]
    }

    fn incomplete(&self) -> u16 {
        self.unread().incomplete
    }
}

impl<
    P: Profile,
    const FRAME: usize,
    const IN: usize,
    const OUT: usize,
    const LONG_IN: usize,
    const LONG_OUT: usize,
> Default for Mail<P, FRAME, IN, OUT, LONG_IN, LONG_OUT>
{
    fn default() -> Self {
        Self::new()
    }
}

/// Runs `act` on the shared value. Only one task holds the value at a time, so the borrow always
/// succeeds.
fn with<T, R>(shared: &Shared<T>, act: impl FnOnce(&mut T) -> R) -> Option<R> {
    shared.lock(|shared| shared.try_borrow_mut().ok().map(|mut shared| act(&mut shared)))
}

/// Returns a random time to wait before a frame is sent.
pub fn pause(rng: &mut Rng) -> Duration {
    let us = rng.uniform_int::<Full>(PAUSE_US.start, PAUSE_US.end);
    Duration::from_micros(us.into())
}
