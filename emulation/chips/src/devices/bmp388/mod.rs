//! The barometers Bosch BMP388 and BMP390.
//!
//! Sources: Bosch's BMP3-Sensor-API, which quotes the data sheet BST-BMP388-DS001, and reports of
//! users in Bosch's forum. Further facts are recalled from the data sheet, as the comments say.
//!
//! # Limits
//! The FIFO, the counter of the sensor's time and the interrupt pin have no model; their registers
//! are storage.

mod calibration;
#[cfg(test)]
mod tests;

use self::calibration::{CALIBRATION_BYTES, Calibration};
use super::{RegisterPointer, SampleClock, SdaHold};
use crate::{I2cDevice, Time};

/// The address when pin SDO is high.
pub const ADDRESS: u8 = 0x77;

const CHIP_ID: u8 = 0x00;
const REV_ID: u8 = 0x01;
const ERR_REG: u8 = 0x02;
const STATUS: u8 = 0x03;
const DATA_0: u8 = 0x04;
const DATA_3: u8 = 0x07;
const DATA_5: u8 = 0x09;
const EVENT: u8 = 0x10;
const INT_STATUS: u8 = 0x11;
const FIFO_WTM_0: u8 = 0x15;
const FIFO_CONFIG_1: u8 = 0x17;
const FIFO_CONFIG_2: u8 = 0x18;
const INT_CTRL: u8 = 0x19;
const PWR_CTRL: u8 = 0x1b;
const OSR: u8 = 0x1c;
const ODR: u8 = 0x1d;
const CONFIG: u8 = 0x1f;
/// The checksum of the calibration.
const CALIBRATION_CRC: u8 = 0x30;
const CALIBRATION: u8 = 0x31;
const CMD: u8 = 0x7e;
const REGISTERS: usize = 0x80;

const ERR_FATAL: u8 = 1 << 0;
const ERR_CMD: u8 = 1 << 1;
const ERR_CONF: u8 = 1 << 2;
const STATUS_CMD_RDY: u8 = 1 << 4;
const STATUS_DRDY_PRESS: u8 = 1 << 5;
const STATUS_DRDY_TEMP: u8 = 1 << 6;
const EVENT_POWER_ON: u8 = 1 << 0;
const INT_STATUS_DRDY: u8 = 1 << 3;
const PWR_CTRL_PRESS_EN: u8 = 1 << 0;
const PWR_CTRL_TEMP_EN: u8 = 1 << 1;
const PWR_CTRL_MODE: u8 = 0x30;
const PWR_CTRL_NORMAL: u8 = 0x30;
const COMMAND_SOFT_RESET: u8 = 0xb6;
const COMMAND_FIFO_FLUSH: u8 = 0xb0;
/// The registers with another reset value than 0 (recalled from the data sheet).
const RESET_VALUES: [(u8, u8); 8] = [
    // Both raw values begin with 0x800000.
    (DATA_0 + 2, 0x80),
    (DATA_5, 0x80),
    (EVENT, EVENT_POWER_ON),
    (FIFO_WTM_0, 0x01),
    (FIFO_CONFIG_1, 0x02),
    (FIFO_CONFIG_2, 0x02),
    (INT_CTRL, 0x02),
    (OSR, 0x02),
];

/// The calibration of a BMP390, which the tests of the crate bmp390 0.4.3 contain.
pub const CALIBRATION_OF_A_BMP390: [u8; CALIBRATION_BYTES] = [
    0x98, 0x6c, 0xa9, 0x4a, 0xf9, 0xe3, 0x1c, 0x61, 0x16, 0x06, 0x01, 0x51, 0x4a, 0xde, 0x5d, 0x03,
    0xfa, 0xf9, 0x0e, 0x06, 0xf5,
];

