//! The two motors: an A3901 full bridge each, its two inputs on TIM2 with PWM of 40 kHz.

use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Moder;

/// PA0 to PA3: both inputs of motor 1 and of motor 2.
const PINS: core::ops::Range<usize> = 0..4;

/// Takes the motors' power whatever state the program is in, until the next reset: the pins become plain outputs, low. The
/// timer no longer reaches them.
pub fn cut_power() {
    // Something may have failed before anybody turned the port on.
    pac::RCC.ahbenr().modify(|w| w.set_gpioaen(true));
    for pin in PINS {
        pac::GPIOA.bsrr().write(|w| w.set_br(pin, true));
    }
    pac::GPIOA.moder().modify(|w| PINS.for_each(|pin| w.set_moder(pin, Moder::OUTPUT)));
}
