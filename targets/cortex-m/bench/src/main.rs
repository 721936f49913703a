//! The benchmark program of Cortex-M cores, see `bittybuzz_bench`.

#![no_std]
#![no_main]

use core::hint::black_box;

#[cfg(target_abi = "eabihf")]
use bittybuzz_bench::slots::CRAZYFLIE as SLOTS;
#[cfg(not(target_abi = "eabihf"))]
use bittybuzz_bench::slots::ZOOIDS as SLOTS;
use bittybuzz_bench::{HEADER, ROOM, run, split};
// The machine of the firmware has the same type, and so the same quick loop.
use bittybuzz_crazyflie_machine::{IMAGE_AREA, Section};
#[cfg(feature = "full")]
use bittybuzz_vm_core::number::Full as Numbers;
#[cfg(not(feature = "full"))]
use bittybuzz_vm_core::number::Tiny as Numbers;
use bittybuzz_vm_core::{Image, Vm};
use debugger_cortex_m::Debugger;

#[unsafe(no_mangle)]
static BENCH_SCRIPT: [u8; ROOM] = [0; ROOM];

#[cortex_m_rt::entry]
fn main() -> ! {
    // The entry macro turns this into a reference, because main runs once.
    static mut MACHINE: Vm<Numbers, Section, SLOTS> = Vm::new();
    let bytes = black_box(&BENCH_SCRIPT);
    let (global, image) = split(bytes);
    // The image is an area of flash, as in the firmware of robots.
    let area = bytes.get(HEADER..).and_then(<[u8]>::first_chunk::<IMAGE_AREA>);
    let Some(image) = area.and_then(|area| Section::new(area, image.len())) else { panic!() };
    run(MACHINE, Image::new(image), global, &mut Debugger);
    loop {
        core::hint::spin_loop();
    }
}
