//! The task that reads the inertial sensors and flies: 1,000 samples per second.

use bittybuzz_bmi088::{Accelerometer, Address, DataReady as DataReadyPin, Gyroscope};
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_time::{Duration, Instant, Timer, with_timeout};
use embedded_hal_async::delay::DelayNs;

use super::control::Controller;
use super::data_ready::DataReady;
use super::report::{Event, Fault, Sensor, StartFault, report};
use super::state::{self, Counters, Sample};
use crate::bus::{BusError, I2c3};

/// The time from power-on until the sensors are used, as in crazyflie-firmware.
const POWER_ON_MS: u32 = 1_000;
/// The longest start of one sensor. That of the gyroscope takes 85 ms.
const START: Duration = Duration::from_millis(200);
/// The time between two attempts to start the sensors.
const RETRY_MS: u32 = 500;
/// The longest time from the begin of the wait for a pulse to the end of the read, which takes
/// 1.5 ms. After that the bus is reset.
const PATIENCE: Duration = Duration::from_millis(3);
/// The least time between two pulses of which the second is late: one and a half periods.
const LATE: Duration = Duration::from_micros(1_500);
/// The number of samples that may fail one after another before the sensors are started again.
const FAILED_MAX: u32 = 10;

/// The inertial sensors after their start.
struct Imu {
    gyroscope: Gyroscope,
    accelerometer: Accelerometer,
}

/// A delay that shows the task's signs of life meanwhile.
struct BeatingDelay(Pulse);

impl DelayNs for BeatingDelay {
    async fn delay_ns(&mut self, ns: u32) {
        let end = Instant::now() + Duration::from_nanos(ns.into());
        loop {
            self.0.beat();
            let next = Instant::now() + BEAT;
            Timer::at(next.min(end)).await;
            if next >= end {
                return self.0.beat();
            }
        }
    }
}

/// Runs the task: starts the sensors, and reads them until they fail.
#[embassy_executor::task]
pub async fn read_sensors(
    mut bus: I2c3,
    mut data_ready: DataReady,
    mut controller: Controller,
    pulse: Pulse,
) -> ! {
    let mut delay = BeatingDelay(pulse);
    let mut counters = Counters::default();
    let mut reported = None;
    delay.delay_ms(POWER_ON_MS).await;
    loop {
        match start(&mut bus, &mut delay).await {
            Ok(imu) => {
                report(Event::Started);
                reported = None;
                let before = counters.samples;
                let flight = &mut controller;
                let fault =
                    sample(&mut bus, &imu, &mut data_ready, flight, pulse, &mut counters).await;
                controller.stop();
                report(Event::Stopped(fault));
                // The chips may only have lost their configuration.
                if counters.samples != before {
                    continue;
                }
            }
            // The log has the same fault once.
            Err(fault) if reported == Some(fault) => {}
            Err(fault) => {
                report(Event::NotStarted(fault));
                reported = Some(fault);
            }
        }
        delay.delay_ms(RETRY_MS).await;
    }
}

/// Starts both sensors.
async fn start(bus: &mut I2c3, delay: &mut BeatingDelay) -> Result<Imu, StartFault> {
    let gyroscope = Gyroscope::start(bus, delay, Address::SdoHigh, DataReadyPin::Int3);
    let gyroscope = match with_timeout(START, gyroscope).await {
        Ok(started) => started.map_err(|error| StartFault::new(Sensor::Gyroscope, error))?,
        Err(_) => return Err(StartFault::timeout(Sensor::Gyroscope)),
    };
    let accelerometer = Accelerometer::start(bus, delay, Address::SdoLow);
    let accelerometer = match with_timeout(START, accelerometer).await {
        Ok(started) => started.map_err(|error| StartFault::new(Sensor::Accelerometer, error))?,
        Err(_) => return Err(StartFault::timeout(Sensor::Accelerometer)),
    };
    Ok(Imu { gyroscope, accelerometer })
}

/// Reads and publishes samples until too many fail, and returns the last fault.
async fn sample(
    bus: &mut I2c3,
    imu: &Imu,
    data_ready: &mut DataReady,
    controller: &mut Controller,
    pulse: Pulse,
    counters: &mut Counters,
) -> Fault {
    data_ready.clear();
    let mut failed = 0;
    let mut previous: Option<Instant> = None;
    let mut resets = bus.resets();
    loop {
        pulse.beat();
        let read = async {
            let pulses = data_ready.wait().await;
            counters.missed += pulses.count - 1;
            let since = previous.map(|previous| duration(previous, pulses.last));
            if since.is_some_and(|since| since > LATE) {
                counters.late += 1;
            }
            previous = Some(pulses.last);
            read(bus, imu, pulses.last).await
        };
        let fault = match with_timeout(PATIENCE, read).await {
            Ok(Ok(sample)) => {
                let us = duration(sample.ready_at, Instant::now()).as_micros() as u32;
                counters.slowest_us = counters.slowest_us.max(us);
                counters.samples += 1;
                state::publish(sample);
                controller.step(&sample);
                // The bus was not free before this sample.
                (bus.resets() != resets).then_some(Fault::BusHeld)
            }
            Ok(Err(error)) => Some(Fault::Bus(error)),
            Err(_) if bus.is_in_doubt() => Some(Fault::BusSilent),
            Err(_) => Some(Fault::NoPulse),
        };
        resets = bus.resets();
        match fault {
            None | Some(Fault::BusHeld) => failed = 0,
            Some(fault) => {
                controller.miss();
                counters.failed += 1;
                failed += 1;
                if failed == FAILED_MAX {
                    state::set_counters(*counters);
                    return fault;
                }
            }
        }
        // The log has the first fault of several.
        if let Some(fault) = fault
            && failed <= 1
        {
            report(Event::Faulty(fault));
        }
        state::set_counters(*counters);
    }
}

/// Returns the time between two moments. The clock goes back if a debugger has halted the core, since
/// its timer then overflows without an interrupt. The duration is zero in that case.
fn duration(from: Instant, to: Instant) -> Duration {
    to.saturating_duration_since(from)
}

/// Reads both sensors: the gyroscope first, because its data are older.
async fn read(bus: &mut I2c3, imu: &Imu, ready_at: Instant) -> Result<Sample, BusError> {
    let rate_counts = imu.gyroscope.read(bus).await?;
    let acceleration_counts = imu.accelerometer.read(bus).await?;
    Ok(Sample {
        ready_at,
        rate_counts,
        acceleration_counts,
        rate: rate_counts.rad_per_s(),
        acceleration: acceleration_counts.m_per_s2(),
    })
}
