//! The memory Microchip 24AA64: 8 KiB that keep their content without power.
//!
//! Sources: data sheet DS21189 (capacity, page and write cycle; its chapters on the protocol are
//! recalled) and the driver at24 of Linux. The pin for write protection has no model.

use super::SdaHold;
use crate::{I2cDevice, Time};

/// The address when the pins A0 to A2 are low.
pub const ADDRESS: u8 = 0x50;
/// The number of bytes.
pub const CAPACITY: usize = 8192;
/// The number of bytes that one write cycle can store.
const PAGE: usize = 32;
/// The duration of a write cycle.
const WRITE_CYCLE: Time = Time::from_millis(5);

/// A fault of the memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Eeprom24aa64Fault {
    /// The chip does not acknowledge its address.
    NoAcknowledge,
    /// SDA is held low.
    SdaLow {
        /// The pulses of SCL until the release.
        clock_pulses: u32,
    },
    /// Write cycles take their time, but change nothing.
    LostWrites,
    /// Write cycles have this duration.
    SlowWrites(Time),
}

/// The next byte from the master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum NextByte {
    AddressHigh,
    AddressLow,
    Data,
}

/// A memory on an I2C bus.
pub struct Eeprom24aa64 {
    content: Box<[u8; CAPACITY]>,
    /// The location of the next byte.
    location: usize,
    /// The bytes for the next write cycle, with their place in the page.
    page: [Option<u8>; PAGE],
    is_selected: bool,
    next_byte: NextByte,
    /// The end of the last write cycle.
    busy_until: Time,
    fault: Option<Eeprom24aa64Fault>,
    sda: SdaHold,
}

impl Eeprom24aa64 {
    /// Returns a memory with this content.
    pub fn new(content: Box<[u8; CAPACITY]>) -> Self {
        Eeprom24aa64 {
            content,
            location: 0,
            page: [None; PAGE],
            is_selected: false,
            next_byte: NextByte::AddressHigh,
            busy_until: Time::ZERO,
            fault: None,
            sda: SdaHold::default(),
        }
    }

    /// Returns a memory whose bytes are all 0xff.
    pub fn erased() -> Self {
        Eeprom24aa64::new(Box::new([0xff; CAPACITY]))
    }

    /// Returns the content, without an unfinished write.
    pub fn content(&self) -> &[u8; CAPACITY] {
        &self.content
    }

    /// Sets or clears the fault.
    pub fn set_fault(&mut self, fault: Option<Eeprom24aa64Fault>) {
        self.fault = fault;
        self.sda.set(match fault {
            Some(Eeprom24aa64Fault::SdaLow { clock_pulses }) => clock_pulses,
            _ => 0,
        });
    }

    /// Begins a write cycle with the bytes of the page, if there are any.
    fn store(&mut self, now: Time) {
        if self.page.iter().all(Option::is_none) {
            return;
        }
        let page = self.location / PAGE * PAGE;
        let content = &mut self.content[page..page + PAGE];
        for (byte, written) in content.iter_mut().zip(self.page) {
            if self.fault != Some(Eeprom24aa64Fault::LostWrites) {
                *byte = written.unwrap_or(*byte);
            }
        }
        let duration = match self.fault {
            Some(Eeprom24aa64Fault::SlowWrites(duration)) => duration,
            _ => WRITE_CYCLE,
        };
        self.busy_until = now + duration;
    }
}

impl I2cDevice for Eeprom24aa64 {
    fn start(&mut self, address: u8, reads: bool, now: Time) -> bool {
        let is_silent = self.fault == Some(Eeprom24aa64Fault::NoAcknowledge) || self.sda.is_low();
        self.is_selected = address == ADDRESS && now >= self.busy_until && !is_silent;
        // A write cycle begins with a stop condition only. A start condition discards the bytes.
        self.page = [None; PAGE];
        if !reads {
            self.next_byte = NextByte::AddressHigh;
        }
        self.is_selected
    }

    fn write(&mut self, byte: u8, _now: Time) -> bool {
        if !self.is_selected {
            return false;
        }
        self.next_byte = match self.next_byte {
            NextByte::AddressHigh => {
                self.location = usize::from(byte) << 8 & (CAPACITY - 1);
                NextByte::AddressLow
            }
            NextByte::AddressLow => {
                self.location |= usize::from(byte);
                NextByte::Data
            }
            NextByte::Data => {
                let place = self.location % PAGE;
                self.page[place] = Some(byte);
                // Bytes beyond the end of the page go to its begin.
                self.location = self.location - place + (place + 1) % PAGE;
                NextByte::Data
            }
        };
        true
    }

    fn read(&mut self, _now: Time) -> u8 {
        if !self.is_selected {
            // Nothing drives SDA.
            return 0xff;
        }
        let byte = self.content[self.location];
        self.location = (self.location + 1) % CAPACITY;
        byte
    }

    fn stop(&mut self, now: Time) {
        if std::mem::take(&mut self.is_selected) {
            self.store(now);
        }
    }

    fn holds_sda(&self) -> bool {
        self.sda.is_low()
    }

    fn clock_pulse(&mut self) {
        self.sda.clock_pulse();
    }
}

#[cfg(test)]
mod tests {
    use eeprom24x::{Eeprom24x, SlaveAddr, Storage};
    use embedded_hal::i2c::{I2c, Operation};
    use embedded_storage::{ReadStorage, Storage as _};

    use super::*;
    use crate::devices::test_bus::TestBus;

    fn bus() -> TestBus<Eeprom24aa64> {
        TestBus::new(Eeprom24aa64::erased())
    }

