//! The gyroscope: ±2000 °/s, 1,000 samples per second.

use core::f32::consts::PI;

use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::i2c::I2c;

use crate::register::{self, SOFT_RESET, axes, check_id};
use crate::{Address, Error};

// Registers (data sheet, 5.5).
const RATE_X_LSB: u8 = 0x02;
const RANGE: u8 = 0x0f;
const BANDWIDTH: u8 = 0x10;
const LPM1: u8 = 0x11;
const SOFTRESET: u8 = 0x14;
const INT_CTRL: u8 = 0x15;
const INT3_INT4_IO_CONF: u8 = 0x16;
const INT3_INT4_IO_MAP: u8 = 0x18;
const SELF_TEST: u8 = 0x3c;

/// The identity of the gyroscope.
const ID: u8 = 0x0f;

/// ±2000 °/s.
const RANGE_2000: u8 = 0x00;
/// 1,000 samples per second, bandwidth 116 Hz. Bit 7 of this register always reads as 1.
const ODR_1000_BANDWIDTH_116: u8 = 0x02;
const BANDWIDTH_BITS: u8 = 0x0f;
const POWER_NORMAL: u8 = 0x00;
const DATA_READY_ON: u8 = 0x80;

/// Bits of [`SELF_TEST`]. Sources do not agree on the bit that reports the health of the sensor
/// without a test (3 in Bosch's API, 4 in the data sheet), and a user of Bosch's forum saw it set
/// on a broken chip whose test failed. Therefore it is not used.
const TEST_START: u8 = 1 << 0;
const TEST_READY: u8 = 1 << 1;
const TEST_FAILED: u8 = 1 << 2;

/// The time after a reset before the gyroscope answers, as in Bosch's API.
const RESET_MS: u32 = 30;
/// The time after the configuration before samples are valid, as in crazyflie-firmware.
const SETTLE_MS: u32 = 50;
/// The longest self-test, in milliseconds. Bosch's API waits without a limit.
const TEST_MS: u32 = 100;

/// 32,768 counts are 2000 °/s, that is 16.384 counts per °/s (data sheet, 5.5.2).
const RAD_PER_S_PER_COUNT: f32 = 2000.0 / 32768.0 * PI / 180.0;

/// The pin that goes high, push-pull, when a sample is ready.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DataReady {
    /// No pin: the caller polls.
    Off,
    Int3,
    Int4,
}

impl DataReady {
    /// Returns the bits of the pin in [`INT3_INT4_IO_CONF`]: the level, and the open drain.
    fn level_and_drain(self) -> (u8, u8) {
        match self {
            DataReady::Off => (0, 0),
            DataReady::Int3 => (1 << 0, 1 << 1),
            DataReady::Int4 => (1 << 2, 1 << 3),
        }
    }

    /// Returns the bit of the pin in [`INT3_INT4_IO_MAP`].
    fn map(self) -> u8 {
        match self {
            DataReady::Off => 0,
            DataReady::Int3 => 1 << 0,
            DataReady::Int4 => 1 << 7,
        }
    }
}

/// Angular rates about x, y and z in counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RateCounts(pub [i16; 3]);

/// Angular rates about x, y and z in radians per second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    pub rad_per_s: [f32; 3],
}

impl RateCounts {
    /// Converts counts: 32,768 are 2000 °/s.
    pub fn rad_per_s(self) -> Rate {
        Rate { rad_per_s: self.0.map(|counts| f32::from(counts) * RAD_PER_S_PER_COUNT) }
    }
}

/// A gyroscope that is configured and runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gyroscope {
    address: u8,
}

impl Gyroscope {
    /// Resets, checks and configures the gyroscope. This takes 80 ms.
    ///
    /// # Errors
    /// Returns the reason why the chip cannot be used. Another call starts from the beginning.
    pub async fn start<B: I2c>(
        bus: &mut B,
        delay: &mut impl DelayNs,
        address: Address,
        data_ready: DataReady,
    ) -> Result<Gyroscope, Error<B::Error>> {
        let address = number(address);
        check_id(bus, address, ID).await?;
        reset(bus, delay, address).await?;
        let (level, drain) = data_ready.level_and_drain();
        let [pins] = register::read(bus, address, INT3_INT4_IO_CONF).await?;
        let pins = (pins | level) & !drain;
        let control = if data_ready == DataReady::Off { 0 } else { DATA_READY_ON };
        let configuration = [
            (RANGE, RANGE_2000, 0xff),
            (BANDWIDTH, ODR_1000_BANDWIDTH_116, BANDWIDTH_BITS),
            (LPM1, POWER_NORMAL, 0xff),
            (INT_CTRL, control, 0xff),
            (INT3_INT4_IO_CONF, pins, 0xff),
            (INT3_INT4_IO_MAP, data_ready.map(), 0xff),
        ];
        for (register, value, _) in configuration {
            register::write(bus, address, register, value).await?;
        }
        for (register, value, mask) in configuration {
            register::check(bus, address, register, value, mask).await?;
        }
        delay.delay_ms(SETTLE_MS).await;
        Ok(Gyroscope { address })
    }

    /// Runs the self-test of the gyroscope, which must stand still. The chip is reset before and
    /// after it, so [`start`](Self::start) must follow.
    ///
    /// # Errors
    /// Returns [`Error::GyroscopeTestFailed`] if the chip reports a failure, and
    /// [`Error::Timeout`] if it reports nothing within 100 ms.
    pub async fn self_test<B: I2c>(
        bus: &mut B,
        delay: &mut impl DelayNs,
        address: Address,
    ) -> Result<(), Error<B::Error>> {
        let address = number(address);
        check_id(bus, address, ID).await?;
        reset(bus, delay, address).await?;
        register::write(bus, address, SELF_TEST, TEST_START).await?;
        for _ in 0..TEST_MS {
            delay.delay_ms(1).await;
            let [state] = register::read(bus, address, SELF_TEST).await?;
            if state & TEST_READY != 0 {
                reset(bus, delay, address).await?;
                let has_failed = state & TEST_FAILED != 0;
                return if has_failed { Err(Error::GyroscopeTestFailed) } else { Ok(()) };
            }
        }
        Err(Error::Timeout)
    }

    /// Reads a sample in one transaction of six bytes.
    ///
    /// # Errors
    /// Returns the error of the bus.
    pub async fn read<B: I2c>(&self, bus: &mut B) -> Result<RateCounts, B::Error> {
        Ok(RateCounts(axes(register::read(bus, self.address, RATE_X_LSB).await?)))
    }
}

fn number(address: Address) -> u8 {
    match address {
        Address::SdoLow => 0x68,
        Address::SdoHigh => 0x69,
    }
}

async fn reset<B: I2c>(bus: &mut B, delay: &mut impl DelayNs, address: u8) -> Result<(), B::Error> {
    register::write(bus, address, SOFTRESET, SOFT_RESET).await?;
    delay.delay_ms(RESET_MS).await;
    Ok(())
}
