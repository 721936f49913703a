//! Mistakes in the Crazyflie's drivers.

use super::Mutant;

const CLOCK: &str = "firmware/crazyflie/src/clock.rs";
const LEDS: &str = "firmware/crazyflie/src/leds.rs";
const FAILURE: &str = "firmware/crazyflie/src/failure.rs";
const WATCHDOG: &str = "firmware/crazyflie/src/watchdog.rs";
const MOTORS: &str = "firmware/crazyflie/src/motors.rs";
const BATTERY: &str = "firmware/crazyflie/src/battery.rs";
const BOARD: &str = "firmware/crazyflie/src/board.rs";
const UART: &str = "firmware/crazyflie/src/link/uart.rs";

pub const MUTANTS: &[Mutant] = &[
    Mutant {
        name: "pll-multiplier",
        file: CLOCK,
        find: "PllMul::MUL336",
        put: "PllMul::MUL320",
        breaks: "the core runs at 160 MHz",
    },
    Mutant {
        name: "pll-divider",
        file: CLOCK,
        find: "PllPDiv::DIV2",
        put: "PllPDiv::DIV4",
        breaks: "the core runs at 84 MHz",
    },
    Mutant {
        name: "apb1-prescaler",
        file: CLOCK,
        find: "APBPrescaler::DIV4",
        put: "APBPrescaler::DIV8",
        breaks: "the timers of the motors run at half their rate",
    },
    Mutant {
        name: "apb2-prescaler",
        file: CLOCK,
        find: "APBPrescaler::DIV2",
        put: "APBPrescaler::DIV4",
        breaks: "the link's USART runs at half its rate",
    },
    Mutant {
        name: "crystal",
        file: CLOCK,
        find: "freq: mhz(8)",
        put: "freq: embassy_stm32::time::hz(7_680_000)",
        breaks: "all clocks are 4 % faster than the firmware believes",
    },
    Mutant {
        name: "baud-rate",
        file: UART,
        find: "const BAUD: u32 = 1_000_000;",
        put: "const BAUD: u32 = 921_600;",
        breaks: "the link is 8 % too slow",
    },
    Mutant {
        name: "alternate-function",
        file: UART,
        find: "const AF: u8 = 8;",
        put: "const AF: u8 = 7;",
        breaks: "the link's pins belong to another peripheral",
    },
    Mutant {
        name: "tx-pin",
        file: UART,
        find: "tx.set_as_af_unchecked(AF, AfType::output(OutputType::PushPull, Speed::VeryHigh));",
        put: "tx.set_as_input(Pull::Up);",
        breaks: "nothing is sent",
    },
    Mutant {
        name: "rx-pin",
        file: UART,
        find: "rx.set_as_af_unchecked(AF, AfType::input(Pull::Up));",
        put: "rx.set_as_input(Pull::Up);",
        breaks: "nothing is received",
    },
    Mutant {
        name: "flow-control-line",
        file: UART,
        find: "pac::EXTI.imr(0).modify(|w| w.set_line(4, true));",
        put: "pac::EXTI.imr(0).modify(|w| w.set_line(5, true));",
        breaks: "the link does not go on when there is room again",
    },
    Mutant {
        name: "pwm-frequency",
        file: MOTORS,
        find: "const FREQUENCY_HZ: u32 = 328_125;",
        put: "const FREQUENCY_HZ: u32 = 164_062;",
        breaks: "the motors get half the power",
    },
    Mutant {
        name: "motors-exchanged",
        file: MOTORS,
        find: "self.tim2.ch2().set_duty_cycle(m1.into());\n        self.tim2.ch4().set_duty_cycle(m2.into());",
        put: "self.tim2.ch2().set_duty_cycle(m2.into());\n        self.tim2.ch4().set_duty_cycle(m1.into());",
        breaks: "motors 1 and 2 get each other's power",
    },
    Mutant {
        name: "leds-exchanged",
        file: LEDS,
        find: "Color::Red => self.red.set_level(low_if(on)),\n            Color::Green => self.green",
        put: "Color::Red => self.green.set_level(low_if(on)),\n            Color::Green => self.red",
        breaks: "green shines for red",
    },
    Mutant {
        name: "led-polarity",
        file: LEDS,
        find: "Color::Red => self.red.set_level(low_if(on)),",
        put: "Color::Red => self.red.set_level(low_if(!on)),",
        breaks: "red is dark when it should shine",
    },
    Mutant {
        name: "watchdog-not-started",
        file: WATCHDOG,
        find: "pac::IWDG.kr().write(|w| w.set_key(Key::START));",
        put: "pac::IWDG.kr().write(|w| w.set_key(Key::RESET));",
        breaks: "a dead task stays dead",
    },
    Mutant {
        name: "watchdog-time",
        file: WATCHDOG,
        find: "Pr::DIVIDE_BY4",
        put: "Pr::DIVIDE_BY32",
        breaks: "a dead task is noticed after seconds",
    },
    Mutant {
        name: "watchdog-too-soon",
        file: WATCHDOG,
        find: "w.set_rl(PERIODS - 1)",
        put: "w.set_rl(PERIODS * 11 / 25 - 1)",
        breaks: "chips whose LSI is fast restart without end",
    },
    Mutant {
        name: "watchdog-while-halted",
        file: WATCHDOG,
        find: "    pac::DBGMCU.apb1fzr().modify(|w| w.set_iwdg(true));\n",
        put: "",
        breaks: "a robot whose core a debugger halts is reset and locked",
    },
    Mutant {
        name: "log-without-room",
        file: "firmware/crazyflie/src/log.rs",
        find: "None => return false,",
        put: "None => {}",
        breaks: "messages that no probe has read are overwritten, and not counted",
    },
    Mutant {
        name: "power-cut-at-the-wrong-pin",
        file: MOTORS,
        find: "low(pac::GPIOB, 9);",
        put: "low(pac::GPIOB, 8);",
        breaks: "motor 4 turns on after a failure",
    },
    Mutant {
        name: "other-board-driven",
        file: BOARD,
        find: "b\"CF20\" | b\"CF21\" => Ok(()),",
        put: "b\"CF20\" | b\"CF21\" | b\"C21B\" => Ok(()),",
        breaks: "a Brushless gets brushed motors' signals",
    },
    Mutant {
        name: "empty-battery-drives",
        file: MOTORS,
        find: ">= Charge::Empty",
        put: "> Charge::Empty",
        breaks: "the motors go on with an empty battery",
    },
    Mutant {
        name: "charger-not-seen",
        file: BATTERY,
        find: "link::STATE.is_usb_powered()",
        put: "false",
        breaks: "a robot that is charged switches itself off",
    },
    Mutant {
        name: "switch-off-asked-once",
        file: BATTERY,
        find: "if now == Charge::Flat {",
        put: "if now == Charge::Flat && charge() != now {",
        breaks: "a lost frame leaves the robot on",
    },
    Mutant {
        name: "note-not-written",
        file: FAILURE,
        find: "PWR.cr1().modify(|w| w.set_dbp(true));",
        put: "PWR.cr1().modify(|w| w.set_dbp(false));",
        breaks: "a reset by pin ends the lock after a failure",
    },
    Mutant {
        name: "unexplained-resets",
        file: FAILURE,
        find: "noted.or((!is_debugged()).then_some(Failure::Unexplained))",
        put: "noted",
        breaks: "after a software reset without a note the script runs",
    },
    Mutant {
        name: "set-point-hold",
        file: "firmware/runtime/src/setpoint.rs",
        find: "pub const HOLD: Duration = Duration::from_millis(500);",
        put: "pub const HOLD: Duration = Duration::from_millis(1000);",
        breaks: "the motors go on for a second after the script's last step",
    },
];
