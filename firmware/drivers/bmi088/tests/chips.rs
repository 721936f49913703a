//! Models of the two chips, written from the data sheet: registers, their values after a reset, and
//! the times during which a chip does not answer.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_chips::Time;
use bittybuzz_testbus::{RegisterFile, Registers, TestI2c, Wires};

pub const GYROSCOPE: u8 = 0x69;
pub const ACCELEROMETER: u8 = 0x18;

/// A defect of a model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Defect {
    #[default]
    None,
    /// The identity has this value.
    Id(u8),
    /// This register always reads as this value.
    Stuck(u16, u8),
    /// The self-test never ends.
    TestHangs,
    /// The self-test of the gyroscope fails.
    TestFails,
    /// The force of the self-test deflects this axis by this number of counts in each direction.
    Force(usize, i16),
}

/// The gyroscope, with the given sample.
pub struct GyroscopeModel {
    pub sample: [u8; 6],
    pub defect: Defect,
    pub values: [u8; 0x40],
    answers_from: Time,
    test_ends: Option<Time>,
}

impl GyroscopeModel {
    fn new(sample: [u8; 6], defect: Defect) -> GyroscopeModel {
        let mut model = GyroscopeModel {
            sample,
            defect,
            values: [0; 0x40],
            answers_from: Time::ZERO,
            test_ends: None,
        };
        // Values that a previous user left: a driver must not rely on those after a reset.
        model.values[0x0f] = 0x04;
        model.values[0x11] = 0x80;
        model
    }
}

impl RegisterFile for GyroscopeModel {
    fn write(&mut self, register: u16, value: u8, now: Time) {
        match (register, value) {
            (0x14, 0xb6) => {
                self.values = [0; 0x40];
                self.values[0x16] = 0x0f;
                self.answers_from = now + Time::from_millis(30);
                self.test_ends = None;
            }
            (0x3c, _) => {
                self.test_ends = (value & 1 != 0).then(|| now + Time::from_millis(10));
            }
            _ => self.values[usize::from(register)] = value,
        }
    }

    fn read(&mut self, register: u16, now: Time) -> u8 {
        match (register, self.defect) {
            (0x00, Defect::Id(id)) => id,
            (0x00, _) => 0x0f,
            (_, Defect::Stuck(stuck, value)) if stuck == register => value,
            (0x02..=0x07, _) => self.sample[usize::from(register - 2)],
            // Bit 7 always reads as 1.
            (0x10, _) => self.values[0x10] | 0x80,
            (0x3c, Defect::TestHangs) => 0x11,
            (0x3c, defect) => match self.test_ends {
                Some(end) if now >= end => 0x12 | u8::from(defect == Defect::TestFails) << 2,
                _ => 0x10,
            },
            _ => self.values[usize::from(register)],
        }
    }

    fn address(&self, now: Time) -> Option<u8> {
        (now >= self.answers_from).then_some(GYROSCOPE)
    }
}

/// The accelerometer, with the given sample, in counts of ±24 g.
pub struct AccelerometerModel {
    pub sample: [i16; 3],
    pub defect: Defect,
    pub values: [u8; 0x80],
    answers_from: Time,
    forced_at: Time,
}

impl AccelerometerModel {
    fn new(sample: [i16; 3], defect: Defect) -> AccelerometerModel {
        let mut model = AccelerometerModel {
            sample,
            defect,
            values: [0; 0x80],
            answers_from: Time::ZERO,
            forced_at: Time::ZERO,
        };
        model.reset();
        // A previous user left another range.
        model.values[0x41] = 0x00;
        model
    }

    fn reset(&mut self) {
        self.values = [0; 0x80];
        self.values[0x40] = 0xa8;
        self.values[0x41] = 0x01;
        self.values[0x7c] = 0x03;
    }

    fn is_active(&self) -> bool {
        self.values[0x7c] == 0 && self.values[0x7d] == 4
    }

    /// Returns the counts that the force adds to an axis: 1.5 g in x and y, 0.75 g in z, once the
    /// accelerometer has settled, at 1,600 Hz and ±24 g.
    fn force(&self, axis: usize, now: Time) -> i16 {
        let is_settled = now > self.forced_at + Time::from_millis(50);
        let is_set_up = self.values[0x40] & 0x0f == 0x0c && self.values[0x41] == 3;
        if !is_settled || !is_set_up {
            return 0;
        }
        let counts = match self.defect {
            Defect::Force(weak, counts) if weak == axis => counts,
            _ if axis == 2 => 512,
            _ => 1024,
        };
        match self.values[0x6d] {
            0x0d => counts,
            0x09 => -counts,
            _ => 0,
        }
    }
}

impl RegisterFile for AccelerometerModel {
    fn write(&mut self, register: u16, value: u8, now: Time) {
        match (register, value) {
            (0x7e, 0xb6) => {
                self.reset();
                self.answers_from = now + Time::from_millis(1);
            }
            (0x7c | 0x7d, _) => self.values[usize::from(register)] = value,
            // A suspended accelerometer takes no configuration.
            _ if !self.is_active() => {}
            (0x6d, _) => {
                self.values[0x6d] = value;
                self.forced_at = now;
            }
            _ => self.values[usize::from(register)] = value,
        }
    }

    fn read(&mut self, register: u16, now: Time) -> u8 {
        match (register, self.defect) {
            (0x00, Defect::Id(id)) => id,
            (0x00, _) => 0x1e,
            (_, Defect::Stuck(stuck, value)) if stuck == register => value,
            (0x12..=0x17, _) if self.is_active() => {
                let at = usize::from(register - 0x12);
                let axis = at / 2;
                let counts = self.sample[axis] + self.force(axis, now);
                counts.to_le_bytes()[at % 2]
            }
            _ => self.values[usize::from(register)],
        }
    }

    fn address(&self, now: Time) -> Option<u8> {
        (now >= self.answers_from).then_some(ACCELEROMETER)
    }
}

/// A bus with both chips.
pub struct Imu {
    pub bus: TestI2c,
    pub gyroscope: Rc<RefCell<Registers<GyroscopeModel>>>,
    pub accelerometer: Rc<RefCell<Registers<AccelerometerModel>>>,
}

impl Imu {
    /// Returns chips with the same defect, and with samples that differ in every byte.
    pub fn new(wires: &Wires, defect: Defect) -> Imu {
        let gyroscope = GyroscopeModel::new([1, 2, 3, 4, 5, 0x86], defect);
        let gyroscope = Rc::new(RefCell::new(Registers::new(gyroscope, 1)));
        let accelerometer = AccelerometerModel::new([0x0102, 0x0304, -0x0506], defect);
        let accelerometer = Rc::new(RefCell::new(Registers::new(accelerometer, 1)));
        let bus = TestI2c::new(wires).with(&gyroscope).with(&accelerometer);
        Imu { bus, gyroscope, accelerometer }
    }
}
