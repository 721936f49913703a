//! The start of the sensors: first their self-tests, then their configuration.
//!
//! A self-test needs a robot that stands still, and takes time. The sensors pass theirs once after
//! power-on; a start after a fault of the bus leaves them out, since the robot may be in the air.

use core::pin::pin;

use bittybuzz_bmi088::{Accelerometer, Address, DataReady, Gyroscope};
use bittybuzz_bmp3xx as bmp3xx;
use bittybuzz_bmp3xx::Barometer;
use bittybuzz_runtime::liveness::{BEAT, Pulse};
use embassy_time::with_timeout;
use embedded_hal_async::delay::DelayNs;

use super::fault::{Sensor, StartCause, StartFault};
use crate::bus::{Bus, BusError};

/// The longest start of one sensor with its self-test, in signs of life: 0.3 s. That of the
/// accelerometer takes 160 ms.
const LIMIT_BEATS: u32 = 6;

/// The sensors after their start.
pub struct Sensors {
    pub gyroscope: Gyroscope,
    pub accelerometer: Accelerometer,
    /// `None` if it did not start again after a fault: the robot may be in the air, and needs the
    /// other sensors.
    pub barometer: Option<Barometer>,
}

/// Starts all sensors.
///
/// # Parameters
/// `are_tested`: true if the sensors have passed their self-tests; this function sets it.
pub async fn start(
    bus: &mut Bus,
    delay: &mut impl DelayNs,
    pulse: Pulse,
    are_tested: &mut bool,
) -> Result<Sensors, StartFault> {
    let gyroscope = async {
        if !*are_tested {
            Gyroscope::self_test(bus, delay, Address::SdoHigh).await?;
        }
        Gyroscope::start(bus, delay, Address::SdoHigh, DataReady::Int3).await
    };
    let gyroscope = limit(Sensor::Gyroscope, pulse, gyroscope).await?;
    let accelerometer = async {
        if !*are_tested {
            Accelerometer::self_test(bus, delay, Address::SdoLow).await?;
        }
        Accelerometer::start(bus, delay, Address::SdoLow).await
    };
    let accelerometer = limit(Sensor::Accelerometer, pulse, accelerometer).await?;
    let barometer = async {
        let barometer = Barometer::start(bus, delay, bmp3xx::Address::SdoHigh).await?;
        if !*are_tested {
            barometer.self_test(bus, delay).await?;
        }
        Ok::<_, bmp3xx::Error<BusError>>(barometer)
    };
    let barometer = match limit(Sensor::Barometer, pulse, barometer).await {
        Err(fault) if !*are_tested => return Err(fault),
        barometer => barometer.ok(),
    };
    *are_tested = true;
    Ok(Sensors { gyroscope, accelerometer, barometer })
}

/// Waits for the start of a sensor, but not for ever, and shows the task's signs of life meanwhile.
async fn limit<T, E: Into<StartCause>>(
    sensor: Sensor,
    pulse: Pulse,
    start: impl Future<Output = Result<T, E>>,
) -> Result<T, StartFault> {
    let mut start = pin!(start);
    for _ in 0..LIMIT_BEATS {
        pulse.beat();
        if let Ok(started) = with_timeout(BEAT, start.as_mut()).await {
            return started.map_err(|error| StartFault { sensor, cause: error.into() });
        }
    }
    Err(StartFault { sensor, cause: StartCause::Timeout })
}
