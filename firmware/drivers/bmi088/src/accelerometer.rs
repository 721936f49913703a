//! The accelerometer: ±24 g, 1,600 samples per second.

use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::i2c::I2c;

use crate::register::{self, SOFT_RESET, axes, check_id};
use crate::{Address, Axis, Error};

// Registers (data sheet, 5.3).
const ACC_ERR_REG: u8 = 0x02;
const ACC_X_LSB: u8 = 0x12;
const ACC_CONF: u8 = 0x40;
const ACC_RANGE: u8 = 0x41;
const ACC_SELF_TEST: u8 = 0x6d;
const ACC_PWR_CONF: u8 = 0x7c;
const ACC_PWR_CTRL: u8 = 0x7d;
const ACC_SOFTRESET: u8 = 0x7e;

/// The identity of the accelerometer of a BMI088; a BMI085 has another one.
const ID: u8 = 0x1e;

const POWER_ACTIVE: u8 = 0x00;
const POWER_ON: u8 = 0x04;
/// 1,600 samples per second with fourfold oversampling, which is a bandwidth of 145 Hz.
const ODR_1600_OSR4: u8 = 0x8c;
/// 1,600 samples per second without oversampling, for the self-test. The data sheet (4.6.1) adds
/// this value up from its bits, and also has 0xA7, which would be 50 samples per second.
const ODR_1600_NORMAL: u8 = 0xac;
/// ±24 g.
const RANGE_24: u8 = 0x03;

/// The bits of ACC_ERR_REG for a fatal error and for an error of the configuration (data sheet,
/// 5.3.2).
const ERRORS: u8 = 0b1_1101;

const TEST_POSITIVE: u8 = 0x0d;
const TEST_NEGATIVE: u8 = 0x09;
const TEST_OFF: u8 = 0x00;

/// The time after a reset before the accelerometer answers, as in Bosch's API and in Linux.
const RESET_MS: u32 = 1;
/// The time after the power is on before the next access, as in crazyflie-firmware and in Linux.
const POWER_MS: u32 = 5;
/// The time after the accelerometer is active before it is configured, as in crazyflie-firmware.
const ACTIVE_MS: u32 = 10;
/// The times of the self-test: after its configuration, which is more than 2 ms, and with each
/// force, which is more than 50 ms (data sheet, 4.6.1).
const TEST_SETTLE_MS: u32 = 3;
const TEST_FORCE_MS: u32 = 60;

/// The least difference between the two forces of the self-test (data sheet, 4.6.1): 1 g for x and
/// y, 0.5 g for z, rounded up to counts of ±24 g.
const TEST_LEAST_COUNTS: [(Axis, i32); 3] = [(Axis::X, 1366), (Axis::Y, 1366), (Axis::Z, 683)];

/// The standard acceleration of free fall, which defines the unit g.
pub const STANDARD_GRAVITY_M_PER_S2: f32 = 9.80665;

/// 32,768 counts are 24 g, that is 1,365.33 counts per g. Bosch's API has 1,365.
const M_PER_S2_PER_COUNT: f32 = 24.0 * STANDARD_GRAVITY_M_PER_S2 / 32768.0;

/// Accelerations along x, y and z in counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AccelerationCounts(pub [i16; 3]);

/// Accelerations along x, y and z in meters per second squared. A chip at rest measures the
/// acceleration that holds it against gravity: 9.8 upwards.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Acceleration {
    pub m_per_s2: [f32; 3],
}

impl AccelerationCounts {
    /// Converts counts: 32,768 are 24 g.
    pub fn m_per_s2(self) -> Acceleration {
        Acceleration { m_per_s2: self.0.map(|counts| f32::from(counts) * M_PER_S2_PER_COUNT) }
    }
}

/// An accelerometer that is configured and runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Accelerometer {
    address: u8,
}

impl Accelerometer {
    /// Resets, checks and configures the accelerometer. This takes 16 ms.
    ///
    /// # Errors
    /// Returns the reason why the chip cannot be used. Another call starts from the beginning.
    pub async fn start<B: I2c>(
        bus: &mut B,
        delay: &mut impl DelayNs,
        address: Address,
    ) -> Result<Accelerometer, Error<B::Error>> {
        let address = number(address);
        power_up(bus, delay, address, ODR_1600_OSR4).await?;
        Ok(Accelerometer { address })
    }

