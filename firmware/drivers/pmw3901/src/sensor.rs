//! The chip on the bus.

use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::{Operation, SpiDevice};

use crate::Error;
use crate::motion::{BURST_BYTES, MotionCounts};
use crate::registers::{FIRST, SECOND, Setting};

// Registers.
const PRODUCT_ID: u8 = 0x00;
const MOTION: u8 = 0x02;
const DELTA_Y_HIGH: u8 = 0x06;
const MOTION_BURST: u8 = 0x16;
const POWER_UP_RESET: u8 = 0x3a;
const INVERSE_PRODUCT_ID: u8 = 0x5f;

/// The bit of a register's number that makes the access a write.
const WRITE: u8 = 0x80;

const ID: u8 = 0x49;
const INVERSE_ID: u8 = 0xb6;
const RESET: u8 = 0x5a;

/// The time from power-on to the first access.
const POWER_UP_MS: u32 = 40;
/// The times of the select line, high, low and high, that reset the chip's SPI.
const SELECT_MS: u32 = 2;
const RESET_MS: u32 = 5;
const CLEAR_MS: u32 = 1;
/// The pause between the two parts of the list.
const LIST_MS: u32 = 10;

/// The pauses of crazyflie-firmware, which are longer than those of PX4: before the first byte,
/// between bytes and after the last; between the register and the value of a reading, in which the
/// chip fetches it; after an access, and after a burst.
const BYTE_US: u32 = 50;
const FETCH_US: u32 = 500;
const ACCESS_US: u32 = 200;
const BURST_US: u32 = 50;

const NS_PER_US: u32 = 1_000;
const NS_PER_MS: u32 = 1_000_000;

/// A flow sensor that is configured and runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlowSensor(());

impl FlowSensor {
    /// Checks, resets and configures the chip. This takes 0.1 s.
    ///
    /// # Errors
    /// Returns the reason why the chip cannot be used. Another call starts from the beginning.
    pub async fn start<S: SpiDevice>(
        spi: &mut S,
        delay: &mut impl DelayNs,
    ) -> Result<FlowSensor, Error<S::Error>> {
        delay.delay_ms(POWER_UP_MS).await;
        delay.delay_ms(SELECT_MS).await;
        spi.transaction(&mut [Operation::DelayNs(SELECT_MS * NS_PER_MS)]).await?;
        delay.delay_ms(SELECT_MS).await;
        let (found, found_inverse) = identity(spi, delay).await?;
        if (found, found_inverse) != (ID, INVERSE_ID) {
            return Err(Error::WrongId { found, found_inverse });
        }
        write(spi, delay, (POWER_UP_RESET, RESET)).await?;
        delay.delay_ms(RESET_MS).await;
        // The first motion after a reset means nothing.
        for register in MOTION..=DELTA_Y_HIGH {
            read(spi, delay, register).await?;
        }
        delay.delay_ms(CLEAR_MS).await;
        for setting in FIRST {
            write(spi, delay, setting).await?;
        }
        delay.delay_ms(LIST_MS).await;
        for setting in SECOND {
            write(spi, delay, setting).await?;
        }
        let (found, found_inverse) = identity(spi, delay).await?;
        if (found, found_inverse) != (ID, INVERSE_ID) {
            return Err(Error::ConfigurationRefused { found, found_inverse });
        }
        Ok(FlowSensor(()))
    }

    /// Reads the motion since the last reading, in one transaction of 13 bytes.
    ///
    /// # Errors
    /// Returns the error of the bus.
    pub async fn read<S: SpiDevice>(
        &self,
        spi: &mut S,
        delay: &mut impl DelayNs,
    ) -> Result<MotionCounts, S::Error> {
        let mut bytes = [0; BURST_BYTES];
        spi.transaction(&mut [
            Operation::DelayNs(BYTE_US * NS_PER_US),
            Operation::Write(&[MOTION_BURST]),
            Operation::DelayNs(BYTE_US * NS_PER_US),
            Operation::Read(&mut bytes),
            Operation::DelayNs(BYTE_US * NS_PER_US),
        ])
        .await?;
        delay.delay_us(BURST_US).await;
        Ok(MotionCounts::new(bytes))
    }
}

/// Returns the identity and its inverse.
async fn identity<S: SpiDevice>(
    spi: &mut S,
    delay: &mut impl DelayNs,
) -> Result<(u8, u8), S::Error> {
    let id = read(spi, delay, PRODUCT_ID).await?;
    let inverse = read(spi, delay, INVERSE_PRODUCT_ID).await?;
    Ok((id, inverse))
}

async fn read<S: SpiDevice>(
    spi: &mut S,
    delay: &mut impl DelayNs,
    register: u8,
) -> Result<u8, S::Error> {
    let mut value = [0];
    spi.transaction(&mut [
        Operation::DelayNs(BYTE_US * NS_PER_US),
        Operation::Write(&[register]),
        Operation::DelayNs(FETCH_US * NS_PER_US),
        Operation::Read(&mut value),
        Operation::DelayNs(BYTE_US * NS_PER_US),
    ])
    .await?;
    delay.delay_us(ACCESS_US).await;
    let [value] = value;
    Ok(value)
}

async fn write<S: SpiDevice>(
    spi: &mut S,
    delay: &mut impl DelayNs,
    (register, value): Setting,
) -> Result<(), S::Error> {
    spi.transaction(&mut [
        Operation::DelayNs(BYTE_US * NS_PER_US),
        Operation::Write(&[register | WRITE]),
        Operation::DelayNs(BYTE_US * NS_PER_US),
        Operation::Write(&[value]),
        Operation::DelayNs(BYTE_US * NS_PER_US),
    ])
    .await?;
    delay.delay_us(ACCESS_US).await;
    Ok(())
}
