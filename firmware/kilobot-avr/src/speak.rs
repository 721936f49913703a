//! The transmission of messages as pulses of infrared light, as in kilolib's `message_send`: 4.4 ms
//! without interrupts.

use core::arch::asm;

use avr_device::interrupt;
use bittybuzz_kilobot::receiver::MESSAGE;

use crate::chip::Chip;
use crate::hear;

/// Intervals in cycles of 8 MHz, as measured with kilolib: from the first pulse to the second, from
/// there to the first start bit, from bit to bit, and from a stop bit to the next start bit.
const LEAD: u16 = 2420;
const TO_BYTES: u16 = 286;
const PITCH: u16 = 270;
const TO_NEXT: u16 = 282;
/// The window in which light between the first two pulses must come from another robot. It begins
/// two bits after the first pulse and lasts seven bits.
const LOOK_FROM: u16 = 522;
const LOOK_UNTIL: u16 = LOOK_FROM + 7 * 269;

/// The I/O address of port B, which `out` takes.
const PORTB: u8 = 0x05;

/// Sends a message with the pins of port B in `transmitters`. Returns false if another robot is
/// sending.
#[inline(never)]
pub fn speak(chip: &Chip, transmitters: u8, message: &[u8; MESSAGE]) -> bool {
    interrupt::free(|_| {
        let directions = chip.PORTB.ddrb().read().bits();
        // SAFETY: the robot's infrared diodes are at these pins.
        unsafe { chip.PORTB.ddrb().write(|w| w.bits(directions | transmitters)) };
        let is_sent = pulses(chip, transmitters, message);
        // SAFETY: as before.
        unsafe { chip.PORTB.ddrb().write(|w| w.bits(directions)) };
        hear::resume(chip);
        is_sent
    })
}

// If this function is inlined, no register is left for the saved SREG, and the proof of
// tools/squeeze rejects flags on the stack.
#[inline(never)]
fn pulses(chip: &Chip, transmitters: u8, message: &[u8; MESSAGE]) -> bool {
    let mut at = chip.TC1.tcnt1().read().bits().wrapping_add(50);
    pulse(chip, at, transmitters);
    wait(chip, at.wrapping_add(LOOK_FROM));
    hear::resume(chip);
    wait(chip, at.wrapping_add(LOOK_UNTIL));
    if hear::has_seen_light(chip) {
        return false;
    }
    at = at.wrapping_add(LEAD);
    pulse(chip, at, transmitters);
    at = at.wrapping_add(TO_BYTES);
    for byte in message {
        pulse(chip, at, transmitters);
        let mut bits = *byte;
        for _ in 0..8 {
            at = at.wrapping_add(PITCH);
            if bits & 1 != 0 {
                pulse(chip, at, transmitters);
            }
            bits >>= 1;
        }
        at = at.wrapping_add(PITCH);
        pulse(chip, at, transmitters);
        at = at.wrapping_add(TO_NEXT);
    }
    true
}

/// Waits until a time that is less than 4 ms away.
#[inline(never)]
fn wait(chip: &Chip, until: u16) {
    while !is_past(chip, until) {}
}

#[inline(always)]
fn is_past(chip: &Chip, until: u16) -> bool {
    (chip.TC1.tcnt1().read().bits().wrapping_sub(until) as i16) >= 0
}

/// Waits until `at`, and sends light for 9 cycles, 1.125 µs.
#[inline(never)]
fn pulse(chip: &Chip, at: u16, transmitters: u8) {
    wait(chip, at);
    // SAFETY: the code lights the diodes and switches them off. Nothing else uses this port, and
    // the levels of its other pins stay 0.
    unsafe {
        asm!(
            "out {port}, {on}",
            "rjmp .+0", "rjmp .+0", "rjmp .+0", "rjmp .+0",
            "out {port}, {off}",
            port = const PORTB, on = in(reg) transmitters, off = in(reg) 0_u8,
            options(nostack, preserves_flags)
        );
    }
}
