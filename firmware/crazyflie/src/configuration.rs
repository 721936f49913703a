//! The configuration in the EEPROM: a 24AA64 at the address 0x50 of I2C1.
//!
//! The robot reads it once, before the radio is set up. Without a valid configuration it has the
//! defaults: channel 80, 2 Mbit/s, address E7E7E7E7E7, no trim. It never writes the EEPROM.
//!
//! The chip takes the location of the first byte, the high byte first, and then sends bytes until it
//! is stopped. That is one transaction of 24 bytes in all, which takes 0.6 ms. The crate eeprom24x
//! 0.7.2 is not used, since its bus blocks.
//!
//! **Not tried on hardware.**

use bittybuzz_memories::{CONFIGURATION_BYTES, Configuration, ConfigurationError};
use embassy_time::{Duration, with_timeout};
use embedded_hal_async::i2c::I2c;

use crate::bus::{Bus, BusError};
use bittybuzz_board::log;

const ADDRESS: u8 = 0x50;
/// The location of the configuration.
const LOCATION: [u8; 2] = [0, 0];
/// The number of attempts to read it.
const ATTEMPTS: u32 = 3;
/// The longest attempt, which takes 0.6 ms.
const LIMIT: Duration = Duration::from_millis(5);

/// A reason why the robot has the default configuration.
enum Unconfigured {
    Bus(BusError),
    /// The transaction did not end in time.
    BusSilent,
    Invalid(ConfigurationError),
}

impl defmt::Format for Unconfigured {
    fn format(&self, f: defmt::Formatter<'_>) {
        match self {
            Unconfigured::Bus(error) => defmt::write!(f, "the memory does not answer: {}", error),
            Unconfigured::BusSilent => defmt::write!(f, "the memory's bus is silent"),
            Unconfigured::Invalid(ConfigurationError::Missing) => {
                defmt::write!(f, "the memory has none")
            }
            Unconfigured::Invalid(ConfigurationError::UnknownVersion(version)) => {
                defmt::write!(f, "it has version {=u8}", version)
            }
            Unconfigured::Invalid(ConfigurationError::Damaged) => {
                defmt::write!(f, "its checksum is wrong")
            }
            Unconfigured::Invalid(ConfigurationError::Channel(channel)) => {
                defmt::write!(f, "channel {=u8} does not exist", channel)
            }
            Unconfigured::Invalid(ConfigurationError::Speed(speed)) => {
                defmt::write!(f, "data rate {=u8} does not exist", speed)
            }
            Unconfigured::Invalid(ConfigurationError::Trim) => {
                defmt::write!(f, "the trim is more than 20 degrees")
            }
        }
    }
}

/// Reads the configuration, and writes it to the log. Call this function once.
pub async fn load(bus: &mut Bus) -> Configuration {
    let configuration = match read(bus).await {
        Ok(configuration) => configuration,
        Err(reason) => {
            log::warning!("default configuration: {}", reason);
            Configuration::DEFAULT
        }
    };
    let Configuration { radio, trim } = configuration;
    let [a0, a1, a2, a3, a4] = radio.address;
    log::info!(
        "radio channel {=u8}, data rate {=u8}, address {=[u8]:02x}, trim {=f32} and {=f32} degrees",
        radio.channel,
        radio.data_rate as u8,
        [a4, a3, a2, a1, a0],
        trim.pitch_degrees,
        trim.roll_degrees
    );
    configuration
}

async fn read(bus: &mut Bus) -> Result<Configuration, Unconfigured> {
    let mut bytes = [0; CONFIGURATION_BYTES];
    let mut outcome = Err(Unconfigured::BusSilent);
    for _ in 0..ATTEMPTS {
        outcome = match with_timeout(LIMIT, bus.write_read(ADDRESS, &LOCATION, &mut bytes)).await {
            Ok(Ok(())) => Configuration::decode(&bytes).map_err(Unconfigured::Invalid),
            Ok(Err(error)) => Err(Unconfigured::Bus(error)),
            Err(_) => Err(Unconfigured::BusSilent),
        };
        if outcome.is_ok() {
            break;
        }
    }
    outcome
}