    fn read<const N: usize>(bus: &mut TestBus<Eeprom24aa64>, location: u16) -> [u8; N] {
        let mut bytes = [0; N];
        bus.write_read(ADDRESS, &location.to_be_bytes(), &mut bytes).unwrap();
        bytes
    }

    /// Bitcraze's firmware reads its configuration block so (configblockeeprom.c): the address of a
    /// register with 16 bits, and 21 bytes from location 0.
    #[test]
    fn the_configuration_block_is_read_at_the_begin() {
        let mut content = Box::new([0xff; CAPACITY]);
        content[..4].copy_from_slice(&0x4342_7830_u32.to_le_bytes());
        let mut bus = TestBus::new(Eeprom24aa64::new(content));
        let block: [u8; 21] = read(&mut bus, 0);
        assert_eq!(block[..5], [0x30, 0x78, 0x42, 0x43, 0xff]);
    }

    /// Data sheet, chapters 6 and 7.
    #[test]
    fn a_write_takes_5_ms_without_acknowledgement() {
        let mut bus = bus();
        bus.write(ADDRESS, &[0x12, 0x34, 7]).unwrap();
        let begin = bus.now.get();
        let polls = (1..100).find(|_| {
            bus.wait(Time::from_micros(100));
            bus.write(ADDRESS, &[]).is_ok()
        });
        assert!(polls.is_some_and(|polls| polls > 30));
        let duration = bus.now.get() - begin;
        assert!(duration >= WRITE_CYCLE && duration < WRITE_CYCLE + Time::from_micros(150));
        assert_eq!(read(&mut bus, 0x1233), [0xff, 7, 0xff]);
    }

    /// Data sheet 6.2: bytes beyond the end of a page overwrite its begin.
    #[test]
    fn a_page_wraps_around() {
        let mut bus = bus();
        let mut bytes = vec![0x00, 0x5e];
        bytes.extend(1..=35);
        bus.write(ADDRESS, &bytes).unwrap();
        bus.wait(WRITE_CYCLE);
        // The bytes 1 and 2 fill the page up, 3 to 32 follow from its begin on, 33 and 34 replace
        // the first two, and 35 replaces the third.
        assert_eq!(read(&mut bus, 0x40), [35, 4, 5, 6]);
        assert_eq!(read(&mut bus, 0x5d), [32, 33, 34, 0xff]);
        assert_eq!(read(&mut bus, 0x3f), [0xff]);
    }

    /// Data sheet 8.3: the counter of locations continues at 0 after the last byte. The upper bits
    /// of the address have no meaning.
    #[test]
    fn reading_continues_from_byte_to_byte() {
        let mut bus = bus();
        bus.write(ADDRESS, &[0x00, 0x00, 1, 2, 3]).unwrap();
        bus.wait(WRITE_CYCLE);
        bus.write(ADDRESS, &[0x1f, 0xff, 9]).unwrap();
        bus.wait(WRITE_CYCLE);
        assert_eq!(read(&mut bus, 0xffff), [9, 1]);
        let mut byte = [0];
        bus.read(ADDRESS, &mut byte).unwrap();
        assert_eq!(byte, [2]);
    }

    /// Data sheet 6: a write cycle begins with the stop condition.
    #[test]
    fn a_start_condition_discards_the_bytes() {
        let mut bus = bus();
        let mut byte = [0];
        let mut list = [Operation::Write(&[0x00, 0x10, 7]), Operation::Read(&mut byte)];
        bus.transaction(ADDRESS, &mut list).unwrap();
        assert_eq!(read(&mut bus, 0x10), [0xff]);
    }

    #[test]
    fn an_unmodified_driver_writes_across_pages() {
        let bus = bus();
        let eeprom = Eeprom24x::new_24x64(bus.clone(), SlaveAddr::default());
        let mut storage = Storage::new(eeprom, bus.clone());
        assert_eq!(storage.capacity(), CAPACITY);
        let bytes: [u8; 100] = std::array::from_fn(|index| index as u8 ^ 0x5a);
        storage.write(0x7f1, &bytes).unwrap();
        let mut found = [0; 102];
        storage.read(0x7f0, &mut found).unwrap();
        assert_eq!((found[0], &found[1..101], found[101]), (0xff, &bytes[..], 0xff));
        assert_eq!(bus.device.borrow().content()[0x7f1..0x7f1 + 100], bytes);
        // The driver waits for 5 ms after each page, which is too short for this chip.
        let slow = Eeprom24aa64Fault::SlowWrites(Time::from_millis(8));
        bus.device.borrow_mut().set_fault(Some(slow));
        assert!(storage.write(0x7f1, &bytes).is_err());
    }

    #[test]
    fn faults_change_the_chip() {
        let mut bus = bus();
        bus.device.borrow_mut().set_fault(Some(Eeprom24aa64Fault::LostWrites));
        bus.write(ADDRESS, &[0x00, 0x00, 1]).unwrap();
        assert!(bus.write(ADDRESS, &[]).is_err());
        bus.wait(WRITE_CYCLE);
        assert_eq!(read(&mut bus, 0), [0xff]);
        bus.device.borrow_mut().set_fault(Some(Eeprom24aa64Fault::NoAcknowledge));
        assert!(bus.write(ADDRESS, &[]).is_err());
        let fault = Eeprom24aa64Fault::SdaLow { clock_pulses: 1 };
        bus.device.borrow_mut().set_fault(Some(fault));
        assert!(bus.write(ADDRESS, &[]).is_err());
        bus.device.borrow_mut().clock_pulse();
        bus.write(ADDRESS, &[]).unwrap();
        assert!(bus.write(ADDRESS + 1, &[]).is_err());
    }
}
