//! The chip on the bus.

use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::i2c::I2c;

use crate::Error;
use crate::calibration::{Air, BarometerCounts, CALIBRATION_BYTES, Calibration, checksum};

// Registers, with the names of the data sheet.
const CHIP_ID: u8 = 0x00;
const ERR_REG: u8 = 0x02;
const STATUS: u8 = 0x03;
const PWR_CTRL: u8 = 0x1b;
const OSR: u8 = 0x1c;
const ODR: u8 = 0x1d;
const CONFIG: u8 = 0x1f;
const NVM_CHECKSUM: u8 = 0x30;
const NVM_CALIBRATION: u8 = 0x31;
const CMD: u8 = 0x7e;

// Bits of ERR_REG.
const FATAL_ERROR: u8 = 1 << 0;
const COMMAND_ERROR: u8 = 1 << 1;
const CONFIGURATION_ERROR: u8 = 1 << 2;

// Bits of STATUS.
const COMMAND_READY: u8 = 1 << 4;
/// A pressure and a temperature have been measured since the last reading.
const DATA_READY: u8 = 0b11 << 5;

const SOFT_RESET: u8 = 0xb6;
/// Pressure ×8, temperature ×1.
const PRESSURE_X8: u8 = 0x03;
/// 200 Hz divided by four.
const RATE_50_HZ: u8 = 0x02;
/// Coefficient 3 of the low-pass filter, in bits 3 to 1.
const FILTER_3: u8 = 0x04;
/// Pressure and temperature on, normal mode.
const POWER_NORMAL: u8 = 0x33;

/// The time after a reset, as in Bosch's API.
const RESET_MS: u32 = 2;
/// The longest wait for a command. crazyflie-firmware tries four times, 1 ms apart.
const READY_MS: u32 = 10;
/// The longest wait for a sample: five periods.
const SAMPLE_MS: u32 = 100;

/// The operating range. Bosch's API limits its results to it.
const PRESSURES_PA: core::ops::RangeInclusive<f32> = 30_000.0..=125_000.0;
const TEMPERATURES_CELSIUS: core::ops::RangeInclusive<f32> = -40.0..=85.0;

/// The level of the pin SDO, which chooses the address: 0x76 or 0x77.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Address {
    SdoLow,
    SdoHigh,
}

/// A chip that this driver knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Model {
    Bmp388,
    Bmp390,
}

/// A reading of the chip's counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sample {
    pub counts: BarometerCounts,
    /// True if the chip has measured since the last reading.
    pub is_new: bool,
}

/// A barometer that is configured and runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Barometer {
    address: u8,
    model: Model,
    calibration: Calibration,
}

impl Barometer {
    /// Resets, checks and configures the chip. This takes 2 ms; the first sample follows after
    /// 20 ms.
    ///
    /// # Errors
    /// Returns the reason why the chip cannot be used. Another call starts from the beginning.
    pub async fn start<B: I2c>(
        bus: &mut B,
        delay: &mut impl DelayNs,
        address: Address,
    ) -> Result<Barometer, Error<B::Error>> {
        let address = match address {
            Address::SdoLow => 0x76,
            Address::SdoHigh => 0x77,
        };
        let [found] = read(bus, address, CHIP_ID).await?;
        let model = match found {
            0x50 => Model::Bmp388,
            0x60 => Model::Bmp390,
            found => return Err(Error::WrongId { found }),
        };
        reset(bus, delay, address).await?;
        let calibration =
            Calibration::new(read::<_, CALIBRATION_BYTES>(bus, address, NVM_CALIBRATION).await?);
        configure(bus, address).await?;
        Ok(Barometer { address, model, calibration })
    }

    /// Returns the model that the chip's identity names.
    pub fn model(&self) -> Model {
        self.model
    }

