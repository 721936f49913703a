//! A bus for the tests of devices, with the interface of embedded-hal.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use embedded_hal::delay::DelayNs;
use embedded_hal::i2c::{ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};

use crate::{I2cDevice, Time};

/// The time of nine bits at 400 kHz.
const BYTE: Time = Time::from_nanos(22_500);

/// A bus of 400 kHz with one device, and the time of its test.
pub(super) struct TestBus<D> {
    pub(super) device: Rc<RefCell<D>>,
    pub(super) now: Rc<Cell<Time>>,
}

impl<D> Clone for TestBus<D> {
    fn clone(&self) -> Self {
        TestBus { device: self.device.clone(), now: self.now.clone() }
    }
}

impl<D: I2cDevice> TestBus<D> {
    pub(super) fn new(device: D) -> Self {
        TestBus { device: Rc::new(RefCell::new(device)), now: Rc::default() }
    }

    pub(super) fn wait(&self, span: Time) {
        self.now.set(self.now.get() + span);
    }

    /// Reads registers of a chip with register addresses of eight bits.
    pub(super) fn registers<const N: usize>(&mut self, address: u8, register: u8) -> [u8; N] {
        let mut bytes = [0; N];
        self.write_read(address, &[register], &mut bytes).unwrap();
        bytes
    }
}

impl<D> ErrorType for TestBus<D> {
    type Error = ErrorKind;
}

impl<D: I2cDevice> I2c for TestBus<D> {
    fn transaction(&mut self, address: u8, list: &mut [Operation<'_>]) -> Result<(), ErrorKind> {
        let mut device = self.device.borrow_mut();
        let after = || {
            self.now.set(self.now.get() + BYTE);
            self.now.get()
        };
        let mut result = Ok(());
        let mut last_reads = None;
        if device.holds_sda() {
            return Err(ErrorKind::ArbitrationLoss);
        }
        for operation in list {
            let reads = matches!(operation, Operation::Read(_));
            // Operations of the same direction continue each other.
            if last_reads.replace(reads) != Some(reads) && !device.start(address, reads, after()) {
                result = Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Address));
                break;
            }
            match operation {
                Operation::Read(bytes) => {
                    bytes.iter_mut().for_each(|byte| *byte = device.read(after()));
                }
                Operation::Write(bytes) => {
                    if !bytes.iter().all(|byte| device.write(*byte, after())) {
                        result = Err(ErrorKind::NoAcknowledge(NoAcknowledgeSource::Data));
                        break;
                    }
                }
            }
        }
        device.stop(self.now.get());
        result
    }
}

impl<D> DelayNs for TestBus<D> {
    fn delay_ns(&mut self, nanos: u32) {
        self.now.set(self.now.get() + Time::from_nanos(nanos.into()));
    }
}
