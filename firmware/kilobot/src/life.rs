//! What the robot does, as the overhead controller has it.

use crate::controller::{Calibration, Command};

/// What the robot does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
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
    /// Shows its calibration.
    Moving,
}

/// How it moves while it shows its calibration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    Stop,
    Left,
    Right,
    Straight,
}

/// What only the hardware can do.
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

/// Life, and the calibration that can be changed by messages.
#[derive(Debug)]
pub struct Life {
    /// What it does.
    pub state: State,
    motion: Motion,
    /// The robot's id.
    pub id: u16,
    /// Duties: turning left, turning right, straight left, straight right.
    pub duties: [u8; 4],
}

impl Life {
    /// Switched on. A stored id and duties.
    pub const fn new(id: u16, duties: [u8; 4]) -> Self {
        Life { state: State::Waiting, motion: Motion::Stop, id, duties }
    }

    /// Does as the controller says.
    pub fn obey(&mut self, command: Command) -> Act {
        self.state = match command {
            Command::Boot => return Act::Boot,
            Command::Reset => return Act::Reset,
            Command::Sleep => State::Asleep,
            Command::Wake => State::Waiting,
            Command::Charge => State::Charging,
            Command::Voltage => State::Battery,
            Command::Run => State::Running,
            Command::ReadId(bit) => {
                let is_set = bit < 16 && self.id >> bit & 1 != 0;
                self.motion = if is_set { Motion::Left } else { Motion::Stop };
                State::Moving
            }
            Command::Calibrate(Calibration::Save) => {
                if self.state != State::Moving {
                    return Act::None;
                }
                self.state = State::Waiting;
                return Act::Store;
            }
            Command::Calibrate(calibration) => {
                self.calibrate(calibration);
                State::Moving
            }
        };
        Act::None
    }

    fn calibrate(&mut self, calibration: Calibration) {
        let [left, right, straight_left, straight_right] = &mut self.duties;
        self.motion = match calibration {
            Calibration::Save => return,
            Calibration::Id(id) => {
                self.id = id;
                Motion::Stop
            }
            Calibration::TurnLeft(duty) => {
                *left = duty;
                Motion::Left
            }
            Calibration::TurnRight(duty) => {
                *right = duty;
                Motion::Right
            }
            Calibration::Straight(duty_left, duty_right) => {
                (*straight_left, *straight_right) = (duty_left, duty_right);
                Motion::Straight
            }
        };
    }

    /// Duties of left and right motor for showing the calibration.
    pub fn shown(&self) -> [u8; 2] {
        match self.motion {
            Motion::Stop => [0, 0],
            Motion::Left => self.turn_left(),
            Motion::Right => self.turn_right(),
            Motion::Straight => self.straight(),
        }
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
