//! Mistakes in the Kilobot's drivers.

use super::Mutant;

const ADC: &str = "firmware/kilobot-avr/src/adc.rs";
const CLOCK: &str = "firmware/kilobot-avr/src/clock.rs";
const EEPROM: &str = "firmware/kilobot-avr/src/eeprom.rs";
const HEAR: &str = "firmware/kilobot-avr/src/hear.rs";
const LIGHT: &str = "firmware/kilobot-avr/src/light.rs";
const MAIN: &str = "firmware/kilobot-avr/src/main.rs";
const MOTORS: &str = "firmware/kilobot-avr/src/motors.rs";
const POWER: &str = "firmware/kilobot-avr/src/power.rs";
const SPEAK: &str = "firmware/kilobot-avr/src/speak.rs";

pub const MUTANTS: &[Mutant] = &[
    Mutant {
        name: "battery-channel",
        file: ADC,
        find: "    Battery = 6,",
        put: "    Battery = 5,",
        breaks: "the battery's voltage is that of a pin that nothing drives",
    },
    Mutant {
        name: "loudness-trigger",
        file: ADC,
        find: "chip.ADC.adcsrb().write(|w| w.bits(1))",
        put: "chip.ADC.adcsrb().write(|w| w.bits(0))",
        breaks: "the loudness is measured before the light comes",
    },
    Mutant {
        name: "quiet-gain",
        file: HEAR,
        find: "adc::listen_quiet(&chip);",
        put: "adc::listen_loud(&chip);",
        breaks: "the second pulse is measured with the high gain, too, so near robots seem to be far away",
    },
    Mutant {
        name: "loudness-after-sensor",
        file: ADC,
        find: "        listen_loud(chip);\n        reading\n",
        put: "        reading\n",
        breaks: "the loudness of the message after a sensor was read is the sensor's reading",
    },
    Mutant {
        name: "clock-rate",
        file: CLOCK,
        find: "w.cs0().prescale_1024()",
        put: "w.cs0().prescale_256()",
        breaks: "time passes four times as fast",
    },
    Mutant {
        name: "clock-overflow",
        file: CLOCK,
        find: "if chip.TC0.tifr0().read().tov0().bit_is_set() && low < 128 {",
        put: "if chip.TC0.tifr0().read().tov0().bit_is_set() && low > 128 {",
        breaks: "the clock goes back by 33 ms at some of its overflows",
    },
    Mutant {
        name: "eeprom-key",
        file: EEPROM,
        find: "asm!(\"sbi 0x1f, 2\", \"sbi 0x1f, 1\", options",
        put: "asm!(\"sbi 0x1f, 1\", \"sbi 0x1f, 2\", options",
        breaks: "nothing is written to the EEPROM",
    },
    Mutant {
        name: "capture-source",
        file: HEAR,
        find: "const CAPTURE: u8 = 0b0000_0111;",
        put: "const CAPTURE: u8 = 0b0000_0011;",
        breaks: "the timer captures the pulses of the robot's own pin instead of those of its receiver",
    },
    Mutant {
        name: "deadline",
        file: HEAR,
        find: "        Pulse::Start => expect_by(&chip, at),\n",
        put: "        Pulse::Start => {}\n",
        breaks: "a message that is longer than a byte is given up",
    },
    Mutant {
        name: "led-pins",
        file: LIGHT,
        find: "(bits & 0b0101_0101) << 1 | (bits >> 1) & 0b0101_0101",
        put: "bits",
        breaks: "bright and dim are exchanged",
    },
    Mutant {
        name: "saved-id",
        file: MAIN,
        find: "        eeprom::write(&registers(), ID + 1, high);\n",
        put: "",
        breaks: "an id above 255 is forgotten",
    },
    Mutant {
        name: "motors-exchanged",
        file: MOTORS,
        find: "        chip.TC2.ocr2a().write(|w| w.bits(left));\n        chip.TC2.ocr2b().write(|w| w.bits(right));",
        put: "        chip.TC2.ocr2a().write(|w| w.bits(right));\n        chip.TC2.ocr2b().write(|w| w.bits(left));",
        breaks: "each motor gets the other's power",
    },
    Mutant {
        name: "right-motor-pin",
        file: MOTORS,
        find: "chip.PORTD.ddrd().modify(|r, w| w.bits(with(r.bits(), RIGHT, right != 0)));",
        put: "chip.PORTD.ddrd().modify(|r, w| w.bits(with(r.bits(), RIGHT, left != 0)));",
        breaks: "the right motor stands whenever the left one does",
    },
    Mutant {
        name: "motor-frequency",
        file: MOTORS,
        find: "chip.TC2.tccr2b().write(|w| w.bits(0b0000_0010));",
        put: "chip.TC2.tccr2b().write(|w| w.bits(0b0000_0011));",
        breaks: "the motors' pulses are four times as long as those of kilolib",
    },
    Mutant {
        name: "watchdog-time",
        file: POWER,
        find: "const RESET_2S: u8 = 0b0000_1111;",
        put: "const RESET_2S: u8 = 0b0010_1001;",
        breaks: "a robot that is stuck stays so for 8 s",
    },
    Mutant {
        name: "stuck-cause",
        file: POWER,
        find: "const BY_WATCHDOG: u8 = 1 << 3;",
        put: "const BY_WATCHDOG: u8 = 1 << 2;",
        breaks: "after a reset by the watchdog the script runs as if nothing had happened",
    },
    Mutant {
        name: "cause-kept",
        file: POWER,
        find: "    \"out 0x34, r1\",\n",
        put: "",
        breaks: "after a reset by the watchdog no script runs until power-on, whatever the controller says",
    },
    Mutant {
        name: "oscillator",
        file: POWER,
        find: "unsafe { chip.CPU.osccal().write(|w| w.bits(correction)) };",
        put: "let _ = correction;",
        breaks: "the oscillator is not corrected, and neighbors do not understand the robot",
    },
    Mutant {
        name: "charger-level",
        file: POWER,
        find: "chip.PORTD.pind().read().bits() & 1 == 0",
        put: "chip.PORTD.pind().read().bits() & 1 != 0",
        breaks: "a robot without a charger shows that it is charged",
    },
    Mutant {
        name: "boot-address",
        file: POWER,
        find: "asm!(\"jmp 0x7000\", options(noreturn))",
        put: "asm!(\"jmp 0x7800\", options(noreturn))",
        breaks: "the bootloader is not found",
    },
    Mutant {
        name: "boot-watchdog",
        file: POWER,
        find: "    watch(chip, OFF);\n",
        put: "",
        breaks: "the watchdog ends the bootloader after two seconds",
    },
    Mutant {
        name: "bit-pitch",
        file: SPEAK,
        find: "const PITCH: u16 = 270;",
        put: "const PITCH: u16 = 300;",
        breaks: "bits come too late for the receivers of kilolib",
    },
    Mutant {
        name: "collisions",
        file: SPEAK,
        find: "    if hear::has_seen_light(chip) {\n        return false;\n    }\n",
        put: "",
        breaks: "two robots that begin at once both go on",
    },
    Mutant {
        name: "interrupts-while-sending",
        file: SPEAK,
        find: "        hear::resume(chip);\n        is_sent\n",
        put: "        is_sent\n",
        breaks: "the robot takes its own light for a message",
    },
    Mutant {
        name: "eeprom-read-while-written",
        file: EEPROM,
        find: "\"sbic 0x1f, 1\"",
        put: "\"sbic 0x1f, 7\"",
        breaks: "after a brown-out while it saves the robot has another oscillator's correction or id",
    },
    Mutant {
        name: "brown-out-taken-for-watchdog",
        file: POWER,
        find: "const BY_WATCHDOG: u8 = 1 << 3;",
        put: "const BY_WATCHDOG: u8 = 1 << 3 | 1 << 2;",
        breaks: "after a brown-out the script does not run until the controller resets the robot",
    },
];
