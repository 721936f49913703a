//! The log of the flight tasks, which a task of the thread executor writes for them.

use bittybuzz_board::log;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, Instant, with_deadline};

use super::fault::{SampleFault, Sensor, StartFault};
use super::state;
use crate::decks::flow;
use crate::readiness;

/// The time between two lines of counters, and that without an event after which the first one comes
/// earlier.
const STATUS: Duration = Duration::from_secs(10);
const FIRST_STATUS: Duration = Duration::from_secs(2);

/// The events that wait for the log. If there is no room, an event is dropped.
static EVENTS: Channel<CriticalSectionRawMutex, Event, 4> = Channel::new();

/// An event of the sensors.
#[derive(Clone, Copy)]
pub enum Event {
    /// All sensors run.
    Started,
    /// A sensor does not start. The attempt is repeated.
    NotStarted(StartFault),
    /// A sample failed, or was late because of the bus.
    Faulty(SampleFault),
    /// Several samples failed, and the sensors are started again.
    Stopped(SampleFault),
    /// A sensor repeats its values.
    Frozen(Sensor),
    /// No sensor repeats its values any more.
    Thawed,
}

/// Queues an event for the log.
pub fn report(event: Event) {
    // The counters also count faults whose line finds no room.
    let _ = EVENTS.try_send(event);
}

/// Runs the task that writes the events, and the counters from time to time.
#[embassy_executor::task]
pub async fn write_reports() -> ! {
    let mut patience = FIRST_STATUS;
    let mut due = Instant::now() + STATUS;
    loop {
        let until = due.min(Instant::now() + patience);
        match with_deadline(until, EVENTS.receive()).await {
            Ok(event) => write(event),
            Err(_) => {
                write_status();
                patience = STATUS;
                due = Instant::now() + STATUS;
            }
        }
    }
}

fn write(event: Event) {
    match event {
        Event::Started => log::info!("gyroscope, accelerometer and barometer run"),
        Event::NotStarted(fault) => log::error!("{}", fault),
        Event::Faulty(fault) => log::warning!("a sample of the sensors was disturbed: {}", fault),
        Event::Stopped(fault) => log::error!("the sensors are started again after {}", fault),
        Event::Frozen(sensor) => log::error!("{} repeats its values", sensor),
        Event::Thawed => log::info!("the values of the sensors change again"),
    }
}

fn write_status() {
    if let Some(refusal) = readiness::refusal() {
        log::warning!("the robot does not arm: {}", refusal);
    }
    let counters = state::counters();
    log::info!(
        "{=u32} samples, {=u32} late, {=u32} missed, {=u32} failed, slowest {=u32} us, {=u32} wake-ups",
        counters.samples,
        counters.late,
        counters.missed,
        counters.failed,
        counters.slowest_us,
        state::wake_ups()
    );
    if let Some(deadlines) = state::deadlines() {
        log::info!(
            "{=u32} samples flown in {=u32} to {=u32} us, {=u32} over 700 us, {=u32} over 950 us",
            deadlines.samples,
            deadlines.fastest_us,
            deadlines.slowest_us,
            deadlines.unusual,
            deadlines.late
        );
    }
    if let Some(sample) = state::last_sample() {
        let [p, q, r] = sample.rate.rad_per_s;
        let [x, y, z] = sample.acceleration.m_per_s2;
        log::info!(
            "turns at {=f32} {=f32} {=f32} rad/s, accelerates by {=f32} {=f32} {=f32} m/s2",
            p,
            q,
            r,
            x,
            y,
            z
        );
        let [p, q, r] = sample.rate_counts.0;
        let [x, y, z] = sample.acceleration_counts.0;
        log::info!("counts {=i16} {=i16} {=i16} and {=i16} {=i16} {=i16}", p, q, r, x, y, z);
    }
    if let Some(sample) = flow::last_sample() {
        let counts = sample.counts;
        log::info!(
            "flow of {=i16} and {=i16} counts in {=u64} us until {=u64} us, quality {=u8}",
            counts.delta_x,
            counts.delta_y,
            sample.duration.as_micros(),
            sample.read_at.as_micros(),
            counts.surface_quality
        );
    }
    if let Some(sample) = state::last_air() {
        let read_us = sample.read_at.as_micros();
        log::info!("pressure {=f32} Pa at {=u64} us", sample.air.pressure_pa, read_us);
    }
}
