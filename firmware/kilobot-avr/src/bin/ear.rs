//! A Kilobot that listens, and reports the messages that it receives on its debug line to a
//! computer: 38,400 baud, a line for each message,
//!
//! ```text
//! ir 0201d9abfeffcdab34050000
//! ```
//! the twelve bytes of the message in hexadecimal, as they came: [`bittybuzz_comms::infrared`] says
//! what they mean. `bbz trace -`
//! reads it and tells of scripts that have stopped; a bridge passes swarm messages on.
//!
//! **Not tried on hardware**: the image is tested in emulation.
//!
//! It sends nothing and runs no script. Of the overhead controller's messages it obeys BOOT, so
//! that KiloGUI can give it another
//! program, and RESET.

#![no_std]
#![no_main]
#![feature(abi_avr_interrupt, asm_experimental_arch)]

#[path = "../adc.rs"]
#[allow(dead_code, reason = "sensors")]
mod adc;
#[path = "../chip.rs"]
mod chip;
#[path = "../clock.rs"]
#[allow(dead_code, reason = "time")]
mod clock;
#[path = "../eeprom.rs"]
#[allow(dead_code, reason = "writing")]
mod eeprom;
#[path = "../hear.rs"]
#[allow(dead_code, reason = "for who also sends")]
mod hear;
#[path = "../power.rs"]
#[allow(dead_code, reason = "sleep")]
mod power;

use bittybuzz_comms::infrared;
use bittybuzz_kilobot::controller;

use chip::registers;

/// Messages that wait for the line. A message takes 4.4 ms, its line 7.3.
const WAITING: usize = 16;

/// UBRR for 38,400 baud at 8 MHz, 0.2 % too fast (data sheet, table 19-10).
const BAUD: u16 = 12;

// memcpy.
#[link(name = "c", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

/// Nothing panics: with a panic left in it the program does not link.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn the_program_contains_a_panic() -> !;
    }
    // SAFETY: it does not exist, so this never links.
    unsafe { the_program_contains_a_panic() }
}

#[avr_device::entry]
fn main() -> ! {
    let chip = &registers();
    power::start(chip);
    hear::start(chip);
    // SAFETY: the bits of the data sheet (19.10): 38,400 baud, transmitter on; eight bits without parity as after a reset.
    unsafe {
        chip.USART0.ubrr0().write(|w| w.bits(BAUD));
        chip.USART0.ucsr0b().write(|w| w.bits(0b0000_1000));
        avr_device::interrupt::enable();
    }
    let mut line =
        Line { waiting: [[0; infrared::MESSAGE]; WAITING], first: 0, count: 0, place: 0 };
    loop {
        power::feed();
        if let Some(heard) = hear::take() {
            line.push(&heard.message);
            match infrared::opened(&heard.message) {
                Some((controller::BOOT, _)) => power::boot(chip),
                Some((controller::RESET, _)) => power::reset(chip),
                _ => {}
            }
        }
        if chip.USART0.ucsr0a().read().udre0().bit_is_set()
            && let Some(byte) = line.next()
        {
            // SAFETY: any byte may be sent.
            unsafe { chip.USART0.udr0().write(|w| w.bits(byte)) };
        }
    }
}

/// Messages that are to be reported, and the progress of the first of them.
struct Line {
    waiting: [[u8; infrared::MESSAGE]; WAITING],
    first: usize,
    count: usize,
    /// Characters of its line that are out.
    place: usize,
}

impl Line {
    /// A message was heard. When there is no room it is lost.
    fn push(&mut self, message: &[u8; infrared::MESSAGE]) {
        if self.count < WAITING
            && let Some(slot) = self.waiting.get_mut((self.first + self.count) % WAITING)
        {
            *slot = *message;
            self.count += 1;
        }
    }

    /// The next character.
    fn next(&mut self) -> Option<u8> {
        if self.count == 0 {
            return None;
        }
        let message = self.waiting.get(self.first)?;
        let place = self.place;
        self.place += 1;
        if let Some(letter) = b"ir ".get(place) {
            return Some(*letter);
        }
        if let Some(byte) = message.get((place - 3) / 2) {
            let digit = if place % 2 == 1 { byte >> 4 } else { byte & 15 };
            return Some(if digit < 10 { b'0' + digit } else { b'a' - 10 + digit });
        }
        self.place = 0;
        self.first = (self.first + 1) % WAITING;
        self.count -= 1;
        Some(b'\n')
    }
}
