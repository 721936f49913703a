//! The RGB LED. It is the script's, except while the firmware has something to show: a fault blinks red as often as its number
//! until the script starts again, red all the time means that no script can run. A battery that will be empty soon shows by short
//! flashes in the script's colour.
//!
//! The timer is set up by its registers, for the reason that `motors.rs` gives.

use bittybuzz_runtime::blink::{self, PHASE};
use bittybuzz_runtime::liveness::Pulse;
use bittybuzz_runtime::script::Stopped;
use embassy_futures::select::{Either, select};
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::pac::timer::vals::Ocm;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Instant, Timer};

use crate::sensors;

/// 48 MHz / 24 = 2 MHz
const PRESCALER: u16 = 24;
/// 2 MHz / 10000 = 200 Hz
const PERIOD: u16 = 10_000;
/// The LED is very bright: an eighth of its light is plenty (SwarmUI divides all colours by 8).
const ON: u16 = PERIOD / 8;

/// The sum of [`RED`], [`GREEN`] and [`BLUE`].
pub type Color = u8;
/// Channel 3.
pub const RED: Color = 1;
/// The red LED's pin, of port A.
const RED_PIN: usize = 10;
/// Channel 4.
pub const GREEN: Color = 2;
/// Channel 2.
pub const BLUE: Color = 4;

/// The content of the LED.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// The script's colour.
    Script(Color),
    /// This fault stopped the script, until its restart or for good.
    Fault(u8),
    /// The script does not run: the image is refused, or the robot has locked itself.
    Stopped,
}

/// Carries the latest of them to the task.
pub type LightChannel = Signal<CriticalSectionRawMutex, Light>;

impl Light {
    /// Returns the light for a stopped script, unless it has ended normally.
    pub fn of(stopped: Stopped) -> Option<Self> {
        match stopped {
            Stopped::Ended => None,
            Stopped::Fault(cause) => Some(Light::Fault(cause)),
            Stopped::Refused => Some(Light::Stopped),
        }
    }

    /// The colour in phase `phase`, in units of [`PHASE`].
    fn color(self, phase: u32) -> Color {
        match self {
            Light::Script(color) => color,
            Light::Fault(cause) => {
                if blink::is_lit(cause, phase) {
                    RED
                } else {
                    0
                }
            }
            Light::Stopped => RED,
        }
    }
}

/// The LED on TIM1: common anode, so that low shines.
pub struct Led(());

impl Led {
    /// Dark.
    pub fn new() -> Self {
        let timer = pac::TIM1;
        timer.psc().write_value(PRESCALER - 1);
        timer.arr().write(|w| w.set_arr(PERIOD - 1));
        timer.ccmr_output(0).write(|w| {
            w.set_ocm(1, Ocm::PWM_MODE1);
            w.set_ocpe(1, true);
        });
        timer.ccmr_output(1).write(|w| {
            for channel in 0..2 {
                w.set_ocm(channel, Ocm::PWM_MODE1);
                w.set_ocpe(channel, true);
            }
        });
        // Active is low (RM0091 17.4.9, CCxP).
        timer.ccer().write(|w| {
            for channel in 1..4 {
                w.set_cce(channel, true);
                w.set_ccp(channel, true);
            }
        });
        timer.bdtr().write(|w| w.set_moe(true));
        timer.egr().write(|w| w.set_ug(true));
        timer.cr1().write(|w| w.set_cen(true));
        Led(())
    }

    fn show(&mut self, color: Color) {
        for (bit, channel) in [(RED, 2), (GREEN, 3), (BLUE, 1)] {
            let compare = if color & bit == 0 { 0 } else { ON };
            pac::TIM1.ccr(channel).write(|w| w.set_ccr(compare));
        }
    }
}

/// Lets the red LED shine until the timer has it, for a robot that may get no further: its crystal may be dead. The pin is low
/// as an output.
pub fn light_red() {
    pac::RCC.ahbenr().modify(|w| w.set_gpioaen(true));
    pac::GPIOA.moder().modify(|w| w.set_moder(RED_PIN, Moder::OUTPUT));
}

/// The task of the LED.
#[embassy_executor::task]
pub async fn shine(channel: &'static LightChannel, mut led: Led, pulse: Pulse) -> ! {
    let mut light = Light::Script(0);
    let mut phase = 0;
    let mut flash: u32 = 0;
    let mut next = Instant::now() + PHASE;
    loop {
        pulse.beat();
        // Red, or dark where the script's colour has red in it.
        let change = if sensors::charge().is_flash(flash) { RED } else { 0 };
        led.show(match light {
            Light::Script(color) => color ^ change,
            _ => light.color(phase),
        });
        match select(channel.wait(), Timer::at(next)).await {
            Either::First(now) => {
                light = now;
                phase = 0;
            }
            Either::Second(()) => {
                phase += 1;
                flash = flash.wrapping_add(1);
                next += PHASE;
            }
        }
    }
}