    /// Checks the chip: its calibration against the checksum beside it, its register of errors, and
    /// that a new sample comes and lies within the operating range. Returns that sample.
    ///
    /// # Errors
    /// Returns [`Error::CalibrationDamaged`], [`Error::Broken`], [`Error::Timeout`] or
    /// [`Error::Implausible`].
    pub async fn self_test<B: I2c>(
        &self,
        bus: &mut B,
        delay: &mut impl DelayNs,
    ) -> Result<Air, Error<B::Error>> {
        let [stored, calibration @ ..] =
            read::<_, { CALIBRATION_BYTES + 1 }>(bus, self.address, NVM_CHECKSUM).await?;
        let computed = checksum(&calibration);
        if stored != computed {
            return Err(Error::CalibrationDamaged { stored, computed });
        }
        let [found] = read(bus, self.address, ERR_REG).await?;
        if found & FATAL_ERROR != 0 {
            return Err(Error::Broken { found });
        }
        // A sample from before this call does not count.
        self.read(bus).await?;
        for _ in 0..SAMPLE_MS {
            delay.delay_ms(1).await;
            let sample = self.read(bus).await?;
            if sample.is_new {
                let air = self.air(sample.counts);
                let is_plausible = PRESSURES_PA.contains(&air.pressure_pa)
                    && TEMPERATURES_CELSIUS.contains(&air.temperature_celsius);
                return if is_plausible { Ok(air) } else { Err(Error::Implausible(air)) };
            }
        }
        Err(Error::Timeout)
    }

    /// Reads a sample in one transaction of seven bytes. The chip measures 50 times per second;
    /// meanwhile the counts stay the same, and the sample is not new.
    ///
    /// # Errors
    /// Returns the error of the bus.
    pub async fn read<B: I2c>(&self, bus: &mut B) -> Result<Sample, B::Error> {
        // The counts stand directly after the status, with their lowest byte first.
        let [status, p_low, p_mid, p_high, t_low, t_mid, t_high] =
            read(bus, self.address, STATUS).await?;
        let counts = BarometerCounts {
            pressure: u32::from_le_bytes([p_low, p_mid, p_high, 0]),
            temperature: u32::from_le_bytes([t_low, t_mid, t_high, 0]),
        };
        Ok(Sample { counts, is_new: status & DATA_READY == DATA_READY })
    }

    /// Converts counts by the calibration of the chip. The result is not limited to the operating
    /// range.
    pub fn air(&self, counts: BarometerCounts) -> Air {
        self.calibration.air(counts)
    }
}

async fn read<B: I2c, const N: usize>(
    bus: &mut B,
    address: u8,
    register: u8,
) -> Result<[u8; N], B::Error> {
    let mut values = [0; N];
    bus.write_read(address, &[register], &mut values).await?;
    Ok(values)
}

async fn reset<B: I2c>(
    bus: &mut B,
    delay: &mut impl DelayNs,
    address: u8,
) -> Result<(), Error<B::Error>> {
    wait_until_ready(bus, delay, address).await?;
    bus.write(address, &[CMD, SOFT_RESET]).await?;
    delay.delay_ms(RESET_MS).await;
    let [found] = read(bus, address, ERR_REG).await?;
    if found & COMMAND_ERROR != 0 { Err(Error::CommandRefused { found }) } else { Ok(()) }
}

/// Waits until the chip can take a command.
async fn wait_until_ready<B: I2c>(
    bus: &mut B,
    delay: &mut impl DelayNs,
    address: u8,
) -> Result<(), Error<B::Error>> {
    for _ in 0..READY_MS {
        let [status] = read(bus, address, STATUS).await?;
        if status & COMMAND_READY != 0 {
            return Ok(());
        }
        delay.delay_ms(1).await;
    }
    Err(Error::Timeout)
}

async fn configure<B: I2c>(bus: &mut B, address: u8) -> Result<(), Error<B::Error>> {
    // The mode comes last: it starts the measurements.
    let configuration =
        [(OSR, PRESSURE_X8), (ODR, RATE_50_HZ), (CONFIG, FILTER_3), (PWR_CTRL, POWER_NORMAL)];
    for (register, value) in configuration {
        bus.write(address, &[register, value]).await?;
    }
    let [found] = read(bus, address, ERR_REG).await?;
    if found & CONFIGURATION_ERROR != 0 {
        return Err(Error::ConfigurationRefused { register: ERR_REG, found });
    }
    for (register, value) in configuration {
        let [found] = read(bus, address, register).await?;
        if found != value {
            return Err(Error::ConfigurationRefused { register, found });
        }
    }
    Ok(())
}
