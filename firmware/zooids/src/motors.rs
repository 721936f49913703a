//! The two motors. Each has an A3901 full bridge, whose two inputs are on TIM2 with a PWM of 40
//! kHz.
//!
//! | motor | inputs | timer 2 |
//! |---|---|---|
//! | 1, left | PA0, PA1 | channels 1 and 2 |
//! | 2, right | PA2, PA3 | channels 3 and 4 |
//!
//! The makers' firmware shows which motor is on the left: motor 1 alone turns the robot clockwise,
//! seen from above (SwarmUI, position_control.c).
//!
//! The timer is set up by its registers. `SimplePwm` of embassy-stm32 0.6.0 takes 0.8 kB more here,
//! nearly all of it a 64-bit division for the frequency, and the image would exceed its budget.

use bittybuzz_motion::bridge::{COAST, Inputs, PERIOD, inputs};
use bittybuzz_motion::drive::{Goal, Pilot, Wheels};
use bittybuzz_runtime::battery::Charge;
use bittybuzz_runtime::setpoint;
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::pac::timer::vals::Ocm;
use embassy_time::Instant;

use crate::eyes::{self, Eyes};
use crate::pins::MOTORS;
use crate::{sensors, watchdog};
use bittybuzz_board::log::info;

/// 48 MHz / 12 = 4 MHz. A period of 100 steps then has 40 kHz.
const PRESCALER: u16 = 12;

/// A command for the motors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// Drive the wheels with these duties.
    Wheels(Wheels),
    /// Drive to this goal and stop there.
    Goal(Goal),
}

/// The motors and their timer.
pub struct Motors {
    pilot: Pilot,
    eyes: Eyes,
    drive: Option<Drive>,
    /// The state of the bridges' inputs.
    inputs: [Inputs; 2],
}

impl Motors {
    /// Starts the timer; the motors have no power.
    pub fn new(pilot: Pilot, eyes: Eyes) -> Self {
        let timer = pac::TIM2;
        timer.psc().write_value(PRESCALER - 1);
        timer.arr().write_value(u32::from(PERIOD - 1));
        for half in 0..2 {
            timer.ccmr_output(half).write(|w| {
                for channel in 0..2 {
                    w.set_ocm(channel, Ocm::PWM_MODE1);
                    w.set_ocpe(channel, true);
                }
            });
        }
        timer.ccer().write(|w| (0..4).for_each(|channel| w.set_cce(channel, true)));
        timer.egr().write(|w| w.set_ug(true));
        timer.cr1().write(|w| w.set_cen(true));
        Motors { pilot, eyes, drive: None, inputs: [COAST; 2] }
    }

    /// Applies the set-point to the motors. A robot that does not know its position stands still.
    /// While the battery is charged or empty, the motors have no power.
    fn update(&mut self) {
        let now = Instant::now().as_ticks() as u32;
        let inputs = match (self.drive, eyes::pose()) {
            (None, _) => [COAST; 2],
            _ if sensors::is_charging() || sensors::charge() >= Charge::Empty => [COAST; 2],
            (Some(_), None) => [inputs(0); 2],
            (Some(Drive::Wheels(wheels)), Some(_)) => duties(wheels),
            (Some(Drive::Goal(goal)), Some(pose)) => {
                let before = self.pilot.minimum();
                let wheels = self.pilot.steer(goal, &pose, now);
                if let (None, Some(_minimum)) = (before, self.pilot.minimum()) {
                    info!("the wheels turn from {=u8} percent on", _minimum);
                }
                duties(wheels)
            }
        };
        if inputs == self.inputs {
            return;
        }
        // Without the watchdog's guard a halted core would leave the motors on.
        if turn(&inputs) && !turn(&self.inputs) && !watchdog::count_in_halts() {
            return;
        }
        self.inputs = inputs;
        let [left, right] = inputs;
        set(0, left);
        set(2, right);
        if !turn(&inputs) {
            watchdog::rest_in_halts();
        }
    }
}

impl setpoint::MotorDriver for Motors {
    type Setpoint = Drive;

    fn apply(&mut self, drive: Drive) {
        if self.drive != Some(drive) {
            self.drive = Some(drive);
            self.pilot.depart();
        }
        self.update();
    }

    fn stop(&mut self) {
        self.drive = None;
        self.update();
    }

    async fn steer(&mut self) {
        loop {
            self.eyes.look().await;
            self.update();
        }
    }
}

/// Returns true if a motor has power. A brake has equal inputs.
fn turn(inputs: &[Inputs; 2]) -> bool {
    inputs.iter().any(|[first, second]| first != second)
}

fn duties(wheels: Wheels) -> [Inputs; 2] {
    [inputs(wheels.left), inputs(wheels.right)]
}

/// Writes the inputs of a motor to two channels.
fn set(channel: usize, inputs: Inputs) {
    for (index, compare) in inputs.into_iter().enumerate() {
        pac::TIM2.ccr(channel + index).write_value(compare.into());
    }
}

/// Cuts the motors' power until the next reset, whatever state the program is in. The pins become
/// plain outputs, low, and the timer no longer reaches them.
pub fn cut_power() {
    // A failure may come before the port is turned on.
    pac::RCC.ahbenr().modify(|w| w.set_gpioaen(true));
    for pin in MOTORS {
        pac::GPIOA.bsrr().write(|w| w.set_br(pin, true));
    }
    pac::GPIOA.moder().modify(|w| MOTORS.for_each(|pin| w.set_moder(pin, Moder::OUTPUT)));
}
