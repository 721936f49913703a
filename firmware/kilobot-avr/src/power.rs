//! Switching on, sleeping, and the ways out of the program.

use core::arch::{asm, global_asm};

use avr_device::{asm as instruction, interrupt};
use bittybuzz_kilobot::calibration::OSCILLATOR;

use crate::chip::Chip;
use crate::{adc, clock, eeprom, hear};

// Before anything else: the watchdog, which may have reset the robot, is still on and fast (data sheet 11.8.2). r2 keeps
// why the robot was reset; the start-up code does not use it.
global_asm!(
    ".section .init3, \"ax\", @progbits",
    "wdr",
    "in r2, 0x34",
    "out 0x34, r1",
    "ldi r24, 0x18",
    "sts 0x60, r24",
    "sts 0x60, r1",
    ".text"
);

/// MCUSR: the watchdog.
const BY_WATCHDOG: u8 = 1 << 3;

/// Pin D2 feeds the receiver.
const RECEIVER: u8 = 1 << 2;

/// Watchdog of two seconds that resets, and of eight that wakes: WDTCSR (data sheet 11.9.2).
const RESET_2S: u8 = 0b0000_1111;
const WAKE_8S: u8 = 0b0110_0001;
const OFF: u8 = 0;

/// Returns true if the watchdog has reset the robot. Must be called first.
#[inline(always)]
pub fn was_stuck() -> bool {
    let cause: u8;
    // SAFETY: reads a register that nothing has used since the code above.
    unsafe {
        asm!("mov {cause}, r2", cause = out(reg) cause, options(nomem, nostack, preserves_flags))
    };
    cause & BY_WATCHDOG != 0
}

/// Everything off but the receiver, the oscillator corrected, the watchdog on.
#[inline(never)]
pub fn start(chip: &Chip) {
    ports(chip, RECEIVER);
    let correction = eeprom::read(chip, OSCILLATOR);
    if correction != 0xff {
        // SAFETY: as it was measured for this robot.
        unsafe { chip.CPU.osccal().write(|w| w.bits(correction)) };
    }
    watch(chip, RESET_2S);
}

/// Pins that are outputs and high at port D; all others are inputs and low.
#[inline(never)]
fn ports(chip: &Chip, high: u8) {
    // SAFETY: nothing shines, nothing moves.
    unsafe {
        chip.PORTB.ddrb().write(|w| w.bits(0));
        chip.PORTB.portb().write(|w| w.bits(0));
        chip.PORTC.ddrc().write(|w| w.bits(0));
        chip.PORTC.portc().write(|w| w.bits(0));
        chip.PORTD.ddrd().write(|w| w.bits(high));
        chip.PORTD.portd().write(|w| w.bits(high));
    }
}

/// Sets the watchdog.
#[inline(never)]
fn watch(_: &Chip, what: u8) {
    interrupt::free(|_| {
        // WDCE and WDE first, what is wanted at most four cycles later.
        // SAFETY: WDTCSR is at 0x60.
        unsafe {
            asm!("wdr", "sts 0x60, {change}", "sts 0x60, {what}",
                change = in(reg) 0x18_u8, what = in(reg) what, options(nostack, preserves_flags));
        }
    });
}

/// Returns true if the battery is being charged: pin D0 is low.
pub fn is_charging(chip: &Chip) -> bool {
    chip.PORTD.pind().read().bits() & 1 == 0
}

/// The program lives.
pub fn feed() {
    instruction::wdr();
}

/// Halts the processor until the next interrupt, a ms from now at the latest. All else goes on.
#[inline(always)]
pub fn doze(chip: &Chip) {
    clock::wake_soon(chip);
    // SAFETY: idle, sleep enabled, and disabled (data sheet 10.11.1).
    unsafe { chip.CPU.smcr().write(|w| w.bits(0b0000_0001)) };
    instruction::sleep();
    // SAFETY: as before.
    unsafe { chip.CPU.smcr().write(|w| w.bits(0)) };
}

/// Sleeps for eight seconds, with everything off.
#[inline(never)]
pub fn sleep(chip: &Chip) {
    // The comparator would go on drawing current.
    // SAFETY: bit ACD.
    unsafe { chip.AC.acsr().write(|w| w.bits(0x80)) };
    adc::stop(chip);
    ports(chip, 0);
    watch(chip, WAKE_8S);
    // SAFETY: power-down, sleep enabled (data sheet 10.11.1).
    unsafe { chip.CPU.smcr().write(|w| w.bits(0b0000_0101)) };
    instruction::sleep();
    // SAFETY: sleep disabled.
    unsafe { chip.CPU.smcr().write(|w| w.bits(0)) };
    ports(chip, RECEIVER);
    watch(chip, RESET_2S);
    // The receiver needs 300 µs.
    pause(300);
    adc::start(chip);
    hear::resume(chip);
}

/// Waits for `us` µs, or a little longer.
#[inline(never)]
pub fn pause(us: u16) {
    for _ in 0..us {
        instruction::delay_cycles(8);
    }
}

// Wakes the robot.
#[avr_device::interrupt(atmega328p)]
fn WDT() {}

/// Starts anew.
pub fn reset(chip: &Chip) -> ! {
    leave(chip);
    // SAFETY: the program begins there, and sets all that it uses.
    unsafe { asm!("jmp 0", options(noreturn)) }
}

/// Starts the boot loader.
pub fn boot(chip: &Chip) -> ! {
    leave(chip);
    // SAFETY: the robot's own program, which does not come back.
    unsafe { asm!("jmp 0x7000", options(noreturn)) }
}

/// Restores the state after a reset, as far as the next program relies on it.
fn leave(chip: &Chip) {
    interrupt::disable();
    watch(chip, OFF);
    ports(chip, 0);
    // SAFETY: no timer interrupts.
    unsafe {
        chip.TC0.timsk0().write(|w| w.bits(0));
        chip.TC1.timsk1().write(|w| w.bits(0));
    }
}
