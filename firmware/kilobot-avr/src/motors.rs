//! The vibration motors, on timer 2 with phase-correct PWM of 1961 Hz: left at PB3 (OC2A), right at
//! PD3 (OC2B).

use crate::chip::Chip;

const LEFT: u8 = 1 << 3;
const RIGHT: u8 = 1 << 3;

/// Starts the timer; the motors stand still.
#[inline(never)]
pub fn start(chip: &Chip) {
    // SAFETY: this selects phase-correct PWM, not inverted, at 8 MHz / 8 (data sheet 18.11).
    unsafe {
        chip.TC2.tccr2a().write(|w| w.bits(0b1010_0001));
        chip.TC2.tccr2b().write(|w| w.bits(0b0000_0010));
    }
    drive(chip, [0, 0]);
}

/// Sets the duties of left and right motor, 0 to 255. The pin of a motor that stands still is an
/// input.
#[inline(never)]
pub fn drive(chip: &Chip, [left, right]: [u8; 2]) {
    // SAFETY: the pins belong to the motors.
    unsafe {
        chip.TC2.ocr2a().write(|w| w.bits(left));
        chip.TC2.ocr2b().write(|w| w.bits(right));
        chip.PORTB.ddrb().modify(|r, w| w.bits(with(r.bits(), LEFT, left != 0)));
        chip.PORTD.ddrd().modify(|r, w| w.bits(with(r.bits(), RIGHT, right != 0)));
    }
}

fn with(bits: u8, bit: u8, is_set: bool) -> u8 {
    if is_set { bits | bit } else { bits & !bit }
}
