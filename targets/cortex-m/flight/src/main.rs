//! The program of Cortex-M cores in which the flight controller is measured, see
//! `bittybuzz_bench_flight`.
//!
//! The program sends marks by calling [`bench_mark`], where a debugger stops it and makes it return
//! at once.

#![no_std]
#![no_main]

use core::arch::naked_asm;
use core::hint::black_box;

use bittybuzz_bench::{Mark, Meter};
use bittybuzz_bench_flight::{BenchFlight, FlightSensors};

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    // The runner detects the missing mark.
    loop {
        core::hint::spin_loop();
    }
}

/// Receives the mark in R0 and the value in R1.
#[unsafe(naked)]
#[unsafe(no_mangle)]
extern "C" fn bench_mark(_mark: u32, _value: u32) {
    naked_asm!("bx lr")
}

struct Debugger;

impl Meter for Debugger {
    #[inline(always)]
    fn mark(&mut self, mark: Mark, value: u32) {
        bench_mark(mark as u32, value);
    }
}

#[unsafe(no_mangle)]
static FLIGHT_SENSORS: [u8; 4] = [0; 4];

#[cortex_m_rt::entry]
fn main() -> ! {
    let sensors = match black_box(&FLIGHT_SENSORS) {
        [0, ..] => FlightSensors::Pose,
        _ => FlightSensors::Deck,
    };
    BenchFlight::new(sensors).run(&mut Debugger);
    loop {
        core::hint::spin_loop();
    }
}
