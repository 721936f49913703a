//! The analog converter, which measures the amplitude of messages and the sensors.
//!
//! While the robot listens, the comparator's flag starts a conversion with each pulse (data sheet
//! 23.3, auto triggering). The channel is that of the high gain, and for the second pulse of a
//! message that of the low gain.

use avr_device::interrupt;

use crate::chip::Chip;

/// The channels of the receiver's two amplifiers (kilolib.c).
const HIGH_GAIN: u8 = 0;
const LOW_GAIN: u8 = 1;

/// A sensor; the number is its channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Sensor {
    /// Voltage of the battery.
    Battery = 6,
    /// Ambient light.
    Light = 7,
}

/// The maximum number of polls for the end of a conversion. A conversion takes 13 cycles of 1 MHz,
/// and an iteration of the loop at least eight cycles of 8 MHz.
const POLLS: u8 = 50;

/// Bits of ADCSRA: on with prescaler 8 for 1 MHz, start, and started by the comparator.
const ON: u8 = 0b1000_0011;
const START: u8 = 0b0100_0000;
const TRIGGERED: u8 = 0b0010_0000;

/// Selects the high gain for the next pulse.
#[inline(always)]
pub fn listen_loud(chip: &Chip) {
    listen(chip, HIGH_GAIN);
}

/// Selects the low gain for the next pulse.
#[inline(always)]
pub fn listen_quiet(chip: &Chip) {
    listen(chip, LOW_GAIN);
}

#[inline(always)]
fn listen(chip: &Chip, channel: u8) {
    // SAFETY: every channel is valid, and the bits are those above.
    unsafe {
        chip.ADC.admux().write(|w| w.bits(channel));
        chip.ADC.adcsra().write(|w| w.bits(ON | TRIGGERED));
    }
}

/// Starts to measure the pulses of messages.
#[inline(never)]
pub fn start(chip: &Chip) {
    // The comparator triggers conversions (data sheet, table 23-6).
    // SAFETY: 1 selects the comparator.
    unsafe { chip.ADC.adcsrb().write(|w| w.bits(1)) };
    listen_loud(chip);
}

/// Turns the converter off before the robot sleeps.
pub fn stop(chip: &Chip) {
    // SAFETY: this turns everything off.
    unsafe { chip.ADC.adcsra().write(|w| w.bits(0)) };
}

/// Waits for the running conversion and returns its result, 0 to 1023.
#[inline(never)]
pub fn finish(chip: &Chip) -> u16 {
    for _ in 0..POLLS {
        if chip.ADC.adcsra().read().bits() & START == 0 {
            break;
        }
    }
    chip.ADC.adc().read().bits()
}

/// Reads a sensor, 0 to 1023. A message that begins meanwhile is lost.
#[inline(never)]
pub fn read(chip: &Chip, sensor: Sensor) -> u16 {
    interrupt::free(|_| {
        // SAFETY: every channel is valid, and the bits are those above.
        unsafe {
            chip.ADC.admux().write(|w| w.bits(sensor as u8));
            chip.ADC.adcsra().write(|w| w.bits(ON | START));
        }
        let reading = finish(chip);
        listen_loud(chip);
        reading
    })
}
