//! The port expander PCA9554 of the Multi-ranger deck: eight pins on an I2C bus.
//!
//! Sources: pca95x4.c of Bitcraze's firmware, and the crate port-expander. The values after
//! power-on and the pull-up resistors are recalled from the data sheet. The pin INT has no model,
//! because nothing is connected to it.

use super::SdaHold;
use crate::{I2cDevice, Time};

/// The address when the pins A0 to A2 are low.
pub const ADDRESS: u8 = 0x20;

const INPUT: usize = 0;
const OUTPUT: usize = 1;
const POLARITY: usize = 2;
/// A pin with a one is an input.
const CONFIGURATION: usize = 3;

/// A fault of the expander.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pca9554Fault {
    /// The chip does not acknowledge its address.
    NoAcknowledge,
    /// SDA is held low.
    SdaLow {
        /// The pulses of SCL until the release.
        clock_pulses: u32,
    },
    /// The pins keep their levels, whatever the registers contain.
    FrozenPins,
}

/// A port expander on an I2C bus.
pub struct Pca9554 {
    registers: [u8; 4],
    /// The levels that others drive at the pins. The chip pulls pins up that nobody drives.
    external: u8,
    /// The levels at the pins that FrozenPins keeps.
    frozen: Option<u8>,
    register: usize,
    is_selected: bool,
    expects_register: bool,
    fault: Option<Pca9554Fault>,
    sda: SdaHold,
}

impl Default for Pca9554 {
    fn default() -> Self {
        Pca9554::new()
    }
}

impl Pca9554 {
    /// Returns an expander after power-on: all pins are inputs.
    pub fn new() -> Self {
        let mut registers = [0; 4];
        registers[OUTPUT] = 0xff;
        registers[CONFIGURATION] = 0xff;
        Pca9554 {
            registers,
            external: 0xff,
            frozen: None,
            register: INPUT,
            is_selected: false,
            expects_register: false,
            fault: None,
            sda: SdaHold::default(),
        }
    }

    /// Sets the levels that others drive at the pins, with pin P0 in bit 0.
    pub fn set_external(&mut self, levels: u8) {
        self.external = levels;
    }

    /// Returns the levels at the pins, with pin P0 in bit 0.
    pub fn levels(&self) -> u8 {
        let inputs = self.registers[CONFIGURATION];
        self.frozen.unwrap_or(self.registers[OUTPUT] & !inputs | self.external & inputs)
    }

    /// Sets or clears the fault.
    pub fn set_fault(&mut self, fault: Option<Pca9554Fault>) {
        self.frozen = None;
        if fault == Some(Pca9554Fault::FrozenPins) {
            self.frozen = Some(self.levels());
        }
        self.fault = fault;
        self.sda.set(match fault {
            Some(Pca9554Fault::SdaLow { clock_pulses }) => clock_pulses,
            _ => 0,
        });
    }
}

impl I2cDevice for Pca9554 {
    fn start(&mut self, address: u8, reads: bool, _now: Time) -> bool {
        let is_silent = self.fault == Some(Pca9554Fault::NoAcknowledge) || self.sda.is_low();
        self.is_selected = address == ADDRESS && !is_silent;
        self.expects_register = !reads;
        self.is_selected
    }

    fn write(&mut self, byte: u8, _now: Time) -> bool {
        if !self.is_selected {
            return false;
        }
        if std::mem::take(&mut self.expects_register) {
            self.register = usize::from(byte & 3);
        } else if self.register != INPUT {
            // All bytes of a transfer go to the same register.
            self.registers[self.register] = byte;
        }
        true
    }

    fn read(&mut self, _now: Time) -> u8 {
        match self.register {
            // Nothing drives SDA.
            _ if !self.is_selected => 0xff,
            INPUT => self.levels() ^ self.registers[POLARITY],
            register => self.registers[register],
        }
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

#[cfg(test)]
mod tests {
    use embedded_hal::i2c::I2c;
    use port_expander::dev::pca9554::Pca9554 as Driver;

    use super::*;
    use crate::devices::test_bus::TestBus;

    /// The traffic of Bitcraze's firmware (multiranger.c, pca95x4.c): the pins become outputs,
    /// whose reset value is high, are all cleared, and then set one after the other. Up, back,
    /// right, front and left are P0, P1, P2, P4 and P6.
    #[test]
    fn the_firmware_releases_one_sensor_after_the_other() {
        let mut bus = TestBus::new(Pca9554::new());
        assert_eq!(bus.registers(ADDRESS, 3), [0xff]);
        bus.write(ADDRESS, &[3, 0xa8]).unwrap();
        assert_eq!(bus.device.borrow().levels(), 0xff);
        assert_eq!(bus.registers(ADDRESS, 1), [0xff]);
        bus.write(ADDRESS, &[1, 0xa8]).unwrap();
        assert_eq!(bus.device.borrow().levels(), 0xa8);
        for pin in [0, 1, 2, 4, 6] {
            let [outputs] = bus.registers(ADDRESS, 1);
            bus.write(ADDRESS, &[1, outputs | 1 << pin]).unwrap();
            assert_eq!(bus.device.borrow().levels(), outputs | 1 << pin);
        }
        // The polarity concerns the input register only.
        bus.write(ADDRESS, &[2, 0x0f]).unwrap();
        assert_eq!(bus.registers(ADDRESS, 0), [0xf0]);
        // The pointer stays at a register.
        assert_eq!(bus.registers(ADDRESS, 1), [0xff, 0xff]);
    }

    #[test]
    fn an_unmodified_driver_reads_and_drives_pins() {
        let bus = TestBus::new(Pca9554::new());
        let mut driver = Driver::new(bus.clone(), false, false, false);
        let pins = driver.split();
        let mut output = pins.io6.into_output().unwrap();
        output.set_high().unwrap();
        assert_eq!(bus.device.borrow().levels(), 0xff);
        output.set_low().unwrap();
        assert_eq!(bus.device.borrow().levels(), 0xbf);
        bus.device.borrow_mut().set_external(0xfd);
        assert!(pins.io1.is_low().unwrap() && pins.io0.is_high().unwrap());
    }

    #[test]
    fn faults_change_the_chip() {
        let mut bus = TestBus::new(Pca9554::new());
        bus.device.borrow_mut().set_fault(Some(Pca9554Fault::FrozenPins));
        bus.write(ADDRESS, &[3, 0x00]).unwrap();
        bus.write(ADDRESS, &[1, 0x00]).unwrap();
        assert_eq!(bus.device.borrow().levels(), 0xff);
        bus.device.borrow_mut().set_fault(Some(Pca9554Fault::NoAcknowledge));
        assert!(bus.write(ADDRESS, &[]).is_err());
        bus.device.borrow_mut().set_fault(Some(Pca9554Fault::SdaLow { clock_pulses: 1 }));
        assert!(bus.write(ADDRESS, &[]).is_err());
        bus.device.borrow_mut().clock_pulse();
        bus.write(ADDRESS, &[]).unwrap();
        assert_eq!(bus.device.borrow().levels(), 0x00);
    }
}
