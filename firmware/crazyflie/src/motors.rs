//! The four brushed motors: PWM of 328.125 kHz with 8 bits on the gates of low-side transistors.
//!
//! | motor | place | pin | timer |
//! |---|---|---|---|
//! | 0 (M1) | front right | PA1 | TIM2 channel 2 |
//! | 1 (M2) | back right | PB11 | TIM2 channel 4 |
//! | 2 (M3) | back left | PA15 | TIM2 channel 1 |
//! | 3 (M4) | front left | PB9 | TIM4 channel 4 |
//!
//! Both timers run at 84 MHz, and a period is 256 cycles (crazyflie-firmware, motors.h and
//! motors_def.c).
//!
//! The flight controller has the motors from the moment at which its supervisor permits them to its end
//! ([`fly`]). A script sets powers at other times only ([`GroundMotors`]).

use core::cell::RefCell;

use bittybuzz_flight::MotorDuties;
use bittybuzz_flight::motor::DutySteps;
use bittybuzz_runtime::battery::Charge;
use bittybuzz_runtime::setpoint::MotorDriver;
use embassy_stm32::Peri;
use embassy_stm32::gpio::OutputType;
use embassy_stm32::pac;
use embassy_stm32::pac::gpio::Gpio;
use embassy_stm32::pac::gpio::vals::Moder;
use embassy_stm32::peripherals::{PA1, PA15, PB9, PB11, TIM2, TIM4};
use embassy_stm32::time::hz;
use embassy_stm32::timer::simple_pwm::{PwmPin, SimplePwm};
use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;

use crate::{battery, watchdog};

/// The PWM frequency: 84 MHz / 256.
const FREQUENCY_HZ: u32 = 328_125;

/// The highest power that a script can set: 30 % of full power, which does not lift the robot.
pub const POWER_MAX: u8 = 76;

/// The power of each motor, in 256ths.
pub type Powers = [u8; 4];

/// The motors, once they are set up. A lock lasts for some register accesses, 1 µs.
static MOTORS: Mutex<CriticalSectionRawMutex, RefCell<Option<Motors>>> =
    Mutex::new(RefCell::new(None));

/// The motors' timers.
struct Motors {
    tim2: SimplePwm<'static, TIM2>,
    tim4: SimplePwm<'static, TIM4>,
    /// True while the watchdog counts in halts of the core, without which no motor turns.
    is_guarded: bool,
    /// True while the flight controller has the motors.
    are_in_flight: bool,
    steps: DutySteps,
}

/// The pins of motors 1 to 4.
pub struct Pins {
    pub m1: Peri<'static, PA1>,
    pub m2: Peri<'static, PB11>,
    pub m3: Peri<'static, PA15>,
    pub m4: Peri<'static, PB9>,
}

/// Sets the motors up, with all powers 0. Before this call no motor turns.
pub fn set_up(tim2: Peri<'static, TIM2>, tim4: Peri<'static, TIM4>, pins: Pins) {
    let motors = Motors::new(tim2, tim4, pins);
    MOTORS.lock(|cell| *cell.borrow_mut() = Some(motors));
}

/// Sets the duties of a flight, or ends the flight with `None`: only then a script can set powers.
pub fn fly(duties: Option<&MotorDuties>) {
    MOTORS.lock(|cell| {
        if let Some(motors) = cell.borrow_mut().as_mut() {
            motors.fly(duties);
        }
    });
}

impl Motors {
    fn new(tim2: Peri<'static, TIM2>, tim4: Peri<'static, TIM4>, pins: Pins) -> Self {
        let Pins { m1, m2, m3, m4 } = pins;
        let frequency = hz(FREQUENCY_HZ);
        let mut motors = Motors {
            tim2: SimplePwm::new(
                tim2,
                Some(PwmPin::new(m3, OutputType::PushPull)),
                Some(PwmPin::new(m1, OutputType::PushPull)),
                None,
                Some(PwmPin::new(m2, OutputType::PushPull)),
                frequency,
                Default::default(),
            ),
            tim4: SimplePwm::new(
                tim4,
                None,
                None,
                None,
                Some(PwmPin::new(m4, OutputType::PushPull)),
                frequency,
                Default::default(),
            ),
            is_guarded: false,
            are_in_flight: false,
            steps: DutySteps::default(),
        };
        motors.set([0; 4]);
        motors.tim2.ch1().enable();
        motors.tim2.ch2().enable();
        motors.tim2.ch4().enable();
        motors.tim4.ch4().enable();
        motors
    }

    /// Sets the powers. The watchdog counts in halts of the core before the first power above 0, and
    /// rests in them after the last.
    fn set(&mut self, powers: Powers) {
        let turns = powers != [0; 4];
        if turns && !self.is_guarded {
            self.is_guarded = watchdog::count_in_halts();
        }
        let [m1, m2, m3, m4] = if self.is_guarded { powers } else { [0; 4] };
        self.tim2.ch2().set_duty_cycle(m1.into());
        self.tim2.ch4().set_duty_cycle(m2.into());
        self.tim2.ch1().set_duty_cycle(m3.into());
        self.tim4.ch4().set_duty_cycle(m4.into());
        if !turns {
            self.is_guarded = false;
            watchdog::rest_in_halts();
        }
    }

    fn fly(&mut self, duties: Option<&MotorDuties>) {
        match duties {
            Some(duties) => {
                self.are_in_flight = true;
                let powers = self.steps.of_256(duties);
                self.set(powers);
            }
            None if self.are_in_flight => {
                self.are_in_flight = false;
                self.steps = DutySteps::default();
                self.set([0; 4]);
            }
            None => {}
        }
    }
}

/// The motors as a script sets them: on the ground.
pub struct GroundMotors;

impl MotorDriver for GroundMotors {
    type Setpoint = Powers;

    /// Sets the powers unless the robot flies, or stops the motors if the battery is empty. Each
    /// completed step of the script calls this function again, so an empty battery takes effect at
    /// the next step.
    fn apply(&mut self, powers: Powers) {
        let is_empty = battery::charge() >= Charge::Empty;
        MOTORS.lock(|cell| {
            if let Some(motors) = cell.borrow_mut().as_mut().filter(|motors| !motors.are_in_flight)
            {
                motors.set(if is_empty { [0; 4] } else { powers });
            }
        });
    }

    fn stop(&mut self) {
        self.apply([0; 4]);
    }
}

/// Stops the motors until the next reset, whatever state the program is in. The pins become plain
/// outputs, low, and the timers no longer reach them.
pub fn cut_power() {
    // The failure may have come before the ports were turned on.
    pac::RCC.ahb1enr().modify(|w| {
        w.set_gpioaen(true);
        w.set_gpioben(true);
    });
    low(pac::GPIOA, 1);
    low(pac::GPIOB, 11);
    low(pac::GPIOA, 15);
    low(pac::GPIOB, 9);
}

fn low(port: Gpio, pin: usize) {
    port.bsrr().write(|w| w.set_br(pin, true));
    port.moder().modify(|w| w.set_moder(pin, Moder::OUTPUT));
}

/// Returns the duties in the compare registers, of 65,535.
pub fn duties() -> [u16; 4] {
    let (tim2, tim4) = (pac::TIM2, pac::TIM4);
    let duties = [tim2.ccr(1).read(), tim2.ccr(3).read(), tim2.ccr(0).read(), tim4.ccr(3).read().0];
    duties.map(|duty| (duty as u16).min(255) * 257)
}
