//! Power-on, sleep, the watchdog, and the jumps to other programs.

use core::arch::{asm, global_asm};

use avr_device::{asm as instruction, interrupt};
use bittybuzz_kilobot::calibration::OSCILLATOR;

use crate::chip::Chip;
use crate::{adc, clock, eeprom, hear};

// This code runs first. The watchdog may have reset the robot, and is then still on with a short
// timeout (data sheet 11.8.2). r2 keeps the cause of the reset; the start-up code does not use r2.
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

/// The bit of MCUSR for a reset by the watchdog.
const BY_WATCHDOG: u8 = 1 << 3;

/// The pin D2, which supplies the receiver.
const RECEIVER: u8 = 1 << 2;

/// Values of WDTCSR: a watchdog that resets after two seconds, one that wakes after eight, and none
/// (data sheet 11.9.2).
const RESET_2S: u8 = 0b0000_1111;
const WAKE_8S: u8 = 0b0110_0001;
const OFF: u8 = 0;

/// Returns true if the watchdog has reset the robot. Call this function first.
#[inline(always)]
pub fn was_stuck() -> bool {
    let cause: u8;
    // SAFETY: this reads a register that no code has used since the code above.
    unsafe {
        asm!("mov {cause}, r2", cause = out(reg) cause, options(nomem, nostack, preserves_flags))
    };
    cause & BY_WATCHDOG != 0
}

/// Turns everything off except the receiver, corrects the oscillator, and starts the watchdog.
#[inline(never)]
pub fn start(chip: &Chip) {
    ports(chip, RECEIVER);
    let correction = eeprom::read(chip, OSCILLATOR);
    if correction != 0xff {
        // SAFETY: the value was measured for this robot.
        unsafe { chip.CPU.osccal().write(|w| w.bits(correction)) };
    }
    watch(chip, RESET_2S);
}

/// Makes the pins `high` of port D outputs with a high level. All other pins become inputs with a
/// low level.
#[inline(never)]
fn ports(chip: &Chip, high: u8) {
    // SAFETY: with these values all diodes and motors are off.
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
        // The new value must follow at most four cycles after WDCE and WDE were set.
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

/// Feeds the watchdog.
pub fn feed() {
    instruction::wdr();
}

/// Halts the processor until the next interrupt, at most for a ms. All peripherals keep running.
#[inline(always)]
pub fn doze(chip: &Chip) {
    clock::wake_soon(chip);
    // SAFETY: this selects idle mode and enables sleep; below it is disabled (data sheet 10.11.1).
    unsafe { chip.CPU.smcr().write(|w| w.bits(0b0000_0001)) };
    instruction::sleep();
    // SAFETY: as before.
    unsafe { chip.CPU.smcr().write(|w| w.bits(0)) };
}

/// Sleeps for eight seconds, with everything off.
#[inline(never)]
pub fn sleep(chip: &Chip) {
    // The comparator is turned off, since it would continue to draw current.
    // SAFETY: this sets only the bit ACD.
    unsafe { chip.AC.acsr().write(|w| w.bits(0x80)) };
    adc::stop(chip);
    ports(chip, 0);
    watch(chip, WAKE_8S);
    // SAFETY: this selects power-down and enables sleep (data sheet 10.11.1).
    unsafe { chip.CPU.smcr().write(|w| w.bits(0b0000_0101)) };
    instruction::sleep();
    // SAFETY: this disables sleep.
    unsafe { chip.CPU.smcr().write(|w| w.bits(0)) };
    ports(chip, RECEIVER);
    watch(chip, RESET_2S);
    // The receiver needs 300 µs to start.
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

// The interrupt only wakes the robot.
#[avr_device::interrupt(atmega328p)]
fn WDT() {}

/// Restarts the program.
pub fn reset(chip: &Chip) -> ! {
    leave(chip);
    // SAFETY: the program begins at address 0, and initializes everything that it uses.
    unsafe { asm!("jmp 0", options(noreturn)) }
}

/// Starts the boot loader.
pub fn boot(chip: &Chip) -> ! {
    leave(chip);
    // SAFETY: the boot loader is at this address, and does not return.
    unsafe { asm!("jmp 0x7000", options(noreturn)) }
}

/// Restores the state after a reset, as far as the next program relies on that state.
fn leave(chip: &Chip) {
    interrupt::disable();
    watch(chip, OFF);
    ports(chip, 0);
    // SAFETY: this turns the timers' interrupts off.
    unsafe {
        chip.TC0.timsk0().write(|w| w.bits(0));
        chip.TC1.timsk1().write(|w| w.bits(0));
    }
}
