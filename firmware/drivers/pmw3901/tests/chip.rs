//! A model of the chip, written from the drivers of crazyflie-firmware and PX4: registers in banks,
//! a burst, and the least pause after an access, without which it answers garbage.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use bittybuzz_chips::{SpiDevice, Time};
use bittybuzz_pmw3901::{Error, FlowSensor};
use bittybuzz_testbus::{BusError, TestDelay, TestSpi, Wires, run};

/// The least time between two accesses: TIME_us_TSWW of PX4.
const ACCESS: Time = Time::from_micros(11);

/// The answer of a chip that was not given its time.
const GARBAGE: u8 = 0x5c;

/// A defect of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Defect {
    #[default]
    None,
    /// The identity and its inverse have these values.
    Id(u8, u8),
    /// The chip stays in the bank 0x0D, which the list selects last before bank 0.
    StaysInBank,
}

/// The chip, with the given burst.
#[derive(Default)]
pub struct Model {
    pub defect: Defect,
    pub burst: [u8; 12],
    /// The values by bank and register.
    pub values: HashMap<(u8, u8), u8>,
    pub writes: usize,
    bank: u8,
    register: Option<u8>,
    bytes: usize,
    access_ended_at: Time,
    is_too_early: bool,
}

impl Model {
    fn value(&self, register: u8) -> u8 {
        let (id, inverse) = match self.defect {
            Defect::Id(id, inverse) => (id, inverse),
            _ => (0x49, 0xb6),
        };
        match (self.bank, register) {
            (0, 0x00) => id,
            (0, 0x5f) => inverse,
            key => self.values.get(&key).copied().unwrap_or(0),
        }
    }

    fn write(&mut self, register: u8, value: u8) {
        self.writes += 1;
        match (register, value) {
            (0x7f, _) if self.bank == 0x0d && self.defect == Defect::StaysInBank => {}
            (0x7f, bank) => self.bank = bank,
            (0x3a, 0x5a) => {
                self.values.clear();
                self.bank = 0;
            }
            _ => {
                self.values.insert((self.bank, register), value);
            }
        }
    }
}

impl SpiDevice for Model {
    fn select(&mut self, selected: bool, now: Time) {
        if selected {
            self.register = None;
            self.bytes = 0;
            self.is_too_early =
                self.access_ended_at != Time::ZERO && now < self.access_ended_at + ACCESS;
        } else {
            self.access_ended_at = now;
        }
    }

    fn exchange(&mut self, byte: u8, _now: Time) -> u8 {
        let Some(register) = self.register else {
            self.register = Some(byte);
            return 0xff;
        };
        self.bytes += 1;
        if self.is_too_early {
            return GARBAGE;
        }
        if register & 0x80 != 0 {
            self.write(register & 0x7f, byte);
            return 0xff;
        }
        if register == 0x16 {
            return self.burst.get(self.bytes - 1).copied().unwrap_or(GARBAGE);
        }
        self.value(register)
    }
}

/// A bus with the chip.
pub struct Bench {
    pub spi: TestSpi<Model>,
    pub delay: TestDelay,
    pub chip: Rc<RefCell<Model>>,
}

impl Bench {
    pub fn new(wires: &Wires, defect: Defect) -> Bench {
        let chip = Rc::new(RefCell::new(Model { defect, ..Model::default() }));
        let spi = TestSpi::new(wires, &chip);
        Bench { spi, delay: TestDelay(wires.clone()), chip }
    }

    pub fn start(&mut self) -> Result<FlowSensor, Error<BusError>> {
        run(FlowSensor::start(&mut self.spi, &mut self.delay))
    }
}
