//! The states of the robot, as the overhead controller switches them.

use crate::calibration::{ERASED_DUTY, ERASED_ID};
use crate::controller::*;

/// The state of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RobotMode {
    /// Waits for the controller: blinks green.
    Waiting,
    /// Sleeps, and listens every eight seconds.
    Asleep,
    /// Shows the battery's state.
    Battery,
    /// Blinks red while it is being charged.
    Charging,
    /// Runs the script.
    Running,
    /// Should run the script, but has no id or motor duties of its own: shows magenta.
    Uncalibrated,
    /// Shows its calibration.
    Moving,
}

/// An action of the hardware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// Nothing.
    None,
    /// Jump to the boot loader.
    Boot,
    /// Start anew.
    Reset,
    /// Store id and duties.
    Store,
}

/// The mode of the robot, and the calibration that messages can change.
#[derive(Debug)]
pub struct ModeSwitch {
    /// Its state.
    pub state: RobotMode,
    /// Duties of left and right motor for showing the calibration.
    pub shown: [u8; 2],
    /// The robot's id.
    pub id: u16,
    /// Duties: turning left, turning right, straight left, straight right.
    pub duties: [u8; 4],
}

impl ModeSwitch {
    /// Switched on. A stored id and duties.
    pub const fn new(id: u16, duties: [u8; 4]) -> Self {
        ModeSwitch { state: RobotMode::Waiting, shown: [0, 0], id, duties }
    }

    /// Does as the controller says, by a message of this type with these data.
    pub fn obey(&mut self, kind: u8, data: &[u8; DATA]) -> Act {
        self.state = match kind {
            BOOT => return Act::Boot,
            RESET => return Act::Reset,
            SLEEP => RobotMode::Asleep,
            WAKE => RobotMode::Waiting,
            CHARGE => RobotMode::Charging,
            VOLTAGE => RobotMode::Battery,
            RUN => RobotMode::Running,
            READ_ID => {
                let [bit, ..] = *data;
                let is_set = bit < 16 && self.id >> bit & 1 != 0;
                self.shown = if is_set { self.turn_left() } else { [0, 0] };
                RobotMode::Moving
            }
            // Any robot can send this. A script that runs must not lose its id or duties to one that babbles.
            CALIBRATE if self.state == RobotMode::Running => return Act::None,
            CALIBRATE => return self.calibrate(data),
            _ => return Act::None,
        };
        if self.state == RobotMode::Running && !self.is_calibrated() {
            self.state = RobotMode::Uncalibrated;
        }
        Act::None
    }

    /// Robots that share the erased id would be one to all others, and erased duties are full power.
    #[expect(clippy::manual_contains, reason = "`contains` takes 130 bytes of flash more")]
    #[inline(never)]
    fn is_calibrated(&self) -> bool {
        self.id != ERASED_ID && !self.duties.iter().any(|duty| *duty == ERASED_DUTY)
    }

    fn calibrate(&mut self, data: &[u8; DATA]) -> Act {
        let [mode, low, high, left, right, straight_left, straight_right, ..] = *data;
        self.shown = match mode {
            SAVE if self.state == RobotMode::Moving => {
                self.state = RobotMode::Waiting;
                return Act::Store;
            }
            SET_ID => {
                self.id = u16::from_le_bytes([low, high]);
                [0, 0]
            }
            TURN_LEFT => {
                self.duties[0] = left;
                self.turn_left()
            }
            TURN_RIGHT => {
                self.duties[1] = right;
                self.turn_right()
            }
            STRAIGHT => {
                self.duties[2] = straight_left;
                self.duties[3] = straight_right;
                self.straight()
            }
            _ => return Act::None,
        };
        self.state = RobotMode::Moving;
        Act::None
    }

    /// Duties of left and right motor for turning left.
    pub fn turn_left(&self) -> [u8; 2] {
        [self.duties[0], 0]
    }

    /// Duties of left and right motor for turning right.
    pub fn turn_right(&self) -> [u8; 2] {
        [0, self.duties[1]]
    }

    /// Duties of left and right motor for going straight on.
    pub fn straight(&self) -> [u8; 2] {
        [self.duties[2], self.duties[3]]
    }
}
