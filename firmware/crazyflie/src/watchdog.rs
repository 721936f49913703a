//! The independent watchdog, by its registers (RM0090 21): it is started before anything waits, and embassy's driver can only
//! be made after `embassy_stm32::init`, which waits for the crystal without limit.
//!
//! It counts the oscillator LSI, which runs at 17 to 47 kHz (data sheet, LSI oscillator characteristics). So the time without
//! food after which it resets the chip has two ends: [`SHORTEST_MS`], which must leave time to feed it, and [`LONGEST_MS`], for
//! which motors may turn without control.

use bittybuzz_runtime::liveness::LOOK;
use embassy_stm32::pac;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};

/// Periods of LSI / 4 until it resets the chip: 250 ms at 32 kHz.
const PERIODS: u16 = 2_000;
const SHORTEST_MS: u64 = PERIODS as u64 * 4 / 47;
const LONGEST_MS: u64 = PERIODS as u64 * 4 / 17;

/// Food comes every [`LOOK`]; two thirds of that is the most by which it may be late.
const _: () = assert!(SHORTEST_MS >= LOOK.as_millis() * 5 / 3);
/// The motors' set-points expire after half a second anyway.
const _: () = assert!(LONGEST_MS <= 500);

/// Starts it; only a reset ends it. It needs no other clock than LSI, which it turns on itself.
pub fn start() {
    // A debugger may stop the core; time stops for the watchdog, too (RM0090 38.16.4).
    pac::DBGMCU.apb1fzr().modify(|w| w.set_iwdg(true));
    pac::IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    pac::IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    pac::IWDG.rlr().write(|w| w.set_rl(PERIODS - 1));
    pac::IWDG.kr().write(|w| w.set_key(Key::START));
}

/// Lets it count from the beginning.
pub fn feed() {
    pac::IWDG.kr().write(|w| w.set_key(Key::RESET));
}
