//! The independent watchdog, driven by its registers (RM0090 21). It has to start before anything
//! waits, but embassy's driver needs `embassy_stm32::init` first, which waits for the crystal
//! without limit.
//!
//! The watchdog counts the oscillator LSI, which runs at 17 to 47 kHz (data sheet, LSI oscillator
//! characteristics). Its timeout is therefore between [`TIMEOUT_MIN_MS`], which must leave time to
//! feed the watchdog, and [`TIMEOUT_MAX_MS`], for which motors may turn without control.
//!
//! # Debuggers
//! A debugger that halts the core stops the program, but not the timers of the motors, which go on
//! as they are. The watchdog therefore counts during a halt while a motor turns: it resets the robot,
//! which ends the PWM. With all motors off it stands still, so that a person can look at a robot and
//! let it continue (RM0090 38.16.4). [`count_in_halts`] and [`rest_in_halts`] choose; both clear the
//! stop bits of all timers, which another firmware may have set: only power-on resets DBGMCU.

use bittybuzz_runtime::liveness::CHECK_PERIOD;
use embassy_stm32::pac;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};

/// The timeout in periods of LSI / 4: 250 ms at 32 kHz.
const PERIODS: u16 = 2_000;
const TIMEOUT_MIN_MS: u64 = PERIODS as u64 * 4 / 47;
const TIMEOUT_MAX_MS: u64 = PERIODS as u64 * 4 / 17;

/// The watchdog is fed every [`CHECK_PERIOD`]. At most two thirds of that are left for delays.
const _: () = assert!(TIMEOUT_MIN_MS >= CHECK_PERIOD.as_millis() * 5 / 3);
/// The motors' set-points also expire after half a second.
const _: () = assert!(TIMEOUT_MAX_MS <= 500);

/// Starts the watchdog, which only a reset stops. It needs no other clock than LSI, which it turns
/// on itself.
pub fn start() {
    rest_in_halts();
    pac::IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    pac::IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    pac::IWDG.rlr().write(|w| w.set_rl(PERIODS - 1));
    pac::IWDG.kr().write(|w| w.set_key(Key::START));
}

/// Feeds the watchdog: its counter restarts.
pub fn feed() {
    pac::IWDG.kr().write(|w| w.set_key(Key::RESET));
}

/// Lets the watchdog count while a debugger halts the core. Returns true if the register shows that it
/// does, and that no timer stops: a timer that stops may leave a motor at full power. Motors must not
/// turn otherwise.
#[must_use]
pub fn count_in_halts() -> bool {
    pac::DBGMCU.apb1fzr().write(|_| {});
    pac::DBGMCU.apb1fzr().read().0 == 0
}

/// Lets the watchdog stand still while a debugger halts the core. Call this only with all motors off.
pub fn rest_in_halts() {
    pac::DBGMCU.apb1fzr().write(|w| w.set_iwdg(true));
}
