//! The Zooid's clock tree: 16 MHz crystal, 48 MHz core and buses (RM0091 section 6.2), and the crystal's 16 MHz on PA8 for
//! the radio, which has no crystal of its own.

use embassy_stm32::Config;
use embassy_stm32::pac::RCC;
use embassy_stm32::pac::rcc::vals::Mcosel;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllMul, PllPreDiv, PllSource, Sysclk,
};
use embassy_stm32::time::mhz;

/// For `embassy_stm32::init`.
pub fn config() -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse { freq: mhz(16), mode: HseMode::Oscillator });
    // 16 MHz / 2 * 6
    rcc.pll = Some(Pll { src: PllSource::HSE, prediv: PllPreDiv::DIV2, mul: PllMul::MUL6 });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV1;
    rcc.apb1_pre = APBPrescaler::DIV1;
    config
}

/// Gives the radio its clock, for ever.
pub fn feed_radio() {
    RCC.cfgr().modify(|w| w.set_mcosel(Mcosel::HSE));
}
