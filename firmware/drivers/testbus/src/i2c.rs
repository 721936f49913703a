//! An I2C bus of models.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_chips::{I2cDevice, Time};
use embedded_hal_async::i2c::{Error, ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};

use crate::{BusError, Event, Wires};

/// The duration of a byte and its acknowledgement at 400 kHz.
const BYTE: Time = Time::from_nanos(9 * 2_500);

/// An I2C bus at 400 kHz.
pub struct TestI2c {
    wires: Wires,
    devices: Vec<Rc<RefCell<dyn I2cDevice>>>,
}

impl TestI2c {
    /// Returns a bus without chips.
    pub fn new(wires: &Wires) -> TestI2c {
        TestI2c { wires: wires.clone(), devices: Vec::new() }
    }

    /// Connects a chip to the bus.
    pub fn with<D: I2cDevice + 'static>(mut self, device: &Rc<RefCell<D>>) -> TestI2c {
        self.devices.push(device.clone());
        self
    }

    /// Sends a start condition and an address, and returns the chips that acknowledge it.
    fn start(&self, address: u8, reads: bool) -> Result<Vec<Rc<RefCell<dyn I2cDevice>>>, BusError> {
        self.wires.advance(BYTE);
        let now = self.wires.now();
        let mut chosen = Vec::new();
        for device in &self.devices {
            if device.borrow_mut().start(address, reads, now) {
                chosen.push(device.clone());
            }
        }
        if chosen.is_empty() { Err(BusError::Nack) } else { Ok(chosen) }
    }

    fn transfer(
        &self,
        address: u8,
        operations: &mut [Operation<'_>],
        written: &mut Vec<u8>,
        read: &mut Vec<u8>,
    ) -> Result<(), BusError> {
        let mut direction = None;
        let mut chosen = Vec::new();
        for operation in operations {
            // Operations of the same direction follow each other without a start condition.
            let reads = matches!(operation, Operation::Read(_));
            if direction != Some(reads) {
                chosen = self.start(address, reads)?;
                direction = Some(reads);
            }
            match operation {
                Operation::Write(bytes) => {
                    for byte in bytes.iter() {
                        self.wires.advance(BYTE);
                        let now = self.wires.now();
                        let mut is_acknowledged = false;
                        for device in &chosen {
                            is_acknowledged |= device.borrow_mut().write(*byte, now);
                        }
                        written.push(*byte);
                        if !is_acknowledged {
                            return Err(BusError::Nack);
                        }
                    }
                }
                Operation::Read(bytes) => {
                    for byte in bytes.iter_mut() {
                        self.wires.advance(BYTE);
                        let now = self.wires.now();
                        // The bus is a wired AND.
                        *byte = chosen
                            .iter()
                            .fold(0xff, |byte, device| byte & device.borrow_mut().read(now));
                        read.push(*byte);
                    }
                }
            }
        }
        Ok(())
    }
}

impl Error for BusError {
    fn kind(&self) -> ErrorKind {
        match self {
            BusError::Nack => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Unknown),
            BusError::Failed(_) => ErrorKind::Bus,
        }
    }
}

impl ErrorType for TestI2c {
    type Error = BusError;
}

impl I2c for TestI2c {
    async fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        self.wires.begin()?;
        let (mut written, mut read) = (Vec::new(), Vec::new());
        let result = self.transfer(address, operations, &mut written, &mut read);
        let now = self.wires.now();
        for device in &self.devices {
            device.borrow_mut().stop(now);
        }
        self.wires.log(Event::I2c { address, written, read });
        result
    }
}
