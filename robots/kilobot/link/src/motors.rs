//! The two vibration motors. A motor that stands still needs full duty for 15 ms to start.

use crate::clock::{is_past, units};

/// The time of full duty in ms. More than 50 ms within two seconds would harm the motor
/// (kilolib.h).
const PUSH_MS: u16 = 15;
const FULL: u8 = 255;

/// The duties of the motors. The left motor is the one that turns the robot to the left (`ccw`).
#[derive(Debug)]
pub struct MotorDuties {
    motors: [Motor; 2],
    push_ends: u16,
}

#[derive(Clone, Copy, Debug)]
struct Motor {
    wanted: u8,
    is_pushed: bool,
}

impl MotorDuties {
    /// Returns motors that are off.
    pub const fn new() -> Self {
        MotorDuties { motors: [Motor { wanted: 0, is_pushed: false }; 2], push_ends: 0 }
    }

    /// Sets the duties of left and right motor, 0 to 255.
    pub fn set(&mut self, duties: [u8; 2], now: u16) {
        let [left, right] = &mut self.motors;
        let [duty_left, duty_right] = duties;
        let left_starts = left.set(duty_left);
        if right.set(duty_right) || left_starts {
            self.push_ends = now.wrapping_add(units(PUSH_MS)).wrapping_add(1);
        }
    }

    /// Returns the present duties. Call this function at least every four seconds.
    pub fn duties(&mut self, now: u16) -> [u8; 2] {
        let [left, right] = &mut self.motors;
        if is_past(self.push_ends, now) {
            left.is_pushed = false;
            right.is_pushed = false;
        }
        [left.duty(), right.duty()]
    }
}

impl Motor {
    /// Sets a new duty, and returns true if the motor starts.
    #[inline(never)]
    fn set(&mut self, duty: u8) -> bool {
        let stands = self.wanted == 0;
        self.wanted = duty;
        if duty == 0 {
            self.is_pushed = false;
            return false;
        }
        self.is_pushed |= stands;
        stands
    }

    fn duty(self) -> u8 {
        if self.is_pushed { FULL } else { self.wanted }
    }
}

impl Default for MotorDuties {
    fn default() -> Self {
        Self::new()
    }
}
