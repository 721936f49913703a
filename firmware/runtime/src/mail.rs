//! Swarm messages between the script and the link. Frames that were heard wait for the script's next step, frames of the
//! script wait for the radio; what there is no room for is dropped and counted.

use core::cell::RefCell;

use bittybuzz_vm_core::Sighting;
use bittybuzz_vm_core::number::{Full, Profile, Rng};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Timer, with_timeout};
use heapless::{Deque, Vec};

use crate::liveness::{BEAT, Pulse};

/// Before each frame, µs: 10 ms on average, and seldom the same as another robot's. Without carrier sense nobody hears what
/// two robots send at once, and robots that were switched on together also step together.
const PAUSE_US: core::ops::Range<u32> = 2_000..18_000;

/// A frame of at most `FRAME` bytes.
pub type Frame<const FRAME: usize> = Vec<u8, FRAME>;

type Shared<T> = Mutex<CriticalSectionRawMutex, RefCell<T>>;

/// Room for `IN` frames that were heard and `OUT` that are to be sent, of at most `FRAME` bytes each.
pub struct Mail<P: Profile, const IN: usize, const OUT: usize, const FRAME: usize> {
    boxes: Shared<Boxes<P, IN, OUT, FRAME>>,
    waiting: Signal<CriticalSectionRawMutex, ()>,
}

struct Boxes<P: Profile, const IN: usize, const OUT: usize, const FRAME: usize> {
    heard: Deque<(Frame<FRAME>, Sighting<P>), IN>,
    unsent: Deque<Frame<FRAME>, OUT>,
    dropped: Dropped,
}

/// Frames for which there was no room.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// Heard, and dropped before the script could read them.
    pub heard: u32,
    /// Dropped before the radio could send them.
    pub unsent: u32,
}

impl<P: Profile, const IN: usize, const OUT: usize, const FRAME: usize> Mail<P, IN, OUT, FRAME> {
    /// Nothing waits.
    pub const fn new() -> Self {
        let dropped = Dropped { heard: 0, unsent: 0 };
        let boxes = Boxes { heard: Deque::new(), unsent: Deque::new(), dropped };
        Mail { boxes: Mutex::new(RefCell::new(boxes)), waiting: Signal::new() }
    }

    fn with<T>(&self, act: impl FnOnce(&mut Boxes<P, IN, OUT, FRAME>) -> T) -> Option<T> {
        // Nobody holds it twice: the borrow succeeds.
        self.boxes.lock(|boxes| boxes.try_borrow_mut().ok().map(|mut boxes| act(&mut boxes)))
    }

    /// The link has heard a frame.
    pub fn hear(&self, frame: &[u8], sighting: Sighting<P>) {
        let Ok(frame) = Frame::from_slice(frame) else { return };
        self.with(|boxes| {
            if boxes.heard.is_full() {
                boxes.heard.pop_front();
                boxes.dropped.heard += 1;
            }
            let _ = boxes.heard.push_back((frame, sighting));
        });
    }

    /// The oldest frame that was heard, as `bittybuzz_vm_core::Host::receive` says.
    pub fn receive(&self, frame: &mut [u8]) -> Option<(usize, Sighting<P>)> {
        let (heard, sighting) = self.with(|boxes| boxes.heard.pop_front()).flatten()?;
        frame.iter_mut().zip(&heard).for_each(|(to, from)| *to = *from);
        Some((heard.len().min(frame.len()), sighting))
    }

    /// The script sends a frame.
    pub fn send(&self, frame: &[u8]) {
        let Ok(frame) = Frame::from_slice(frame) else { return };
        self.with(|boxes| {
            if boxes.unsent.is_full() {
                boxes.unsent.pop_front();
                boxes.dropped.unsent += 1;
            }
            let _ = boxes.unsent.push_back(frame);
        });
        self.waiting.signal(());
    }

    fn next_unsent(&self) -> Option<Frame<FRAME>> {
        self.with(|boxes| boxes.unsent.pop_front()).flatten()
    }

    /// What was dropped since the start.
    pub fn dropped(&self) -> Dropped {
        self.with(|boxes| boxes.dropped).unwrap_or_default()
    }

    /// The sending task: gives one frame after the other to `transmit`, with random pauses between. Robots are given
    /// unlike generators.
    pub async fn drain(&self, mut rng: Rng, pulse: Pulse, mut transmit: impl FnMut(&[u8])) -> ! {
        loop {
            pulse.beat();
            if with_timeout(BEAT, self.waiting.wait()).await.is_err() {
                continue;
            }
            loop {
                pulse.beat();
                Timer::after(pause(&mut rng)).await;
                let Some(frame) = self.next_unsent() else { break };
                transmit(&frame);
            }
        }
    }
}

impl<P: Profile, const IN: usize, const OUT: usize, const FRAME: usize> Default
    for Mail<P, IN, OUT, FRAME>
{
    fn default() -> Self {
        Self::new()
    }
}

fn pause(rng: &mut Rng) -> Duration {
    let us = rng.uniform_int::<Full>(PAUSE_US.start, PAUSE_US.end);
    Duration::from_micros(us.into())
}
