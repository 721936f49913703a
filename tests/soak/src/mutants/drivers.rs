//! Mistakes in the drivers of the flying Crazyflie's sensors.

use super::Mutant;

const ACCELEROMETER: &str = "firmware/drivers/bmi088/src/accelerometer.rs";
const BAROMETER: &str = "firmware/drivers/bmp3xx/src/barometer.rs";
const BMI088_REGISTERS: &str = "firmware/drivers/bmi088/src/register.rs";
const CALIBRATION: &str = "firmware/drivers/bmp3xx/src/calibration.rs";
const FLOW: &str = "firmware/drivers/pmw3901/src/sensor.rs";
const FLOW_MOTION: &str = "firmware/drivers/pmw3901/src/motion.rs";
const FLOW_REGISTERS: &str = "firmware/drivers/pmw3901/src/registers.rs";
const GYROSCOPE: &str = "firmware/drivers/bmi088/src/gyroscope.rs";
const RANGE_CONFIGURATION: &str = "firmware/drivers/vl53l1x/src/configuration.rs";
const RANGE_FINDER: &str = "firmware/drivers/vl53l1x/src/range_finder.rs";
const RANGE_READING: &str = "firmware/drivers/vl53l1x/src/reading.rs";

pub const MUTANTS: &[Mutant] = &[
    Mutant {
        name: "gyroscope-range",
        file: GYROSCOPE,
        find: "const RANGE_2000: u8 = 0x00;",
        put: "const RANGE_2000: u8 = 0x01;",
        breaks: "the gyroscope saturates at half the rate, and its counts mean half as much",
    },
    Mutant {
        name: "gyroscope-unit",
        file: GYROSCOPE,
        find: "2000.0 / 32768.0 * PI / 180.0;",
        put: "2000.0 / 32768.0;",
        breaks: "rates in degrees per second pass for radians per second",
    },
    Mutant {
        name: "gyroscope-pin",
        file: GYROSCOPE,
        find: "DataReady::Int3 => 1 << 0,",
        put: "DataReady::Int3 => 1 << 1,",
        breaks: "pin INT3 has no data-ready pulses",
    },
    Mutant {
        name: "gyroscope-test-ignored",
        file: GYROSCOPE,
        find: "state & TEST_FAILED != 0;",
        put: "state & TEST_READY == 0;",
        breaks: "a gyroscope that fails its self-test counts as healthy",
    },
    Mutant {
        name: "gyroscope-test-endless",
        file: GYROSCOPE,
        find: "        Err(Error::Timeout)\n",
        put: "        Ok(())\n",
        breaks: "a self-test that never ends counts as passed",
    },
    Mutant {
        name: "axis-byte-order",
        file: BMI088_REGISTERS,
        find: "i16::from_le_bytes([y_low, y_high])",
        put: "i16::from_be_bytes([y_low, y_high])",
        breaks: "the bytes of the y axis are exchanged",
    },
    Mutant {
        name: "accelerometer-addresses",
        file: ACCELEROMETER,
        find: "        Address::SdoLow => 0x18,\n        Address::SdoHigh => 0x19,\n",
        put: "        Address::SdoLow => 0x19,\n        Address::SdoHigh => 0x18,\n",
        breaks: "the accelerometer is sought at the address of the other level of its pin",
    },
    Mutant {
        name: "accelerometer-scale",
        file: ACCELEROMETER,
        find: "24.0 * STANDARD_GRAVITY_M_PER_S2 / 32768.0;",
        put: "STANDARD_GRAVITY_M_PER_S2 / 1024.0;",
        breaks: "accelerations have the scale of 32 g",
    },
    Mutant {
        name: "accelerometer-power-wait",
        file: ACCELEROMETER,
        find: "    delay.delay_ms(POWER_MS).await;\n",
        put: "",
        breaks: "the accelerometer is accessed before its power is on",
    },
    Mutant {
        name: "accelerometer-test-sign",
        file: ACCELEROMETER,
        find: "i32::from(positive) - i32::from(negative)",
        put: "i32::from(positive) + i32::from(negative)",
        breaks: "both forces of the self-test cancel each other",
    },
    Mutant {
        name: "pressure-byte-order",
        file: BAROMETER,
        find: "[p_low, p_mid, p_high, 0]",
        put: "[p_high, p_mid, p_low, 0]",
        breaks: "the bytes of the pressure are exchanged",
    },
    Mutant {
        name: "oversampling-bits",
        file: BAROMETER,
        find: "const PRESSURE_X8: u8 = 0x03;",
        put: "const PRESSURE_X8: u8 = 0x18;",
        breaks: "the temperature is oversampled in place of the pressure",
    },
    Mutant {
        name: "filter-bits",
        file: BAROMETER,
        find: "const FILTER_3: u8 = 0x04;",
        put: "const FILTER_3: u8 = 0x02;",
        breaks: "the coefficient of the filter is 1, so heights are noisier",
    },
    Mutant {
        name: "command-error-bit",
        file: BAROMETER,
        find: "const COMMAND_ERROR: u8 = 1 << 1;",
        put: "const COMMAND_ERROR: u8 = 1 << 3;",
        breaks: "a barometer that refuses its reset is not noticed",
    },
    Mutant {
        name: "bmp390-id",
        file: BAROMETER,
        find: "0x60 => Model::Bmp390,",
        put: "0x61 => Model::Bmp390,",
        breaks: "a BMP390 is refused as another chip",
    },
    Mutant {
        name: "temperature-sign",
        file: CALIBRATION,
        find: "short(t3) / TWO_48]",
        put: "f32::from(t3) / TWO_48]",
        breaks: "a negative coefficient of the temperature is read as positive",
    },
    Mutant {
        name: "pressure-offset",
        file: CALIBRATION,
        find: "(signed(p2_low, p2_high) - 16_384.0) / TWO_29",
        put: "signed(p2_low, p2_high) / TWO_29",
        breaks: "the pressure drifts with the temperature",
    },
    Mutant {
        name: "checksum-polynomial",
        file: CALIBRATION,
        find: "const POLYNOMIAL: u8 = 0x1d;",
        put: "const POLYNOMIAL: u8 = 0x07;",
        breaks: "a sound calibration counts as damaged",
    },
    Mutant {
        name: "flow-write-bit",
        file: FLOW,
        find: "const WRITE: u8 = 0x80;",
        put: "const WRITE: u8 = 0x40;",
        breaks: "the flow sensor takes writes for reads",
    },
    Mutant {
        name: "flow-reset",
        file: FLOW,
        find: "const RESET: u8 = 0x5a;",
        put: "const RESET: u8 = 0xb6;",
        breaks: "the flow sensor is not reset",
    },
    Mutant {
        name: "flow-fetch-time",
        file: FLOW,
        find: "const FETCH_US: u32 = 500;",
        put: "const FETCH_US: u32 = 5;",
        breaks: "a register of the flow sensor is read before its value is there",
    },
    Mutant {
        name: "flow-bank",
        file: FLOW_REGISTERS,
        find: "(0x7f, 0x14), (0x65, 0x67)",
        put: "(0x7f, 0x15), (0x65, 0x67)",
        breaks: "settings of the flow sensor go to another bank",
    },
    Mutant {
        name: "flow-shutter-order",
        file: FLOW_MOTION,
        find: "u16::from_be_bytes([shutter_high, shutter_low])",
        put: "u16::from_le_bytes([shutter_high, shutter_low])",
        breaks: "the exposure of the flow sensor has its bytes exchanged",
    },
    Mutant {
        name: "flow-valid-bits",
        file: FLOW_MOTION,
        find: "const VALID_MOTION: u8 = 0xb0;",
        put: "const VALID_MOTION: u8 = 0x80;",
        breaks: "no motion of the flow sensor is used",
    },
    Mutant {
        name: "flow-scale",
        file: FLOW_MOTION,
        find: "0.1 * 0.71674 / 35.0;",
        put: "0.71674 / 35.0;",
        breaks: "angles of the flow are ten times too large",
    },
    Mutant {
        name: "range-byte-order",
        file: RANGE_READING,
        find: "u16::from_be_bytes([distance_high, distance_low])",
        put: "u16::from_le_bytes([distance_high, distance_low])",
        breaks: "distances have their bytes exchanged",
    },
    Mutant {
        name: "range-unit",
        file: RANGE_READING,
        find: "/ 1000.0 })",
        put: "/ 100.0 })",
        breaks: "distances in centimeters pass for meters",
    },
    Mutant {
        name: "range-acknowledgement",
        file: RANGE_FINDER,
        find: "        write(bus, self.address, SYSTEM__INTERRUPT_CLEAR, &[CLEAR]).await?;\n",
        put: "",
        breaks: "the same result is read again and again",
    },
    Mutant {
        name: "range-period",
        file: RANGE_FINDER,
        find: "mode.period_ms() * 1075 / 1000",
        put: "mode.period_ms()",
        breaks: "measurements follow each other 7 % too fast for their budget",
    },
    Mutant {
        name: "range-oscillator",
        file: RANGE_FINDER,
        find: "const OSCILLATOR_BITS: u16 = 0x03ff;",
        put: "const OSCILLATOR_BITS: u16 = 0x00ff;",
        breaks: "a chip with a fast oscillator measures too often",
    },
    Mutant {
        name: "range-defaults",
        file: RANGE_CONFIGURATION,
        find: "DEFAULTS_START: u16 = 0x0030;",
        put: "DEFAULTS_START: u16 = 0x002d;",
        breaks: "the configuration is written three registers too early",
    },
    Mutant {
        name: "range-laser-period",
        file: RANGE_CONFIGURATION,
        find: "(0x0060, &[0x0f]),",
        put: "(0x0060, &[0x07]),",
        breaks: "long distances are measured with a laser period of short ones",
    },
];