/// A fault of a barometer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bmp388Fault {
    /// The chip has this identification.
    WrongId(u8),
    /// The chip does not acknowledge its address.
    NoAcknowledge,
    /// SDA is held low.
    SdaLow {
        /// The pulses of SCL until the release.
        clock_pulses: u32,
    },
    /// The chip repeats its last measurement, with its bits of data ready.
    FrozenData,
    /// The chip measures nothing.
    NoMeasurement,
    /// The chip never reports that it is ready for a command.
    CommandNotReady,
    /// The chip reports a fatal error.
    FatalError,
}

/// The two types of the barometer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BarometerType {
    /// BMP388.
    #[default]
    Bmp388,
    /// BMP390, its successor with the same registers.
    Bmp390,
}

/// The properties of a barometer that differ from chip to chip.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bmp388Settings {
    /// The type of the chip.
    pub chip: BarometerType,
    /// Registers 0x31 to 0x45.
    pub calibration: [u8; CALIBRATION_BYTES],
    /// Deviation of the rate of measurements, in millionths.
    pub deviation_ppm: i32,
    /// The time from power-on or a reset until the chip acknowledges its address.
    pub start_up: Time,
}

impl Default for Bmp388Settings {
    /// Returns a BMP388. The data sheet has 2 ms as the largest time of the start; Bitcraze's
    /// firmware, whose delay of 2 ms can be up to 1 ms shorter, works with its chips.
    fn default() -> Self {
        Bmp388Settings {
            chip: BarometerType::Bmp388,
            calibration: CALIBRATION_OF_A_BMP390,
            deviation_ppm: 0,
            start_up: Time::from_millis(1),
        }
    }
}

/// A barometer on an I2C bus.
pub struct Bmp388 {
    settings: Bmp388Settings,
    calibration: Calibration,
    registers: [u8; REGISTERS],
    pointer: RegisterPointer,
    is_selected: bool,
    /// The chip acknowledges its address from this time on.
    responds_at: Time,
    /// The ends of the measurements; `None` in sleep mode.
    clock: Option<SampleClock>,
    /// The filter's state: raw pressure and raw temperature.
    filtered: Option<[f64; 2]>,
    /// The data registers at the begin of the transfer (recalled from the data sheet).
    shadow: [u8; 6],
    pressure_pa: f64,
    temperature_c: f64,
    fault: Option<Bmp388Fault>,
    sda: SdaHold,
}

impl Bmp388 {
    /// Returns a chip that is powered on at `now`, in standard air.
    pub fn new(settings: Bmp388Settings, now: Time) -> Self {
        let mut chip = Bmp388 {
            calibration: Calibration::new(&settings.calibration),
            settings,
            registers: [0; REGISTERS],
            pointer: RegisterPointer::default(),
            is_selected: false,
            responds_at: now,
            clock: None,
            filtered: None,
            shadow: [0; 6],
            pressure_pa: 101_325.0,
            temperature_c: 15.0,
            fault: None,
            sda: SdaHold::default(),
        };
        chip.reset(now);
        chip
    }

    /// Sets the present air. Measurements before `now` have the former one.
    pub fn set_air(&mut self, pressure_pa: f64, temperature_c: f64, now: Time) {
        self.advance(now);
        self.pressure_pa = pressure_pa;
        self.temperature_c = temperature_c;
    }

    /// Sets or clears the fault.
    pub fn set_fault(&mut self, fault: Option<Bmp388Fault>, now: Time) {
        self.advance(now);
        self.fault = fault;
        self.sda.set(match fault {
            Some(Bmp388Fault::SdaLow { clock_pulses }) => clock_pulses,
            _ => 0,
        });
    }

    fn reset(&mut self, now: Time) {
        self.registers = [0; REGISTERS];
        for (register, value) in RESET_VALUES {
            self.registers[usize::from(register)] = value;
        }
        let begin = usize::from(CALIBRATION);
        self.registers[begin..begin + CALIBRATION_BYTES]
            .copy_from_slice(&self.settings.calibration);
        self.registers[usize::from(CALIBRATION_CRC)] = calibration::crc(&self.settings.calibration);
        self.clock = None;
        self.filtered = None;
        self.responds_at = now + self.settings.start_up;
    }

