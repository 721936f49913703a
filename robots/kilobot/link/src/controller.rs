//! The messages of the overhead controller, which are the commands of a person at KiloGUI (kilolib,
//! `message.h` and `ohc.h`).

/// The number of data bytes in a message.
pub const DATA: usize = 9;

/// The first type of the controller's messages; all greater ones are the controller's, too.
pub const FIRST: u8 = 0x80;

// Types.
/// Starts the boot loader, which receives a program.
pub const BOOT: u8 = 0x80;
/// Restarts the robot as if switched on.
pub const RESET: u8 = 0x83;
/// Puts the robot to sleep.
pub const SLEEP: u8 = 0x84;
/// Makes the robot wait; this also pauses the script.
pub const WAKE: u8 = 0x85;
/// Shows by the LED that the battery is being charged.
pub const CHARGE: u8 = 0x86;
/// Shows the battery's state by the LED.
pub const VOLTAGE: u8 = 0x87;
/// Runs the script.
pub const RUN: u8 = 0x88;
/// Makes the robot turn if a bit of its id is set. The first byte of the data is the number of the
/// bit.
pub const READ_ID: u8 = 0x89;
/// Tests or stores calibration. A running script ignores this message; [`WAKE`] pauses the script.
/// The data are `calibmsg` of `ohc.h`: mode, id (low byte first), duties of turning left, right,
/// straight left, straight right.
pub const CALIBRATE: u8 = 0x8a;

// Modes of calibration.
/// Stores id and duties.
pub const SAVE: u8 = 0;
/// Sets the robot's id.
pub const SET_ID: u8 = 1;
/// Turns left with the given duty.
pub const TURN_LEFT: u8 = 2;
/// Turns right with the given duty.
pub const TURN_RIGHT: u8 = 3;
/// Moves straight with the given duties.
pub const STRAIGHT: u8 = 4;
