//! The task that reads the inertial sensors and flies, 1,000 samples per second, and reads the barometer.

use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_time::{Duration, Instant, Timer, with_timeout};
use embedded_hal_async::delay::DelayNs;

use super::control::Controller;
use super::data_ready::DataReady;
use super::fault::{SampleFault, SensorRefusal};
use super::frozen::FrozenCheck;
use super::report::{Event, report};
use super::start::{Sensors, start};
use super::state::{self, AirSample, Counters, Sample};
use crate::bus::{Bus, BusError};

/// The time from power-on until the sensors are used, as in crazyflie-firmware.
const POWER_ON_MS: u32 = 1_000;
/// The time between two attempts to start the sensors.
const RETRY_MS: u32 = 500;
/// The longest time from the begin of the wait for a pulse to the end of the read, which takes
/// 1.7 ms with the barometer. After that the bus is reset.
const PATIENCE: Duration = Duration::from_millis(3);
/// The least time between two pulses of which the second is late: one and a half periods.
const LATE: Duration = Duration::from_micros(1_500);
/// The number of samples that may fail one after another before the sensors are started again.
const FAILED_MAX: u32 = 10;

/// The samples from one reading of the barometer to the next: it measures 50 times per second.
const AIR_SAMPLES: u32 = 20;

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
    mut bus: Bus,
    mut data_ready: DataReady,
    mut controller: Controller,
    pulse: Pulse,
) -> ! {
    let mut delay = BeatingDelay(pulse);
    let mut counters = Counters::default();
    let mut reported = None;
    let mut are_tested = false;
    delay.delay_ms(POWER_ON_MS).await;
    loop {
        match start(&mut bus, &mut delay, pulse, &mut are_tested).await {
            Ok(sensors) => {
                report(Event::Started);
                reported = None;
                let before = counters.samples;
                state::set_refusal(None);
                let flight = &mut controller;
                let fault =
                    sample(&mut bus, &sensors, &mut data_ready, flight, pulse, &mut counters).await;
                controller.stop();
                state::set_refusal(Some(SensorRefusal::Stopped(fault)));
                report(Event::Stopped(fault));
                // The chips may only have lost their configuration.
                if counters.samples != before {
                    continue;
                }
            }
            Err(fault) => {
                state::set_refusal(Some(SensorRefusal::Start(fault)));
                // The log has the same fault once.
                if reported != Some(fault) {
                    report(Event::NotStarted(fault));
                }
                reported = Some(fault);
            }
        }
        delay.delay_ms(RETRY_MS).await;
    }
}

/// Reads and publishes samples until too many fail, and returns the last fault.
async fn sample(
    bus: &mut Bus,
    sensors: &Sensors,
    data_ready: &mut DataReady,
    controller: &mut Controller,
    pulse: Pulse,
    counters: &mut Counters,
) -> SampleFault {
    data_ready.clear();
    let mut failed = 0;
    let mut previous: Option<Instant> = None;
    let mut resets = bus.resets();
    let mut frozen = FrozenCheck::NEW;
    let mut frozen_sensor = None;
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
            read(bus, sensors, pulses.last).await
        };
        let fault = match with_timeout(PATIENCE, read).await {
            Ok(Ok(sample)) => {
                let us = duration(sample.ready_at, Instant::now()).as_micros() as u32;
                counters.slowest_us = counters.slowest_us.max(us);
                counters.samples += 1;
                state::publish(sample);
                controller.step(&sample);
                frozen.add(&sample);
                // The bus was not free before this sample.
                (bus.resets() != resets).then_some(SampleFault::BusHeld)
            }
            Ok(Err(error)) => Some(SampleFault::Bus(error)),
            Err(_) if bus.is_in_doubt() => Some(SampleFault::BusSilent),
            Err(_) => Some(SampleFault::NoPulse),
        };
        match fault {
            None | Some(SampleFault::BusHeld) => {
                failed = 0;
                if counters.samples.is_multiple_of(AIR_SAMPLES) {
                    read_air(bus, sensors, &mut frozen).await;
                }
            }
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
        // A reset by the barometer does not count as one by these samples.
        resets = bus.resets();
        if frozen.sensor() != frozen_sensor {
            frozen_sensor = frozen.sensor();
            state::set_refusal(frozen_sensor.map(SensorRefusal::Frozen));
            report(frozen_sensor.map_or(Event::Thawed, Event::Frozen));
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
async fn read(bus: &mut Bus, sensors: &Sensors, ready_at: Instant) -> Result<Sample, BusError> {
    let rate_counts = sensors.gyroscope.read(bus).await?;
    let acceleration_counts = sensors.accelerometer.read(bus).await?;
    Ok(Sample {
        ready_at,
        rate_counts,
        acceleration_counts,
        rate: rate_counts.rad_per_s(),
        acceleration: acceleration_counts.m_per_s2(),
    })
}

/// Reads the barometer and publishes its sample. A reading that fails counts as one without a new
/// value; the next sample of the inertial sensors resets the bus.
async fn read_air(bus: &mut Bus, sensors: &Sensors, frozen: &mut FrozenCheck) {
    let Some(barometer) = sensors.barometer else { return frozen.add_barometer(None) };
    let sample = with_timeout(PATIENCE, barometer.read(bus)).await;
    let counts = sample.ok().and_then(Result::ok).map(|sample| sample.counts);
    frozen.add_barometer(counts);
    if let Some(counts) = counts {
        let air = barometer.air(counts);
        state::publish_air(AirSample { read_at: Instant::now(), air });
    }
}
