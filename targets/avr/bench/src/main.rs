//! The benchmark program of the ATmega328P, see `bittybuzz_bench`.
//!
//! The program sends marks by writing to the general purpose I/O registers (ATmega328P data sheet,
//! section 8.5), which have no other use here: first the value to GPIOR1 and GPIOR2, then the mark
//! to GPIOR0. `simavr` records each change with its cycle, because the section `.mmcu` requests it.

#![no_std]
#![no_main]
#![feature(asm_experimental_arch)]

mod flash;
mod trace;

use core::arch::asm;

use bittybuzz_bench::{MEMORY, Mark, Meter, run, slots};
use bittybuzz_vm_core::number::Tiny;
use bittybuzz_vm_core::{Image, Vm};
use chip_avr::stop;

use crate::flash::Flash;

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    stop()
}

/// The machine under test.
type Machine = Vm<Tiny, Flash, { slots::KILOBOT }>;

/// The machine must not need more memory than the robot file states.
const _: () = assert!(size_of::<Machine>() <= MEMORY);

/// I/O addresses of GPIOR0, GPIOR1 and GPIOR2.
const GPIOR: [u8; 3] = [0x1e, 0x2a, 0x2b];

struct Registers;

impl Meter for Registers {
    #[inline(always)]
    fn mark(&mut self, mark: Mark, value: u32) {
        // The lower half of a tiny float is zero; the upper half of other values has no
        // information.
        let half = if mark == Mark::Float { value >> 16 } else { value };
        let [low, high, ..] = half.to_le_bytes();
        // SAFETY: no other code uses these registers. The block may access memory as far as the
        // compiler knows, which keeps the counted work between its marks.
        unsafe {
            asm!("out {r1}, {low}", "out {r2}, {high}", "out {r0}, {mark}",
                r0 = const GPIOR[0], r1 = const GPIOR[1], r2 = const GPIOR[2],
                low = in(reg) low, high = in(reg) high, mark = in(reg) mark as u8,
                options(nostack, preserves_flags));
        }
    }
}

#[unsafe(no_mangle)]
extern "C" fn main() -> ! {
    static mut MACHINE: Machine = Vm::new();
    let place = &raw mut MACHINE;
    // SAFETY: this is the only reference to the machine, because main runs once.
    let vm = unsafe { &mut *place };
    run(vm, Image::new(Flash), Flash::global(), &mut Registers);
    stop()
}
