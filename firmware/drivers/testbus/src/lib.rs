//! Buses on the host for tests of drivers: an I2C bus, an SPI device and a delay that share a
//! clock and a log.
//!
//! # Principles
//! 1. **The chip is a model**: anything that implements [`bittybuzz_chips::I2cDevice`] or
//!    [`bittybuzz_chips::SpiDevice`]. [`Registers`] makes a model of a few lines of behavior.
//! 2. **Each transfer and each wait is an [`Event`]**, so a test can compare the whole traffic of a
//!    driver with a list from a data sheet.
//! 3. **Any transfer can fail**: [`Wires::fail_at`] chooses it, so a test can visit every error
//!    path of a driver.
//! 4. **Time is virtual.** It advances by waits and by bits on the bus; nothing sleeps, and
//!    [`run`] therefore polls a future once.
//!
//! # What it will not do
//! It has no clock stretching, no second master and no bus that hangs: these belong to the tests of
//! the bus drivers.

mod i2c;
mod registers;
mod spi;

use std::cell::RefCell;
use std::fmt::Debug;
use std::future::Future;
use std::pin::pin;
use std::rc::Rc;
use std::task::{Context, Poll, Waker};

use bittybuzz_chips::Time;
use embedded_hal_async::delay::DelayNs;

pub use i2c::TestI2c;
pub use registers::{RegisterFile, Registers};
pub use spi::TestSpi;

/// An event on the wires, in the order of their occurrence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Event {
    /// A transaction on I2C: the bytes to the chip, and then the bytes from it.
    I2c { address: u8, written: Vec<u8>, read: Vec<u8> },
    /// The line of an SPI chip goes low.
    Select,
    /// Bytes that an SPI device exchanged: from the driver, and from the chip.
    Spi { written: Vec<u8>, read: Vec<u8> },
    /// The line of an SPI chip goes high.
    Release,
    /// A pause, in nanoseconds.
    Wait(u32),
    /// The transaction that a test let fail.
    Failure,
}

impl Event {
    /// Returns a transaction that only writes.
    pub fn write(address: u8, written: &[u8]) -> Event {
        Event::I2c { address, written: written.to_vec(), read: Vec::new() }
    }

    /// Returns a transaction that writes and then reads.
    pub fn read(address: u8, written: &[u8], read: &[u8]) -> Event {
        Event::I2c { address, written: written.to_vec(), read: read.to_vec() }
    }

    /// Returns a pause.
    pub fn wait_us(micros: u32) -> Event {
        Event::Wait(micros * 1_000)
    }

    /// Returns true for a transaction that only writes.
    pub fn is_write(&self) -> bool {
        matches!(self, Event::I2c { read, .. } if read.is_empty())
    }
}

/// An error of a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BusError {
    /// No chip acknowledged the address or a byte.
    Nack,
    /// The transaction with this number failed, as the test asked.
    Failed(usize),
}

#[derive(Default)]
struct State {
    now: Time,
    events: Vec<Event>,
    transactions: usize,
    fails_at: Option<usize>,
}

/// The clock and the log that the buses of a test share. Clones refer to the same ones.
#[derive(Clone, Default)]
pub struct Wires(Rc<RefCell<State>>);

impl Wires {
    /// Returns new wires at power-on.
    pub fn new() -> Wires {
        Wires::default()
    }

    /// Lets the transaction with this number fail, counted from 0 at power-on.
    pub fn fail_at(&self, transaction: usize) {
        self.0.borrow_mut().fails_at = Some(transaction);
    }

    /// Returns the time since power-on.
    pub fn now(&self) -> Time {
        self.0.borrow().now
    }

    /// Returns the number of transactions since power-on.
    pub fn transactions(&self) -> usize {
        self.0.borrow().transactions
    }

    /// Returns the events since the last call.
    pub fn take_events(&self) -> Vec<Event> {
        std::mem::take(&mut self.0.borrow_mut().events)
    }

    fn log(&self, event: Event) {
        self.0.borrow_mut().events.push(event);
    }

    fn advance(&self, span: Time) {
        let mut state = self.0.borrow_mut();
        state.now = state.now + span;
    }

    /// Counts a transaction.
    fn begin(&self) -> Result<(), BusError> {
        let mut state = self.0.borrow_mut();
        let number = state.transactions;
        state.transactions += 1;
        if state.fails_at == Some(number) {
            state.events.push(Event::Failure);
            return Err(BusError::Failed(number));
        }
        Ok(())
    }

    fn wait(&self, nanos: u32) {
        self.log(Event::Wait(nanos));
        self.advance(Time::from_nanos(nanos.into()));
    }
}

/// A delay that advances the clock of the wires.
pub struct TestDelay(pub Wires);

impl DelayNs for TestDelay {
    async fn delay_ns(&mut self, nanos: u32) {
        self.0.wait(nanos);
    }
}

/// Returns the result of a future that waits for nothing.
///
/// # Panics
/// Panics if the future is pending.
pub fn run<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(result) => result,
        Poll::Pending => panic!("the buses of a test are always ready"),
    }
}

/// Runs `driver` once for each of its transactions, which then fails, and checks that the driver
/// returns that error at once. Returns the number of transactions.
///
/// # Panics
/// Panics if the driver returns anything else, or uses the bus after the failure.
pub fn check_failures<T: Debug, E: Debug + PartialEq>(
    driver: impl Fn(&Wires) -> Result<T, E>,
    error: impl Fn(BusError) -> E,
) -> usize {
    let wires = Wires::new();
    let result = driver(&wires);
    assert!(result.is_ok(), "without a failure: {result:?}");
    let count = wires.transactions();
    for number in 0..count {
        let wires = Wires::new();
        wires.fail_at(number);
        let result = driver(&wires).map(|_| ());
        assert_eq!(result, Err(error(BusError::Failed(number))));
        assert_eq!(wires.transactions(), number + 1, "transactions after the failure");
    }
    count
}
