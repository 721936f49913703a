//! A model of the chip, written from the data sheet: registers, commands, and the times of a reset
//! and of the measurements.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_bmp3xx::{Address, Barometer, Error};
use bittybuzz_chips::Time;
use bittybuzz_testbus::{BusError, RegisterFile, Registers, TestDelay, TestI2c, Wires, run};

pub const ADDRESS: u8 = 0x77;

/// Calibrations with values of the size of a real chip's. In the first, T1 to T3 are 27513, 18933
/// and -10, and P1 to P11 are -1144, -1998, 35, 0, 24987, 30236, -13, -7, 16400, 29 and -60; in the
/// second they are 27000, 18500, -7, -433, -1586, 30, 3, 25200, 30000, 12, -6, 15200, -20 and -45.
pub const CALIBRATIONS: [[u8; 21]; 2] = [
    [
        0x79, 0x6b, 0xf5, 0x49, 0xf6, 0x88, 0xfb, 0x32, 0xf8, 0x23, 0x00, 0x9b, 0x61, 0x1c, 0x76,
        0xf3, 0xf9, 0x10, 0x40, 0x1d, 0xc4,
    ],
    [
        0x78, 0x69, 0x44, 0x48, 0xf9, 0x4f, 0xfe, 0xce, 0xf9, 0x1e, 0x03, 0x70, 0x62, 0x30, 0x75,
        0x0c, 0xfa, 0x60, 0x3b, 0xec, 0xd3,
    ],
];

/// Their checksums, computed by a program in Python whose result for "123456789" is 0x4B: that of
/// CRC-8/SAE-J1850 in the catalog of CRC algorithms.
const CHECKSUMS: [u8; 2] = [0x3e, 0xed];

/// A defect of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Defect {
    #[default]
    None,
    /// The identity has this value: 0x60 is a BMP390 without a defect.
    Id(u8),
    /// This register always reads as this value.
    Stuck(u16, u8),
    /// A byte of the calibration is damaged.
    Calibration,
    /// The chip measures once, and then never again.
    Silent,
}

/// The chip, with the given counts.
pub struct Model {
    pub calibration: usize,
    pub defect: Defect,
    pub counts: [u32; 2],
    values: [u8; 0x80],
    reset_at: Time,
    /// The number of periods of 20 ms that were over at the last reading of the counts.
    read_periods: u64,
}

impl Model {
    fn new(defect: Defect) -> Model {
        let counts = [6_500_000, 8_300_000];
        let values = [0; 0x80];
        let mut model =
            Model { calibration: 0, defect, counts, values, reset_at: Time::ZERO, read_periods: 0 };
        // A previous user left another filter.
        model.values[0x1f] = 0x0e;
        model
    }

    fn periods(&self, now: Time) -> u64 {
        match (self.defect, self.values[0x1b]) {
            (Defect::Silent, _) => 1,
            (_, 0x33) => (now - self.reset_at).nanos() / 20_000_000,
            _ => 0,
        }
    }
}

impl RegisterFile for Model {
    fn write(&mut self, register: u16, value: u8, now: Time) {
        match (register, value) {
            (0x7e, 0xb6) => {
                self.values = [0; 0x80];
                self.values[0x1c] = 0x02;
                self.reset_at = now;
                self.read_periods = 0;
            }
            _ => self.values[usize::from(register)] = value,
        }
    }

    fn read(&mut self, register: u16, now: Time) -> u8 {
        match (register, self.defect) {
            (0x00, Defect::Id(id)) => id,
            (0x00, _) => 0x50,
            (_, Defect::Stuck(stuck, value)) if stuck == register => value,
            (0x03, _) => {
                let is_new = self.periods(now) > self.read_periods;
                0x10 | if is_new { 0x60 } else { 0 }
            }
            (0x04..=0x09, _) => {
                self.read_periods = self.periods(now);
                let at = usize::from(register - 0x04);
                self.counts[at / 3].to_le_bytes()[at % 3]
            }
            (0x30, _) => CHECKSUMS[self.calibration],
            (0x31..=0x45, defect) => {
                let byte = CALIBRATIONS[self.calibration][usize::from(register - 0x31)];
                if defect == Defect::Calibration && register == 0x35 { byte ^ 1 } else { byte }
            }
            _ => self.values[usize::from(register)],
        }
    }

    fn address(&self, now: Time) -> Option<u8> {
        let answers = self.reset_at == Time::ZERO || now >= self.reset_at + Time::from_millis(2);
        answers.then_some(ADDRESS)
    }
}

/// A bus with the chip.
pub struct Bench {
    pub bus: TestI2c,
    pub delay: TestDelay,
    pub chip: Rc<RefCell<Registers<Model>>>,
}

impl Bench {
    pub fn new(wires: &Wires, defect: Defect) -> Bench {
        let chip = Rc::new(RefCell::new(Registers::new(Model::new(defect), 1)));
        let bus = TestI2c::new(wires).with(&chip);
        Bench { bus, delay: TestDelay(wires.clone()), chip }
    }

    pub fn start(&mut self) -> Result<Barometer, Error<BusError>> {
        run(Barometer::start(&mut self.bus, &mut self.delay, Address::SdoHigh))
    }
}
