//! The LEDs. The left ones (red, green, blue) are the script's, the right ones the firmware's:
//! green blinks shortly every two seconds while all is well, and red does so, too, while the battery is low, four times as often while it
//! is empty; red blinks the number of a fault until the script starts again, or shines when the script cannot run or the robot
//! has stopped itself.

use bittybuzz_runtime::blink::{self, PHASE};
use bittybuzz_runtime::liveness::Pulse;
use bittybuzz_runtime::script::Stopped;
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

/// A light of the script.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Color {
    /// Left, bit 0.
    Red = 1,
    /// Left, bit 1.
    Green = 2,
    /// Left (the charger's), bit 2.
    Blue = 4,
}

/// The script's LEDs.
pub struct ScriptLeds {
    red: Output<'static>,
    green: Output<'static>,
    blue: Output<'static>,
}

impl ScriptLeds {
    /// All dark. Red and green are lit by a low level, blue by a high one (crazyflie-firmware, led.h).
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

    /// Lights exactly the colours whose bits are set.
    pub fn show(&mut self, colors: u8) {
        for color in [Color::Red, Color::Green, Color::Blue] {
            self.set(color, colors & color as u8 != 0);
        }
    }

    /// Lights or darkens one colour.
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
    /// All is well.
    Well,
    /// This fault stopped the script, until its restart or for good.
    Fault(u8),
    /// The script does not run: the image is refused, or the robot has locked itself.
    Stopped,
}

impl From<Stopped> for Status {
    fn from(stopped: Stopped) -> Self {
        match stopped {
            Stopped::Ended => Status::Well,
            Stopped::Fault(cause) => Status::Fault(cause),
            Stopped::Refused => Status::Stopped,
        }
    }
}

/// Carries the latest status to the task.
pub type StatusChannel = Signal<CriticalSectionRawMutex, Status>;

/// The firmware's LEDs.
pub struct StatusLeds {
    green: Output<'static>,
    red: Output<'static>,
}

impl StatusLeds {
    /// Both dark; both are lit by a low level.
    pub fn new(green: Peri<'static, PC2>, red: Peri<'static, PC3>) -> Self {
        StatusLeds {
            green: Output::new(green, Level::High, Speed::Low),
            red: Output::new(red, Level::High, Speed::Low),
        }
    }

    /// Which of them (green, red) are lit in phase `phase`, in units of [`PHASE`].
    fn pattern(status: Status, phase: u32) -> (bool, bool) {
        match status {
            // Not together with green.
            Status::Well => (phase.is_multiple_of(40), battery::charge().is_flash(phase + 5)),
            Status::Fault(cause) => (false, blink::is_lit(cause, phase)),
            Status::Stopped => (false, true),
        }
    }
}

/// Lights the red status LED, PC3, by its registers: clocks and drivers are not set up yet, and may never be.
pub fn light_red() {
    pac::RCC.ahb1enr().modify(|w| w.set_gpiocen(true));
    pac::GPIOC.bsrr().write(|w| w.set_br(3, true));
    pac::GPIOC.moder().modify(|w| w.set_moder(3, Moder::OUTPUT));
}

/// The task of the status LEDs.
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
