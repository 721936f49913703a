//! The robot's pose, which two photodiodes under the projector determine.

use core::cell::RefCell;

use bittybuzz_motion::projector::{FRAME_US, PATTERN_US, READABLE_US};
use bittybuzz_motion::track::{TrackedPose, Tracker};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::{Duration, Instant, Timer};

use crate::edges::{self, Eye};

static TRACKER: Mutex<CriticalSectionRawMutex, RefCell<Tracker>> =
    Mutex::new(RefCell::new(Tracker::new()));

/// The time between two readings of the photodiodes while the robot does not know its position.
const SEARCH_PERIOD: Duration = Duration::from_millis(20);
const HALF: u16 = (PATTERN_US / 2) as u16;
const FRAME: Duration = Duration::from_micros(FRAME_US as u64);

/// Converts a time to the tracker's µs.
fn us(at: Instant) -> u32 {
    at.as_ticks() as u32
}

/// Runs `act` on the tracker. Only one task holds the tracker at a time, so the borrow always
/// succeeds.
fn with<R>(act: impl FnOnce(&mut Tracker) -> R) -> Option<R> {
    TRACKER.lock(|tracker| tracker.try_borrow_mut().ok().map(|mut tracker| act(&mut tracker)))
}

/// Returns the robot's pose at this moment, unless the robot is blind.
pub fn pose() -> Option<TrackedPose> {
    with(|tracker| tracker.pose(us(Instant::now())))?
}

/// Both photodiodes, and the time of their next reading.
pub struct Eyes {
    eyes: [Eye; 2],
    next: Instant,
}

impl Eyes {
    /// Starts to capture the edges of both photodiodes.
    pub fn open() -> Self {
        Eyes { eyes: edges::open(), next: Instant::MIN }
    }

    /// Waits until a frame can be read, or until an expected frame is overdue, and processes the
    /// edges. The future may be dropped while it waits; the next call continues.
    pub async fn look(&mut self) {
        Timer::at(self.next).await;
        let now = Instant::now();
        let [right, left] = &mut self.eyes;
        right.look();
        left.look();
        let Some(begun) = right.decoder.begun() else {
            // A lost frame does not shift the time of the next one.
            self.next += if pose().is_some() { FRAME } else { SEARCH_PERIOD };
            return;
        };
        let age = (us(now) as u16).wrapping_sub(begun);
        let start = now - Duration::from_ticks(age.into());
        self.next = start + Duration::from_micros(READABLE_US.into());
        if u32::from(age) < READABLE_US {
            return;
        }
        self.next += FRAME;
        // Both photodiodes must have decoded the same frame.
        let is_same = left.decoder.begun().is_some_and(|other| {
            u32::from(other.wrapping_sub(begun).wrapping_add(HALF)) < PATTERN_US
        });
        if let (Some(right), Some(left)) = (right.read(), left.read())
            && is_same
        {
            with(|tracker| tracker.see(us(start), right, left));
        }
    }
}
