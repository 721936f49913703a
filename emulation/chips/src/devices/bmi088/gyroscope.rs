//! The gyroscope (data sheet 5.4 and 5.5).

use super::{
    AxisLatch, Bmi088Fault, Bmi088Settings, DEVIATION_PPM_MAX, POWER_ON, RegisterPointer,
    SampleClock,
};
use crate::Time;

const CHIP_ID: u8 = 0x00;
const RATE_X_LSB: u8 = 0x02;
const RATE_Z_MSB: u8 = 0x07;
const INT_STAT_1: u8 = 0x0a;
const RANGE: u8 = 0x0f;
const BANDWIDTH: u8 = 0x10;
const LPM1: u8 = 0x11;
const SOFTRESET: u8 = 0x14;
const INT_CTRL: u8 = 0x15;
const INT3_INT4_IO_CONF: u8 = 0x16;
const INT3_INT4_IO_MAP: u8 = 0x18;
const SELF_TEST: u8 = 0x3c;

const ID: u8 = 0x0f;
const RESET_COMMAND: u8 = 0xb6;
/// Bit 7 of BANDWIDTH always reads as one (BMI08_GYRO_ODR_RESET_VAL of Bosch's driver).
const BANDWIDTH_FIXED: u8 = 0x80;
const LPM1_NORMAL: u8 = 0x00;
const LPM1_SUSPEND: u8 = 0x80;
const LPM1_DEEP_SUSPEND: u8 = 0x20;
const DATA_READY: u8 = 0x80;
const IO_CONF_INT3_HIGH: u8 = 1 << 0;
const IO_CONF_INT3_OPEN_DRAIN: u8 = 1 << 1;
const IO_CONF_RESET: u8 = 0x0f;
const IO_MAP_INT3: u8 = 1 << 0;
const SELF_TEST_TRIGGER: u8 = 1 << 0;
const SELF_TEST_READY: u8 = 1 << 1;
const SELF_TEST_FAILED: u8 = 1 << 2;
/// Bit 4 is recalled from the data sheet. Bosch's driver has the mask 0x08, which it does not use.
const SELF_TEST_RATE_OK: u8 = 1 << 4;

/// The time from power-on, or from the end of a suspend mode, until the sensor measures
/// (BMI08_GYRO_POWER_MODE_CONFIG_DELAY of Bosch's driver). After a soft reset the driver waits for
/// the same time before any access; this model does not acknowledge meanwhile.
const START_UP: Time = Time::from_millis(30);
/// The duration of a pulse at INT3: the middle of the data sheet's 280 to 400 µs (5.5.3).
const PULSE: Time = Time::from_micros(340);
/// The duration of the self-test (choice; the data sheet has none).
const SELF_TEST_DURATION: Time = Time::from_millis(10);

pub(super) struct Gyroscope {
    /// The stored registers.
    registers: [u8; 0x40],
    pointer: RegisterPointer,
    deviation_ppm: i32,
    /// The chip acknowledges its address from this time on.
    responds_at: Time,
    /// `None` in a suspend mode.
    clock: Option<SampleClock>,
    output: AxisLatch,
    /// The begin of the next pulse.
    pulse_begin: Option<Time>,
    /// The end of the present pulse.
    pulse_end: Option<Time>,
    /// The end of the self-test.
    self_test_end: Option<Time>,
    pub(super) rate_counts: [i16; 3],
    pub(super) fault: Option<Bmi088Fault>,
}

impl Gyroscope {
    pub(super) fn new(settings: &Bmi088Settings, now: Time) -> Self {
        let deviation_ppm = settings.gyroscope_deviation_ppm;
        let mut gyroscope = Gyroscope {
            registers: [0; 0x40],
            pointer: RegisterPointer::default(),
            deviation_ppm: deviation_ppm.clamp(-DEVIATION_PPM_MAX, DEVIATION_PPM_MAX),
            responds_at: now + POWER_ON,
            clock: None,
            output: AxisLatch::default(),
            pulse_begin: None,
            pulse_end: None,
            self_test_end: None,
            rate_counts: [0; 3],
            fault: None,
        };
        gyroscope.reset(now);
        gyroscope
    }

    fn reset(&mut self, now: Time) {
        self.registers = [0; 0x40];
        self.registers[usize::from(BANDWIDTH)] = BANDWIDTH_FIXED;
        self.registers[usize::from(INT3_INT4_IO_CONF)] = IO_CONF_RESET;
        self.output = AxisLatch::default();
        self.pulse_begin = None;
        self.pulse_end = None;
        self.self_test_end = None;
        self.restart(now + START_UP);
    }

    fn register(&self, register: u8) -> u8 {
        self.registers[usize::from(register)]
    }

    /// Restarts the samples, the first of which is one period after `begin`.
    fn restart(&mut self, begin: Time) {
        // BMI08_GYRO_BW_* of Bosch's driver.
        let hz = match self.register(BANDWIDTH) & 0x0f {
            0 | 1 => 2_000,
            2 => 1_000,
            3 => 400,
            4 | 6 => 200,
            _ => 100,
        };
        let is_normal = self.register(LPM1) == LPM1_NORMAL;
        self.clock = is_normal.then(|| SampleClock::new(begin, hz * 1_000_000, self.deviation_ppm));
    }

