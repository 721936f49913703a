//! The RGB LED. It has two lamps of each color, so four brightnesses.

use crate::clock::units;

/// A color, with a brightness from 0 to 3 for each of red, green and blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Color {
    /// Two bits for each brightness, red lowest.
    pub bits: u8,
}

impl Color {
    /// Dark.
    pub const DARK: Color = Color { bits: 0 };
    /// Bright red.
    pub const RED: Color = Color::of(3, 0, 0);
    /// Bright green.
    pub const GREEN: Color = Color::of(0, 3, 0);
    /// Bright blue.
    pub const BLUE: Color = Color::of(0, 0, 3);
    /// Bright red and green.
    pub const YELLOW: Color = Color::of(3, 3, 0);
    /// Bright red and blue.
    pub const MAGENTA: Color = Color::of(3, 0, 3);
    /// Bright red, green and blue.
    pub const WHITE: Color = Color::of(3, 3, 3);
    /// Dim red.
    pub const DIM_RED: Color = Color::of(1, 0, 0);

    /// Returns the color of brightnesses 0 to 3.
    pub const fn of(red: u8, green: u8, blue: u8) -> Color {
        Color { bits: red & 3 | (green & 3) << 2 | (blue & 3) << 4 }
    }

    /// Returns the color of the sum of 1 red, 2 green and 4 blue, all bright.
    pub const fn of_sum(sum: u8) -> Color {
        let mut bits = 0;
        if sum & 1 != 0 {
            bits |= Color::RED.bits;
        }
        if sum & 2 != 0 {
            bits |= Color::GREEN.bits;
        }
        if sum & 4 != 0 {
            bits |= Color::BLUE.bits;
        }
        Color { bits }
    }
}

/// Returns the color that stands for the battery's reading (kilolib.c).
pub const fn of_battery(reading: u16) -> Color {
    match reading {
        683.. => Color::GREEN,
        649..683 => Color::BLUE,
        615..649 => Color::YELLOW,
        _ => Color::RED,
    }
}

/// The pattern of a waiting or charging robot: a flash of a ms every 201 ms.
const FLASH: u16 = units(1);
const FLASH_ROUND: u16 = units(201);

/// The pattern of a fault: 200 ms on and 200 ms off, as often as its number, then dark for 1.4 s.
const BLINK: u16 = units(200);
const PAUSE: u8 = 7;

/// The state of a blinking lamp.
#[derive(Debug)]
pub struct Blinker {
    since: u16,
    phase: u8,
}

impl Blinker {
    /// Starts the pattern at `now`.
    pub const fn start(now: u16) -> Self {
        Blinker { since: now, phase: 0 }
    }

    /// Returns true if the lamp of a waiting robot is lit. Call this function at least every eight
    /// seconds.
    pub fn flash(&mut self, now: u16) -> bool {
        let mut at = now.wrapping_sub(self.since);
        if at >= FLASH_ROUND {
            self.since = now;
            at = 0;
        }
        at < FLASH
    }

    /// Returns true if the lamp that shows a fault's number is lit.
    pub fn blink(&mut self, number: u8, now: u16) -> bool {
        if now.wrapping_sub(self.since) >= BLINK {
            self.since = now;
            self.phase += 1;
            if self.phase >= 2 * number + PAUSE {
                self.phase = 0;
            }
        }
        self.phase & 1 == 0 && self.phase < 2 * number
    }
}
