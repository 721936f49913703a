//! A firmware that tests the features of a core: a word in flash selects the case, results go to
//! RAM. The test builds it with rustc alone, for the Crazyflie's target.

#![no_std]
#![no_main]

use core::arch::asm;
use core::ptr::{read_volatile, write_volatile};

/// Written by the test before the start.
const CASE: u32 = 0x0802_0000;
/// Address of the results: the first RAM that the bootloader does not overwrite. This program has
/// no variables.
const RESULTS: u32 = 0x2000_5000;

const RCC_CFGR: u32 = 0x4002_3808;
const RCC_APB1ENR: u32 = 0x4002_3840;
const RCC_CSR: u32 = 0x4002_3874;
const TIM5: u32 = 0x4000_0c00;
const TIM5_IRQ: u32 = 50;
const IWDG: u32 = 0x4000_3000;
const NVIC_ISER1: u32 = 0xe000_e104;
const SYST_CSR: u32 = 0xe000_e010;
const VTOR: u32 = 0xe000_ed08;
const AIRCR: u32 = 0xe000_ed0c;
const CPACR: u32 = 0xe000_ed88;

fn read(address: u32) -> u32 {
    // SAFETY: a register of the chip, or memory that no other code uses.
    unsafe { read_volatile(address as *const u32) }
}

fn write(address: u32, value: u32) {
    // SAFETY: as above.
    unsafe { write_volatile(address as *mut u32, value) }
}

fn result(index: u32, value: u32) {
    write(RESULTS + 4 * index, value);
}

#[repr(C)]
union Vector {
    handler: unsafe extern "C" fn(),
    value: u32,
}

const UNEXPECTED: Vector = Vector { handler: unexpected };

#[unsafe(link_section = ".vectors")]
#[used]
static VECTORS: [Vector; 16 + TIM5_IRQ as usize + 1] = {
    let mut vectors = [const { UNEXPECTED }; 16 + TIM5_IRQ as usize + 1];
    vectors[0] = Vector { value: 0x1001_0000 };
    vectors[1] = Vector { handler: reset };
    vectors[3] = Vector { handler: hard_fault };
    vectors[16 + TIM5_IRQ as usize] = Vector { handler: tim5 };
    vectors
};

#[unsafe(no_mangle)]
unsafe extern "C" fn reset() {
    // Switches from the bootloader's 168 MHz back to the 16 MHz internal oscillator, without a
    // divider before TIM5.
    write(RCC_CFGR, 0);
    match read(CASE) {
        0 => stay(accesses),
        1 => stay(wait_for_event),
        2 => stay(busy),
        3 => stay(software_reset),
        4 => stay(watchdog),
        5 => stay(lockup),
        6 => without_vector_table(),
        7 => stay(core_coupled_memory),
        8 => stay(systick),
        9 => stay(floating_point),
        10 => stay(skipped_function),
        11 => stay(masked),
        _ => result(0, u32::MAX),
    }
}

/// Sets the vector table, runs a case and then loops for ever.
fn stay(case: fn()) {
    write(VTOR, (&raw const VECTORS) as u32);
    case();
    loop {
        // SAFETY: does nothing.
        unsafe { asm!("nop") };
    }
}

extern "C" fn unexpected() {
    result(15, 0xdead);
    loop {}
}

/// Loads and stores of many forms, to TIM5's capture and compare registers, which keep 32 bits.
fn accesses() {
    write(RCC_APB1ENR, 1 << 3);
    // SAFETY: registers of TIM5 and RAM.
    unsafe {
        asm!(
            "str {a}, [{tim}, #0x34]",
            "ldr {x}, [{tim}, #0x34]",
            "str {x}, [{out}], #4",
            "ldrb {x}, [{tim}, #0x34]",
            "str {x}, [{out}], #4",
            "ldrsb {x}, [{tim}, #0x34]",
            "str {x}, [{out}], #4",
            "ldrsh {x}, [{tim}, #0x34]",
            "str {x}, [{out}], #4",
            "add {y}, {tim}, #0x30",
            "ldr {x}, [{y}, #4]!",
            "subs {y}, {y}, {tim}",
            "strd {x}, {y}, [{out}], #8",
            "strd {b}, {a}, [{tim}, #0x38]",
            "ldrd {x}, {y}, [{tim}, #0x38]",
            "strd {x}, {y}, [{out}], #8",
            "add {z}, {tim}, #0x38",
            "ldm {z}, {{r0, r1}}",
            "strd r0, r1, [{out}], #8",
            // In an IT block: the skipped instructions must stay skipped.
            "cmp {a}, {a}",
            "ittee eq",
            "ldreq {x}, [{tim}, #0x34]",
            "moveq {y}, #1",
            "ldrne {x}, [{tim}, #0x38]",
            "movne {y}, #2",
            "strd {x}, {y}, [{out}], #8",
            tim = in(reg) TIM5,
            out = inout(reg) RESULTS => _,
            a = in(reg) 0x8182_8384u32,
            b = in(reg) 0x1234_5678u32,
            x = out(reg) _,
            y = out(reg) _,
            z = out(reg) _,
            out("r0") _,
            out("r1") _,
        );
    }
}