    /// Runs the self-test of the accelerometer, which must stand still: an electrostatic force
    /// deflects it in both directions. The chip is reset before and after it, so
    /// [`start`](Self::start) must follow. This takes 140 ms.
    ///
    /// # Errors
    /// Returns [`Error::AccelerometerTestFailed`] with the first axis that is deflected too little.
    pub async fn self_test<B: I2c>(
        bus: &mut B,
        delay: &mut impl DelayNs,
        address: Address,
    ) -> Result<(), Error<B::Error>> {
        let address = number(address);
        power_up(bus, delay, address, ODR_1600_NORMAL).await?;
        delay.delay_ms(TEST_SETTLE_MS).await;
        let positive = sample_with_force(bus, delay, address, TEST_POSITIVE).await?;
        let negative = sample_with_force(bus, delay, address, TEST_NEGATIVE).await?;
        register::write(bus, address, ACC_SELF_TEST, TEST_OFF).await?;
        reset(bus, delay, address).await?;
        let values = positive.into_iter().zip(negative).zip(TEST_LEAST_COUNTS);
        for ((positive, negative), (axis, least)) in values {
            let difference_counts = i32::from(positive) - i32::from(negative);
            if difference_counts.abs() < least {
                return Err(Error::AccelerometerTestFailed { axis, difference_counts });
            }
        }
        Ok(())
    }

    /// Reads a sample in one transaction of six bytes.
    ///
    /// # Errors
    /// Returns the error of the bus.
    pub async fn read<B: I2c>(&self, bus: &mut B) -> Result<AccelerationCounts, B::Error> {
        Ok(AccelerationCounts(axes(register::read(bus, self.address, ACC_X_LSB).await?)))
    }
}

fn number(address: Address) -> u8 {
    match address {
        Address::SdoLow => 0x18,
        Address::SdoHigh => 0x19,
    }
}

async fn reset<B: I2c>(bus: &mut B, delay: &mut impl DelayNs, address: u8) -> Result<(), B::Error> {
    register::write(bus, address, ACC_SOFTRESET, SOFT_RESET).await?;
    delay.delay_ms(RESET_MS).await;
    Ok(())
}

/// Resets, checks and turns the accelerometer on: after a reset its power is off. The two power
/// registers follow each other and are written in one transaction.
async fn power_up<B: I2c>(
    bus: &mut B,
    delay: &mut impl DelayNs,
    address: u8,
    rate: u8,
) -> Result<(), Error<B::Error>> {
    check_id(bus, address, ID).await?;
    reset(bus, delay, address).await?;
    register::write(bus, address, ACC_PWR_CTRL, POWER_ON).await?;
    delay.delay_ms(POWER_MS).await;
    bus.write(address, &[ACC_PWR_CONF, POWER_ACTIVE, POWER_ON]).await?;
    delay.delay_ms(ACTIVE_MS).await;
    register::write(bus, address, ACC_CONF, rate).await?;
    register::write(bus, address, ACC_RANGE, RANGE_24).await?;
    let configuration = [
        (ACC_PWR_CONF, POWER_ACTIVE),
        (ACC_PWR_CTRL, POWER_ON),
        (ACC_CONF, rate),
        (ACC_RANGE, RANGE_24),
    ];
    for (register, value) in configuration {
        register::check(bus, address, register, value, 0xff).await?;
    }
    register::check(bus, address, ACC_ERR_REG, 0, ERRORS).await
}

/// Applies a force of the self-test, and reads a sample when the accelerometer has settled.
async fn sample_with_force<B: I2c>(
    bus: &mut B,
    delay: &mut impl DelayNs,
    address: u8,
    force: u8,
) -> Result<[i16; 3], B::Error> {
    register::write(bus, address, ACC_SELF_TEST, force).await?;
    delay.delay_ms(TEST_FORCE_MS).await;
    Ok(axes(register::read(bus, address, ACC_X_LSB).await?))
}
