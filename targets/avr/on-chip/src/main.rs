//! The program of the AVR, see `bittybuzz_on_chip`. It reports through USART 0.

#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::arch::asm;
use core::ptr::write_volatile;

use bittybuzz_on_chip::{Batch, run_batch, slots};
use bittybuzz_progmem as progmem;
use bittybuzz_vm_core::number::{Profile, Tiny};
use bittybuzz_vm_core::{ByteCode, Part, Parts, Vm};
use chip_avr::stop;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // The runner detects the missing report.
    stop()
}

/// Bytes for a batch: the flash of the chip that the machine leaves free.
const ROOM: usize = 0x1400;

#[unsafe(no_mangle)]
#[unsafe(link_section = ".progmem.data")]
static BATCH: [u8; ROOM] = [0; ROOM];

/// The batch in program memory.
struct Flash;

impl Batch for Flash {
    type Code = Slice;

    fn part(&self, at: usize, length: usize) -> Slice {
        Slice { address: (&raw const BATCH as usize).wrapping_add(at), length }
    }
}

/// A part of the batch.
#[derive(Clone, Copy)]
struct Slice {
    address: usize,
    length: usize,
}

impl ByteCode for Slice {
    type Slots<P: Profile, const SLOTS: usize> = P::Slots<SLOTS>;

    // No image of a batch uses other robots, and the other parts of the machine would leave no room
    // for images.
    const PARTS: Parts = Parts::LANGUAGE.and(Parts::of(&[Part::Maths]));

    fn len(&self) -> usize {
        self.length
    }

    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        progmem::byte(self.address.wrapping_add(at))
    }

    #[inline(always)]
    fn word(&self, at: usize) -> u16 {
        progmem::word(self.address.wrapping_add(at))
    }

    fn rom<P: Profile>(at: usize) -> u8 {
        progmem::rom(Self::PARTS, at)
    }
}

// USART 0 (ATmega328P data sheet, section 19.10).
const UCSR0B: *mut u8 = 0xc1 as *mut u8;
const TRANSMITTER: u8 = 1 << 3;
const UDR0: *mut u8 = 0xc6 as *mut u8;

/// Sends a byte and waits until it is sent. At the highest rate, the one after reset, that takes
/// 160 cycles. The loop does not poll the register, because the emulator would sleep at each poll.
fn send(byte: u8) {
    // SAFETY: no other code uses the register.
    unsafe { write_volatile(UDR0, byte) };
    for _ in 0..80_u8 {
        // SAFETY: `nop` has no effect.
        unsafe { asm!("nop", options(nomem, nostack, preserves_flags)) };
    }
}

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    static mut MACHINE: Vm<Tiny, Slice, { slots::KILOBOT }> = Vm::new();
    // SAFETY: no other code uses the register.
    unsafe { write_volatile(UCSR0B, TRANSMITTER) };
    let place = &raw mut MACHINE;
    // SAFETY: this is the only reference to the machine, because main runs once.
    let vm = unsafe { &mut *place };
    run_batch(vm, &Flash, |report| report.line().into_iter().for_each(send));
    stop()
}
