//! The independent watchdog, fed while all tasks live (RM0091 chapter 24).
//!
//! A debugger that halts the core stops the program, but not the timer of the motors. The watchdog
//! therefore counts during a halt while a motor has power, and resets the robot. Otherwise it stands
//! still, so that a person can look at a robot and let it continue (RM0091 32.9.4).

use bittybuzz_runtime::liveness::{CHECK_PERIOD, Liveness};
use embassy_stm32::pac;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::Timer;

use crate::Task;
use bittybuzz_board::log::error;

/// The timeout in µs, at the 40 kHz that the driver assumes. The watchdog's own clock has 30 to 50
/// kHz (data sheet, table 42), so the timeout is 200 to 333 ms. The watchdog is fed every 100 ms.
const TIMEOUT_US: u32 = 250_000;

/// The watchdog.
pub type Watchdog = IndependentWatchdog<'static, IWDG>;

/// Starts the watchdog, which only a reset stops. Call this function before anything waits, so that
/// the robot also restarts if its crystal does not start.
pub fn start() -> Watchdog {
    pac::RCC.apb2enr().modify(|w| w.set_dbgmcuen(true));
    rest_in_halts();
    // SAFETY: the peripheral from `embassy_stm32::init` is not used, because `init` waits for the
    // crystal first.
    let mut watchdog = IndependentWatchdog::new(unsafe { IWDG::steal() }, TIMEOUT_US);
    watchdog.unleash();
    watchdog
}

/// Lets the watchdog count while a debugger halts the core. Returns true if the register shows that it
/// does, and that no timer stops. Motors must have no power otherwise.
#[must_use]
pub fn count_in_halts() -> bool {
    pac::DBGMCU.apb1_fz().write(|_| {});
    pac::DBGMCU.apb1_fz().read().0 == 0
}

/// Lets the watchdog stand still while a debugger halts the core. Call this only while the motors have
/// no power.
pub fn rest_in_halts() {
    pac::DBGMCU.apb1_fz().write(|w| w.set_iwdg(true));
}

/// Runs the task that feeds the watchdog.
#[embassy_executor::task]
pub async fn feed(mut watchdog: Watchdog, tasks: &'static Liveness<Task>) -> ! {
    loop {
        if tasks.all_live() {
            watchdog.pet();
        }
        Timer::after(CHECK_PERIOD).await;
        for _task in tasks.missing() {
            error!("no sign of life from task {}", _task);
        }
    }
}
