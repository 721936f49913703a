//! The time in units of 128 µs, modulo 65536. Timer 0 counts 8 MHz / 1024, and the number of its
//! overflows is the upper half.

use core::cell::Cell;

use avr_device::interrupt::{self, CriticalSection, Mutex};

use crate::chip::{Chip, registers};

/// The time until `wake_soon` wakes the processor, in units of 128 µs.
const WAKE: u8 = 8;

static OVERFLOWS: Mutex<Cell<u8>> = Mutex::new(Cell::new(0));

/// Starts timer 0.
#[inline(never)]
pub fn start(chip: &Chip) {
    // The timer runs in normal mode with a prescaler of 1024 (ATmega328P data sheet 15.9).
    chip.TC0.tccr0b().write(|w| w.cs0().prescale_1024());
    chip.TC0.timsk0().write(|w| w.toie0().set_bit());
}

/// Returns the present time.
#[inline(never)]
pub fn now(chip: &Chip) -> u16 {
    interrupt::free(|guard| {
        let low = chip.TC0.tcnt0().read().bits();
        let mut high = OVERFLOWS.borrow(guard).get();
        // The timer has overflowed, and its interrupt is pending.
        if chip.TC0.tifr0().read().tov0().bit_is_set() && low < 128 {
            high = high.wrapping_add(1);
        }
        u16::from_le_bytes([low, high])
    })
}

/// Wakes the processor about a ms from now, if it sleeps.
#[inline(always)]
pub fn wake_soon(chip: &Chip) {
    let soon = chip.TC0.tcnt0().read().bits().wrapping_add(WAKE);
    // SAFETY: any compare value is valid.
    unsafe { chip.TC0.ocr0a().write(|w| w.bits(soon)) };
    chip.TC0.timsk0().write(|w| w.toie0().set_bit().ocie0a().set_bit());
}

/// The length of a slice in cycles: 480 µs. Timer 1 counts them; it runs for the infrared receiver.
const SLICE: u16 = 3840;

/// Begins a slice of the script.
#[inline(always)]
pub fn begin_slice(chip: &Chip) {
    // Interrupts are off because they also use the timer's register for upper bytes (data sheet
    // 16.3).
    interrupt::free(|_| {
        let end = chip.TC1.tcnt1().read().bits().wrapping_add(SLICE);
        // SAFETY: any compare value is valid.
        unsafe { chip.TC1.ocr1b().write(|w| w.bits(end)) };
    });
    // Writing a one clears the flag, which is set when the counter leaves `end` (data sheet
    // 16.11.9).
    chip.TC1.tifr1().write(|w| w.ocf1b().set_bit());
}

/// Returns true if the slice has to end.
#[inline(always)]
pub fn is_slice_over(chip: &Chip) -> bool {
    chip.TC1.tifr1().read().ocf1b().bit_is_set()
}

// The interrupt has woken the processor, and is turned off again.
#[avr_device::interrupt(atmega328p)]
fn TIMER0_COMPA() {
    registers().TC0.timsk0().write(|w| w.toie0().set_bit());
}

#[avr_device::interrupt(atmega328p)]
fn TIMER0_OVF() {
    // SAFETY: interrupts are off in a handler.
    let guard = unsafe { CriticalSection::new() };
    let overflows = OVERFLOWS.borrow(guard);
    overflows.set(overflows.get().wrapping_add(1));
}
