//! The accelerometer (data sheet 5.2 and 5.3).

use super::{
    AccelerometerStart, AxisLatch, Bmi088Fault, Bmi088Settings, DEVIATION_PPM_MAX, POWER_ON,
    RegisterPointer, SampleClock,
};
use crate::Time;

const CHIP_ID: u8 = 0x00;
const ERR_REG: u8 = 0x02;
const STATUS: u8 = 0x03;
const X_LSB: u8 = 0x12;
const Z_MSB: u8 = 0x17;
const SENSORTIME_0: u8 = 0x18;
const SENSORTIME_2: u8 = 0x1a;
const INT_STAT_1: u8 = 0x1d;
const TEMP_MSB: u8 = 0x22;
const TEMP_LSB: u8 = 0x23;
const CONF: u8 = 0x40;
const RANGE: u8 = 0x41;
const SELF_TEST: u8 = 0x6d;
const PWR_CONF: u8 = 0x7c;
const PWR_CTRL: u8 = 0x7d;
const SOFTRESET: u8 = 0x7e;

const ID: u8 = 0x1e;
const RESET_COMMAND: u8 = 0xb6;
/// Bandwidth "normal" at 100 Hz.
const CONF_RESET: u8 = 0xa8;
/// ±6 g.
const RANGE_RESET: u8 = 0x01;
const PWR_CONF_SUSPEND: u8 = 0x03;
const PWR_CONF_ACTIVE: u8 = 0x00;
const PWR_CTRL_ON: u8 = 0x04;
const SELF_TEST_POSITIVE: u8 = 0x0d;
const SELF_TEST_NEGATIVE: u8 = 0x09;
const DATA_READY: u8 = 0x80;
/// An error in ACC_CONF: code 1 in bits 4:2.
const ERR_CONF: u8 = 1 << 2;
/// The temperature before the first measurement (data sheet 5.3.7).
const TEMPERATURE_INVALID: [u8; 2] = [0x80, 0x00];

/// The counter of the sensor's time has a period of 39.0625 µs (data sheet 5.3.5).
const SENSOR_TIME_HZ: u64 = 25_600;
/// A temperature is measured every 1.28 s (data sheet 5.3.7).
const TEMPERATURE_MICRO_HZ: u64 = 781_250;
/// The effect of the self-test along each axis: 0.75 g in counts at ±24 g (choice). The difference
/// of both polarities is to be at least 1 g along x and y, and 0.5 g along z (data sheet 4.6.1);
/// Bosch's driver cuts fractions of a g off, and therefore demands 1 g along z too.
const SELF_TEST_COUNTS: i16 = 1024;

pub(super) struct Accelerometer {
    /// The stored registers.
    registers: [u8; 0x80],
    pointer: RegisterPointer,
    deviation_ppm: i32,
    start_reading: AccelerometerStart,
    /// The chip acknowledges its address from this time on.
    responds_at: Time,
    /// The time of the last reset.
    reset_at: Time,
    /// `None` while the sensor is off.
    clock: Option<SampleClock>,
    temperature_clock: Option<SampleClock>,
    output: AxisLatch,
    sensor_time: [u8; 4],
    pub(super) force_counts: [i16; 3],
    pub(super) temperature_c: f64,
    pub(super) fault: Option<Bmi088Fault>,
}

impl Accelerometer {
    pub(super) fn new(settings: &Bmi088Settings, now: Time) -> Self {
        let deviation_ppm = settings.accelerometer_deviation_ppm;
        let mut accelerometer = Accelerometer {
            registers: [0; 0x80],
            pointer: RegisterPointer::default(),
            deviation_ppm: deviation_ppm.clamp(-DEVIATION_PPM_MAX, DEVIATION_PPM_MAX),
            start_reading: settings.start,
            responds_at: now,
            reset_at: now,
            clock: None,
            temperature_clock: None,
            output: AxisLatch::default(),
            sensor_time: [0; 4],
            force_counts: [0; 3],
            temperature_c: 23.0,
            fault: None,
        };
        accelerometer.reset(now);
        accelerometer
    }

    /// Resets the chip, which then needs the time of a power-on (Bosch's driver,
    /// bmi08a_soft_reset).
    fn reset(&mut self, now: Time) {
        self.registers = [0; 0x80];
        self.registers[usize::from(CONF)] = CONF_RESET;
        self.registers[usize::from(RANGE)] = RANGE_RESET;
        self.registers[usize::from(PWR_CONF)] = PWR_CONF_SUSPEND;
        let [msb, lsb] = TEMPERATURE_INVALID;
        self.registers[usize::from(TEMP_MSB)] = msb;
        self.registers[usize::from(TEMP_LSB)] = lsb;
        self.clock = None;
        self.temperature_clock = None;
        self.output = AxisLatch::default();
        self.reset_at = now;
        self.responds_at = now + POWER_ON;
    }

    fn register(&self, register: u8) -> u8 {
        self.registers[usize::from(register)]
    }

    fn is_on(&self) -> bool {
        let is_enabled = self.register(PWR_CTRL) == PWR_CTRL_ON;
        match self.start_reading {
            AccelerometerStart::BothRegisters => {
                is_enabled && self.register(PWR_CONF) == PWR_CONF_ACTIVE
            }
            AccelerometerStart::PowerControl => is_enabled,
        }
    }

