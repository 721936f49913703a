//! The chip on the bus.

use core::slice::from_ref;

use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::i2c::I2c;

use crate::Error;
use crate::configuration::{DEFAULTS, DEFAULTS_START, Mode, Setting};
use crate::reading::{RESULT_BYTES, Reading};

/// The address of a chip after power-on, 7 bits.
pub const DEFAULT_ADDRESS: u8 = 0x29;

/// The addresses that I2C leaves to devices.
const ADDRESSES: core::ops::RangeInclusive<u8> = 0x08..=0x77;

// Registers, with ST's names.
const I2C_SLAVE__DEVICE_ADDRESS: u16 = 0x0001;
const VHV_CONFIG__TIMEOUT_MACROP_LOOP_BOUND: u16 = 0x0008;
const VHV_CONFIG__INIT: u16 = 0x000b;
const PAD_I2C_HV__CONFIG: u16 = 0x002d;
const PAD_I2C_HV__EXTSUP_CONFIG: u16 = 0x002e;
const GPIO_HV_PAD__CTRL: u16 = 0x002f;
const GPIO_HV_MUX__CTRL: u16 = 0x0030;
const INTERRUPT_STATUS: u16 = 0x0031;
const SYSTEM__INTERMEASUREMENT_PERIOD: u16 = 0x006c;
const SYSTEM__INTERRUPT_CLEAR: u16 = 0x0086;
const SYSTEM__MODE_START: u16 = 0x0087;
const RESULT__RANGE_STATUS: u16 = 0x0089;
const RESULT__OSC_CALIBRATE_VAL: u16 = 0x00de;
const FIRMWARE__SYSTEM_STATUS: u16 = 0x00e5;
const IDENTIFICATION__MODEL_ID: u16 = 0x010f;

const MODEL_ID: u16 = 0xeacc;
const BOOTED: u8 = 1 << 0;
/// The interrupt is active high, as [`DEFAULTS`] says: the state is 1 when a result is ready.
const RESULT_READY: u8 = 1 << 0;
const IO_2_8_VOLTS: u8 = 1;
const START: u8 = 0x40;
const STOP: u8 = 0x00;
const CLEAR: u8 = 0x01;
/// The calibration of the voltage begins with the value of the previous measurement.
const TWO_LOOPS: u8 = 0x09;

/// The voltage of the bus, before the configuration.
const VOLTAGE: [Setting; 3] = [
    (PAD_I2C_HV__CONFIG, &[0]),
    (PAD_I2C_HV__EXTSUP_CONFIG, &[IO_2_8_VOLTS]),
    (GPIO_HV_PAD__CTRL, &[IO_2_8_VOLTS]),
];
/// The end of the first measurement. Later ones use its calibration.
const CALIBRATED: [Setting; 4] = [
    (SYSTEM__INTERRUPT_CLEAR, &[CLEAR]),
    (SYSTEM__MODE_START, &[STOP]),
    (VHV_CONFIG__TIMEOUT_MACROP_LOOP_BOUND, &[TWO_LOOPS]),
    (VHV_CONFIG__INIT, &[0]),
];
/// The begin of the measurements. A result from before it does not count, as in Linux.
const BEGIN: [Setting; 2] = [(SYSTEM__INTERRUPT_CLEAR, &[CLEAR]), (SYSTEM__MODE_START, &[START])];

/// The longest value that is written or read back: the period.
const VALUE_BYTES: usize = 4;

const BOOT_MS: u32 = 100;
/// The longest wait for the first measurement, as in Linux.
const CALIBRATION_MS: u32 = 1_000;

/// The bits of the oscillator's frequency.
const OSCILLATOR_BITS: u16 = 0x03ff;

/// A range finder that is configured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RangeFinder {
    address: u8,
}

impl RangeFinder {
    /// Gives the chip at address `from` the address `to`, which it has until XSHUT goes low.
    /// XSHUT must have been high for 2 ms.
    ///
    /// # Errors
    /// Returns the reason why the chip cannot be moved.
    pub async fn move_chip<B: I2c>(
        bus: &mut B,
        delay: &mut impl DelayNs,
        from: u8,
        to: u8,
    ) -> Result<(), Error<B::Error>> {
        if !ADDRESSES.contains(&to) {
            return Err(Error::AddressReserved { address: to });
        }
        check_identity(bus, delay, from).await?;
        write(bus, from, I2C_SLAVE__DEVICE_ADDRESS, &[to]).await?;
        check_identity(bus, delay, to).await
    }

    /// Checks and configures the chip, and lets it calibrate itself. XSHUT must have been high for
    /// 2 ms. This takes a measurement of about 0.1 s.
    ///
    /// # Errors
    /// Returns the reason why the chip cannot be used. Another call starts from the beginning.
    pub async fn start<B: I2c>(
        bus: &mut B,
        delay: &mut impl DelayNs,
        address: u8,
    ) -> Result<RangeFinder, Error<B::Error>> {
        check_identity(bus, delay, address).await?;
        write_all(bus, address, &VOLTAGE).await?;
        write_defaults(bus, address).await?;
        // ST does not say which of the other registers can be read back.
        let [polarity, ..] = &DEFAULTS;
        check(bus, address, GPIO_HV_MUX__CTRL, from_ref(polarity)).await?;

        let finder = RangeFinder { address };
        write_all(bus, address, &BEGIN).await?;
        finder.wait_for_result(bus, delay).await?;
        write_all(bus, address, &CALIBRATED).await?;
        Ok(finder)
    }