    fn register(&self, register: u8) -> u8 {
        self.registers[usize::from(register)]
    }

    fn has_mode(&self, mode: u8) -> bool {
        self.register(PWR_CTRL) & PWR_CTRL_MODE == mode
    }

    /// Returns the duration of a measurement (data sheet 3.9.2; calculate_press_meas_time of
    /// Bosch's driver).
    fn duration(&self) -> Time {
        let enabled = self.register(PWR_CTRL);
        let samples = |shift: u8| 1 << (self.register(OSR) >> shift & 7).min(5);
        let mut micros = 234;
        if enabled & PWR_CTRL_PRESS_EN != 0 {
            micros += 392 + 2_000 * samples(0);
        }
        if enabled & PWR_CTRL_TEMP_EN != 0 {
            micros += 313 + 2_000 * samples(3);
        }
        Time::from_micros(micros)
    }

    /// Handles a change of the mode or of its settings.
    fn restart(&mut self, now: Time) {
        let duration = self.duration();
        // 200 Hz is halved for each further code up to 17 (BMP3_ODR_* of Bosch's driver).
        let code = (self.register(ODR) & 0x1f).min(17);
        let period = Time::from_millis(5 << code);
        self.clock = None;
        if self.has_mode(0) {
            return;
        }
        if self.has_mode(PWR_CTRL_NORMAL) && duration >= period {
            // The chip returns to sleep mode. Users read 0x33 and then 0x03 from PWR_CTRL; this
            // model returns at once.
            self.registers[usize::from(ERR_REG)] |= ERR_CONF;
            self.registers[usize::from(PWR_CTRL)] &= !PWR_CTRL_MODE;
            return;
        }
        let micro_hz = 200_000_000 >> code;
        let deviation_ppm = self.settings.deviation_ppm;
        self.clock = Some(SampleClock::with_first(now + duration, micro_hz, deviation_ppm));
    }

    fn advance(&mut self, now: Time) {
        while self.clock.as_mut().is_some_and(|clock| clock.take_due(now).is_some()) {
            self.measure();
            if !self.has_mode(PWR_CTRL_NORMAL) {
                // A single measurement has ended.
                self.registers[usize::from(PWR_CTRL)] &= !PWR_CTRL_MODE;
                self.clock = None;
            }
        }
    }

    fn measure(&mut self) {
        if self.fault == Some(Bmp388Fault::NoMeasurement) {
            return;
        }
        let enabled = self.register(PWR_CTRL);
        if self.fault != Some(Bmp388Fault::FrozenData) {
            let pressure = self.calibration.raw_pressure(self.pressure_pa, self.temperature_c);
            let temperature = self.calibration.raw_temperature(self.temperature_c);
            let raw = self.filter([pressure, temperature]);
            if enabled & PWR_CTRL_PRESS_EN != 0 {
                self.store(DATA_0, raw[0]);
            }
            if enabled & PWR_CTRL_TEMP_EN != 0 {
                self.store(DATA_3, raw[1]);
            }
        }
        if enabled & PWR_CTRL_PRESS_EN != 0 {
            self.registers[usize::from(STATUS)] |= STATUS_DRDY_PRESS;
        }
        if enabled & PWR_CTRL_TEMP_EN != 0 {
            self.registers[usize::from(STATUS)] |= STATUS_DRDY_TEMP;
        }
        self.registers[usize::from(INT_STATUS)] |= INT_STATUS_DRDY;
    }

    /// Returns the values that leave the filter of order 1, whose coefficient is 2ⁿ − 1. Without
    /// the filter a value has 16 bits, and one more for each doubling of the samples (recalled
    /// from the data sheet); users report zeros in its low byte.
    fn filter(&mut self, raw: [u32; 2]) -> [u32; 2] {
        let code = self.register(CONFIG) >> 1 & 7;
        if code == 0 {
            let osr = self.register(OSR);
            let zeros = |shift: u8| 8 - (osr >> shift & 7).min(5);
            self.filtered = None;
            return [raw[0] >> zeros(0) << zeros(0), raw[1] >> zeros(3) << zeros(3)];
        }
        let weight = f64::from(1_u32 << code);
        let new = raw.map(f64::from);
        let old = self.filtered.unwrap_or(new);
        let filtered = [0, 1].map(|at| old[at] + (new[at] - old[at]) / weight);
        self.filtered = Some(filtered);
        filtered.map(|value| value.round() as u32)
    }

