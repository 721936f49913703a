//! The optical flow sensor PixArt PMW3901 of the Flow deck.
//!
//! Sources: Bitcraze's drivers (Bitcraze_PMW3901 and pmw3901.c of the firmware), PX4's driver, and
//! the excerpt of the data sheet PMW3901MB-TXQT in the ecosystem of the M5StamFly. The first uses SPI
//! mode 3, and the next two use mode 0; the model has whole bytes only.
//!
//! # Limits
//! The registers that tune the sensor are storage in banks: their meaning is not public, and the
//! model measures without them. Frame capture has no model. The physics gives the motion, so that
//! the sensor's own rate of frames has no model either.

use std::collections::BTreeMap;

use crate::{SpiDevice, Time};

const PRODUCT_ID: u8 = 0x00;
const REVISION_ID: u8 = 0x01;
const MOTION: u8 = 0x02;
const DELTA_X_L: u8 = 0x03;
const DELTA_X_H: u8 = 0x04;
const DELTA_Y_L: u8 = 0x05;
const DELTA_Y_H: u8 = 0x06;
const SQUAL: u8 = 0x07;
const RAW_DATA_SUM: u8 = 0x08;
const RAW_DATA_MAX: u8 = 0x09;
const RAW_DATA_MIN: u8 = 0x0a;
const SHUTTER_LOWER: u8 = 0x0b;
const SHUTTER_UPPER: u8 = 0x0c;
const OBSERVATION: u8 = 0x15;
const MOTION_BURST: u8 = 0x16;
const POWER_UP_RESET: u8 = 0x3a;
const SHUTDOWN: u8 = 0x3b;
const INVERSE_PRODUCT_ID: u8 = 0x5f;
const BANK: u8 = 0x7f;

const ID: u8 = 0x49;
const RESET_COMMAND: u8 = 0x5a;
const SHUTDOWN_COMMAND: u8 = 0xb6;
const WRITES: u8 = 0x80;
/// Bit 7: motion since the last reading.
const MOTION_OCCURRED: u8 = 0x80;
/// The other bits of MOTION. Bitcraze's firmware accepts readings with 0xb0 only.
const MOTION_FIXED: u8 = 0x30;
/// The value that the data sheet's check of the start expects.
const OBSERVATION_VALUE: u8 = 0xbf;
/// Bank 0x0e, register 0x47: the data sheet's list of the start expects the value 0x08.
const START_CHECK: ((u8, u8), u8) = ((0x0e, 0x47), 0x08);
/// The registers of a burst, in their order. The upper byte of the shutter comes first.
const BURST: [u8; 12] = [
    MOTION,
    OBSERVATION,
    DELTA_X_L,
    DELTA_X_H,
    DELTA_Y_L,
    DELTA_Y_H,
    SQUAL,
    RAW_DATA_SUM,
    RAW_DATA_MAX,
    RAW_DATA_MIN,
    SHUTTER_UPPER,
    SHUTTER_LOWER,
];

/// The time from power-on until SPI works.
const POWER_ON: Time = Time::from_millis(40);
/// The time from a reset until SPI works.
const RESET: Time = Time::from_millis(1);
/// The shortest time from the address of a register to its value (tSRAD).
const READ_DELAY: Time = Time::from_micros(35);

/// A fault of a flow sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pmw3901Fault {
    /// The chip has this identification; that of INVERSE_PRODUCT_ID remains.
    WrongId(u8),
    /// The chip does not drive MISO, which is pulled up.
    NoAnswer,
    /// The chip repeats its last motion.
    FrozenData,
}

/// The two readings of the time tSRAD. The data sheet demands it for each read, but PX4's driver
/// reads without a pause.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EarlyRead {
    /// A value that is read too early is zero.
    #[default]
    Zero,
    /// A value is valid at once.
    Valid,
}

/// The picture of the ground, as the sensor describes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FlowImage {
    /// Number of features divided by 4.
    pub squal: u8,
    /// Sum of the brightness of all pixels, upper byte.
    pub raw_data_sum: u8,
    /// Brightness of the brightest pixel.
    pub raw_data_max: u8,
    /// Brightness of the darkest pixel.
    pub raw_data_min: u8,
    /// Time of exposure in cycles of the sensor's clock.
    pub shutter: u16,
}

/// The motion that a reading of MOTION froze.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Reading {
    motion: u8,
    delta: [i16; 2],
}

/// The exchange since the chip was selected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Exchange {
    Address,
    /// The register, the time of its address, and the number of bytes since.
    Read(u8, Time, usize),
    Write(u8),
    /// Further bytes have no meaning.
    Complete,
}

