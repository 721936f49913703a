//! Where the robot is, by two photodiodes under the projector.

use core::cell::RefCell;

use bittybuzz_motion::projector::{Decoder, READABLE_US};
use bittybuzz_motion::track::{Pose, Tracker};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Duration, Instant, Timer, with_timeout};

/// A photodiode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// Photodiode 1.
    Right,
    /// Photodiode 2.
    Left,
}

type Shared<T> = Mutex<CriticalSectionRawMutex, RefCell<T>>;

static RIGHT: Shared<Decoder> = Mutex::new(RefCell::new(Decoder::new()));
static LEFT: Shared<Decoder> = Mutex::new(RefCell::new(Decoder::new()));
static TRACKER: Shared<Tracker> = Mutex::new(RefCell::new(Tracker::new()));

/// A frame has begun.
static FRAME: Signal<CriticalSectionRawMutex, Instant> = Signal::new();
/// There is a new position.
static SEEN: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// Times as the decoders take them.
fn us(at: Instant) -> u32 {
    at.as_ticks() as u32
}

/// The interrupt of a photodiode.
pub fn edge(side: Side, at: Instant, is_lit: bool) {
    let decoder = if side == Side::Right { &RIGHT } else { &LEFT };
    if with(decoder, |decoder| decoder.edge(us(at), is_lit)) == Some(true) {
        FRAME.signal(at);
    }
}

/// Nobody holds it twice: the borrow always succeeds.
fn with<T, R>(shared: &Shared<T>, act: impl FnOnce(&mut T) -> R) -> Option<R> {
    shared.lock(|shared| shared.try_borrow_mut().ok().map(|mut shared| act(&mut shared)))
}

/// Where the robot is now, unless it is blind.
pub fn pose() -> Option<Pose> {
    with(&TRACKER, |tracker| tracker.pose(us(Instant::now())))?
}

/// Waits for the next position.
pub async fn new_pose() {
    SEEN.wait().await;
}

/// The task: reads each frame as soon as both coordinates have been shown.
#[embassy_executor::task]
pub async fn look(pulse: Pulse) -> ! {
    loop {
        pulse.beat();
        let Ok(start) = with_timeout(BEAT, FRAME.wait()).await else {
            // Asked in time, it notices that the robot is blind.
            let _ = pose();
            continue;
        };
        Timer::at(start + Duration::from_micros(READABLE_US.into())).await;
        // The other photodiode has told the same frame.
        FRAME.reset();
        let [right, left] =
            [&RIGHT, &LEFT].map(|decoder| with(decoder, |decoder| decoder.pixel(us(start))));
        if let (Some(Some(right)), Some(Some(left))) = (right, left) {
            with(&TRACKER, |tracker| tracker.see(us(start), right, left));
            SEEN.signal(());
        }
    }
}
