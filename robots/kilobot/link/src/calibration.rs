//! The addresses of the robot's measured calibration in its EEPROM (kilolib.c).

use crate::distance::{ENTRIES, Gain};

/// The size of the EEPROM, in bytes.
pub const EEPROM: u16 = 1024;

/// The correction of the 8 MHz oscillator; 255 if there is none.
pub const OSCILLATOR: u16 = 0x01;
/// The duties for turning left, turning right, straight left, straight right.
pub const DUTIES: [u16; 4] = [0x05, 0x09, 0x0c, 0x14];
/// The value of a duty that was never stored. Those of calibrated robots are 60 to 75.
pub const ERASED_DUTY: u8 = 0xff;
/// The table of the low gain: 14 readings of two bytes, the high one first.
const LOW_GAIN: u16 = 0x20;
/// The table of the high gain, in the same format.
const HIGH_GAIN: u16 = 0x50;
/// The pins of port B that drive the infrared diodes.
pub const TRANSMITTERS: u16 = 0x90;
/// The robot's id: two bytes, the low one first.
pub const ID: u16 = 0xb0;
/// The value of an id that was never stored.
pub const ERASED_ID: u16 = 0xffff;

/// The pins that can drive diodes, and the one that does if the EEPROM names others.
const POSSIBLE: u8 = 0b1100_0111;
const USUAL: u8 = 1;

/// Returns entry `index` of the table for a gain. `byte` reads the EEPROM.
pub fn entry(gain: Gain, index: u8, byte: impl Fn(u16) -> u8) -> u16 {
    let table = match gain {
        Gain::High => HIGH_GAIN,
        Gain::Low => LOW_GAIN,
    };
    let at = table + 2 * u16::from(index.min(ENTRIES - 1));
    u16::from_be_bytes([byte(at), byte(at + 1)])
}

/// Returns the pins of port B that drive the infrared diodes, from the byte in the EEPROM.
pub const fn transmitters(byte: u8) -> u8 {
    if byte & !POSSIBLE == 0 { byte } else { USUAL }
}
