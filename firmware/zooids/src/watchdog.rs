//! The independent watchdog, fed while all tasks live (RM0091 chapter 24).

use bittybuzz_runtime::liveness::{LOOK, Liveness};
use embassy_stm32::pac;
use embassy_stm32::peripherals::IWDG;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_time::Timer;

use crate::log::error;

/// Time without food after which the chip restarts, at the 40 kHz that the driver counts with. The watchdog's own clock has 30
/// to 50 kHz (data sheet, table 42), so that it takes 200 to 333 ms; food comes every 100 ms.
const TIMEOUT_US: u32 = 250_000;

/// The watchdog.
pub type Watchdog = IndependentWatchdog<'static, IWDG>;

/// Starts it, for ever: before anything waits, so that the robot also restarts if its crystal does not start.
pub fn start() -> Watchdog {
    // A debugger may stop the core; time stops for the watchdog, too (RM0091 32.9.4).
    pac::RCC.apb2enr().modify(|w| w.set_dbgmcuen(true));
    pac::DBGMCU.apb1_fz().modify(|w| w.set_iwdg(true));
    // SAFETY: the one that `embassy_stm32::init` returns is not used: `init` waits for the crystal first.
    let mut watchdog = IndependentWatchdog::new(unsafe { IWDG::steal() }, TIMEOUT_US);
    watchdog.unleash();
    watchdog
}

/// The task.
#[embassy_executor::task]
pub async fn feed(mut watchdog: Watchdog, tasks: &'static Liveness) -> ! {
    loop {
        if tasks.all_live() {
            watchdog.pet();
        }
        Timer::after(LOOK).await;
        if tasks.missing() != 0 {
            error!("no sign of life from task(s) {=u8:b}", tasks.missing());
        }
    }
}
