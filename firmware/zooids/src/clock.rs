//! The Zooid's clock tree (RM0091 section 6.2). The crystal has 16 MHz, and the core and the buses
//! run at 48 MHz. PA8 supplies the crystal's 16 MHz to the radio, which has no crystal of its own.

use embassy_stm32::Config;
use embassy_stm32::pac::RCC;
use embassy_stm32::pac::rcc::vals::Mcosel;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPreDiv, PllSource, Sysclk,
};
use embassy_stm32::time::mhz;

/// Returns the configuration for `embassy_stm32::init`.
pub fn config() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse { freq: mhz(16), mode: HseMode::Oscillator });
    // 16 MHz / 2 * 6 = 48 MHz.
    rcc.pll = Some(Pll { src: PllSource::HSE, prediv: PllPreDiv::DIV2, mul: PllMul::MUL6 });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV1;
    rcc.apb1_pre = APBPrescaler::DIV1;
    config
}

/// Turns the radio's clock on; it stays on.
pub fn feed_radio() {
    RCC.cfgr().modify(|w| w.set_mcosel(Mcosel::HSE));
}