    fn is_mapped(&self) -> bool {
        self.register(INT_CTRL) & DATA_READY != 0
            && self.register(INT3_INT4_IO_MAP) & IO_MAP_INT3 != 0
    }

    pub(super) fn next_event(&self) -> Option<Time> {
        let sample = self.clock.as_ref().map(SampleClock::next).filter(|_| self.is_mapped());
        [sample, self.pulse_begin, self.pulse_end].into_iter().flatten().min()
    }

    pub(super) fn advance(&mut self, now: Time) {
        loop {
            let sample = self.clock.as_ref().map(SampleClock::next);
            let next = [sample, self.pulse_begin, self.pulse_end].into_iter().flatten().min();
            let Some(at) = next.filter(|at| *at <= now) else { break };
            if self.pulse_end.take_if(|end| *end <= at).is_some() {
                continue;
            }
            if self.pulse_begin.take_if(|begin| *begin <= at).is_some() {
                self.pulse_end = Some(at + PULSE);
                continue;
            }
            if self.clock.as_mut().is_some_and(|clock| clock.take_due(at).is_some()) {
                self.sample(at);
            }
        }
    }

    fn sample(&mut self, at: Time) {
        if self.fault != Some(Bmi088Fault::FrozenData) {
            // Each further range is half as large, and its counts are twice as many.
            let factor = 1 << self.register(RANGE).min(4);
            self.output.set(self.rate_counts.map(|counts| counts.saturating_mul(factor)));
        }
        if self.register(INT_CTRL) & DATA_READY == 0 {
            return;
        }
        let begin = match self.fault {
            Some(Bmi088Fault::NoDataReady) => return,
            Some(Bmi088Fault::LateDataReady(delay)) => at + delay,
            _ => at,
        };
        self.pulse_begin.get_or_insert(begin);
    }

    pub(super) fn int3(&self) -> Option<bool> {
        let configuration = self.register(INT3_INT4_IO_CONF);
        let is_active = self.pulse_end.is_some() && self.is_mapped();
        let level = is_active == (configuration & IO_CONF_INT3_HIGH != 0);
        let is_driven = configuration & IO_CONF_INT3_OPEN_DRAIN == 0 || !level;
        is_driven.then_some(level)
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
            RANGE => self.registers[usize::from(RANGE)] = value & 0x07,
            BANDWIDTH => {
                self.registers[usize::from(BANDWIDTH)] = BANDWIDTH_FIXED | value & 0x0f;
                self.restart(now);
            }
            LPM1 => self.set_power_mode(value, now),
            SOFTRESET if value == RESET_COMMAND => {
                self.reset(now);
                self.responds_at = now + START_UP;
            }
            SELF_TEST if value & SELF_TEST_TRIGGER != 0 => {
                self.self_test_end = Some(now + SELF_TEST_DURATION);
            }
            INT_CTRL | INT3_INT4_IO_CONF | INT3_INT4_IO_MAP => {
                self.registers[usize::from(register)] = value;
            }
            // The FIFO's registers.
            0x1e | 0x34 | 0x3d | 0x3e => self.registers[usize::from(register)] = value,
            _ => {}
        }
    }

    /// Handles a write to LPM1. Other values have no effect, and a change between both suspend
    /// modes is impossible (Bosch's driver, bmi08g_set_power_mode).
    fn set_power_mode(&mut self, value: u8, now: Time) {
        let old = self.register(LPM1);
        let is_allowed = match value {
            LPM1_NORMAL => true,
            LPM1_SUSPEND | LPM1_DEEP_SUSPEND => old == LPM1_NORMAL,
            _ => false,
        };
        if is_allowed && value != old {
            self.registers[usize::from(LPM1)] = value;
            self.restart(now + START_UP);
        }
    }

    pub(super) fn read(&mut self, now: Time) -> u8 {
        let register = self.pointer.increment();
        match register {
            CHIP_ID => match self.fault {
                Some(Bmi088Fault::GyroscopeId(id)) => id,
                _ => ID,
            },
            RATE_X_LSB..=RATE_Z_MSB => self.output.read(usize::from(register - RATE_X_LSB)),
            INT_STAT_1 => u8::from(self.pulse_end.is_some()) << 7,
            SELF_TEST => self.self_test_status(now),
            _ => self.registers.get(usize::from(register)).copied().unwrap_or(0),
        }
    }

    fn self_test_status(&self, now: Time) -> u8 {
        let has_failed = self.fault == Some(Bmi088Fault::FailedSelfTest);
        let rate_ok = if has_failed { 0 } else { SELF_TEST_RATE_OK };
        match self.self_test_end {
            Some(end) if now < end => rate_ok | SELF_TEST_TRIGGER,
            Some(_) if has_failed => SELF_TEST_READY | SELF_TEST_FAILED,
            Some(_) => rate_ok | SELF_TEST_READY,
            None => rate_ok,
        }
    }
}
