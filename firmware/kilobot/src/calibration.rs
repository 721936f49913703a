//! The places of the robot's measured calibration in its EEPROM (kilolib.c).

use crate::distance::{ENTRIES, Gain};

/// Bytes of the EEPROM.
pub const EEPROM: u16 = 1024;

/// Correction of the 8 MHz oscillator; 255 if there is none.
pub const OSCILLATOR: u16 = 0x01;
/// Duties: turning left, turning right, straight left, straight right.
pub const DUTIES: [u16; 4] = [0x05, 0x09, 0x0c, 0x14];
/// A duty that was never stored. Those of calibrated robots are 60 to 75.
pub const ERASED_DUTY: u8 = 0xff;
/// Table of the low gain: 14 readings of two bytes, the high one first.
const LOW_GAIN: u16 = 0x20;
/// Table of the high gain, likewise.
const HIGH_GAIN: u16 = 0x50;
/// Which pins of port B light the infrared diodes.
pub const TRANSMITTERS: u16 = 0x90;
/// The robot's id: two bytes, the low one first.
pub const ID: u16 = 0xb0;
/// An id that was never stored.
pub const ERASED_ID: u16 = 0xffff;

/// Pins that can be transmitters, and the one that is if the EEPROM names another.
const POSSIBLE: u8 = 0b1100_0111;
const USUAL: u8 = 1;

/// Entry `index` of the table for that gain.
pub fn entry(gain: Gain, index: u8, byte: impl Fn(u16) -> u8) -> u16 {
    let table = match gain {
        Gain::High => HIGH_GAIN,
        Gain::Low => LOW_GAIN,
    };
    let at = table + 2 * u16::from(index.min(ENTRIES - 1));
    u16::from_be_bytes([byte(at), byte(at + 1)])
}

/// The pins of port B that send.
pub const fn transmitters(byte: u8) -> u8 {
    if byte & !POSSIBLE == 0 { byte } else { USUAL }
}
