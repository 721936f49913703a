//! A model of the chip, written from ST's user manual UM2356 and from the register map of the crate
//! vl53l1-reg: it boots, measures in its period, and offers a result until the interrupt is
//! cleared.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_chips::Time;
use bittybuzz_testbus::{RegisterFile, Registers, TestDelay, TestI2c, Wires};

/// A defect of the model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Defect {
    #[default]
    None,
    /// The identity has this value.
    Id(u16),
    /// This register always reads as this value.
    Stuck(u16, u8),
    NeverBoots,
    NeverMeasures,
    /// The chip keeps its old address.
    KeepsAddress,
}

/// The oscillator of the model: a number per millisecond.
const OSCILLATOR: u16 = 501;

/// The chip.
pub struct Model {
    pub defect: Defect,
    pub values: [u8; 0x120],
    /// The time at which XSHUT went high.
    released_at: Time,
    /// The time of the next result while the chip measures.
    due: Option<Time>,
    /// True from a result until the interrupt is cleared, also after the chip has stopped.
    offers: bool,
}

impl Model {
    pub fn new(defect: Defect, released_at: Time) -> Model {
        let mut model = Model { defect, values: [0; 0x120], released_at, due: None, offers: false };
        model.values[1] = 0x29;
        model.values[0xde..0xe0].copy_from_slice(&OSCILLATOR.to_be_bytes());
        // The highest bits of the oscillator's value have another meaning.
        model.values[0xde] |= 0xf0;
        model
    }

    fn word(&self, register: usize) -> u16 {
        u16::from_be_bytes([self.values[register], self.values[register + 1]])
    }

    /// Returns the time of a measurement: the period, or the budget if that is longer. The budgets
    /// are those of the table of ST's ultra-lite driver, by register 0x5E.
    fn period(&self) -> Time {
        let budget_ms = match self.word(0x5e) {
            0x001d => 15,
            0x0051 | 0x001e => 20,
            0x0060 | 0x00d6 => 33,
            _ => 100,
        };
        let ticks = u32::from(self.word(0x6c)) << 16 | u32::from(self.word(0x6e));
        let micros = f64::from(ticks) / (f64::from(OSCILLATOR) * 1.075) * 1000.0;
        Time::from_micros(micros as u64).max(Time::from_millis(budget_ms))
    }

    fn is_due(&self, now: Time) -> bool {
        self.due.is_some_and(|due| now >= due) && self.defect != Defect::NeverMeasures
    }
}

impl RegisterFile for Model {
    fn write(&mut self, register: u16, value: u8, now: Time) {
        if register == 0x01 && self.defect == Defect::KeepsAddress {
            return;
        }
        self.offers |= self.is_due(now);
        self.values[usize::from(register)] = value;
        match (register, value) {
            (0x87, 0x40) => self.due = Some(now + self.period()),
            (0x87, _) => self.due = None,
            (0x86, 0x01) => {
                self.offers = false;
                if self.is_due(now) {
                    // The chip has gone on measuring meanwhile.
                    self.due = self.due.map(|due| due + self.period());
                    self.values[0x8b] = self.values[0x8b].wrapping_add(1);
                }
            }
            _ => {}
        }
    }

    fn read(&mut self, register: u16, now: Time) -> u8 {
        match (register, self.defect) {
            (_, Defect::Stuck(stuck, value)) if stuck == register => value,
            (0x31, _) => {
                self.offers |= self.is_due(now);
                0x02 | u8::from(self.offers)
            }
            (0xe5, Defect::NeverBoots) => 0,
            (0xe5, _) => u8::from(now >= self.released_at + Time::from_millis(3)),
            (0x10f | 0x110, defect) => {
                let id = if let Defect::Id(id) = defect { id } else { 0xeacc };
                id.to_be_bytes()[usize::from(register - 0x10f)]
            }
            _ => self.values[usize::from(register)],
        }
    }

    fn address(&self, now: Time) -> Option<u8> {
        // The data sheet has at most 1.2 ms from XSHUT to the first access.
        (now >= self.released_at + Time::from_micros(1_200)).then_some(self.values[1])
    }
}

/// A bus with a chip whose XSHUT goes high at power-on.
pub struct Bench {
    pub bus: TestI2c,
    pub delay: TestDelay,
    pub chip: Rc<RefCell<Registers<Model>>>,
}

impl Bench {
    pub fn new(wires: &Wires, defect: Defect) -> Bench {
        let chip = Rc::new(RefCell::new(Registers::new(Model::new(defect, Time::ZERO), 2)));
        let bus = TestI2c::new(wires).with(&chip);
        Bench { bus, delay: TestDelay(wires.clone()), chip }
    }
}