/// Starts TIM5, which counts microseconds of the 16 MHz internal oscillator and interrupts at
/// `compare`.
fn start_tim5(compare: u32) {
    write(RCC_APB1ENR, 1 << 3);
    write(TIM5 + 0x28, 15); // PSC
    write(TIM5 + 0x2c, u32::MAX); // ARR
    write(TIM5 + 0x14, 1); // EGR.UG loads the prescaler
    write(TIM5 + 0x10, 0); // SR
    write(TIM5 + 0x34, compare); // CCR1
    write(TIM5 + 0x0c, 1 << 1); // DIER.CC1IE
    write(NVIC_ISER1, 1 << (TIM5_IRQ - 32));
    write(TIM5, 1); // CR1.CEN
}

/// Records the time, and requests the next interrupt a millisecond later.
unsafe extern "C" fn tim5() {
    write(TIM5 + 0x10, 0);
    let count = read(RESULTS) + 1;
    result(0, count);
    result(count.min(8), read(TIM5 + 0x24));
    write(TIM5 + 0x34, read(TIM5 + 0x34) + 1000);
    // The count that the loop of `busy` has reached.
    result(14, read(RESULTS + 4 * 13));
}

/// Tests the event register: SEV sets it and WFE clears it; without an event, WFE waits for the
/// interrupt.
fn wait_for_event() {
    // SAFETY: hints.
    unsafe {
        asm!("sev", "wfe"); // one from the past
        start_tim5(1000);
        asm!("sev", "wfe");
        result(9, read(TIM5 + 0x24));
        loop {
            asm!("wfe");
            result(10, read(RESULTS + 40) + 1);
        }
    }
}

/// Tests a loop of three instructions that counts to RAM and is interrupted by TIM5.
fn busy() {
    start_tim5(1000);
    // SAFETY: writes a result.
    unsafe {
        asm!(
            "movs {n}, #0",
            "2:",
            "adds {n}, {n}, #1",
            "str {n}, [{out}]",
            "b 2b",
            n = out(reg) _,
            out = in(reg) RESULTS + 4 * 13,
        );
    }
}

fn software_reset() {
    let starts = read(RESULTS + 4) + 1;
    result(1, starts);
    result(2, read(RCC_CSR));
    if starts < 3 {
        write(AIRCR, 0x05fa_0004);
    }
}

/// Tests that the watchdog resets a core that never allows interrupts and accesses no peripheral.
fn watchdog() {
    let starts = read(RESULTS + 4) + 1;
    result(1, starts);
    result(2, read(RCC_CSR));
    if starts < 2 {
        write(IWDG, 0x5555);
        write(IWDG + 4, 0); // PR: 32 kHz / 4
        write(IWDG + 8, 799); // RLR: 800 counts of 125 us are 100 ms
        write(IWDG, 0xcccc);
        // SAFETY: masks interrupts.
        unsafe { asm!("cpsid i") };
    }
}

unsafe extern "C" fn hard_fault() {
    result(3, read(RESULTS + 12) + 1);
    fault();
}

fn fault() {
    // SAFETY: takes the exception for undefined instructions.
    unsafe { asm!("udf #0") };
}

fn lockup() {
    fault();
}

/// Tests the vector table at its address after a reset without a bootloader, in erased flash.
fn without_vector_table() {
    write(VTOR, 0);
    fault();
}

/// Tests that addresses in the core-coupled memory work like those on the stack, which is there.
fn core_coupled_memory() {
    write(0x1000_0000, 0x0123_4567);
    result(1, read(0x1000_0000));
    // SAFETY: the free part of the memory, and the stack.
    unsafe {
        write_volatile(0x1000_0002 as *mut u8, 0xff);
        result(2, read(0x1000_0000));
        // A stack pointer set by the program, as start-up code does behind a bootloader.
        asm!(
            "mrs {old}, msp",
            "msr msp, {new}",
            "push {{{value}}}",
            "msr msp, {old}",
            new = in(reg) 0x1000_8000u32,
            value = in(reg) 0x1111u32,
            old = out(reg) _,
        );
        result(4, read(0x1000_7ffc));
    }
    let mut on_stack = [1u32, 2, 3];
    // SAFETY: a variable.
    result(3, unsafe { read_volatile(&raw mut on_stack[2]) });
}

fn systick() {
    write(SYST_CSR, 7);
    result(1, read(SYST_CSR));
}

fn floating_point() {
    write(CPACR, 0xf << 20);
    // SAFETY: loads a register of TIM5.
    unsafe {
        asm!("dsb", "isb", "vldr s0, [{0}]", in(reg) TIM5, out("s0") _);
    }
}

fn skipped_function() {
    result(1, 1);
    change_result();
    result(2, 1);
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn change_result() {
    result(1, 2);
}

/// Tests that WFI ends with an interrupt that is masked, and that the handler runs once it is
/// unmasked.
fn masked() {
    start_tim5(1000);
    // SAFETY: masks interrupts for a while.
    unsafe {
        asm!("cpsid i", "wfi");
        result(9, read(TIM5 + 0x24));
        result(10, read(RESULTS));
        asm!("cpsie i", "isb");
        result(11, read(RESULTS));
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}
