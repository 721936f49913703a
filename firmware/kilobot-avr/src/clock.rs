//! Time in units of 128 µs, modulo 65536: timer 0 counts 8 MHz / 1024, its overflows are the upper half.

use core::cell::Cell;

use avr_device::interrupt::{self, CriticalSection, Mutex};

use crate::chip::{Chip, registers};

/// 8 of 128 µs.
const WAKE: u8 = 8;

static OVERFLOWS: Mutex<Cell<u8>> = Mutex::new(Cell::new(0));

/// Begins.
#[inline(never)]
pub fn start(chip: &Chip) {
    // Normal mode, prescaler 1024 (ATmega328P data sheet 15.9).
    chip.TC0.tccr0b().write(|w| w.cs0().prescale_1024());
    chip.TC0.timsk0().write(|w| w.toie0().set_bit());
}

/// Now.
#[inline(never)]
pub fn now(chip: &Chip) -> u16 {
    interrupt::free(|guard| {
        let low = chip.TC0.tcnt0().read().bits();
        let mut high = OVERFLOWS.borrow(guard).get();
        // It overflowed, and the interrupt waits.
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
    // SAFETY: any time may be compared with.
    unsafe { chip.TC0.ocr0a().write(|w| w.bits(soon)) };
    chip.TC0.timsk0().write(|w| w.toie0().set_bit().ocie0a().set_bit());
}

// It has woken the processor.
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
