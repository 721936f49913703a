//! Messages of the overhead controller: what the person at KiloGUI wants (kilolib, `message.h` and `ohc.h`).

/// From this type on messages are the controller's.
pub const FIRST: u8 = 0x80;

/// What is to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// The boot loader receives a program.
    Boot,
    /// As if switched on.
    Reset,
    /// Saves the battery.
    Sleep,
    /// Waits; also pauses the script.
    Wake,
    /// Shows by the LED that the battery is being charged.
    Charge,
    /// Shows the battery's state by the LED.
    Voltage,
    /// Runs the script.
    Run,
    /// Turns if this bit of its id is set.
    ReadId(u8),
    /// Tries out or stores calibration.
    Calibrate(Calibration),
}

/// What of the calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Calibration {
    /// Store id and duties.
    Save,
    /// The robot's id.
    Id(u16),
    /// Turn left with this duty.
    TurnLeft(u8),
    /// Turn right with this duty.
    TurnRight(u8),
    /// Go straight on with the duties of left and right motor.
    Straight(u8, u8),
}

/// The command in a message of this type with these data; `None` if there is none.
pub fn command(kind: u8, data: &[u8; 9]) -> Option<Command> {
    Some(match kind {
        0x80 => Command::Boot,
        0x83 => Command::Reset,
        0x84 => Command::Sleep,
        0x85 => Command::Wake,
        0x86 => Command::Charge,
        0x87 => Command::Voltage,
        0x88 => Command::Run,
        0x89 => Command::ReadId(data[0]),
        0x8a => Command::Calibrate(calibration(data)?),
        _ => return None,
    })
}

/// `calibmsg` of `ohc.h`: mode, id, duties of turning left, right, straight left, straight right.
fn calibration(data: &[u8; 9]) -> Option<Calibration> {
    let [mode, low, high, left, right, straight_left, straight_right, ..] = *data;
    Some(match mode {
        0 => Calibration::Save,
        1 => Calibration::Id(u16::from_le_bytes([low, high])),
        2 => Calibration::TurnLeft(left),
        3 => Calibration::TurnRight(right),
        4 => Calibration::Straight(straight_left, straight_right),
        _ => return None,
    })
}