    /// Chooses a mode, reads it back, and starts to measure. A chip that measures stops before.
    ///
    /// # Errors
    /// Returns an error of the bus, or [`Error::ConfigurationRefused`].
    pub async fn begin<B: I2c>(&self, bus: &mut B, mode: Mode) -> Result<(), Error<B::Error>> {
        let address = self.address;
        let period = self.period(bus, mode).await?.to_be_bytes();
        self.stop(bus).await?;
        write_all(bus, address, mode.settings()).await?;
        write(bus, address, SYSTEM__INTERMEASUREMENT_PERIOD, &period).await?;
        for (register, value) in mode.settings() {
            check(bus, address, *register, value).await?;
        }
        check(bus, address, SYSTEM__INTERMEASUREMENT_PERIOD, &period).await?;
        Ok(write_all(bus, address, &BEGIN).await?)
    }

    /// Stops the measurements.
    ///
    /// # Errors
    /// Returns the error of the bus.
    pub async fn stop<B: I2c>(&self, bus: &mut B) -> Result<(), B::Error> {
        write(bus, self.address, SYSTEM__MODE_START, &[STOP]).await
    }

    /// Returns the result of a new measurement, if there is one, and lets the chip offer the next.
    /// This takes one transaction without a result and three with one.
    ///
    /// # Errors
    /// Returns the error of the bus.
    pub async fn poll<B: I2c>(&self, bus: &mut B) -> Result<Option<Reading>, B::Error> {
        if !self.has_result(bus).await? {
            return Ok(None);
        }
        let result: [u8; RESULT_BYTES] = read(bus, self.address, RESULT__RANGE_STATUS).await?;
        write(bus, self.address, SYSTEM__INTERRUPT_CLEAR, &[CLEAR]).await?;
        Ok(Some(Reading::new(result)))
    }

    async fn has_result<B: I2c>(&self, bus: &mut B) -> Result<bool, B::Error> {
        let [state] = read(bus, self.address, INTERRUPT_STATUS).await?;
        Ok(state & RESULT_READY != 0)
    }

    async fn wait_for_result<B: I2c>(
        &self,
        bus: &mut B,
        delay: &mut impl DelayNs,
    ) -> Result<(), Error<B::Error>> {
        for _ in 0..CALIBRATION_MS {
            if self.has_result(bus).await? {
                return Ok(());
            }
            delay.delay_ms(1).await;
        }
        Err(Error::CalibrationTimeout)
    }

    /// Returns the period of a mode in periods of the chip's oscillator, of which the chip has
    /// measured the number per millisecond. 1.075 is ST's correction.
    async fn period<B: I2c>(&self, bus: &mut B, mode: Mode) -> Result<u32, Error<B::Error>> {
        let register = RESULT__OSC_CALIBRATE_VAL;
        let found = u16::from_be_bytes(read(bus, self.address, register).await?);
        let oscillator = u32::from(found & OSCILLATOR_BITS);
        if oscillator == 0 {
            return Err(Error::ConfigurationRefused { register, found: found.into() });
        }
        Ok(oscillator * mode.period_ms() * 1075 / 1000)
    }
}

/// Waits until the chip has booted, and checks its identity.
async fn check_identity<B: I2c>(
    bus: &mut B,
    delay: &mut impl DelayNs,
    address: u8,
) -> Result<(), Error<B::Error>> {
    for _ in 0..BOOT_MS {
        let [status] = read(bus, address, FIRMWARE__SYSTEM_STATUS).await?;
        if status & BOOTED != 0 {
            let found = u16::from_be_bytes(read(bus, address, IDENTIFICATION__MODEL_ID).await?);
            return if found == MODEL_ID { Ok(()) } else { Err(Error::WrongId { found }) };
        }
        delay.delay_ms(1).await;
    }
    Err(Error::BootTimeout)
}

async fn write_defaults<B: I2c>(bus: &mut B, address: u8) -> Result<(), B::Error> {
    let mut bytes = [0; 2 + DEFAULTS.len()];
    let register = DEFAULTS_START.to_be_bytes();
    bytes.iter_mut().zip(register.iter().chain(&DEFAULTS)).for_each(|(to, from)| *to = *from);
    bus.write(address, &bytes).await
}

/// Reads registers from `register` on.
async fn read<B: I2c, const N: usize>(
    bus: &mut B,
    address: u8,
    register: u16,
) -> Result<[u8; N], B::Error> {
    let mut values = [0; N];
    bus.write_read(address, &register.to_be_bytes(), &mut values).await?;
    Ok(values)
}

/// Writes at most [`VALUE_BYTES`] bytes to registers from `register` on.
async fn write<B: I2c>(
    bus: &mut B,
    address: u8,
    register: u16,
    value: &[u8],
) -> Result<(), B::Error> {
    let mut bytes = [0; 2 + VALUE_BYTES];
    let content = register.to_be_bytes();
    bytes.iter_mut().zip(content.iter().chain(value)).for_each(|(to, from)| *to = *from);
    let bytes = bytes.get(..content.len() + value.len()).unwrap_or(&bytes);
    bus.write(address, bytes).await
}

async fn write_all<B: I2c>(bus: &mut B, address: u8, settings: &[Setting]) -> Result<(), B::Error> {
    for (register, value) in settings {
        write(bus, address, *register, value).await?;
    }
    Ok(())
}

/// Reads at most [`VALUE_BYTES`] bytes back, and compares them.
async fn check<B: I2c>(
    bus: &mut B,
    address: u8,
    register: u16,
    value: &[u8],
) -> Result<(), Error<B::Error>> {
    let mut found = [0; VALUE_BYTES];
    let found = found.get_mut(..value.len()).unwrap_or_default();
    bus.write_read(address, &register.to_be_bytes(), found).await?;
    if found == value {
        return Ok(());
    }
    let found = found.iter().fold(0, |number, byte| number << 8 | u32::from(*byte));
    Err(Error::ConfigurationRefused { register, found })
}