/// A flow sensor on an SPI bus.
pub struct Pmw3901 {
    /// The stored registers: bank and number.
    registers: BTreeMap<(u8, u8), u8>,
    bank: u8,
    early_read: EarlyRead,
    /// `None` while the chip is not selected.
    exchange: Option<Exchange>,
    responds_at: Time,
    is_shut_down: bool,
    /// Motion since the last reading, in counts.
    delta: [i16; 2],
    image: FlowImage,
    reading: Reading,
    fault: Option<Pmw3901Fault>,
}

impl Pmw3901 {
    /// Returns a chip that is powered on at `now`.
    pub fn new(early_read: EarlyRead, now: Time) -> Self {
        Pmw3901 {
            registers: BTreeMap::from([START_CHECK]),
            bank: 0,
            early_read,
            exchange: None,
            responds_at: now + POWER_ON,
            is_shut_down: false,
            delta: [0; 2],
            image: FlowImage::default(),
            reading: Reading::default(),
            fault: None,
        }
    }

    /// Adds motion in counts along the axes of the chip, and sets the present picture. The axes of
    /// the Flow deck are turned: the robot's x is −y of the chip, and its y is −x
    /// (flowdeck_v1v2.c).
    pub fn add_motion(&mut self, counts: [i16; 2], image: FlowImage) {
        if self.is_shut_down {
            return;
        }
        for (sum, counts) in self.delta.iter_mut().zip(counts) {
            *sum = sum.saturating_add(counts);
        }
        self.image = image;
    }

    /// Sets or clears the fault.
    pub fn set_fault(&mut self, fault: Option<Pmw3901Fault>) {
        self.fault = fault;
    }

    /// Freezes the motion for the registers that follow, and begins a new sum.
    fn freeze(&mut self) {
        let delta = std::mem::take(&mut self.delta);
        if self.fault != Some(Pmw3901Fault::FrozenData) {
            let occurred = if delta == [0; 2] { 0 } else { MOTION_OCCURRED };
            self.reading = Reading { motion: MOTION_FIXED | occurred, delta };
        }
    }

    fn write_register(&mut self, register: u8, value: u8, now: Time) {
        match (register, value) {
            (BANK, _) => self.bank = value,
            (POWER_UP_RESET, RESET_COMMAND) if self.bank == 0 => {
                self.registers = BTreeMap::from([START_CHECK]);
                self.is_shut_down = false;
                self.delta = [0; 2];
                self.reading = Reading::default();
                self.responds_at = now + RESET;
            }
            (SHUTDOWN, SHUTDOWN_COMMAND) if self.bank == 0 => self.is_shut_down = true,
            _ => {
                self.registers.insert((self.bank, register), value);
            }
        }
    }

    fn read_register(&mut self, register: u8) -> u8 {
        if self.bank != 0 {
            return self.registers.get(&(self.bank, register)).copied().unwrap_or(0);
        }
        let [x, y] = self.reading.delta.map(i16::to_le_bytes);
        let shutter = self.image.shutter.to_le_bytes();
        match register {
            PRODUCT_ID => match self.fault {
                Some(Pmw3901Fault::WrongId(id)) => id,
                _ => ID,
            },
            // Zero is a choice.
            REVISION_ID => 0,
            MOTION => self.reading.motion,
            DELTA_X_L => x[0],
            DELTA_X_H => x[1],
            DELTA_Y_L => y[0],
            DELTA_Y_H => y[1],
            SQUAL => self.image.squal,
            RAW_DATA_SUM => self.image.raw_data_sum,
            RAW_DATA_MAX => self.image.raw_data_max,
            RAW_DATA_MIN => self.image.raw_data_min,
            SHUTTER_LOWER => shutter[0],
            SHUTTER_UPPER => shutter[1],
            OBSERVATION => OBSERVATION_VALUE,
            INVERSE_PRODUCT_ID => !ID,
            _ => self.registers.get(&(0, register)).copied().unwrap_or(0),
        }
    }

    /// Returns a byte of a read exchange, of which `count` bytes were sent before.
    fn send(&mut self, register: u8, addressed: Time, count: usize, now: Time) -> u8 {
        let is_burst = register == MOTION_BURST && self.bank == 0;
        if self.bank == 0 && count == 0 && (is_burst || register == MOTION) {
            self.freeze();
        }
        let value = match BURST.get(count) {
            Some(burst) if is_burst => self.read_register(*burst),
            _ if count == 0 => self.read_register(register),
            _ => 0,
        };
        let is_early = now < addressed + READ_DELAY && self.early_read == EarlyRead::Zero;
        if is_early { 0 } else { value }
    }
}