    fn store(&mut self, register: u8, raw: u32) {
        let at = usize::from(register);
        self.registers[at..at + 3].copy_from_slice(&raw.to_le_bytes()[..3]);
    }

    fn write_register(&mut self, register: u8, value: u8, now: Time) {
        match register {
            CMD => match value {
                COMMAND_SOFT_RESET => self.reset(now),
                COMMAND_FIFO_FLUSH => {}
                _ => self.registers[usize::from(ERR_REG)] |= ERR_CMD,
            },
            PWR_CTRL | OSR | ODR => {
                self.registers[usize::from(register)] = value;
                self.restart(now);
            }
            CONFIG => {
                self.registers[usize::from(CONFIG)] = value;
                self.filtered = None;
            }
            FIFO_WTM_0..=0x1a => self.registers[usize::from(register)] = value,
            _ => {}
        }
    }

    fn read_register(&mut self, register: u8) -> u8 {
        let at = usize::from(register);
        match register {
            CHIP_ID => match (self.fault, self.settings.chip) {
                (Some(Bmp388Fault::WrongId(id)), _) => id,
                (_, BarometerType::Bmp388) => 0x50,
                (_, BarometerType::Bmp390) => 0x60,
            },
            REV_ID => 0x01,
            ERR_REG => {
                let is_fatal = self.fault == Some(Bmp388Fault::FatalError);
                std::mem::take(&mut self.registers[at]) | if is_fatal { ERR_FATAL } else { 0 }
            }
            STATUS => match self.fault {
                Some(Bmp388Fault::CommandNotReady) => self.registers[at],
                _ => self.registers[at] | STATUS_CMD_RDY,
            },
            DATA_0..=DATA_5 => {
                let ready = if register < DATA_3 { STATUS_DRDY_PRESS } else { STATUS_DRDY_TEMP };
                self.registers[usize::from(STATUS)] &= !ready;
                self.shadow[usize::from(register - DATA_0)]
            }
            EVENT | INT_STATUS => std::mem::take(&mut self.registers[at]),
            _ => self.registers.get(at).copied().unwrap_or(0),
        }
    }
}

impl I2cDevice for Bmp388 {
    fn start(&mut self, address: u8, reads: bool, now: Time) -> bool {
        self.advance(now);
        let is_silent = self.fault == Some(Bmp388Fault::NoAcknowledge) || self.sda.is_low();
        self.is_selected = address == ADDRESS && now >= self.responds_at && !is_silent;
        self.pointer.start(reads);
        let begin = usize::from(DATA_0);
        self.shadow.copy_from_slice(&self.registers[begin..begin + 6]);
        self.is_selected
    }

    fn write(&mut self, byte: u8, now: Time) -> bool {
        self.advance(now);
        if !self.is_selected {
            return false;
        }
        if let Some(register) = self.pointer.written(byte) {
            self.write_register(register, byte, now);
            // Each further byte has a register address of its own (bmp3_set_regs of Bosch's
            // driver).
            self.pointer.expect_register();
        }
        true
    }

    fn read(&mut self, now: Time) -> u8 {
        self.advance(now);
        if !self.is_selected {
            // Nothing drives SDA.
            return 0xff;
        }
        let register = self.pointer.increment();
        self.read_register(register)
    }

    fn stop(&mut self, _now: Time) {
        self.is_selected = false;
    }

    fn holds_sda(&self) -> bool {
        self.sda.is_low()
    }

    fn clock_pulse(&mut self) {
        self.sda.clock_pulse();
    }
}
