//! The reception of infrared messages, with the analog comparator, timer 1 for the time of each
//! pulse, and the converter.
//!
//! The comparator's output goes to the timer's input capture (data sheet 22.3.2, ACIC). The time of
//! a pulse is therefore exact even if the interrupt is late, as long as it comes before the next
//! pulse.

use core::cell::Cell;

use avr_device::interrupt::{self, CriticalSection, Mutex};
use bittybuzz_kilobot::receiver::{DEADLINE, Pulse, ReceivedMessage, Receiver};

use crate::adc;
use crate::chip::{Chip, registers};

/// The received message, until it is taken. Later messages are lost.
static HEARD: Mutex<Cell<Option<ReceivedMessage>>> = Mutex::new(Cell::new(None));

/// The receiver, which belongs to the interrupts.
static mut RECEIVER: Receiver = Receiver::new();

/// Bits of ACSR: capture by the timer on rising edges; and the flag, which a one clears.
const CAPTURE: u8 = 0b0000_0111;
const FLAG: u8 = 0b0001_0000;

/// Bits of TIMSK1 and TIFR1: input capture, and the deadline (compare A).
const ON_CAPTURE: u8 = 0b0010_0000;
const ON_DEADLINE: u8 = 0b0000_0010;

/// Starts to receive.
pub fn start(chip: &Chip) {
    // SAFETY: the bits follow the data sheet, 22.3 and 16.11.
    unsafe {
        // The pins' digital inputs are off, since only the comparator uses the pins.
        chip.AC.didr1().write(|w| w.bits(0b11));
        // The timer runs in normal mode at 8 MHz and captures rising edges.
        chip.TC1.tccr1b().write(|w| w.bits(0b0100_0001));
    }
    adc::start(chip);
    resume(chip);
}

/// Discards pulses that came while the robot did not listen: those of its own message.
#[inline(never)] // -58 bytes
pub fn resume(chip: &Chip) {
    // SAFETY: as above.
    unsafe {
        chip.AC.acsr().write(|w| w.bits(CAPTURE | FLAG));
        chip.TC1.tifr1().write(|w| w.bits(ON_CAPTURE | ON_DEADLINE));
        chip.TC1.timsk1().write(|w| w.bits(ON_CAPTURE));
    }
}

/// Returns true if a pulse came since [`resume`], while interrupts were off.
///
/// The flag records the pulse, which lasts 9 cycles and may be over between two readings of the
/// comparator's output.
pub fn has_seen_light(chip: &Chip) -> bool {
    chip.AC.acsr().read().aci().bit_is_set()
}

/// Returns true if a message is being received.
#[inline(never)]
pub fn is_busy() -> bool {
    let receiver = &raw const RECEIVER;
    // SAFETY: no interrupt changes the receiver meanwhile.
    interrupt::free(|_| unsafe { &*receiver }.is_busy())
}

/// Returns true if a received message waits.
pub fn has_message() -> bool {
    interrupt::free(|guard| HEARD.borrow(guard).get().is_some())
}

/// Takes the received message, if there is one.
pub fn take() -> Option<ReceivedMessage> {
    interrupt::free(|guard| HEARD.borrow(guard).take())
}

#[avr_device::interrupt(atmega328p)]
fn TIMER1_CAPT() {
    let chip = registers();
    let at = chip.TC1.icr1().read().bits();
    // Clearing the flag lets the next pulse start a conversion.
    // SAFETY: the bits follow the data sheet.
    unsafe { chip.AC.acsr().write(|w| w.bits(CAPTURE | FLAG)) };
    let receiver = &raw mut RECEIVER;
    // SAFETY: only the two handlers change the receiver, and neither interrupts the other.
    let receiver = unsafe { &mut *receiver };
    match receiver.pulse(at) {
        Pulse::Inside => {}
        Pulse::First => {
            expect_by(&chip, at);
            receiver.received.amplitudes.high_gain = adc::finish(&chip);
            adc::listen_quiet(&chip);
        }
        Pulse::Second => {
            receiver.received.amplitudes.low_gain = adc::finish(&chip);
            adc::listen_loud(&chip);
        }
        Pulse::Start => expect_by(&chip, at),
        Pulse::Last => {
            end(&chip);
            // SAFETY: interrupts are off in a handler.
            let guard = unsafe { CriticalSection::new() };
            let heard = HEARD.borrow(guard);
            if heard.get().is_none() {
                heard.set(Some(receiver.received));
            }
        }
        Pulse::Stray => end(&chip),
    }
}

#[avr_device::interrupt(atmega328p)]
fn TIMER1_COMPA() {
    let receiver = &raw mut RECEIVER;
    // SAFETY: only the two handlers change the receiver, and neither interrupts the other.
    unsafe { &mut *receiver }.give_up();
    end(&registers());
}

/// Sets the deadline by which the next byte must have begun.
#[inline(never)]
fn expect_by(chip: &Chip, start: u16) {
    // SAFETY: any compare value is valid, and the bits are those above.
    unsafe {
        chip.TC1.ocr1a().write(|w| w.bits(start.wrapping_add(DEADLINE)));
        chip.TC1.tifr1().write(|w| w.bits(ON_DEADLINE));
        chip.TC1.timsk1().write(|w| w.bits(ON_CAPTURE | ON_DEADLINE));
    }
}

/// Ends the reception and waits for another message.
#[inline(never)]
fn end(chip: &Chip) {
    // SAFETY: as above.
    unsafe { chip.TC1.timsk1().write(|w| w.bits(ON_CAPTURE)) };
    adc::listen_loud(chip);
}