impl SpiDevice for Pmw3901 {
    fn select(&mut self, selected: bool, _now: Time) {
        self.exchange = selected.then_some(Exchange::Address);
    }

    fn exchange(&mut self, byte: u8, now: Time) -> u8 {
        let is_silent = self.fault == Some(Pmw3901Fault::NoAnswer) || now < self.responds_at;
        let Some(exchange) = self.exchange.filter(|_| !is_silent) else {
            // MISO is pulled up.
            return 0xff;
        };
        let (next, answer) = match exchange {
            Exchange::Address if byte & WRITES != 0 => (Exchange::Write(byte & !WRITES), 0),
            Exchange::Address => (Exchange::Read(byte, now, 0), 0),
            Exchange::Read(register, addressed, count) => {
                let value = self.send(register, addressed, count, now);
                (Exchange::Read(register, addressed, count + 1), value)
            }
            Exchange::Write(register) => {
                self.write_register(register, byte, now);
                (Exchange::Complete, 0)
            }
            Exchange::Complete => (Exchange::Complete, 0),
        };
        self.exchange = Some(next);
        answer
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The list that Bitcraze's firmware writes at the start (pmw3901.c), up to its pause.
    const START_BEFORE_PAUSE: &str = "7F=00 61=AD 7F=03 40=00 7F=05 41=B3 43=F1 45=14 5B=32 5F=34 \
        7B=08 7F=06 44=1B 40=BF 4E=3F 7F=08 65=20 6A=18 7F=09 4F=AF 5F=40 48=80 49=80 57=77 60=78 \
        61=78 62=08 63=50 7F=0A 45=60 7F=00 4D=11 55=80 74=1F 75=1F 4A=78 4B=78 44=08 45=50 64=FF \
        65=1F 7F=14 65=67 66=08 63=70 7F=15 48=48 7F=07 41=0D 43=14 4B=0E 45=0F 44=42 4C=80 7F=10 \
        5B=02 7F=07 40=41 70=00";
    const START_AFTER_PAUSE: &str = "32=44 7F=07 40=40 7F=06 62=F0 63=00 7F=0D 48=C0 6F=D5 7F=00 \
        5B=A0 4E=A8 5A=50 40=80 7F=00 5A=10 54=00";
    /// The time of a byte at 1.3125 MHz.
    const BYTE: Time = Time::from_nanos(6_095);

    /// The master, with the times of Bitcraze's firmware.
    struct Master {
        chip: Pmw3901,
        now: Time,
    }

    impl Master {
        fn new(early_read: EarlyRead) -> Self {
            Master { chip: Pmw3901::new(early_read, Time::ZERO), now: Time::from_millis(46) }
        }

        fn wait(&mut self, micros: u64) {
            self.now = self.now + Time::from_micros(micros);
        }

        /// Exchanges bytes with a pause after the first one.
        fn exchange(&mut self, bytes: &[u8], pause_micros: u64) -> Vec<u8> {
            self.chip.select(true, self.now);
            self.wait(50);
            let mut answers = Vec::new();
            for (index, byte) in bytes.iter().enumerate() {
                self.now = self.now + BYTE;
                answers.push(self.chip.exchange(*byte, self.now));
                self.wait(if index == 0 { pause_micros } else { 0 });
            }
            self.wait(50);
            self.chip.select(false, self.now);
            self.wait(200);
            answers
        }

        fn read(&mut self, register: u8) -> u8 {
            self.exchange(&[register, 0], 500)[1]
        }

        fn write(&mut self, register: u8, value: u8) {
            self.exchange(&[register | 0x80, value], 50);
        }

        fn write_list(&mut self, list: &str) {
            for pair in list.split_whitespace() {
                let (register, value) = pair.split_once('=').unwrap();
                let number = |digits| u8::from_str_radix(digits, 16).unwrap();
                self.write(number(register), number(value));
            }
        }

        fn burst(&mut self) -> [u8; 12] {
            let mut bytes = [0; 13];
            bytes[0] = 0x16;
            self.exchange(&bytes, 50)[1..].try_into().unwrap()
        }

        fn start(&mut self) {
            assert_eq!((self.read(0x00), self.read(0x5f)), (0x49, 0xb6));
            self.write(0x3a, 0x5a);
            self.wait(5_000);
            assert_eq!((2..=6).map(|register| self.read(register)).sum::<u8>(), 0x30);
            self.wait(1_000);
            self.write_list(START_BEFORE_PAUSE);
            self.wait(10_000);
            self.write_list(START_AFTER_PAUSE);
        }
    }

    const IMAGE: FlowImage = FlowImage {
        squal: 100,
        raw_data_sum: 60,
        raw_data_max: 120,
        raw_data_min: 10,
        shutter: 0x07aa,
    };

    #[test]
    fn starts_as_the_firmware_starts_it() {
        let mut master = Master::new(EarlyRead::Zero);
        master.start();
        // A still robot: 0x30, with a picture.
        master.chip.add_motion([0, 0], IMAGE);
        assert_eq!(master.burst(), [0x30, 0xbf, 0, 0, 0, 0, 100, 60, 120, 10, 0x07, 0xaa]);
        master.chip.add_motion([-3, 0x0123], IMAGE);
        master.chip.add_motion([1, 1], IMAGE);
        assert_eq!(master.burst()[..6], [0xb0, 0xbf, 0xfe, 0xff, 0x24, 0x01]);
        assert_eq!(master.burst()[..6], [0x30, 0xbf, 0, 0, 0, 0]);
        // Registers of the same number in different banks are different ones.
        for (bank, register, value) in [(0x06, 0x40, 0xbf), (0x07, 0x40, 0x40), (0x00, 0x40, 0x80)]
        {
            master.write(0x7f, bank);
            assert_eq!(master.read(register), value);
        }
        // The identification belongs to bank 0.
        master.write(0x7f, 0x09);
        assert_eq!(master.read(0x5f), 0x40);
    }

    /// Data sheet, "Standard motion data readout": reading MOTION freezes the deltas.
    #[test]
    fn reading_motion_freezes_the_deltas() {
        let mut master = Master::new(EarlyRead::Zero);
        master.chip.add_motion([5, -6], IMAGE);
        assert_eq!(master.read(0x02), 0xb0);
        master.chip.add_motion([50, 60], IMAGE);
        let bytes = [0x03, 0x04, 0x05, 0x06].map(|register| master.read(register));
        assert_eq!(bytes, [5, 0, 0xfa, 0xff]);
        assert_eq!([0x07, 0x0b, 0x0c].map(|register| master.read(register)), [100, 0xaa, 0x07]);
        assert_eq!(master.read(0x02), 0xb0);
        assert_eq!(master.read(0x03), 50);
        assert_eq!(master.read(0x02), 0x30);
    }

    #[test]
    fn counts_saturate() {
        let mut master = Master::new(EarlyRead::Zero);
        master.chip.add_motion([i16::MAX, i16::MIN], IMAGE);
        master.chip.add_motion([1, -1], IMAGE);
        assert_eq!(master.burst()[2..6], [0xff, 0x7f, 0x00, 0x80]);
    }

    #[test]
    fn values_need_their_time() {
        for (early_read, expected) in [(EarlyRead::Zero, 0), (EarlyRead::Valid, 0x49)] {
            let mut master = Master::new(early_read);
            // PX4 reads without a pause.
            assert_eq!(master.exchange(&[0x00, 0], 0)[1], expected);
            assert_eq!(master.exchange(&[0x00, 0], 35)[1], 0x49);
            // The chip is not ready for SPI after a reset.
            master.write(0x3a, 0x5a);
            assert_eq!(master.read(0x00), 0xff);
            master.wait(1_000);
            assert_eq!(master.read(0x00), 0x49);
        }
        let mut chip = Pmw3901::new(EarlyRead::Valid, Time::ZERO);
        chip.select(true, Time::from_millis(39));
        assert_eq!(chip.exchange(0x00, Time::from_millis(39)), 0xff);
    }

    #[test]
    fn a_chip_that_is_shut_down_measures_nothing() {
        let mut master = Master::new(EarlyRead::Zero);
        master.write(0x3b, 0xb6);
        master.chip.add_motion([5, 5], IMAGE);
        assert_eq!(master.burst()[0], 0x30);
        master.write(0x3a, 0x5a);
        master.wait(1_000);
        master.chip.add_motion([5, 5], IMAGE);
        assert_eq!(master.burst()[0], 0xb0);
    }

    #[test]
    fn faults_change_the_chip() {
        let mut master = Master::new(EarlyRead::Zero);
        master.chip.set_fault(Some(Pmw3901Fault::WrongId(0x50)));
        assert_eq!((master.read(0x00), master.read(0x5f)), (0x50, 0xb6));
        master.chip.set_fault(Some(Pmw3901Fault::NoAnswer));
        assert_eq!(master.read(0x00), 0xff);
        master.chip.set_fault(None);
        master.chip.add_motion([7, 8], IMAGE);
        let before = master.burst();
        master.chip.set_fault(Some(Pmw3901Fault::FrozenData));
        master.chip.add_motion([1, 1], IMAGE);
        assert_eq!((master.burst(), master.burst()), (before, before));
    }
}
