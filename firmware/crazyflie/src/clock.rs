//! The Crazyflie's clock tree, and the time in µs. The crystal has 8 MHz, the core runs at 168 MHz,
//! APB1 at 42 MHz (timers 84), APB2 at 84 MHz (timers 168), and USB and the random number generator
//! at 48 MHz. See RM0090 section 7.2, and 7.3 for the limits.

use embassy_stm32::Config;
use embassy_stm32::pac;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, LsConfig, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv,
    PllSource, Sysclk,
};
use embassy_stm32::time::mhz;

/// Returns the configuration for `embassy_stm32::init`.
pub fn config() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse { freq: mhz(8), mode: HseMode::Oscillator });
    rcc.pll_src = PllSource::HSE;
    // 8 MHz / 8 * 336 = 336 MHz, which is divided by 2 for the core and by 7 for USB.
    rcc.pll = Some(Pll {
        prediv: PllPreDiv::DIV8,
        mul: PllMul::MUL336,
        divp: Some(PllPDiv::DIV2),
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV1;
    rcc.apb1_pre = APBPrescaler::DIV4;
    rcc.apb2_pre = APBPrescaler::DIV2;
    // The real-time clock is not used. Choosing a clock for it would reset the backup domain, which
    // holds the notes of failures (failure.rs).
    rcc.ls = LsConfig::off();
    config
}

/// Returns the time in µs, modulo 65536. embassy's time driver lets timer 5 count µs
/// (`Cargo.toml`).
pub fn us() -> u16 {
    pac::TIM5.cnt().read() as u16
}
