//! The LEDs. The left ones (red, green, blue) belong to the script, and the right ones (red, green)
//! to the firmware:
//!
//! * Green flashes every two seconds while all is well.
//! * Red flashes every two seconds while the battery is low, and four times as often while it is
//!   empty.
//! * Red blinks the number of a fault until the script restarts.
//! * Red is lit permanently when the script cannot run, or when the robot has stopped itself.

use bittybuzz_runtime::blink::{self, PHASE};
use bittybuzz_runtime::liveness::Pulse;
use bittybuzz_runtime::script::ScriptStopped;
use embassy_futures::select::{Either, select};
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::peripherals::{PC0, PC1, PC2, PC3, PD2};
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_time::{Instant, Timer};

use crate::battery;

/// The color of one of the script's LEDs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Color {
    /// The left red LED, bit 0.
    Red = 1,
    /// The left green LED, bit 1.
    Green = 2,
    /// The left blue LED (the charger's), bit 2.
    Blue = 4,
}

/// The script's LEDs.
pub struct ScriptLeds {
    red: Output<'static>,
    green: Output<'static>,
    blue: Output<'static>,
}

impl ScriptLeds {
    /// Takes the pins, with all LEDs dark. A low level lights red and green, and a high one blue
    /// (crazyflie-firmware, led.h).
    pub fn new(
        red: Peri<'static, PC0>,
        green: Peri<'static, PC1>,
        blue: Peri<'static, PD2>,
    ) -> Self {
        ScriptLeds {
            red: Output::new(red, Level::High, Speed::Low),
            green: Output::new(green, Level::High, Speed::Low),
            blue: Output::new(blue, Level::Low, Speed::Low),
        }
    }

    /// Lights exactly the colors whose bits are set.
    pub fn show(&mut self, colors: u8) {
        for color in [Color::Red, Color::Green, Color::Blue] {
            self.set(color, colors & color as u8 != 0);
        }
    }

    /// Switches one color on or off.
    pub fn set(&mut self, color: Color, on: bool) {
        match color {
            Color::Red => self.red.set_level(low_if(on)),
            Color::Green => self.green.set_level(low_if(on)),
            Color::Blue => self.blue.set_level(low_if(!on)),
        }
    }
}

fn low_if(low: bool) -> Level {
    if low { Level::Low } else { Level::High }
}

/// The status that the firmware's LEDs show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The script runs or has ended normally.
    Well,
    /// This fault stopped the script, until its restart or for good.
    Fault(u8),
    /// The script does not run: the image is refused, or the robot has locked itself.
    Stopped,
}

impl From<ScriptStopped> for Status {
    fn from(stopped: ScriptStopped) -> Self {
        match stopped {
            ScriptStopped::Ended => Status::Well,
            ScriptStopped::Fault(cause) => Status::Fault(cause),
            ScriptStopped::Refused => Status::Stopped,
        }
    }
}

/// Carries the latest status to the task of the status LEDs.
pub type StatusChannel = Signal<CriticalSectionRawMutex, Status>;

/// The firmware's LEDs.
pub struct StatusLeds {
    green: Output<'static>,
    red: Output<'static>,
}

impl StatusLeds {
    /// Takes the pins, with both LEDs dark. A low level lights them.
    pub fn new(green: Peri<'static, PC2>, red: Peri<'static, PC3>) -> Self {
        StatusLeds {
            green: Output::new(green, Level::High, Speed::Low),
            red: Output::new(red, Level::High, Speed::Low),
        }
    }

    /// Returns the states (green, red) of the LEDs in phase `phase`, in units of [`PHASE`].
    fn pattern(status: Status, phase: u32) -> (bool, bool) {
        match status {
            // The red flash comes five phases before the green one, so that they do not coincide.
            Status::Well => (phase.is_multiple_of(40), battery::charge().is_flash(phase + 5)),
            Status::Fault(cause) => (false, blink::is_lit(cause, phase)),
            Status::Stopped => (false, true),
        }
    }
}

/// Lights the red status LED, PC3, by its registers, since clocks and drivers are not set up yet
/// and may never be.
pub fn light_red() {
    pac::RCC.ahb1enr().modify(|w| w.set_gpiocen(true));
    pac::GPIOC.bsrr().write(|w| w.set_br(3, true));
    pac::GPIOC.moder().modify(|w| w.set_moder(3, Moder::OUTPUT));
}

/// Runs the task of the status LEDs.
#[embassy_executor::task]
pub async fn show_status(channel: &'static StatusChannel, mut leds: StatusLeds, pulse: Pulse) -> ! {
    let mut status = Status::Well;
    let mut phase = 0;
    let mut next = Instant::now() + PHASE;
    loop {
        pulse.beat();
        let (green, red) = StatusLeds::pattern(status, phase);
        leds.green.set_level(low_if(green));
        leds.red.set_level(low_if(red));
        match select(channel.wait(), Timer::at(next)).await {
            Either::First(now) => {
                status = now;
                phase = 0;
            }
            Either::Second(()) => {
                phase += 1;
                next += PHASE;
            }
        }
    }
}
