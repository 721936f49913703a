//! An SPI device that is a model.

use std::cell::RefCell;
use std::rc::Rc;

use bittybuzz_chips::{SpiDevice as Chip, Time};
use embedded_hal_async::spi::{Error, ErrorKind, ErrorType, Operation, SpiDevice};

use crate::{BusError, Event, Wires};

/// The duration of a byte at 1.3125 MHz, the clock of Bitcraze's slowest setting.
const BYTE: Time = Time::from_nanos(6_095);

/// A chip on an SPI bus, with its select line.
pub struct TestSpi<C> {
    wires: Wires,
    chip: Rc<RefCell<C>>,
}

impl<C: Chip> TestSpi<C> {
    /// Connects a chip.
    pub fn new(wires: &Wires, chip: &Rc<RefCell<C>>) -> TestSpi<C> {
        TestSpi { wires: wires.clone(), chip: chip.clone() }
    }

    fn exchange(&self, written: &[u8]) -> Vec<u8> {
        let mut read = Vec::new();
        for byte in written {
            self.wires.advance(BYTE);
            read.push(self.chip.borrow_mut().exchange(*byte, self.wires.now()));
        }
        self.wires.log(Event::Spi { written: written.to_vec(), read: read.clone() });
        read
    }
}

impl Error for BusError {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl<C> ErrorType for TestSpi<C> {
    type Error = BusError;
}

impl<C: Chip> SpiDevice for TestSpi<C> {
    async fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), BusError> {
        self.wires.begin()?;
        self.chip.borrow_mut().select(true, self.wires.now());
        self.wires.log(Event::Select);
        for operation in operations {
            match operation {
                Operation::Read(bytes) => {
                    let read = self.exchange(&vec![0; bytes.len()]);
                    bytes.copy_from_slice(&read);
                }
                Operation::Write(bytes) => {
                    self.exchange(bytes);
                }
                Operation::Transfer(read, written) => {
                    let mut longer = written.to_vec();
                    longer.resize(written.len().max(read.len()), 0);
                    let answer = self.exchange(&longer);
                    read.iter_mut().zip(answer).for_each(|(to, from)| *to = from);
                }
                Operation::TransferInPlace(bytes) => {
                    let read = self.exchange(bytes);
                    bytes.copy_from_slice(&read);
                }
                Operation::DelayNs(nanos) => self.wires.wait(*nanos),
            }
        }
        self.chip.borrow_mut().select(false, self.wires.now());
        self.wires.log(Event::Release);
        Ok(())
    }
}
