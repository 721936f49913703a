//! Runs a script's global code, `init()` and three steps on an ATmega328P, and prints on the serial port for each how many
//! cycles it took, then the global that `build.rs` names.
//!
//! The panic handler calls a function that does not exist: the program links only if no panic is left in it.

#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

use core::arch::asm;
use core::ptr::{read_volatile, write_volatile};

use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{
    Arguments, Axis, ByteCode, Entry, Host, Image, Outcome, Reply, RobotFault, Value, Vm, rom,
};

// avr-libc's float and memory functions are smaller and faster than those of compiler_builtins.
#[link(name = "m", kind = "static", modifiers = "-bundle")]
#[link(name = "c", kind = "static", modifiers = "-bundle")]
unsafe extern "C" {}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn the_program_contains_a_panic() -> !;
    }
    // SAFETY: it does not exist, so this never links.
    unsafe { the_program_contains_a_panic() }
}

include!(concat!(env!("OUT_DIR"), "/script.rs"));

#[unsafe(link_section = ".progmem.data")]
static SCRIPT: [u8; IMAGE.len()] = *IMAGE;

#[unsafe(link_section = ".progmem.data")]
static ROM: [u8; rom::LENGTH] = rom::BYTES;

/// A byte of flash.
#[inline(always)]
fn lpm(address: usize) -> u8 {
    let byte: u8;
    // SAFETY: `lpm` reads program memory, all of which may be read.
    unsafe {
        asm!("lpm {b}, Z", b = out(reg) byte, in("Z") address as u16,
            options(pure, nomem, nostack, preserves_flags));
    }
    byte
}

/// The image in flash.
#[derive(Clone, Copy)]
struct Flash;

impl ByteCode for Flash {
    fn len(&self) -> usize {
        IMAGE.len()
    }

    #[inline(always)]
    fn byte(&self, at: usize) -> u8 {
        lpm((&raw const SCRIPT as usize).wrapping_add(at))
    }

    fn rom(at: usize) -> u8 {
        lpm((&raw const ROM as usize).wrapping_add(at))
    }

    #[inline(always)]
    fn word(&self, at: usize) -> u16 {
        let address = (&raw const SCRIPT as usize).wrapping_add(at);
        let (low, high): (u8, u8);
        // SAFETY: as above.
        unsafe {
            asm!("lpm {l}, Z+", "lpm {h}, Z", l = out(reg) low, h = out(reg) high,
                inout("Z") address as u16 => _, options(pure, nomem, nostack, preserves_flags));
        }
        u16::from_le_bytes([low, high])
    }
}

struct Probe;

impl Host<Tiny> for Probe {
    fn call<C: ByteCode, const SLOTS: usize>(
        &mut self,
        _: u16,
        _: Arguments<'_, Tiny, C, SLOTS>,
        _: bool,
    ) -> Result<Reply<Tiny>, RobotFault> {
        Ok(Reply::Value(Value::nil()))
    }

    fn log<C: ByteCode, const SLOTS: usize>(&mut self, _: Arguments<'_, Tiny, C, SLOTS>) {}

    fn delay_is_over(&mut self, _: i32, again: bool) -> bool {
        again
    }

    fn position(&mut self, _: Axis) -> Option<f32> {
        None
    }
}

// Timer 1 (data sheet, section 16.11) and USART 0 (section 20.11).
const TCCR1B: *mut u8 = 0x81 as *mut u8;
const TCNT1L: *mut u8 = 0x84 as *mut u8;
const TCNT1H: *mut u8 = 0x85 as *mut u8;
const TIFR1: *mut u8 = 0x36 as *mut u8;
const UCSR0A: *mut u8 = 0xc0 as *mut u8;
const UCSR0B: *mut u8 = 0xc1 as *mut u8;
const UDR0: *mut u8 = 0xc6 as *mut u8;

fn send(byte: u8) {
    // SAFETY: registers of USART 0, which nothing else uses.
    unsafe {
        while read_volatile(UCSR0A) & 0x20 == 0 {}
        write_volatile(UDR0, byte);
    }
}

fn send_number(mut number: u32) {
    let mut digits = [b' '; 11];
    for digit in digits.iter_mut().rev().skip(1) {
        *digit = b'0' + (number % 10) as u8;
        number /= 10;
        if number == 0 {
            break;
        }
    }
    digits.iter().for_each(|digit| send(*digit));
}

/// Runs an entry in slices of one timer period at most; sends its cycles.
#[cfg_attr(feature = "empty", allow(dead_code))]
fn measure(vm: &mut Vm<Tiny, Flash, SLOTS>, entry: Entry) {
    let mut cycles: u32 = 0;
    // SAFETY: registers of timer 1, which nothing else uses.
    unsafe {
        write_volatile(TCCR1B, 0);
        write_volatile(TCNT1H, 0);
        write_volatile(TCNT1L, 0);
        write_volatile(TIFR1, 1);
        write_volatile(TCCR1B, 1);
    }
    let mut last: u16 = 0;
    let mut begun = vm.begin(entry);
    while begun {
        let outcome = vm.run(&mut Probe, 100);
        // SAFETY: as above; the low byte latches the high one.
        let now = unsafe {
            let low = read_volatile(TCNT1L);
            u16::from_le_bytes([low, read_volatile(TCNT1H)])
        };
        cycles = cycles.wrapping_add(u32::from(now.wrapping_sub(last)));
        last = now;
        begun = matches!(outcome, Outcome::Pending | Outcome::Waiting);
        if let Outcome::Fault(fault) = outcome {
            send(b'F');
            send_number(fault.code as u32);
            send_number(u32::from(fault.position));
        }
    }
    send_number(cycles);
    send(b'\n');
}

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    // SAFETY: enables the transmitter.
    unsafe { write_volatile(UCSR0B, 8) };
    #[cfg(not(feature = "empty"))]
    {
        static mut VM: core::mem::MaybeUninit<Vm<Tiny, Flash, SLOTS>> =
            core::mem::MaybeUninit::uninit();
        // SAFETY: the only reference to VM; main runs once.
        let vm = unsafe { (*(&raw mut VM)).write(Vm::new(1)) };
        if vm.load(Image::new(Flash), |_| true).is_err() {
            send(b'E');
        }
        for entry in [Entry::Global, Entry::Init, Entry::Step, Entry::Step, Entry::Step] {
            measure(vm, entry);
        }
        if let Some(value) = vm.global(RESULT_GLOBAL).and_then(Value::as_int) {
            send(b'=');
            send_number(value as u32);
        }
    }
    send(b'\n');
    // SAFETY: ends the emulation: sleep without interrupts.
    unsafe { asm!("cli", "sleep") };
    loop {}
}
