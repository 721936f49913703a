//! Two vibration motors. One that stands needs a push: full duty for 15 ms.

use crate::clock::{is_past, units};

/// Full duty for so long, ms; more than 50 within two seconds would harm the motor (kilolib.h).
const PUSH_MS: u16 = 15;
const FULL: u8 = 255;

/// What the motors are told. Left is the one that turns the robot to the left (`ccw`).
#[derive(Debug)]
pub struct Motors {
    wanted: [u8; 2],
    pushed: [bool; 2],
    push_ends: u16,
}

impl Motors {
    /// Off.
    pub const fn new() -> Self {
        Motors { wanted: [0; 2], pushed: [false; 2], push_ends: 0 }
    }

    /// New duties of left and right motor, 0 to 255.
    pub fn set(&mut self, duties: [u8; 2], now: u16) {
        let mut starts = false;
        for ((pushed, was), duty) in self.pushed.iter_mut().zip(self.wanted).zip(duties) {
            let starts_now = was == 0 && duty != 0;
            *pushed = starts_now || *pushed && duty != 0;
            starts |= starts_now;
        }
        self.wanted = duties;
        if starts {
            self.push_ends = now.wrapping_add(units(PUSH_MS)).wrapping_add(1);
        }
    }

    /// Their duties now. To be asked at least every four seconds.
    pub fn duties(&mut self, now: u16) -> [u8; 2] {
        if is_past(self.push_ends, now) {
            self.pushed = [false; 2];
        }
        let mut duties = self.wanted;
        for (duty, pushed) in duties.iter_mut().zip(self.pushed) {
            if pushed {
                *duty = FULL;
            }
        }
        duties
    }
}

impl Default for Motors {
    fn default() -> Self {
        Self::new()
    }
}
