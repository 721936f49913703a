//! The log of the flight tasks, which a task of the thread executor writes for them.

use bittybuzz_bmi088::Error;
use bittybuzz_board::log;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::channel::Channel;
use embassy_time::{Duration, with_timeout};

use super::state;
use crate::bus::BusError;

/// The time between two lines of counters.
const STATUS: Duration = Duration::from_secs(10);

/// The events that wait for the log. If there is no room, an event is dropped.
static EVENTS: Channel<CriticalSectionRawMutex, Event, 4> = Channel::new();

/// An event of the sensors.
#[derive(Clone, Copy)]
pub enum Event {
    /// Both sensors run.
    Started,
    /// A sensor does not start. The attempt is repeated.
    NotStarted(StartFault),
    /// A sample failed, or was late because of the bus.
    Faulty(Fault),
    /// Several samples failed, and the sensors are started again.
    Stopped(Fault),
}

/// An inertial sensor.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum Sensor {
    Gyroscope,
    Accelerometer,
}

/// A fault of a sample.
#[derive(Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum Fault {
    /// There was no data-ready pulse.
    NoPulse,
    /// A transaction did not end in time.
    BusSilent,
    /// A chip held a line of the bus, which was freed. The sample was read.
    BusHeld,
    /// A transaction failed.
    Bus(BusError),
}

/// A reason why a sensor does not start.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct StartFault {
    sensor: Sensor,
    cause: StartCause,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum StartCause {
    Bus(BusError),
    WrongId(u8),
    Refused { register: u8, found: u8 },
    Timeout,
}

impl StartFault {
    /// Returns the fault of a driver.
    pub fn new(sensor: Sensor, error: Error<BusError>) -> Self {
        let cause = match error {
            Error::Bus(error) => StartCause::Bus(error),
            Error::WrongId { found } => StartCause::WrongId(found),
            Error::ConfigurationRefused { register, found } => {
                StartCause::Refused { register, found }
            }
            // The start contains no self-test.
            Error::GyroscopeTestFailed | Error::AccelerometerTestFailed { .. } | Error::Timeout => {
                StartCause::Timeout
            }
        };
        StartFault { sensor, cause }
    }

    /// Returns the fault of a sensor that does not start in time.
    pub fn timeout(sensor: Sensor) -> Self {
        StartFault { sensor, cause: StartCause::Timeout }
    }
}

/// Queues an event for the log.
pub fn report(event: Event) {
    // The counters also count faults whose line finds no room.
    let _ = EVENTS.try_send(event);
}

/// Runs the task that writes the events, and the counters from time to time.
#[embassy_executor::task]
pub async fn write_reports() -> ! {
    loop {
        match with_timeout(STATUS, EVENTS.receive()).await {
            Ok(event) => write(event),
            Err(_) => write_status(),
        }
    }
}

fn write(event: Event) {
    match event {
        Event::Started => log::info!("gyroscope and accelerometer run"),
        Event::NotStarted(StartFault { sensor, cause }) => match cause {
            StartCause::Bus(error) => log::error!("{} does not answer: {}", sensor, error),
            StartCause::WrongId(id) => {
                log::error!("{} is another chip, with id {=u8:#x}", sensor, id)
            }
            StartCause::Refused { register, found } => log::error!(
                "{} does not take its settings: register {=u8:#x} holds {=u8:#x}",
                sensor,
                register,
                found
            ),
            StartCause::Timeout => log::error!("{} does not start", sensor),
        },
        Event::Faulty(fault) => log::warning!("a sample of the sensors was disturbed: {}", fault),
        Event::Stopped(fault) => log::error!("the sensors are started again after {}", fault),
    }
}

fn write_status() {
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
}
