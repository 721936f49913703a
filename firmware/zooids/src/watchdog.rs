//! The independent watchdog, fed while all tasks live (RM0091 chapter 24).

use bittybuzz_runtime::liveness::{LOOK, Liveness};
use embassy_stm32::pac::IWDG;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_time::Timer;

use crate::log::error;

/// Periods of the watchdog's own clock, divided by 4, without food after which the chip restarts: that clock is between 30 and 50
/// kHz (data sheet, table 42), so that it takes 200 to 333 ms; food comes every 100 ms.
const RELOAD: u16 = 2500;

/// Starts it, for ever.
pub fn start() {
    IWDG.kr().write(|w| w.set_key(Key::START));
    IWDG.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG.pr().write(|w| w.set_pr(Pr::DIVIDE_BY4));
    IWDG.rlr().write(|w| w.set_rl(RELOAD));
    // They take effect in the watchdog's time (24.4.4).
    while IWDG.sr().read().0 != 0 {}
    pet();
}

fn pet() {
    IWDG.kr().write(|w| w.set_key(Key::RESET));
}

/// The task.
#[embassy_executor::task]
pub async fn feed(tasks: &'static Liveness) -> ! {
    loop {
        if tasks.all_live() {
            pet();
        }
        Timer::after(LOOK).await;
        if tasks.missing() != 0 {
            error!("no sign of life from task(s) {=u8:b}", tasks.missing());
        }
    }
}
