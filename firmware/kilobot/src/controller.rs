//! Messages of the overhead controller: the commands of a person at KiloGUI (kilolib, `message.h`
//! and `ohc.h`).

/// Bytes of data in a message.
pub const DATA: usize = 9;

/// From this type on messages are the controller's.
pub const FIRST: u8 = 0x80;

// Types.
/// The boot loader receives a program.
pub const BOOT: u8 = 0x80;
/// Restarts the robot as if switched on.
pub const RESET: u8 = 0x83;
/// Saves the battery.
pub const SLEEP: u8 = 0x84;
/// Waits; also pauses the script.
pub const WAKE: u8 = 0x85;
/// Shows by the LED that the battery is being charged.
pub const CHARGE: u8 = 0x86;
/// Shows the battery's state by the LED.
pub const VOLTAGE: u8 = 0x87;
/// Runs the script.
pub const RUN: u8 = 0x88;
/// Turns if the bit of its id is set whose number is the first byte of the data.
pub const READ_ID: u8 = 0x89;
/// Tries out or stores calibration; ignored while the script runs, [`WAKE`] pauses it. The data are `calibmsg` of `ohc.h`: mode, id (low byte first), duties of turning left, right,
/// straight left, straight right.
pub const CALIBRATE: u8 = 0x8a;

// Modes of calibration.
/// Stores id and duties.
pub const SAVE: u8 = 0;
/// The robot's id.
pub const SET_ID: u8 = 1;
/// Turns left with that duty.
pub const TURN_LEFT: u8 = 2;
/// Turns right with that duty.
pub const TURN_RIGHT: u8 = 3;
/// Goes straight on with those duties.
pub const STRAIGHT: u8 = 4;
