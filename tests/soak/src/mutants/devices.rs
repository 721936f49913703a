//! Mistakes in the models of the flying Crazyflie: its sensors, its memories, and the peripherals
//! that read them.

use super::Mutant;

const ACCELEROMETER: &str = "emulation/chips/src/devices/bmi088/accelerometer.rs";
const ADC: &str = "emulation/chips/src/f405/adc.rs";
const BAROMETER: &str = "emulation/chips/src/devices/bmp388/mod.rs";
const CALIBRATION: &str = "emulation/chips/src/devices/bmp388/calibration.rs";
const DMA: &str = "emulation/chips/src/f405/dma.rs";
const EEPROM: &str = "emulation/chips/src/devices/eeprom_24aa64.rs";
const EXPANDER: &str = "emulation/chips/src/devices/pca9554.rs";
const FLASH: &str = "emulation/chips/src/f405/flash.rs";
const FLOW: &str = "emulation/chips/src/devices/pmw3901.rs";
const GYROSCOPE: &str = "emulation/chips/src/devices/bmi088/gyroscope.rs";
const I2C: &str = "emulation/chips/src/f405/i2c.rs";
const I2C_BUS: &str = "emulation/chips/src/i2c_bus.rs";
const ONE_WIRE: &str = "emulation/chips/src/devices/one_wire.rs";
const RANGE_FINDER: &str = "emulation/chips/src/devices/vl53l1x/mod.rs";
const RANGE_TIMING: &str = "emulation/chips/src/devices/vl53l1x/timing.rs";
const SPI: &str = "emulation/chips/src/f405/spi.rs";
const SYSTEM: &str = "emulation/chips/src/f405/system.rs";
const USART: &str = "emulation/chips/src/f405/usart.rs";

