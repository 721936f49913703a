//! The configuration of a robot in its EEPROM, which Bitcraze's cfclient writes.
//!
//! ```text
//! magic "0xBC" | version | channel | speed | pitch, 4 bytes | roll, 4 bytes
//!     | address, its highest byte first and then its 4 lower ones, the lowest first | check
//! ```
//! All other numbers are little-endian, and the check is the sum of all bytes before it, modulo 256.
//! Version 0 has no address (configblockeeprom.c of crazyflie-firmware).

use bittybuzz_comms::syslink::{DataRate, RadioSettings};

/// The number of bytes of a configuration.
pub const CONFIGURATION_BYTES: usize = 21;
/// The number of bytes of version 0.
const OLD_BYTES: usize = 16;

const MAGIC: [u8; 4] = *b"0xBC";
/// The highest channel of the radio.
const CHANNEL_MAX: u8 = 125;
/// The largest trim. A robot whose sensors are tilted by more needs another cure.
const TRIM_MAX_DEGREES: f32 = 20.0;

/// The tilt of the inertial sensors on the robot.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Trim {
    pub pitch_degrees: f32,
    pub roll_degrees: f32,
}

/// The configuration of a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Configuration {
    pub radio: RadioSettings,
    pub trim: Trim,
}

impl Configuration {
    /// The configuration of a robot without a valid one.
    pub const DEFAULT: Configuration = Configuration {
        radio: RadioSettings::DEFAULT,
        trim: Trim { pitch_degrees: 0.0, roll_degrees: 0.0 },
    };
}

/// A reason why the EEPROM has no valid configuration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConfigurationError {
    /// The first bytes are not those of a configuration.
    Missing,
    /// The configuration has a version that this crate does not know.
    UnknownVersion(u8),
    /// The checksum is wrong.
    Damaged,
    /// The radio has no such channel.
    Channel(u8),
    /// The radio has no data rate with this number.
    Speed(u8),
    /// A trim is more than 20°, or not a number.
    Trim,
}

impl Configuration {
    /// Decodes the first bytes of the EEPROM.
    ///
    /// # Errors
    /// Returns the reason why they are no valid configuration.
    pub fn decode(bytes: &[u8; CONFIGURATION_BYTES]) -> Result<Self, ConfigurationError> {
        let [
            m0,
            m1,
            m2,
            m3,
            version,
            channel,
            speed,
            p0,
            p1,
            p2,
            p3,
            r0,
            r1,
            r2,
            r3,
            a4,
            a0,
            a1,
            a2,
            a3,
            _check,
        ] = *bytes;
        if [m0, m1, m2, m3] != MAGIC {
            return Err(ConfigurationError::Missing);
        }
        let (length, address) = match version {
            0 => (OLD_BYTES, RadioSettings::DEFAULT.address),
            1 => (CONFIGURATION_BYTES, [a0, a1, a2, a3, a4]),
            version => return Err(ConfigurationError::UnknownVersion(version)),
        };
        if !is_intact(bytes, length) {
            return Err(ConfigurationError::Damaged);
        }
        if channel > CHANNEL_MAX {
            return Err(ConfigurationError::Channel(channel));
        }
        let data_rate = match speed {
            0 => DataRate::Kilobits250,
            1 => DataRate::Megabit1,
            2 => DataRate::Megabits2,
            speed => return Err(ConfigurationError::Speed(speed)),
        };
        let trim = Trim {
            pitch_degrees: f32::from_le_bytes([p0, p1, p2, p3]),
            roll_degrees: f32::from_le_bytes([r0, r1, r2, r3]),
        };
        let range = -TRIM_MAX_DEGREES..=TRIM_MAX_DEGREES;
        if !range.contains(&trim.pitch_degrees) || !range.contains(&trim.roll_degrees) {
            return Err(ConfigurationError::Trim);
        }
        let radio = RadioSettings { channel, data_rate, address, ..RadioSettings::DEFAULT };
        Ok(Configuration { radio, trim })
    }
}

/// Returns true if the last of `length` bytes is the sum of the others.
fn is_intact(bytes: &[u8; CONFIGURATION_BYTES], length: usize) -> bool {
    let Some([covered @ .., check]) = bytes.get(..length) else { return false };
    covered.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)) == *check
}
