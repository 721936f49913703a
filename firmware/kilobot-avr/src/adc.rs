//! The analog converter: how loud a message is, and the sensors.
//!
//! While the robot listens, the comparator's flag starts a conversion with each pulse (data sheet 23.3, auto triggering):
//! by itself with the high gain, and for the second pulse of a message with the low one.

use avr_device::interrupt;

use crate::chip::Chip;

/// Channels (facts of kilolib.c).
const HIGH_GAIN: u8 = 0;
const LOW_GAIN: u8 = 1;

/// A sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Sensor {
    /// Voltage of the battery.
    Battery = 6,
    /// Ambient light.
    Light = 7,
}

/// A conversion takes 13 cycles of 1 MHz; this loop eight of 8 MHz, or more.
const POLLS: u8 = 50;

/// Bits of ADCSRA: on, start, started by the comparator, prescaler 8 for 1 MHz.
const ON: u8 = 0b1000_0011;
const START: u8 = 0b0100_0000;
const TRIGGERED: u8 = 0b0010_0000;

/// The next pulse is measured with the high gain.
#[inline(always)]
pub fn listen_loud(chip: &Chip) {
    listen(chip, HIGH_GAIN);
}

/// The next pulse is measured with the low gain.
#[inline(always)]
pub fn listen_quiet(chip: &Chip) {
    listen(chip, LOW_GAIN);
}

#[inline(always)]
fn listen(chip: &Chip, channel: u8) {
    // SAFETY: every channel may be chosen, and the bits are those above.
    unsafe {
        chip.ADC.admux().write(|w| w.bits(channel));
        chip.ADC.adcsra().write(|w| w.bits(ON | TRIGGERED));
    }
}

/// Begins to listen.
#[inline(never)]
pub fn start(chip: &Chip) {
    // Triggered by the comparator (data sheet, table 23-6).
    // SAFETY: 1 is that.
    unsafe { chip.ADC.adcsrb().write(|w| w.bits(1)) };
    listen_loud(chip);
}

/// Off, to sleep.
pub fn stop(chip: &Chip) {
    // SAFETY: all of it off.
    unsafe { chip.ADC.adcsra().write(|w| w.bits(0)) };
}

/// Waits for the running conversion: 0 to 1023.
#[inline(never)]
pub fn finish(chip: &Chip) -> u16 {
    for _ in 0..POLLS {
        if chip.ADC.adcsra().read().bits() & START == 0 {
            break;
        }
    }
    chip.ADC.adc().read().bits()
}

/// Reads a sensor: 0 to 1023. A message that begins meanwhile is lost.
#[inline(never)]
pub fn read(chip: &Chip, sensor: Sensor) -> u16 {
    interrupt::free(|_| {
        // SAFETY: every channel may be chosen, and the bits are those above.
        unsafe {
            chip.ADC.admux().write(|w| w.bits(sensor as u8));
            chip.ADC.adcsra().write(|w| w.bits(ON | START));
        }
        let reading = finish(chip);
        listen_loud(chip);
        reading
    })
}
