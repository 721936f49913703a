//! The RGB LED. It belongs to the script, unless the firmware has something to show:
//!
//! * It blinks red the number of a fault until the script restarts.
//! * It is lit red permanently when no script can run.
//! * Short flashes in the script's color show that the battery will be empty soon.
//!
//! The timer is set up by its registers, for the reason in `motors.rs`.

use bittybuzz_runtime::blink::{self, PHASE};
use bittybuzz_runtime::liveness::Pulse;
use bittybuzz_runtime::script::ScriptStopped;
use embassy_futures::select::{Either, select};
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::pac::timer::vals::Ocm;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Instant, Timer};

use crate::sensors;

/// 48 MHz / 24 = 2 MHz.
const PRESCALER: u16 = 24;
/// 2 MHz / 10000 = 200 Hz.
const PERIOD: u16 = 10_000;
/// The compare value of a lit LED. An eighth of the light is enough, since the LED is very bright
/// (SwarmUI divides all colors by 8).
const ON: u16 = PERIOD / 8;

/// A sum of [`RED`], [`GREEN`] and [`BLUE`].
pub type Color = u8;
/// The bit of the red LED, on channel 3.
pub const RED: Color = 1;
/// The pin of the red LED on port A.
const RED_PIN: usize = 10;
/// The bit of the green LED, on channel 4.
pub const GREEN: Color = 2;
/// The bit of the blue LED, on channel 2.
pub const BLUE: Color = 4;

/// The state that the LED shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Light {
    /// The script's color.
    Script(Color),
    /// This fault stopped the script, until its restart or for good.
    Fault(u8),
    /// The script does not run: the image is refused, or the robot has locked itself.
    Stopped,
}

/// Carries the latest [`Light`] to the task.
pub type LightChannel = Signal<CriticalSectionRawMutex, Light>;

impl Light {
    /// Returns the light for a stopped script, unless it has ended normally.
    pub fn of(stopped: ScriptStopped) -> Option<Self> {
        match stopped {
            ScriptStopped::Ended => None,
            ScriptStopped::Fault(cause) => Some(Light::Fault(cause)),
            ScriptStopped::Refused => Some(Light::Stopped),
        }
    }

    /// Returns the color in phase `phase`, in units of [`PHASE`].
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

/// The LED on TIM1. It has a common anode, so a low level lights it.
pub struct Led(());

impl Led {
    /// Starts the timer with the LED dark.
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
        // The outputs are active low (RM0091 17.4.9, CCxP).
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

/// Lights the red LED until the timer drives it, for a robot that gets no further because its
/// crystal is dead. The pin is low as soon as it is an output.
pub fn light_red() {
    pac::RCC.ahbenr().modify(|w| w.set_gpioaen(true));
    pac::GPIOA.moder().modify(|w| w.set_moder(RED_PIN, Moder::OUTPUT));
}

/// Runs the task of the LED.
#[embassy_executor::task]
pub async fn shine(channel: &'static LightChannel, mut led: Led, pulse: Pulse) -> ! {
    let mut light = Light::Script(0);
    let mut phase = 0;
    let mut flash: u32 = 0;
    let mut next = Instant::now() + PHASE;
    loop {
        pulse.beat();
        // A flash toggles red: it is red, or dark if the script's color contains red.
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
