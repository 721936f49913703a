//! Mistakes in the Zooid's drivers.

use super::Mutant;

const CLOCK: &str = "firmware/zooids/src/clock.rs";
const EDGES: &str = "firmware/zooids/src/edges.rs";
const FAILURE: &str = "firmware/zooids/src/failure.rs";
const ID: &str = "firmware/runtime/src/id.rs";
const I2C: &str = "firmware/zooids/src/i2c.rs";
const LEDS: &str = "firmware/zooids/src/leds.rs";
const MOTORS: &str = "firmware/zooids/src/motors.rs";
const NRF24: &str = "firmware/zooids/src/radio/nrf24.rs";
const PINS: &str = "firmware/zooids/src/pins.rs";
const RADIO: &str = "firmware/zooids/src/radio/mod.rs";
const SECTION: &str = "firmware/runtime/src/section.rs";
const SENSORS: &str = "firmware/zooids/src/sensors.rs";
const TIME: &str = "firmware/zooids/src/time.rs";
const TOUCH: &str = "firmware/zooids/src/touch.rs";
const WATCHDOG: &str = "firmware/zooids/src/watchdog.rs";

pub const MUTANTS: &[Mutant] = &[
    Mutant {
        name: "core-clock",
        file: CLOCK,
        find: "PllMul::MUL6",
        put: "PllMul::MUL5",
        breaks: "the core runs at 40 MHz",
    },
    Mutant {
        name: "radio-clock",
        file: CLOCK,
        find: "w.set_mcosel(Mcosel::HSE)",
        put: "w.set_mcosel(Mcosel::HSI)",
        breaks: "the radio gets the 8 MHz of the internal oscillator",
    },
    Mutant {
        name: "radio-interrupt-edge",
        file: EDGES,
        find: "pac::EXTI.ftsr(0)",
        put: "pac::EXTI.rtsr(0)",
        breaks: "the radio's interrupt comes when its cause is gone",
    },
    Mutant {
        name: "right-eye-edges",
        file: EDGES,
        find: "        w.set_ccnp(0, true);\n",
        put: "",
        breaks: "the right photodiode sees rising edges only",
    },
    Mutant {
        name: "left-eye-dma",
        file: EDGES,
        find: "left.dier().modify(|w| w.set_ccde(3, true));",
        put: "left.dier().modify(|w| w.set_ccde(2, true));",
        breaks: "edges of the left photodiode are not written down",
    },
    Mutant {
        name: "capture-ring",
        file: EDGES,
        find: "            w.set_circ(true);\n",
        put: "",
        breaks: "the photodiodes see 64 edges and no more",
    },
    Mutant {
        name: "capture-rate",
        file: EDGES,
        find: "const PRESCALER: u16 = 48;",
        put: "const PRESCALER: u16 = 50;",
        breaks: "the right photodiode's times are 4 % too short",
    },
    Mutant {
        name: "watchdog-while-halted",
        file: "firmware/zooids/src/watchdog.rs",
        find: "    pac::DBGMCU.apb1_fz().write(|w| w.set_iwdg(true));\n",
        put: "",
        breaks: "a robot whose core a debugger halts is reset and locked",
    },
    Mutant {
        name: "motors-while-halted",
        file: "firmware/zooids/src/watchdog.rs",
        find: "    pac::DBGMCU.apb1_fz().write(|_| {});\n    pac::DBGMCU.apb1_fz().read().0 == 0\n",
        put: "    true\n",
        breaks: "the wheels of a robot whose core a debugger halts turn on",
    },
    Mutant {
        name: "power-cut",
        file: MOTORS,
        find: "pac::GPIOA.moder().modify(|w| MOTORS.for_each(|pin| w.set_moder(pin, Moder::OUTPUT)));",
        put: "pac::GPIOA.moder().modify(|w| w.set_moder(MOTORS.start, Moder::OUTPUT));",
        breaks: "a wheel turns on after a failure",
    },
    Mutant {
        name: "power-cut-after-hard-fault",
        file: FAILURE,
        find: "extern \"C\" fn hard_fault(frame: *const u32) -> ! {\n    motors::cut_power();\n",
        put: "extern \"C\" fn hard_fault(frame: *const u32) -> ! {\n    loop {}\n",
        breaks: "the motors turn until the watchdog ends a hard fault",
    },
    Mutant {
        name: "failure-forgotten",
        file: FAILURE,
        find: "if flags.iwdgrstf() {",
        put: "if flags.wwdgrstf() {",
        breaks: "the script runs again after the watchdog's reset",
    },
    Mutant {
        name: "motors-exchanged",
        file: MOTORS,
        find: "        set(0, left);\n        set(2, right);",
        put: "        set(2, left);\n        set(0, right);",
        breaks: "each wheel turns as the other should",
    },
    Mutant {
        name: "motor-frequency",
        file: MOTORS,
        find: "const PRESCALER: u16 = 12;",
        put: "const PRESCALER: u16 = 24;",
        breaks: "the motors' frequency is 20 kHz",
    },
    Mutant {
        name: "motor-pin",
        file: PINS,
        find: "    (MOTORS.start + 1, Alternate(2)),\n",
        put: "    (MOTORS.start + 1, Alternate(1)),\n",
        breaks: "an input of the left motor's bridge belongs to another peripheral",
    },
    Mutant {
        name: "led-polarity",
        file: LEDS,
        find: "            w.set_ccp(channel, true);\n",
        put: "",
        breaks: "the LED shines where it should be dark",
    },
    Mutant {
        name: "led-colors",
        file: LEDS,
        find: "[(RED, 2), (GREEN, 3), (BLUE, 1)]",
        put: "[(RED, 3), (GREEN, 2), (BLUE, 1)]",
        breaks: "green shines for red",
    },
    Mutant {
        name: "led-light",
        file: LEDS,
        find: "const ON: u16 = PERIOD / 8;",
        put: "const ON: u16 = PERIOD / 2;",
        breaks: "the LED is four times as bright, and empties the battery",
    },
    Mutant {
        name: "touch-address",
        file: TOUCH,
        find: "const ADDRESS: u8 = 0x1b;",
        put: "const ADDRESS: u8 = 0x1c;",
        breaks: "the touch sensor is not found",
    },
    Mutant {
        name: "i2c-reset",
        file: I2C,
        find: "    if result.is_err() {",
        put: "    if false {",
        breaks: "a transfer that failed leaves the bus as it was",
    },
    Mutant {
        name: "charger-level",
        file: SENSORS,
        find: "CHARGING.store(charger.is_low(), Ordering::Relaxed);",
        put: "CHARGING.store(charger.is_high(), Ordering::Relaxed);",
        breaks: "a robot that is not being charged believes that it is",
    },
    Mutant {
        name: "battery-reference",
        file: SENSORS,
        find: "let steps = steps * calibrated / reference.max(1);",
        put: "let steps = steps * calibrated / calibrated.max(1);",
        breaks: "a battery below 3.3 V reads as 3.3 V",
    },
    Mutant {
        name: "battery-empty",
        file: SENSORS,
        find: "const LADDER_MV: [u16; 3] = [3420, 3300, 3000];",
        put: "const LADDER_MV: [u16; 3] = [3420, 3300, 2700];",
        breaks: "the battery is emptied below 3.0 V",
    },
    Mutant {
        name: "power-detector",
        file: NRF24,
        find: "    pub async fn is_busy(&mut self) -> bool {\n        self.ce.set_low();\n",
        put: "    pub async fn is_busy(&mut self) -> bool {\n",
        breaks: "a radio whose detector latches falls silent",
    },
    Mutant {
        name: "radio-rate",
        file: NRF24,
        find: "(RF_SETUP, 0b0000_1110)",
        put: "(RF_SETUP, 0b0000_0110)",
        breaks: "the radio sends 1 Mbit/s, which no other robot receives",
    },
    Mutant {
        name: "radio-lengths",
        file: NRF24,
        find: "    (DYNPD, 1),\n",
        put: "    (DYNPD, 0),\n",
        breaks: "payloads have no length of their own",
    },
    Mutant {
        name: "radio-flags",
        file: NRF24,
        find: "        self.ce.set_low();\n        self.write(STATUS, &[TX_DS]);\n",
        put: "        self.ce.set_low();\n",
        breaks: "the radio's line stays low once something was sent",
    },
    Mutant {
        name: "radio-address",
        file: NRF24,
        find: "        self.write(RX_ADDR_P0, &ADDRESS);\n",
        put: "",
        breaks: "the radio receives packets to the address that it was delivered with",
    },
    Mutant {
        name: "busy-looks",
        file: RADIO,
        find: "if busy_checks < BUSY_CHECKS_MAX && radio.is_busy().await {",
        put: "if radio.is_busy().await {",
        breaks: "a sender that never pauses silences all robots around it",
    },
    Mutant {
        name: "radio-rests",
        file: RADIO,
        find: "            radio.sleep();\n",
        put: "",
        breaks: "the radio sends and listens while the battery is charged",
    },
    Mutant {
        name: "late-alarm",
        file: TIME,
        find: "if at <= CLOCK.now() {",
        put: "if false {",
        breaks: "an alarm that is late comes 65 ms later",
    },
    Mutant {
        name: "clock-rate",
        file: TIME,
        find: "timer.psc().write_value(PRESCALER - 1);",
        put: "timer.psc().write_value(PRESCALER);",
        breaks: "time passes 2 % too slowly",
    },
    Mutant {
        name: "watchdog-time",
        file: WATCHDOG,
        find: "const TIMEOUT_US: u32 = 250_000;",
        put: "const TIMEOUT_US: u32 = 2_500_000;",
        breaks: "a dead task is noticed after seconds",
    },
    Mutant {
        name: "watchdog-not-started",
        file: WATCHDOG,
        find: "    watchdog.unleash();\n",
        put: "",
        breaks: "a dead task stays dead",
    },
    Mutant {
        name: "half-a-script-runs",
        file: SECTION,
        find: "(found == u16::from_le_bytes(check)).then_some(length)",
        put: "(found == u16::from_le_bytes(check) || length < bytes.len()).then_some(length)",
        breaks: "a script that was written in part runs",
    },
    Mutant {
        name: "id-unchecked",
        file: ID,
        find: "if number == !complement { Some(number) } else { None }",
        put: "if number == !complement || complement != 0xffff { Some(number) } else { None }",
        breaks: "a robot uses an id that was written in part",
    },
];