    /// Returns the rate of samples in µHz: 12.5 Hz for code 5, and twice the rate for each further
    /// code up to 12 (BMI08_ACCEL_ODR_* of Bosch's driver).
    fn micro_hz(&self) -> Option<u64> {
        let code = self.register(CONF) & 0x0f;
        (5..=12).contains(&code).then(|| 12_500_000 << (code - 5))
    }

    /// Restarts the samples, the first of which is one period after `now`.
    fn restart(&mut self, now: Time) {
        let micro_hz = self.micro_hz().filter(|_| self.is_on());
        self.clock = micro_hz.map(|micro_hz| SampleClock::new(now, micro_hz, self.deviation_ppm));
        if self.clock.is_none() {
            self.temperature_clock = None;
        } else if self.temperature_clock.is_none() {
            self.temperature_clock = Some(SampleClock::new(now, TEMPERATURE_MICRO_HZ, 0));
            self.measure_temperature();
        }
    }

    pub(super) fn advance(&mut self, now: Time) {
        while self.clock.as_mut().is_some_and(|clock| clock.take_due(now).is_some()) {
            self.sample();
        }
        while self.temperature_clock.as_mut().is_some_and(|clock| clock.take_due(now).is_some()) {
            self.measure_temperature();
        }
    }

    /// Takes a sample between two of its own, if the sensor measures.
    pub(super) fn sample_now(&mut self) {
        if self.clock.is_some() {
            self.sample();
        }
    }

    fn sample(&mut self) {
        self.registers[usize::from(STATUS)] |= DATA_READY;
        self.registers[usize::from(INT_STAT_1)] |= DATA_READY;
        if self.fault == Some(Bmi088Fault::FrozenData) {
            return;
        }
        let sign = match self.register(SELF_TEST) {
            _ if self.fault == Some(Bmi088Fault::FailedSelfTest) => 0,
            SELF_TEST_POSITIVE => 1,
            SELF_TEST_NEGATIVE => -1,
            _ => 0,
        };
        // Range 3 is ±24 g. Each smaller one is half as large, and its counts are twice as many.
        let factor = 1 << (3 - (self.register(RANGE) & 0x03));
        let mut sample = self.force_counts;
        for counts in &mut sample {
            *counts = counts.saturating_add(sign * SELF_TEST_COUNTS).saturating_mul(factor);
        }
        self.output.set(sample);
    }

    /// Stores the temperature as eleven bits of 0.125 K from 23 °C on.
    fn measure_temperature(&mut self) {
        let eighths = ((self.temperature_c - 23.0) * 8.0).round().clamp(-1023.0, 1023.0) as i16;
        let [lsb, msb] = (eighths << 5).to_le_bytes();
        self.registers[usize::from(TEMP_MSB)] = msb;
        self.registers[usize::from(TEMP_LSB)] = lsb;
    }

    pub(super) fn start(&mut self, reads: bool, now: Time) -> bool {
        self.pointer.start(reads);
        now >= self.responds_at
    }

    pub(super) fn write(&mut self, byte: u8, now: Time) {
        if self.pointer.written(byte).is_some() {
            let register = self.pointer.increment();
            self.write_register(register, byte, now);
        }
    }

    fn write_register(&mut self, register: u8, value: u8, now: Time) {
        match register {
            CONF => {
                self.registers[usize::from(CONF)] = value;
                // Bandwidths are 8 to 10 (BMI08_ACCEL_BW_* of Bosch's driver).
                let is_valid = self.micro_hz().is_some() && (8..=10).contains(&(value >> 4));
                self.registers[usize::from(ERR_REG)] = if is_valid { 0 } else { ERR_CONF };
                self.restart(now);
            }
            PWR_CONF | PWR_CTRL => {
                self.registers[usize::from(register)] = value;
                if self.is_on() != self.clock.is_some() {
                    self.restart(now);
                }
            }
            SOFTRESET if value == RESET_COMMAND => self.reset(now),
            // Interrupts and the FIFO have no model.
            RANGE | SELF_TEST | 0x45..=0x49 | 0x53..=0x59 | 0x70 => {
                self.registers[usize::from(register)] = value;
            }
            _ => {}
        }
    }

    pub(super) fn read(&mut self, now: Time) -> u8 {
        let register = self.pointer.increment();
        match register {
            CHIP_ID => match self.fault {
                Some(Bmi088Fault::AccelerometerId(id)) => id,
                _ => ID,
            },
            X_LSB..=Z_MSB => {
                self.registers[usize::from(STATUS)] &= !DATA_READY;
                self.output.read(usize::from(register - X_LSB))
            }
            SENSORTIME_0..=SENSORTIME_2 => {
                if register == SENSORTIME_0 {
                    let ticks = (now - self.reset_at).ticks(SENSOR_TIME_HZ);
                    self.sensor_time = (ticks as u32).to_le_bytes();
                }
                self.sensor_time[usize::from(register - SENSORTIME_0)]
            }
            INT_STAT_1 => std::mem::take(&mut self.registers[usize::from(INT_STAT_1)]),
            _ => self.registers.get(usize::from(register)).copied().unwrap_or(0),
        }
    }
}