pub const MUTANTS: &[Mutant] = &[
    Mutant {
        name: "accelerometer-ranges",
        file: ACCELEROMETER,
        find: "3 - (self.register(RANGE) & 0x03)",
        put: "self.register(RANGE) & 0x03",
        breaks: "the accelerometer's ranges are in the opposite order",
    },
    Mutant {
        name: "gyroscope-rate",
        file: GYROSCOPE,
        find: "            2 => 1_000,",
        put: "            2 => 2_000,",
        breaks: "the gyroscope samples twice as often as its bandwidth says",
    },
    Mutant {
        name: "gyroscope-polarity",
        file: GYROSCOPE,
        find: "(configuration & IO_CONF_INT3_HIGH != 0)",
        put: "(configuration & IO_CONF_INT3_HIGH == 0)",
        breaks: "pulses at pin INT3 are upside down",
    },
    Mutant {
        name: "barometer-filter-bits",
        file: BAROMETER,
        find: "self.register(CONFIG) >> 1 & 7",
        put: "self.register(CONFIG) & 7",
        breaks: "the barometer's filter has another coefficient than its register",
    },
    Mutant {
        name: "barometer-always-ready",
        file: BAROMETER,
        find: "self.registers[usize::from(STATUS)] &= !ready;",
        put: "let _ = ready;",
        breaks: "a sample of the barometer counts as new after it was read",
    },
    Mutant {
        name: "barometer-coefficient",
        file: CALIBRATION,
        find: "unsigned(13) * power(-6)",
        put: "unsigned(13) * power(-5)",
        breaks: "the barometer's counts do not fit its calibration",
    },
    Mutant {
        name: "memory-page",
        file: EEPROM,
        find: "self.location - place + (place + 1) % PAGE",
        put: "(self.location + 1) % CAPACITY",
        breaks: "a write beyond the end of a page goes to the next page",
    },
    Mutant {
        name: "memory-never-busy",
        file: EEPROM,
        find: " && now >= self.busy_until",
        put: "",
        breaks: "the memory answers during its write cycle",
    },
    Mutant {
        name: "deck-location-order",
        file: ONE_WIRE,
        find: "answer.extend(location.to_le_bytes());",
        put: "answer.extend(location.to_be_bytes());",
        breaks: "answers name the wrong location of a deck's memory",
    },
    Mutant {
        name: "deck-elements-length",
        file: ONE_WIRE,
        find: "(bytes.len() - begin - 2) as u8",
        put: "(bytes.len() - begin) as u8",
        breaks: "the description of a deck is two bytes longer than it is",
    },
    Mutant {
        name: "expander-directions",
        file: EXPANDER,
        find: "self.registers[OUTPUT] & !inputs | self.external & inputs",
        put: "self.registers[OUTPUT] & inputs | self.external & !inputs",
        breaks: "the expander drives the pins that are inputs",
    },
    Mutant {
        name: "flow-burst-old",
        file: FLOW,
        find: "(is_burst || register == MOTION)",
        put: "register == MOTION",
        breaks: "a burst repeats the motion of the last single reading",
    },
    Mutant {
        name: "flow-burst-order",
        file: FLOW,
        find: "    SHUTTER_UPPER,\n    SHUTTER_LOWER,\n",
        put: "    SHUTTER_LOWER,\n    SHUTTER_UPPER,\n",
        breaks: "a burst ends with the bytes of the exposure exchanged",
    },
    Mutant {
        name: "range-polarity",
        file: RANGE_FINDER,
        find: "self.is_raised != is_active_low",
        put: "self.is_raised == is_active_low",
        breaks: "the range finder's interrupt is upside down",
    },
    Mutant {
        name: "range-stream-count",
        file: RANGE_FINDER,
        find: "checked_add(1).unwrap_or(128)",
        put: "wrapping_add(1)",
        breaks: "the range finder's counter continues at 0",
    },
    Mutant {
        name: "range-period-factor",
        file: RANGE_TIMING,
        find: "const PERIOD_FACTOR: f64 = 1.075;",
        put: "const PERIOD_FACTOR: f64 = 1.0;",
        breaks: "the range finder measures 7 % too seldom",
    },
    Mutant {
        name: "i2c-last",
        file: I2C,
        find: "self.is_last_by_dma && self.cr2 & CR2_LAST != 0",
        put: "self.cr2 & CR2_LAST != 0",
        breaks: "a read by DMA ends after its first byte",
    },
    Mutant {
        name: "i2c-fast-mode",
        file: I2C,
        find: "            CCR_FAST => 3,",
        put: "            CCR_FAST => 2,",
        breaks: "the I2C bus is faster than its clock register says",
    },
    Mutant {
        name: "i2c-refusal",
        file: I2C,
        find: "self.sr1 |= SR1_AF;",
        put: "self.sr1 |= SR1_ADDR;",
        breaks: "an address that no chip acknowledges counts as acknowledged",
    },
    Mutant {
        name: "spi-clock",
        file: SPI,
        find: "(self.cr1 >> 3 & 7) + 1",
        put: "self.cr1 >> 3 & 7",
        breaks: "SPI runs at twice its rate",
    },
    Mutant {
        name: "spi-overrun",
        file: SPI,
        find: "            self.overrun = true;\n",
        put: "",
        breaks: "a byte that is lost on SPI is not reported",
    },
    Mutant {
        name: "dma-flag-places",
        file: DMA,
        find: "[0, 6, 16, 22];",
        put: "[0, 6, 12, 18];",
        breaks: "the flags of streams 2 and 3 are at other bits",
    },
    Mutant {
        name: "dma-error-flag",
        file: DMA,
        find: "stream.flags |= TEIF;",
        put: "stream.flags |= FEIF;",
        breaks: "a transfer to memory out of reach has no error flag",
    },
    Mutant {
        name: "dma-one-left",
        file: DMA,
        find: "let one_left = stream.left == 1;",
        put: "let one_left = stream.left == 0;",
        breaks: "I2C refuses the byte after the last one",
    },
    Mutant {
        name: "usart-oversampling",
        file: USART,
        find: "(self.brr >> 4 & 0xfff) * 8 + (self.brr & 7)",
        put: "(self.brr >> 4 & 0xfff) * 16 + (self.brr & 7)",
        breaks: "a USART with eight samples per bit has half its rate",
    },
    Mutant {
        name: "usart-overrun-flag",
        file: USART,
        find: "self.sr |= SR_ORE;",
        put: "self.sr |= SR_FE;",
        breaks: "a lost byte is reported as a wrong stop bit",
    },
    Mutant {
        name: "adc-clock",
        file: ADC,
        find: "(2 * (u64::from(self.ccr >> 16 & 3) + 1))",
        put: "(u64::from(self.ccr >> 16 & 3) + 1)",
        breaks: "conversions take half their time",
    },
    Mutant {
        name: "adc-result-read",
        file: ADC,
        find: "converter.registers[SR as usize / 4] &= !SR_EOC;",
        put: "",
        breaks: "a result that was read counts as a new one",
    },
    Mutant {
        name: "flash-wait-states",
        file: FLASH,
        find: "hz.div_ceil(30_000_000).saturating_sub(1)",
        put: "hz.div_ceil(30_000_000)",
        breaks: "flash needs one wait state too many",
    },
    Mutant {
        name: "flash-size",
        file: SYSTEM,
        find: "FLASH_KBYTES: usize = 0xa22;",
        put: "FLASH_KBYTES: usize = 0xa20;",
        breaks: "the size of the flash is at another address",
    },
    Mutant {
        name: "bus-bit-order",
        file: I2C_BUS,
        find: "bits >> (left - 1) & 1 == 0",
        put: "bits >> (8 - left) & 1 == 0",
        breaks: "a chip that waits sends its byte backwards",
    },
    Mutant {
        name: "bus-nobody-low",
        file: I2C_BUS,
        find: "(BusAction::Read, None) => BusAnswer::Byte(0xff)",
        put: "(BusAction::Read, None) => BusAnswer::Byte(0)",
        breaks: "a read that no chip answers is zero",
    },
];
