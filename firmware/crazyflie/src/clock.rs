//! The Crazyflie's clock tree: 8 MHz crystal, 168 MHz core, APB1 42 MHz (timers 84), APB2 84 MHz (timers 168),
//! 48 MHz for USB and random numbers. RM0090 section 7.2, limits in section 7.3. And the time in µs.

use embassy_stm32::Config;
use embassy_stm32::pac;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, LsConfig, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv,
    PllSource, Sysclk,
};
use embassy_stm32::time::mhz;

/// For `embassy_stm32::init`.
pub fn config() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse { freq: mhz(8), mode: HseMode::Oscillator });
    rcc.pll_src = PllSource::HSE;
    // 8 MHz / 8 * 336 = 336 MHz: / 2 for the core, / 7 for USB.
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
    // Nothing needs the real-time clock, and choosing a clock for it resets the backup domain, where failures are noted
    // (failure.rs).
    rcc.ls = LsConfig::off();
    config
}

/// Returns the time in µs, modulo 65536: embassy's time driver lets timer 5 count them (`Cargo.toml`).
pub fn us() -> u16 {
    pac::TIM5.cnt().read() as u16
}
