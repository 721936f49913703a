//! Where the robot is, by two photodiodes under the projector.

use core::cell::Cell;

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

type Shared<T> = Mutex<CriticalSectionRawMutex, Cell<T>>;

static RIGHT: Shared<Decoder> = Mutex::new(Cell::new(Decoder::new()));
static LEFT: Shared<Decoder> = Mutex::new(Cell::new(Decoder::new()));
static TRACKER: Shared<Tracker> = Mutex::new(Cell::new(Tracker::new()));

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
    let begins = update(decoder, |decoder| decoder.edge(us(at), is_lit));
    if begins {
        FRAME.signal(at);
    }
}

fn update<T: Copy, R>(shared: &Shared<T>, act: impl FnOnce(&mut T) -> R) -> R {
    shared.lock(|cell| {
        let mut value = cell.get();
        let result = act(&mut value);
        cell.set(value);
        result
    })
}

/// Where the robot is now, unless it is blind.
pub fn pose() -> Option<Pose> {
    update(&TRACKER, |tracker| tracker.pose(us(Instant::now())))
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
        let [right, left] = [&RIGHT, &LEFT].map(|decoder| decoder.lock(Cell::get).pixel(us(start)));
        if let (Some(right), Some(left)) = (right, left) {
            update(&TRACKER, |tracker| tracker.see(us(start), right, left));
            SEEN.signal(());
        }
    }
}
