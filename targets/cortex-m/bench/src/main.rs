//! The benchmark program of Cortex-M cores, see `bittybuzz_bench`.

#![no_std]
#![no_main]

use core::hint::black_box;

use bittybuzz_bench::{HEADER, ROOM, run, slots, split};
#[cfg(feature = "full")]
use bittybuzz_vm_core::number::Full as Numbers;
#[cfg(not(feature = "full"))]
use bittybuzz_vm_core::number::Tiny as Numbers;
use bittybuzz_vm_core::{FlashArea, Image, Vm};
use debugger_cortex_m::Debugger;

/// Slots of the machine of the robot with this core.
#[cfg(target_abi = "eabihf")]
const SLOTS: usize = slots::CRAZYFLIE;
#[cfg(not(target_abi = "eabihf"))]
const SLOTS: usize = slots::ZOOIDS;

#[unsafe(no_mangle)]
static BENCH_SCRIPT: [u8; ROOM] = [0; ROOM];

type Section = FlashArea<'static, { ROOM - HEADER }>;

#[cortex_m_rt::entry]
fn main() -> ! {
    // The entry macro turns this into a reference, because main runs once.
    static mut MACHINE: Vm<Numbers, Section, SLOTS> = Vm::new();
    let bytes = black_box(&BENCH_SCRIPT);
    let (global, image) = split(bytes);
    // The image is an area of flash, as in the firmware of robots.
    let area = bytes.last_chunk().and_then(|area| Section::new(area, image.len()));
    let Some(image) = area else { panic!() };
    run(MACHINE, Image::new(image), global, &mut Debugger);
    loop {
        core::hint::spin_loop();
    }
}
