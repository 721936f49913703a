//! The program of Cortex-M cores in which the flight controller is measured, see
//! `bittybuzz_bench_flight`.

#![no_std]
#![no_main]

use core::hint::black_box;

use bittybuzz_bench_flight::{BenchFlight, FlightSensors};
use debugger_cortex_m::Debugger;

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
