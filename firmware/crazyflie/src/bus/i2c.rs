//! Transactions on the I2C buses for the drivers of chips.
//!
//! # Time
//! No function blocks, and none has a time limit: the caller sets one with its own clock, for
//! example by [`embassy_time::with_timeout`]. A dropped future leaves the bus as it is, and the next
//! transaction first resets it. A transaction that finds a line low does the same, so that a chip
//! that holds SDA is freed without a timeout.
//!
//! # Errors
//! After an error the bus is reset before the function returns, within 0.5 ms. A chip that still
//! holds a line then is reported at each transaction.

use embassy_stm32::Peri;
use embassy_stm32::gpio::Flex;
use embassy_stm32::interrupt::typelevel::{
    Binding, DMA1_STREAM0, DMA1_STREAM2, I2C1_ER, I2C1_EV, I2C3_ER, I2C3_EV,
};
use embassy_stm32::peripherals::{DMA1_CH0, DMA1_CH2, I2C1, I2C3, PA8, PB6, PB7, PC9};
use embassy_stm32::rcc;
use embassy_time::{Duration, Timer};
use embedded_hal_async::i2c::{Error, ErrorKind, ErrorType, I2c, NoAcknowledgeSource, Operation};

use super::recovery::Lines;
use super::transfer::{self, Controller, Interrupts, READ_MAX, WRITE_MAX};

/// The duration of a stop condition, with a margin.
const STOP: Duration = Duration::from_micros(10);

/// A reason why a transaction failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub enum BusError {
    /// No chip acknowledged the address or a byte.
    NoAcknowledge,
    /// A line was low that the peripheral had released (ARLO).
    ArbitrationLost,
    /// A start or stop condition came within a byte (BERR), or another error.
    Misplaced,
    /// The DMA controller could not access the memory.
    Dma,
    /// A chip holds SDA low, also after nine clock pulses.
    SdaLow,
    /// A chip holds SCL low.
    SclLow,
    /// The transaction is longer than the buffers, or is not a write, a read, or a write and then a
    /// read.
    Unsupported,
}

impl Error for BusError {
    fn kind(&self) -> ErrorKind {
        match self {
            BusError::NoAcknowledge => ErrorKind::NoAcknowledge(NoAcknowledgeSource::Unknown),
            BusError::ArbitrationLost => ErrorKind::ArbitrationLoss,
            BusError::Misplaced => ErrorKind::Bus,
            _ => ErrorKind::Other,
        }
    }
}

/// A bus, which one task owns.
pub struct Bus {
    controller: &'static Controller,
    lines: Lines,
    /// True until the bus is known to be in order: before the first transaction, while one is under
    /// way, and after a failed reset.
    is_in_doubt: bool,
    resets: u32,
}

impl Bus {
    /// Takes the bus of the sensors on the board. The first transaction sets it up.
    pub fn sensors(
        _i2c: Peri<'static, I2C3>,
        _stream: Peri<'static, DMA1_CH2>,
        scl: Peri<'static, PA8>,
        sda: Peri<'static, PC9>,
        irq: impl Binding<I2C3_EV, Interrupts>
        + Binding<I2C3_ER, Interrupts>
        + Binding<DMA1_STREAM2, Interrupts>,
    ) -> Self {
        rcc::enable_and_reset::<I2C3>();
        transfer::enable_i2c3(irq);
        Bus::new(&transfer::I2C3, Flex::new(scl), Flex::new(sda))
    }

    /// Takes the bus of the expansion port. The first transaction sets it up.
    pub fn expansion(
        _i2c: Peri<'static, I2C1>,
        _stream: Peri<'static, DMA1_CH0>,
        scl: Peri<'static, PB6>,
        sda: Peri<'static, PB7>,
        irq: impl Binding<I2C1_EV, Interrupts>
        + Binding<I2C1_ER, Interrupts>
        + Binding<DMA1_STREAM0, Interrupts>,
    ) -> Self {
        rcc::enable_and_reset::<I2C1>();
        transfer::enable_i2c1(irq);
        Bus::new(&transfer::I2C1, Flex::new(scl), Flex::new(sda))
    }

    fn new(controller: &'static Controller, scl: Flex<'static>, sda: Flex<'static>) -> Self {
        let lines = Lines { i2c: controller.i2c, scl, sda };
        Bus { controller, lines, is_in_doubt: true, resets: 0 }
    }

    /// Returns the number of times that the bus was reset, at the first transaction and then after
    /// errors.
    pub fn resets(&self) -> u32 {
        self.resets
    }

    /// Returns true if the last transaction did not end, or the bus could not be freed after it.
    pub fn is_in_doubt(&self) -> bool {
        self.is_in_doubt
    }

    async fn reset(&mut self) -> Result<(), BusError> {
        self.is_in_doubt = true;
        self.controller.abort();
        self.resets += 1;
        self.lines.reset().await?;
        self.is_in_doubt = false;
        Ok(())
    }

    /// Waits until the stop condition of the last transaction is on the bus: CR1 must not be written
    /// before (RM0090 27.6.1). The wake-up of the task takes longer than the condition, so this does
    /// not wait as a rule.
    async fn wait_until_idle(&mut self) -> Result<(), BusError> {
        if !self.is_in_doubt {
            if self.is_idle() {
                return Ok(());
            }
            Timer::after(STOP).await;
            if self.is_idle() {
                return Ok(());
            }
        }
        self.reset().await
    }

    async fn perform(
        &mut self,
        address: u8,
        written: &[u8],
        read_count: usize,
    ) -> Result<(), BusError> {
        self.wait_until_idle().await?;
        // If the caller drops this future, the next transaction resets the bus.
        self.is_in_doubt = true;
        self.controller.begin(address, written, read_count);
        match self.controller.end().await {
            Ok(()) => {
                self.is_in_doubt = false;
                Ok(())
            }
            Err(error) => self.reset().await.and(Err(error)),
        }
    }

    /// Returns true if no condition is requested and both lines are high.
    fn is_idle(&self) -> bool {
        let i2c = self.controller.i2c;
        !i2c.cr1().read().stop() && !i2c.sr2().read().busy()
    }
}

impl ErrorType for Bus {
    type Error = BusError;
}

impl I2c for Bus {
    /// Performs a write, a read, or a write and then a read.
    async fn transaction(
        &mut self,
        address: u8,
        operations: &mut [Operation<'_>],
    ) -> Result<(), BusError> {
        let (written, read): (&[u8], &mut [u8]) = match operations {
            [Operation::Write(bytes)] => (bytes, &mut []),
            [Operation::Read(bytes)] => (&[], bytes),
            [Operation::Write(written), Operation::Read(read)] => (written, read),
            _ => return Err(BusError::Unsupported),
        };
        let is_too_long = written.len() > WRITE_MAX || read.len() > READ_MAX;
        if is_too_long || written.is_empty() && read.is_empty() {
            return Err(BusError::Unsupported);
        }
        self.perform(address, written, read.len()).await?;
        self.controller.copy_received(read);
        Ok(())
    }
}
