//! The modes of the robot, which the overhead controller selects.

use crate::calibration::{ERASED_DUTY, ERASED_ID};
use crate::controller::*;

/// The mode of the robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RobotMode {
    /// Waits for the controller: blinks green.
    Waiting,
    /// Sleeps, and listens for a moment every eight seconds.
    Asleep,
    /// Shows the battery's state.
    Battery,
    /// Blinks red while it is being charged.
    Charging,
    /// Runs the script.
    Running,
    /// Was asked to run the script, but has no id or motor duties of its own: shows magenta.
    Uncalibrated,
    /// Moves to show its calibration.
    Moving,
}

/// An action that the caller has to carry out on the hardware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    /// No action.
    None,
    /// Jump to the boot loader.
    Boot,
    /// Restart the robot.
    Reset,
    /// Store id and duties.
    Store,
}

/// The mode of the robot, and the calibration that messages can change.
#[derive(Debug)]
pub struct ModeSwitch {
    /// The selected mode.
    pub state: RobotMode,
    /// The duties of left and right motor while the robot shows its calibration.
    pub shown: [u8; 2],
    /// The robot's id.
    pub id: u16,
    /// The duties for turning left, turning right, straight left, straight right.
    pub duties: [u8; 4],
}

impl ModeSwitch {
    /// Returns the state at power-on, with the stored id and duties.
    pub const fn new(id: u16, duties: [u8; 4]) -> Self {
        ModeSwitch { state: RobotMode::Waiting, shown: [0, 0], id, duties }
    }

    /// Handles a message of the controller, and returns the action that it requires.
    pub fn handle(&mut self, kind: u8, data: &[u8; DATA]) -> Act {
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
            // Any robot can send this message. A running script must not lose its id or duties to a
            // faulty sender.
            CALIBRATE if self.state == RobotMode::Running => return Act::None,
            CALIBRATE => return self.calibrate(data),
            _ => return Act::None,
        };
        if self.state == RobotMode::Running && !self.is_calibrated() {
            self.state = RobotMode::Uncalibrated;
        }
        Act::None
    }

    /// Returns true if the robot has an id and duties of its own. Other robots could not
    /// distinguish robots with the erased id, and erased duties are full power.
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

    /// Returns the duties of left and right motor for turning left.
    pub fn turn_left(&self) -> [u8; 2] {
        [self.duties[0], 0]
    }

    /// Returns the duties of left and right motor for turning right.
    pub fn turn_right(&self) -> [u8; 2] {
        [0, self.duties[1]]
    }

    /// Returns the duties of left and right motor for moving straight.
    pub fn straight(&self) -> [u8; 2] {
        [self.duties[2], self.duties[3]]
    }
}
