//! The last samples of the sensors, the reason why they are not fit for flight, and the counters of
//! their task.

use core::cell::Cell;
use core::sync::atomic::{AtomicU32, Ordering};

use bittybuzz_bmi088::{Acceleration, AccelerationCounts, Rate, RateCounts};
use bittybuzz_bmp3xx::Air;
use bittybuzz_runtime::pose::LatestPose;
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::Instant;

use super::fault::SensorRefusal;

/// The time in µs from a data-ready pulse to the compare registers within which nearly all samples, and
/// all samples, have to be used.
const USUAL_US: u32 = 700;
const LIMIT_US: u32 = 950;

/// A sample of both inertial sensors. The axes of the chip are those of the body: x ahead, y to the
/// left, z up (crazyflie-firmware, platform_defaults.h: the angles of the IMU are 0).
#[derive(Clone, Copy)]
pub struct Sample {
    /// The time of the gyroscope's data-ready pulse. The acceleration was read up to 0.43 ms later.
    pub ready_at: Instant,
    pub rate_counts: RateCounts,
    pub acceleration_counts: AccelerationCounts,
    pub rate: Rate,
    pub acceleration: Acceleration,
}

/// A sample of the barometer.
#[derive(Clone, Copy)]
pub struct AirSample {
    /// The time of the reading. The measurement is up to 20 ms older.
    pub read_at: Instant,
    pub air: Air,
}

/// The counters since the start.
#[derive(Clone, Copy, Default)]
pub struct Counters {
    /// Samples that were read.
    pub samples: u32,
    /// Data-ready pulses more than 1.5 ms after the one before.
    pub late: u32,
    /// Data-ready pulses that came before the last sample was read.
    pub missed: u32,
    /// Samples that could not be read.
    pub failed: u32,
    /// The longest time from a data-ready pulse to the end of the read, in µs.
    pub slowest_us: u32,
}

/// The times from data-ready pulses to the compare registers of the motors, in flight since the start.
#[derive(Clone, Copy, Default)]
pub struct Deadlines {
    /// The number of samples.
    pub samples: u32,
    pub fastest_us: u32,
    pub slowest_us: u32,
    /// Samples that took longer than [`USUAL_US`].
    pub unusual: u32,
    /// Samples that took longer than [`LIMIT_US`].
    pub late: u32,
}

impl Deadlines {
    /// Notes the time of a sample in µs.
    pub(super) fn note(&mut self, us: u32) {
        let is_first = self.samples == 0;
        self.fastest_us = if is_first { us } else { self.fastest_us.min(us) };
        self.slowest_us = self.slowest_us.max(us);
        self.samples = self.samples.wrapping_add(1);
        self.unusual += u32::from(us > USUAL_US);
        self.late += u32::from(us > LIMIT_US);
    }
}

/// The estimated place of the robot, while it is known.
pub static ESTIMATE: LatestPose = LatestPose::new();

static DEADLINES: Mutex<CriticalSectionRawMutex, Cell<Option<Deadlines>>> =
    Mutex::new(Cell::new(None));
static LAST: Mutex<CriticalSectionRawMutex, Cell<Option<Sample>>> = Mutex::new(Cell::new(None));
static LAST_AIR: Mutex<CriticalSectionRawMutex, Cell<Option<AirSample>>> =
    Mutex::new(Cell::new(None));
static REFUSAL: Mutex<CriticalSectionRawMutex, Cell<Option<SensorRefusal>>> =
    Mutex::new(Cell::new(Some(SensorRefusal::NotStarted)));
static COUNTERS: Mutex<CriticalSectionRawMutex, Cell<Counters>> =
    Mutex::new(Cell::new(Counters { samples: 0, late: 0, missed: 0, failed: 0, slowest_us: 0 }));
static WAKE_UPS: AtomicU32 = AtomicU32::new(0);

/// Returns the last sample, once there is one.
pub fn last_sample() -> Option<Sample> {
    LAST.lock(Cell::get)
}

/// Returns the last sample of the barometer, once there is one.
pub fn last_air() -> Option<AirSample> {
    LAST_AIR.lock(Cell::get)
}

/// Returns the reason why the sensors are not fit for flight; `None` if there is none.
pub fn refusal() -> Option<SensorRefusal> {
    REFUSAL.lock(Cell::get)
}

/// Returns the counters.
pub fn counters() -> Counters {
    COUNTERS.lock(Cell::get)
}

/// Returns the times from pulses to the motors, once the robot has flown.
pub fn deadlines() -> Option<Deadlines> {
    DEADLINES.lock(Cell::get)
}

pub(super) fn set_deadlines(deadlines: Deadlines) {
    DEADLINES.lock(|cell| cell.set(Some(deadlines)));
}

/// Returns the number of times that the flight executor ran.
pub fn wake_ups() -> u32 {
    WAKE_UPS.load(Ordering::Relaxed)
}

pub(super) fn count_wake_up() {
    WAKE_UPS.fetch_add(1, Ordering::Relaxed);
}

pub(super) fn publish(sample: Sample) {
    LAST.lock(|last| last.set(Some(sample)));
}

pub(super) fn publish_air(sample: AirSample) {
    LAST_AIR.lock(|last| last.set(Some(sample)));
}

pub(super) fn set_refusal(refusal: Option<SensorRefusal>) {
    REFUSAL.lock(|cell| cell.set(refusal));
}

pub(super) fn set_counters(counters: Counters) {
    COUNTERS.lock(|cell| cell.set(counters));
}
