//! A Kilobot that receives messages and sends them to a computer on its debug line: 38,400 baud,
//! with one line for each message:
//!
//! ```text
//! ir 0201d9abfeffcdab34050000
//! ```
//! The digits are the twelve bytes of the message in hexadecimal, as they were received;
//! [`bittybuzz_comms::infrared`] describes them. `bbz trace -` reads these lines and reports
//! scripts that have stopped, and a bridge passes swarm messages on.
//!
//! **Not tried on hardware**: the image is tested in emulation only.
//!
//! This program sends no messages and runs no script. It handles two messages of the overhead
//! controller: BOOT, so that KiloGUI can load another program, and RESET.

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

/// The number of messages that can wait for the debug line. A message takes 4.4 ms, its line 7.3
/// ms.
const WAITING: usize = 16;

/// The value of UBRR for 38,400 baud at 8 MHz, which is 0.2 % too fast (data sheet, table 19-10).
const BAUD: u16 = 12;

// The C library supplies memcpy.
#[link(name = "c", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

/// Makes the link fail if the program contains a panic.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn the_program_contains_a_panic() -> !;
    }
    // SAFETY: the function does not exist, so this never links.
    unsafe { the_program_contains_a_panic() }
}

#[avr_device::entry]
fn main() -> ! {
    let chip = &registers();
    power::start(chip);
    hear::start(chip);
    // SAFETY: the bits follow the data sheet (19.10): 38,400 baud, transmitter on; eight bits
    // without parity are the state after a reset.
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
            // SAFETY: any byte is valid.
            unsafe { chip.USART0.udr0().write(|w| w.bits(byte)) };
        }
    }
}

/// The messages that wait for the debug line, and the progress of the first one.
struct Line {
    waiting: [[u8; infrared::MESSAGE]; WAITING],
    first: usize,
    count: usize,
    /// The number of characters of the first message's line that were sent.
    place: usize,
}

impl Line {
    /// Adds a received message. The message is lost if there is no room.
    fn push(&mut self, message: &[u8; infrared::MESSAGE]) {
        if self.count < WAITING
            && let Some(slot) = self.waiting.get_mut((self.first + self.count) % WAITING)
        {
            *slot = *message;
            self.count += 1;
        }
    }

    /// Returns the next character to be sent.
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
