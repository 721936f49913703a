//! Mistakes in the models of the chips and boards: tests that pass with a wrong model would be no evidence about the firmware.

use super::Mutant;

const ADC_F0: &str = "emulation/chips/src/f051/adc.rs";
const ADC_AVR: &str = "emulation/chips/src/atmega328p/adc.rs";
const DMA: &str = "emulation/chips/src/f051/dma.rs";
const EEPROM: &str = "emulation/chips/src/atmega328p/eeprom.rs";
const EXTI: &str = "emulation/chips/src/stm32/exti.rs";
const GPIO: &str = "emulation/chips/src/stm32/gpio.rs";
const INFRARED: &str = "robots/kilobot/board/src/infrared.rs";
const RADIO: &str = "emulation/chips/src/nrf24/radio.rs";
const RCC_F0: &str = "emulation/chips/src/f051/rcc.rs";
const TIMER: &str = "emulation/chips/src/stm32/timer.rs";
const USART: &str = "emulation/chips/src/f405/usart.rs";
const WATCHDOG: &str = "emulation/chips/src/stm32/watchdog.rs";
const WATCHDOG_AVR: &str = "emulation/chips/src/atmega328p/watchdog.rs";

pub const MUTANTS: &[Mutant] = &[
    Mutant {
        name: "battery-undivided",
        file: ADC_F0,
        find: "VBAT if self.ccr & CCR_VBATEN != 0 => self.battery_volts / 2.0,",
        put: "VBAT if self.ccr & CCR_VBATEN != 0 => self.battery_volts,",
        breaks: "the battery is measured whole, not by half",
    },
    Mutant {
        name: "supply-always-regulated",
        file: ADC_F0,
        find: "let vdda = REGULATED_VOLTS.min(self.battery_volts);",
        put: "let vdda = REGULATED_VOLTS;",
        breaks: "a battery below 3.3 V does not lower the supply",
    },
    Mutant {
        name: "conversion-order",
        file: ADC_F0,
        find: "match (channel + 1..CHANNELS).find(",
        put: "match (0..channel).find(",
        breaks: "channels are converted backwards",
    },
    Mutant {
        name: "first-conversion",
        file: ADC_AVR,
        find: "(true, _) => (27, 50),",
        put: "(true, _) => (3, 26),",
        breaks: "the first conversion takes no longer than others",
    },
    Mutant {
        name: "circular-count",
        file: DMA,
        find: "                channel.cndtr = channel.total;\n",
        put: "                channel.cndtr = channel.total - 1;\n",
        breaks: "a ring of DMA is one item too short from its second round on",
    },
    Mutant {
        name: "dma-direction",
        file: DMA,
        find: "&& (channel.ccr & CCR_DIR != 0) == to_peripheral",
        put: "",
        breaks: "a channel serves requests of the other direction",
    },
    Mutant {
        name: "eeprom-unlocked",
        file: EEPROM,
        find: "if value & EEPE != 0 && is_unlocked && !is_flash_busy {",
        put: "if value & EEPE != 0 && !is_flash_busy {",
        breaks: "the EEPROM is written without its key",
    },
    Mutant {
        name: "edges-exchanged",
        file: EXTI,
        find: "let rising = levels & !self.levels & self.rtsr;\n        let falling = !levels & self.levels & self.ftsr;",
        put: "let rising = levels & !self.levels & self.ftsr;\n        let falling = !levels & self.levels & self.rtsr;",
        breaks: "interrupts come at the other edge",
    },
    Mutant {
        name: "open-drain",
        file: GPIO,
        find: "if open_drain && high { Pin::Floating } else { Pin::Level(high) }",
        put: "Pin::Level(high)",
        breaks: "an output with open drain drives high",
    },
    Mutant {
        name: "infrared-pitch",
        file: INFRARED,
        find: "const BIT: u64 = 269;",
        put: "const BIT: u64 = 285;",
        breaks: "bits are taken to be 6 % longer",
    },
    Mutant {
        name: "detector-always-live",
        file: RADIO,
        find: "if self.has_received && self.power_detector == PowerDetector::Latched {",
        put: "if false {",
        breaks: "no radio latches its power detector",
    },
    Mutant {
        name: "radio-without-clock",
        file: RADIO,
        find: "if !self.is_powered_up() || !self.has_clock {",
        put: "if !self.is_powered_up() {",
        breaks: "a radio works without its clock",
    },
    Mutant {
        name: "prescaler-at-once",
        file: TIMER,
        find: "            raised |= UIF;\n",
        put: "            raised |= 0;\n",
        breaks: "a timer's overflow raises no flag",
    },
    Mutant {
        name: "one-edge-captured",
        file: TIMER,
        find: "edges => edges == CCER_BOTH,",
        put: "edges => edges == CCER_BOTH && high,",
        breaks: "a timer that should capture both edges captures one",
    },
    Mutant {
        name: "overrun-without-flag",
        file: USART,
        find: "            self.sr |= SR_ORE;\n            self.overruns += 1;\n",
        put: "            self.overruns += 1;\n",
        breaks: "a byte is lost without a flag",
    },
    Mutant {
        name: "idle-never",
        file: USART,
        find: "            self.idle_at = None;\n            self.sr |= SR_IDLE;\n",
        put: "            self.idle_at = None;\n",
        breaks: "an idle line is never noticed",
    },
    Mutant {
        name: "watchdog-unlocked",
        file: WATCHDOG,
        find: "0x08 if self.unlocked => self.reload",
        put: "0x08 => self.reload",
        breaks: "the watchdog's time can be changed without its key",
    },
    Mutant {
        name: "watchdog-interrupt-stays",
        file: WATCHDOG_AVR,
        find: "            self.control &= !WDIE;\n",
        put: "",
        breaks: "the AVR's watchdog never goes from interrupt to reset",
    },
    Mutant {
        name: "causes-survive-a-brown-out",
        file: RCC_F0,
        find: "ResetCause::PowerOn | ResetCause::BrownOut => 0,",
        put: "ResetCause::PowerOn => 0,",
        breaks: "a Zooid whose supply falls after a failure does not start like one that is switched on",
    },
    Mutant {
        name: "eeprom-never-damaged",
        file: EEPROM,
        find: "            self.cells[usize::from(self.address)] = value;\n",
        put: "",
        breaks: "a byte is whole whenever the supply falls while it is written",
    },
];
